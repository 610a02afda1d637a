# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes to arrays."""

import math

import bpy
import numpy as np
import pytest
from blenders import auto_smooth
from brume.export import mesh
from conftest import add, cube


def evaluated(ob):
    return ob.evaluated_get(bpy.context.evaluated_depsgraph_get())


def read(ob):
    return mesh.read(evaluated(ob).data)


def face_normals(arrays):
    a, b, c = (arrays["positions"][arrays["triangles"][:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def volume(arrays):
    a, b, c = (arrays["positions"][arrays["triangles"][:, i]].astype(float) for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_flat_cube(scene):
    arrays = read(cube(size=2.0))
    assert arrays["triangles"].shape == (12, 3)
    assert arrays["triangles"].dtype == np.uint32
    assert volume(arrays) == pytest.approx(8.0)
    np.testing.assert_allclose(arrays["corner_normals"],
                               np.repeat(face_normals(arrays)[:, None], 3, 1), atol=1e-6)


def test_smooth_cube(scene):
    ob = cube()
    ob.data.polygons.foreach_set("use_smooth", [True] * 6)
    ob.data.update()
    arrays = read(ob)
    corners = arrays["positions"][arrays["triangles"]]
    np.testing.assert_allclose(arrays["corner_normals"], corners / math.sqrt(3), atol=1e-6)


def test_custom_normals(scene):
    ob = cube()
    auto_smooth(ob.data)
    ob.data.normals_split_custom_set([(0.0, 0.6, 0.8)] * len(ob.data.loops))
    # Blender stores custom normals with 16 bits.
    np.testing.assert_allclose(read(ob)["corner_normals"],
                               np.broadcast_to((0, 0.6, 0.8), (12, 3, 3)), atol=1e-3)


def test_uvs_are_the_active_render_layer(scene):
    ob = cube()
    second = ob.data.uv_layers.new(name="Second")
    second.data.foreach_set("uv", np.arange(48, dtype=np.float32))
    assert read(ob)["corner_uvs"].max() <= 1.0
    second.active_render = True
    arrays = read(ob)
    loops = np.empty(36, np.uint32)
    ob.data.calc_loop_triangles()
    ob.data.loop_triangles.foreach_get("loops", loops)
    np.testing.assert_array_equal(arrays["corner_uvs"].reshape(-1, 2)[:, 0], loops * 2)


def test_uvs_survive_smooth_normals(scene):
    """Computing normals moves the mesh's layers in memory; the UVs must be read after it."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    ob = bpy.context.object
    bpy.ops.object.shade_smooth()
    auto_smooth(ob.data)
    first = read(ob)["corner_uvs"]
    np.testing.assert_array_equal(read(ob)["corner_uvs"], first)
    assert np.unique(first.reshape(-1, 2), axis=0).shape[0] > 64 * 30


def test_slots(scene):
    ob = cube()
    for name in "ab":
        ob.data.materials.append(bpy.data.materials.new(name))
    ob.data.polygons[3].material_index = 1
    arrays = read(ob)
    assert np.bincount(arrays["triangle_slots"]).tolist() == [10, 2]
    only = mesh.only_slots(arrays, [1])
    assert only["triangles"].shape == (2, 3)
    assert only["corner_normals"].shape == (2, 3, 3)
    assert mesh.only_slots(arrays, [5]) is None


def test_modifiers_count(scene):
    ob = cube()
    ob.modifiers.new("Subdivision", 'SUBSURF').render_levels = 1
    assert read(ob)["triangles"].shape[0] == 4 * 12


def test_nothing_to_draw(scene):
    assert read(add("Empty", bpy.data.meshes.new("Empty"))) is None
