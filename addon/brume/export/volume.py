# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: volume objects by file or from memory, and meshes filled with a volume shader."""

import hashlib
import os
import re
import tempfile
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..compat import identity
from ..native import BrumeError, vdb_list
from . import material as materials
from . import nodes
from .files import grid_infos, load_grid
from .volume_shader import FOG_SPACES, SPACES, compile_volume, default_program


def density_scale(matrix):
    """What Cycles multiplies the coefficients of a medium in object space by (object.cpp,
    object_volume_density): a stretched volume keeps its optical depth."""
    length = np.linalg.norm(np.asarray(matrix)[:3, :3] @ np.full(3, 3 ** -0.5))
    if length == 0.0:
        raise BrumeError("TRANSFORM", "its transform is singular.")
    return 1.0 / length


def generated_box(ob):
    """The corners of what an object's generated coordinates span, in its space: a mesh's texture
    space. Those of volume objects are the same as the object's, in Cycles as well."""
    if not isinstance(ob.data, bpy.types.Mesh):
        return np.zeros(3), np.ones(3)
    middle, half = (np.array(v) for v in (ob.data.texspace_location, ob.data.texspace_size))
    return middle - half, middle + half


def program_for(target, material, available, numbered=()):
    """The compiled program of a material for a medium with these grids; None if the material has
    no volume shader. numbered: the grids whose numbers are given."""
    available = frozenset(available)
    name = "program", material and identity(material), available, numbered
    return target.part(name, None, nodes.identities(material) if material else (),
                       lambda: _compile(target, material, available, numbered))


def _compile(target, material, available, numbered):
    if material is None:
        return default_program(available)
    tree = materials.volume_tree(material)
    owner = f'Material "{material.name}"'
    return tree and compile_volume(
        tree, available, lambda sentence: target.reports.unsupported(owner, sentence), numbered,
        FOG_SPACES if numbered else SPACES)


# ------------------------------------------------------------------------------------------------
# Files


@contextmanager
def _scratch_file():
    shared_memory = Path("/dev/shm")
    folder = shared_memory if os.access(shared_memory, os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="brume-", dir=folder) as path:
        yield os.path.join(path, "volume.vdb")


class _Scratch:
    """Bytes that are a .vdb; as files.File."""

    def __init__(self, target, path):
        self.target, self.path = target, path
        digest = hashlib.blake2b(Path(path).read_bytes(), digest_size=16).hexdigest()
        self.stamp = "memory", digest
        self.infos = grid_infos(path)

    def grids(self, names):
        return [self.target.grid((*self.stamp, name), partial(load_grid, self.path, name))
                for name in names]


def _save(volume, path):
    if not volume.grids.save(filepath=path):
        raise BrumeError("VOLUME_SAVE", "its grids could not be saved by Blender.")


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


def _on_disk(ob):
    """Whether the grids are those of a file, which Blender need not read."""
    original = ob.original
    return (original.type == 'VOLUME' and bool(ob.data.filepath) and not original.modifiers
            and not original.data.packed_file)


def _writer(ob):
    """A function that writes the grids of a volume without a file of its own to a path; None if
    there are none."""
    volume, original = ob.data, ob.original
    if original.type == 'VOLUME' and volume.filepath:
        packed = original.data.packed_file
        if packed and not original.modifiers:
            # Blender itself does not read these once the file is gone.
            return lambda path: Path(path).write_bytes(packed.data)
        path = frame_path(volume, original.data.library)
        if path and not packed:
            vdb_list(path)  # raises if the file is damaged, before Blender opens it
    volume.grids.load()
    return partial(_save, volume) if len(volume.grids) else None


def export_volume_object(target, ob, matrix, key, reads, override=None):
    """Puts one instance of a volume object; reads: identities of what made it. Raises
    BrumeError."""
    material = override or next((slot.material for slot in ob.material_slots if slot.material),
                                None)
    stamp = ob.name, matrix.tobytes(), material and identity(material)
    if _on_disk(ob):
        path = frame_path(ob.data, ob.original.data.library)
        if path is None:
            return
        file = target.files.open(key, path)
        if file is None:
            target.unfinished("volume", key)
            return

        def make():
            _export_file(target, ob, matrix, key, material, file,
                         partial(target.files.grids, key, file))
        target.part(("volume", key), (*stamp, file.stamp), reads, make)
        return

    def make():
        write = _writer(ob)
        if write is None:
            return
        with _scratch_file() as path:
            write(path)
            file = _Scratch(target, path)
            _export_file(target, ob, matrix, key, material, file, file.grids)
    target.part(("volume", key), (*stamp, ob.data.as_pointer()), reads, make)


def _export_file(target, ob, matrix, key, material, file, grids_of):
    program = program_for(target, material, file.infos)
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
    grids = grids_of(program.grids)
    if grids is None:
        target.unfinished("volume", key)
        return
    for name in program.grids:
        width = max(file.infos[name].file_dims)
        if width > _WIDEST:
            target.reports.warn(
                "GRID_WIDE", f'Volume "{ob.name}": the grid "{name}" in {file.path} is {width} '
                             f"voxels wide. All volumes get as coarse as its box is large: "
                             f"are there stray voxels far away?")
    scale = density_scale(matrix) if ob.data.render.space == 'OBJECT' else 1.0
    target.put("volume", key, name=ob.name, program=program, grids=grids,
               world_from_object=matrix, scale=scale, generated=generated_box(ob))


def export_mesh_volume(target, ob, arrays, material, matrix, key):
    """Puts one instance of a closed mesh filled with its material's medium."""
    program = program_for(target, material, ())
    for name in program.unknown:
        target.reports.warn("GRID_UNKNOWN", f'"{ob.name}": a mesh has no grid "{name}"; it reads '
                                            f"as 0.")
    target.put("volume", key, name=ob.name, program=program, world_from_object=matrix,
               positions=arrays["positions"], triangles=arrays["triangles"],
               generated=generated_box(ob))
