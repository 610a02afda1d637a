# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the add-on takes to export one edit of a large scene, and the whole; appends a JSON line
to out/bench/export.jsonl:

    scripts/blender -b --factory-startup -P bench/export.py
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from brume import native
from brume.export import changes, scene
from brume.export.target import Target

sys.path.insert(0, str(Path(__file__).resolve().parent))
from place import here, keep

OBJECTS, MESHES, SIDE, INSTANCES = 1000, 100, 224, 20000
REPEATS = 5


def grid(name, side):
    """A wavy square of 2 * (side - 1)^2 triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    points = np.stack([x, y, 0.1 * np.sin(20 * x)], -1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.stack([corner, corner + 1, corner + side + 1, corner + side], 1)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    return mesh


def add(name, data):
    ob = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def build():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    add("Large", grid("Large", SIDE))
    for i in range(MESHES):
        mesh = grid(f"Small {i}", 8)
        mesh.materials.append(bpy.data.materials.new(f"Material {i}"))
    for i in range(OBJECTS):
        add(f"Object {i}", bpy.data.meshes[f"Small {i % MESHES}"]).location.x = i
    for i in range(10):
        add(f"Lamp {i}", bpy.data.lights.new(f"Lamp {i}", 'POINT')).location.z = i


def instance():
    points = bpy.data.meshes.new("Points")
    points.from_pydata([(i % 200, i // 200, 9) for i in range(INSTANCES)], [], [])
    host = add("Host", points)
    add("Guest", bpy.data.meshes["Small 0"]).parent = host
    host.instance_type = 'VERTS'


def stretch():
    mesh = bpy.data.meshes["Large"]
    mesh.vertices[0].co.z += 1
    mesh.update()


def shift(name):
    bpy.data.objects[name].location.y += 1


def color():
    owner = bpy.data.materials["Material 0"]
    owner.diffuse_color[0] = (owner.diffuse_color[0] + 0.1) % 1


EDITS = {"nothing": lambda: None, "lamp moved": lambda: shift("Lamp 0"),
         "object moved": lambda: shift("Object 0"), "large mesh moved": lambda: shift("Large"),
         "material's colour": color, "large mesh edited": stretch}


def measure(target, listener):
    """Milliseconds of each edit, the best of some."""
    def export(changed):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        began = time.perf_counter()
        scene.export(depsgraph, target, changed)
        return time.perf_counter() - began
    export(None)
    times = {name: [] for name in ("everything", *EDITS)}
    for _ in range(REPEATS):
        times["everything"].append(export(None))
        for name, edit in EDITS.items():
            listener.take()
            edit()
            bpy.context.view_layer.update()
            times[name].append(export(listener.take()))
    return {name: round(min(taken) * 1000, 2) for name, taken in times.items()}


def main():
    line = {"bench": "export", **here(), "blender": bpy.app.version_string,
            "triangles": 2 * (SIDE - 1) ** 2, "repeats": REPEATS, "export_ms": {}}
    device = native.Device()
    for case, more in ((f"{OBJECTS} objects", None), (f"and {INSTANCES} instances", instance)):
        build()
        if more:
            more()
        target = Target(native.Scene(device))
        listener = changes.Changes(bpy.context.scene, bpy.context.view_layer)
        line["export_ms"][case] = measure(target, listener)
        target.scene.close()
    device.close()
    keep(line)


main()
