# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog that is a list of Gaussians: as fog sources for Brume, and the same in a .vdb for Cycles.

Both are made from the list, by what the add-on's settings say of themselves and not by its code:
the twin can tell when that is wrong. Fog sources need the add-on: scripts/blender.
"""
import os
from typing import NamedTuple

import bpy
import numpy as np
import staging

try:
    import pyopenvdb as vdb
except ImportError:  # its name from OpenVDB 11 on
    import openvdb as vdb


class Gaussian(NamedTuple):
    """density * exp(-(2 d / radius)^2) at distance d, and nothing beyond 1.5 radii."""
    center: tuple
    radius: float
    density: float
    color: tuple = (1.0, 1.0, 1.0)  # share of light that is scattered


REACH = 1.5  # radii


def source(thing, kind, **settings):
    """Makes fog of an object's origin, points or particles."""
    made = thing.brume.fog_sources.add()
    made.source = kind
    for name, value in settings.items():
        setattr(made, name, value)


def empty(name, gaussian, anisotropy=0.0):
    """An empty that is one Gaussian."""
    bpy.ops.object.empty_add(type='SPHERE', radius=gaussian.radius, location=gaussian.center)
    thing = bpy.context.object
    thing.name = name
    source(thing, 'OBJECT', density=gaussian.density, color=gaussian.color, anisotropy=anisotropy)
    return thing


def points(name, gaussians, anisotropy=0.0):
    """A mesh of loose vertices, each with a radius and a colour. They share one density."""
    density, = {gaussian.density for gaussian in gaussians}
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([gaussian.center for gaussian in gaussians], [], [])
    radii = mesh.attributes.new('radius', 'FLOAT', 'POINT')
    radii.data.foreach_set('value', [gaussian.radius for gaussian in gaussians])
    colors = mesh.attributes.new('tint', 'FLOAT_COLOR', 'POINT')
    colors.data.foreach_set('color', [value for gaussian in gaussians
                                      for value in (*gaussian.color, 1.0)])
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    source(thing, 'POINTS', density=density, color=(1.0, 1.0, 1.0), color_attribute='tint',
           anisotropy=anisotropy)
    return thing


def particles(thing, radius, density, color, anisotropy=0.0):
    """Makes fog of an object's particles; returns the Gaussians that these are."""
    source(thing, 'PARTICLES', radius=radius, density=density, color=color, anisotropy=anisotropy)
    system, = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).particle_systems
    return [Gaussian(tuple(particle.location), particle.size * radius, density, color)
            for particle in system.particles]


def fields(gaussians, voxels):
    """(origin, voxel, density, colour): the sum at the centres of voxels from `origin` on, and the
    mean of the colours, weighted by density. voxels: to the least radius."""
    voxel = min(gaussian.radius for gaussian in gaussians) / voxels
    centers = np.array([gaussian.center for gaussian in gaussians])
    reaches = np.array([gaussian.radius for gaussian in gaussians])[:, None] * REACH
    first = np.floor((centers - reaches) / voxel).min(axis=0).astype(int)
    last = np.ceil((centers + reaches) / voxel).max(axis=0).astype(int)
    density = np.zeros(last - first + 1)
    color = np.zeros((*density.shape, 3))
    for gaussian, center, reach in zip(gaussians, centers, reaches):
        low = np.floor((center - reach) / voxel).astype(int) - first
        high = np.ceil((center + reach) / voxel).astype(int) - first + 1
        part = tuple(slice(a, b) for a, b in zip(low, high))
        axes = [(np.arange(a, b) + start) * voxel - middle
                for a, b, start, middle in zip(low, high, first, center)]
        squared = sum(axis ** 2 for axis in np.meshgrid(*axes, indexing='ij'))
        found = gaussian.density * np.exp(-4.0 * squared / gaussian.radius ** 2)
        found[squared > reach ** 2] = 0.0
        density[part] += found
        color[part] += found[..., None] * gaussian.color
    color /= np.maximum(density, 1e-30)[..., None]
    return first * voxel, voxel, density, color


def write(path, gaussians, voxels):
    """Writes a .vdb of half floats, with colours only if there is more than one; returns the
    voxels' side and the grids' names."""
    origin, voxel, density, color = fields(gaussians, voxels)
    grids = [(vdb.FloatGrid(), 'density', density)]
    if len({gaussian.color for gaussian in gaussians}) > 1:
        grids.append((vdb.Vec3SGrid(), 'color', color))
    for grid, name, field in grids:
        grid.name = name
        grid.gridClass = vdb.GridClass.FOG_VOLUME
        grid.saveFloatAsHalf = True
        grid.copyFromArray(field.astype(np.float32))
        grid.transform = vdb.createLinearTransform(
            [[voxel, 0, 0, 0], [0, voxel, 0, 0], [0, 0, voxel, 0], [*origin, 1]])
    vdb.write(path, grids=[grid for grid, _, _ in grids])
    return voxel, [name for _, name, _ in grids]


def finish_twin(name, fog, gaussians, voxels, anisotropy=0.0):
    """Replaces the fog by a Volume object, so that Cycles sees it too, and saves <name>_twin.

    Between the voxels, `voxels` to the least radius, it has the fog too thin in its middle and too
    dense at its radius: with 12 by 1 % and 2 %, with 24 by a quarter of that.
    """
    scene = bpy.context.scene
    name = scene.name = name + '_twin'
    bpy.data.objects.remove(fog)
    voxel, grids = write(os.path.join(staging.FOLDER, name + '.vdb'), gaussians, voxels)
    color = {'Color_Attribute': 'color'} if 'color' in grids else {}
    data = bpy.data.volumes.new('Fog')
    data.filepath = f'//{name}.vdb'
    data.render.clipping = 0.0  # else voxels below it are cut off
    data.materials.append(staging.volume(
        'Fog', 'ShaderNodeVolumePrincipled', Density=1.0, Anisotropy=anisotropy,
        Color=(1.0, 1.0, 1.0, 1.0) if color else (*gaussians[0].color, 1.0), **color))
    thing = bpy.data.objects.new('Fog', data)
    # Cycles of Debian's Blender 3.4 shows a voxel's value at its upper corner, not its centre.
    thing.location = (-voxel / 2,) * 3
    scene.collection.objects.link(thing)
    staging.finish(name, engine='CYCLES')
