# SPDX-License-Identifier: GPL-3.0-or-later
"""Gas simulations: the grids of a fluid domain, from memory."""

import hashlib
from functools import partial

import numpy as np

from ..native import Grid
from .volume import generated_box, program_for

# RNA property and components of each attribute that Cycles knows.
_GRIDS = {"density": ("density_grid", 1), "flame": ("flame_grid", 1),
          "temperature": ("temperature_grid", 1), "heat": ("heat_grid", 1),
          "velocity": ("velocity_grid", 3), "color": ("color_grid", 4)}


def gas_domain(ob):
    """The settings of an evaluated object's gas domain, or None."""
    for modifier in ob.modifiers:
        if modifier.type == 'FLUID' and modifier.fluid_type == 'DOMAIN':
            settings = modifier.domain_settings
            if settings and settings.domain_type == 'GAS':
                return settings
    return None


def _shape(settings, cells):
    """(nz, ny, nx) of a grid with so many cells: the domain's, or with noise a multiple."""
    x, y, z = settings.domain_resolution
    scale = 1
    if cells != x * y * z and settings.use_noise:
        scale = settings.noise_scale
    return z * scale, y * scale, x * scale


def _read(settings, name):
    """One grid as (nz, ny, nx[, 3]), or None if the simulation does not have it."""
    attribute, channels = _GRIDS[name]
    values = getattr(settings, attribute)
    cells = len(values) // channels
    shape = _shape(settings, cells)
    if cells == 0 or cells != shape[0] * shape[1] * shape[2]:
        return None
    data = np.empty(cells * channels, np.float32)
    values.foreach_get(data)
    if channels == 1:
        return data.reshape(shape)
    data = data.reshape(*shape, channels)
    if channels == 4:
        # Stored multiplied by alpha, which is the density; Cycles divides it out likewise.
        alpha = data[..., 3:]
        data = np.divide(data[..., :3], alpha, out=data[..., :3].copy(),
                         where=(alpha > 1e-6) & (alpha != 1))
    return data


def _box(ob):
    """Object space from the unit cube. Cycles stretches the grids over the evaluated mesh's
    bounds; an adaptive domain's mesh is the box that the simulation fills at this frame."""
    corners = np.array([tuple(corner) for corner in ob.bound_box])
    low, high = corners.min(0), corners.max(0)
    matrix = np.diag((*(high - low), 1.0))
    matrix[:3, 3] = low
    return matrix


def export(target, ob, settings, material, matrix, key):
    """Puts one instance of a domain, if its material has a volume shader. Unlike a volume object's
    its coefficients are per metre of the world, whatever the object's scale (as in Cycles)."""
    names = [name for name, (attribute, _) in _GRIDS.items() if len(getattr(settings, attribute))]
    if not names:
        return  # no cache at this frame: there is no smoke
    program = program_for(target, material, names)
    if program is None:
        return
    for name in program.unknown:
        target.reports.warn("GRID_UNKNOWN",
                            f'Fluid domain "{ob.name}" has no grid "{name}"; it reads as 0.')
    box = _box(ob)
    grids = []
    for name in program.grids:
        data = _read(settings, name)
        if data is None:
            target.reports.warn("GRID_SHAPE", f'Fluid domain "{ob.name}": the grid "{name}" has '
                                              f"not the domain's size; it reads as 0.")
            grids.append(None)
            continue
        object_from_array = box @ np.diag((*(1.0 / np.array(data.shape[2::-1])), 1.0))
        digest = hashlib.blake2b(data, digest_size=16)
        digest.update(object_from_array.tobytes())
        make = partial(Grid.create, name, data, object_from_array)
        grids.append(target.grid(("fluid", name, digest.hexdigest()), make))
    target.put("volume", key, name=ob.name, program=program, grids=grids,
               world_from_object=matrix, generated=generated_box(ob))
