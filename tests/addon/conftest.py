# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on's tests share: an empty scene, node trees in few words, a recording scene."""

import math
import os
import subprocess
from pathlib import Path

import blenders
import bpy
import numpy as np
import pytest
from brume import native
from brume.export.target import Target

ROOT = Path(__file__).resolve().parents[2]


def pytest_collection_modifyitems(config, items):
    blenders.deselect(config, items)


class Recorder:
    """Stands for native.Scene and remembers what was set; `sent` counts the calls."""

    def __init__(self):
        self.blocks = {}
        self.world = None
        self.sent = []

    def __getattr__(self, name):
        kind = name.removeprefix("set_")

        def record(key, **values):
            self.sent.append(kind)
            self.blocks.setdefault(kind, {})[key] = values
        return record

    def set_world(self, **values):
        self.sent.append("world")
        self.world = values

    def keep(self, kind, keys):
        self.blocks[kind] = {k: v for k, v in self.blocks.get(kind, {}).items() if k in keys}

    def of(self, kind):
        return list(self.blocks.get(kind, {}).values())

    def named(self, kind, name):
        found = [block for block in self.of(kind) if block["name"] == name]
        assert len(found) == 1, f"{len(found)} of {kind} {name}"
        return found[0]


class Nodes:
    """Builds a node tree: tree.node("Math", operation='ADD', Value=1.0, Value_001=other_output).
    Inputs are named by identifier with _ for blanks."""

    def __init__(self, owner):
        if owner.node_tree is None:  # until 5.0
            owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()
        kind = {"Material": "Material", "World": "World"}.get(type(owner).__name__, "Light")
        self.output = self.tree.nodes.new(f"ShaderNodeOutput{kind}")

    def node(self, name, outlet=0, **values):
        node = self.tree.nodes.new(f"ShaderNode{name}")
        for key, value in values.items():
            sockets = {s.identifier.replace(" ", "_"): s for s in node.inputs}
            socket = sockets.get(key) or sockets.get(blenders.RENAMED.get(key))
            if socket is None:
                setattr(node, key, value)
            elif isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node if outlet is None else node.outputs[outlet]

    def surface(self, socket):
        self.tree.links.new(socket, self.output.inputs["Surface"])

    def volume(self, socket):
        self.tree.links.new(socket, self.output.inputs["Volume"])


@pytest.fixture
def scene():
    """Blender's scene, emptied, small, with Brume as its engine."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = 'BRUME'
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = 'Standard'
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = 'OPEN_EXR', '32'
    scene.brume.preset = 'DRAFT'
    scene.brume.half_resolution_volumes = False  # pictures are of a few pixels here
    return scene


@pytest.fixture
def recorder():
    return Recorder()


@pytest.fixture
def target(recorder):
    return Target(recorder)


@pytest.fixture
def export(target, recorder):
    """Exports Blender's scene into the recorder and gives that."""
    from brume.export import scene as scene_export

    def run():
        scene_export.export(bpy.context.evaluated_depsgraph_get(), target)
        return recorder
    return run


def material(name="Material"):
    """A material and its node tree."""
    made = bpy.data.materials.new(name)
    return made, Nodes(made)


def add(name, data, location=(0, 0, 0), scale=(1, 1, 1)):
    ob = bpy.data.objects.new(name, data)
    ob.location, ob.scale = location, scale
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.update()
    return ob


def cube(name="Cube", size=2.0, material=None, **more):
    """A cube about its origin."""
    half = size / 2
    corners = [(x, y, z) for z in (-half, half) for y in (-half, half) for x in (-half, half)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.uv_layers.new()
    if material:
        mesh.materials.append(material)
    return add(name, mesh, **more)


def write_vdb(path, **grids):
    """Writes arrays (x, y, z) as float grids, or (x, y, z, 3) as vec3 grids, of 0.1 m voxels."""
    vdb = blenders.vdb
    made = []
    for name, values in grids.items():
        grid = vdb.FloatGrid() if values.ndim == 3 else vdb.Vec3SGrid()
        grid.copyFromArray(np.ascontiguousarray(values))
        grid.name = name
        grid.transform = vdb.createLinearTransform(0.1)
        made.append(grid)
    vdb.write(str(path), grids=made)
    return str(path)


# -- whole renders


def lit(scene, density=2.0):
    """A fog cube in the sun, seen from the front."""
    fog, nodes = material("Fog")
    nodes.volume(nodes.node("VolumeScatter", Color=(1, 1, 1, 1), Density=density))
    cube("Fog", material=fog)
    sun = bpy.data.lights.new("Sun", 'SUN')
    sun.energy = 10.0
    add("Sun", sun).rotation_euler = (0.6, 0.3, 0)
    camera = bpy.data.cameras.new("Camera")
    scene.camera = add("Camera", camera, location=(0, -6, 0))
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)
    scene.render.film_transparent = True
    return scene


@pytest.fixture
def render(tmp_path):
    """Renders Blender's scene to a file; gives its pixels, rows from the bottom."""
    def run(name="picture"):
        path = tmp_path / f"{name}.exr"
        bpy.context.scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        return native.exr_read(path)
    return run


@pytest.fixture
def plume():
    """The simulated plume of blend_scenes/."""
    path = ROOT / "blend_scenes" / "plume.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path))
    bpy.context.scene.frame_set(bpy.context.scene.frame_current)
    yield next(ob for ob in bpy.data.objects
               if any(m.type == 'FLUID' and m.fluid_type == 'DOMAIN' for m in ob.modifiers))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def blender(*arguments, **environment):
    return subprocess.run(
        [ROOT / "scripts" / "blender", "-b", *arguments], capture_output=True, text=True,
        timeout=300, env=os.environ | environment)


@pytest.fixture
def saved(scene, tmp_path):
    lit(scene)
    scene.render.engine = 'CYCLES'
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path
