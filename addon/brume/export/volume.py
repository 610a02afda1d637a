# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: volume objects by file or from memory, and meshes filled with a volume shader."""

import hashlib
import os
import re
import tempfile
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ..native import BrumeError, Grid, vdb_list
from . import material as materials
from .volume_shader import compile_volume, default_program


def density_scale(matrix):
    """What Cycles multiplies the coefficients of a medium in object space by (object.cpp,
    object_volume_density): a stretched volume keeps its optical depth."""
    length = np.linalg.norm(np.asarray(matrix)[:3, :3] @ np.full(3, 3 ** -0.5))
    if length == 0.0:
        raise BrumeError("TRANSFORM", "its transform is singular.")
    return 1.0 / length


def program_for(target, programs, material, available):
    """The compiled program of a material for a medium with these grids; None if the material has
    no volume shader. programs: those of this export."""
    available = frozenset(available)
    key = (material.as_pointer() if material else 0, available)
    if key not in programs:
        programs[key] = _compile(target, material, available)
    return programs[key]


def _compile(target, material, available):
    if material is None:
        return default_program(available)
    tree = materials.volume_tree(material)
    owner = f'Material "{material.name}"'
    return tree and compile_volume(
        tree, available, lambda sentence: target.reports.unsupported(owner, sentence))


# ------------------------------------------------------------------------------------------------
# Files


@contextmanager
def _scratch_file():
    shared_memory = Path("/dev/shm")
    folder = shared_memory if os.access(shared_memory, os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="brume-", dir=folder) as path:
        yield os.path.join(path, "volume.vdb")


class _File:
    """A .vdb on disk, or bytes that are one; gives the names of its grids and the grids."""

    def __init__(self, path, stamp):
        self.path, self.stamp = path, stamp
        self.infos = {info.name.decode(): info for info in vdb_list(path)}

    def grid(self, target, name):
        return target.grid((*self.stamp, name), lambda: Grid.load_vdb(self.path, name))


@contextmanager
def _from_memory(write):
    """A file that lives as long as the block; write(path) fills it."""
    with _scratch_file() as path:
        write(path)
        digest = hashlib.blake2b(Path(path).read_bytes(), digest_size=16).hexdigest()
        yield _File(path, ("memory", digest))


def _save(volume, path):
    if not volume.grids.save(filepath=path):
        raise BrumeError("VOLUME_SAVE", "its grids could not be saved by Blender.")


@contextmanager
def _on_disk(path):
    try:
        stamp = os.stat(path).st_mtime_ns
    except OSError:
        stamp = None  # the library says what is wrong with the path
    yield _File(path, (path, stamp))


# Voxels along a side that no field of smoke has, but a box around stray voxels.
_WIDEST = 1 << 15

# The frame that Blender gives where a sequence has none.
_NO_FRAME = 2 ** 31 - 1


def frame_path(volume, library=None):
    """The file that an evaluated Volume reads at its frame; None outside of a sequence. This is
    grids.frame_filepath, but that is known only to grids.load(), and in 3.4 a damaged file ends
    Blender there."""
    path = bpy.path.abspath(volume.filepath, library=library)
    # The frame's digits stand right before the extension.
    parts = re.fullmatch(r"(.*?)(\d+)(\.[^./]*)", path, re.DOTALL)
    if not volume.is_sequence or not parts:
        return path
    frame = volume.grids.frame
    if frame == _NO_FRAME:
        return None
    head, digits, extension = parts.groups()
    return f"{head}{'-' if frame < 0 else ''}{abs(frame):0{len(digits)}}{extension}"


def _file_of(ob):
    """A context that gives the file of a volume object, or None where it has no grids at all."""
    volume, original = ob.data, ob.original
    if original.type == 'VOLUME' and volume.filepath:
        packed = original.data.packed_file
        path = frame_path(volume, original.data.library)
        if not original.modifiers:
            if packed:  # Blender itself does not read these once the file is gone
                return _from_memory(lambda path: Path(path).write_bytes(packed.data))
            return _on_disk(path) if path else None
        if path and not packed:
            vdb_list(path)  # raises if the file is damaged, before Blender opens it
    volume.grids.load()
    if len(volume.grids):
        return _from_memory(lambda path: _save(volume, path))
    return None


def export_volume_object(target, programs, ob, matrix, key, override=None):
    """Puts one instance of a volume object; raises BrumeError."""
    opened = _file_of(ob)
    if opened is None:
        return
    material = override or next((slot.material for slot in ob.material_slots if slot.material),
                                None)
    with opened as file:
        program = program_for(target, programs, material, file.infos)
        if program is None:
            target.reports.unsupported(f'Volume "{ob.name}"',
                                       f'its material "{material.name}" has no volume shader.')
            return
        for name in program.unknown:
            target.reports.warn("GRID_UNKNOWN", f'Volume "{ob.name}": no grid "{name}" in '
                                                f"{file.path}; it reads as 0.")
        for name in program.unused:
            target.reports.warn("GRID_UNKNOWN", f'Volume "{ob.name}": no grid "{name}" in '
                                                f"{file.path}; Principled Volume does without.")
        if not program.grids:
            target.reports.warn("GRID_UNKNOWN", f'Volume "{ob.name}": its material uses none of '
                                                f"the grids in {file.path}; it is left out.")
            return
        grids = [file.grid(target, name) for name in program.grids]
        for name in program.grids:
            width = max(file.infos[name].file_dims)
            if width > _WIDEST:
                target.reports.warn(
                    "GRID_WIDE", f'Volume "{ob.name}": the grid "{name}" in {file.path} is {width} '
                                 f"voxels wide. All volumes get as coarse as its box is large: "
                                 f"are there stray voxels far away?")
        scale = density_scale(matrix) if ob.data.render.space == 'OBJECT' else 1.0
        target.put("volume", key, name=ob.name, program=program, grids=grids,
                   world_from_object=matrix, scale=scale)


def export_mesh_volume(target, programs, ob, arrays, material, matrix, key):
    """Puts one instance of a closed mesh filled with its material's medium."""
    program = program_for(target, programs, material, ())
    for name in program.unknown:
        target.reports.warn("GRID_UNKNOWN", f'"{ob.name}": a mesh has no grid "{name}"; it reads '
                                            f"as 0.")
    target.put("volume", key, name=ob.name, program=program, world_from_object=matrix,
               positions=arrays["positions"], triangles=arrays["triangles"])
