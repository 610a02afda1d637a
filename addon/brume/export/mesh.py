# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated meshes to the arrays of brume_mesh."""

from contextlib import contextmanager

import numpy as np

from .. import compat


def values(collection, name, width, dtype):
    """(items, width) of a property of all items."""
    found = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, found)
    return found.reshape(-1, width)


def read(mesh):
    """positions, triangles, corner_normals, corner_uvs (None without a UV layer) and
    triangle_slots; None if there is nothing to draw."""
    mesh.calc_loop_triangles()
    if not mesh.loop_triangles:
        return None
    corners = values(mesh.loop_triangles, "loops", 3, np.uint32)
    # Before the UV layer is looked up: in 3.x this adds a layer, which moves the others.
    normals = compat.corner_normals(mesh)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return {
        "positions": compat.positions(mesh, mesh.vertices),
        "triangles": values(mesh.loop_triangles, "vertices", 3, np.uint32),
        "corner_normals": normals[corners],
        "corner_uvs": compat.corner_uvs(layer, len(mesh.loops))[corners] if layer else None,
        "triangle_slots": values(mesh.loop_triangles, "material_index", 1,
                                 np.int32).astype(np.uint16).ravel(),
    }


@contextmanager
def evaluated(ob):
    """An evaluated object's mesh, in edit mode too."""
    if not ob.data.is_editmode:
        yield ob.data
        return
    # The mesh that is being edited is not in the evaluated one, unless modifiers brought it there.
    try:
        yield ob.to_mesh()
    finally:
        ob.to_mesh_clear()


def read_of(ob):
    """As read(), of an evaluated object."""
    with evaluated(ob) as data:
        return read(data)


def only_slots(arrays, slots):
    """The arrays with the triangles of these slots alone; None if that leaves none."""
    kept = np.isin(arrays["triangle_slots"], list(slots))
    if not kept.any():
        return None
    if kept.all():
        return arrays
    per_triangle = ("triangles", "corner_normals", "corner_uvs", "triangle_slots")
    return {name: values[kept] if name in per_triangle and values is not None else values
            for name, values in arrays.items()}
