# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports of what changed: that they send just that, and end where a full export does."""

import gc
import random
import time
import weakref
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from brume import native
from brume.export import changes, fluid
from brume.export import scene as scene_export
from brume.export.target import Target
from brume.export.volume_shader import Program
from conftest import Nodes, Recorder, add, cube, material, write_vdb
from test_scene import fog, geometry_nodes, smoke, volume_object


class Viewport:
    """A target that follows Blender's scene, as that of a 3D view does."""

    def __init__(self):
        self.recorder = Recorder()
        self.target = Target(self.recorder)
        self.changes = changes.Changes(bpy.context.scene, bpy.context.view_layer)

    def export(self):
        """The kinds sent or removed, each once a call, sorted."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        count = len(self.recorder.sent)
        scene_export.export(depsgraph, self.target, self.changes.take())
        return sorted(self.recorder.sent[count:])


@pytest.fixture
def viewport(scene):
    return Viewport()


def same(one, two):
    if isinstance(one, np.ndarray):
        return one.dtype == two.dtype and np.array_equal(one, two)
    if isinstance(one, native.Grid):
        return bytes(one.describe()) == bytes(two.describe())
    if isinstance(one, dict):
        return one.keys() == two.keys() and all(same(one[key], two[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(two) and all(map(same, one, two))
    if isinstance(one, Program):
        return same(vars(one), vars(two))
    return one == two


def differences(viewport):
    """What the viewport's target and one that is filled from nothing do not agree on."""
    fresh = Viewport()
    fresh.export()
    kinds = viewport.recorder.blocks.keys() | fresh.recorder.blocks.keys()
    found = []
    for kind in kinds:
        one, two = (side.recorder.blocks.get(kind, {}) for side in (viewport, fresh))
        for key in one.keys() | two.keys():
            if key not in one or key not in two:
                block = one.get(key) or two.get(key)
                found.append((kind, block.get("name"), "gone" if key in one else "missing"))
            else:
                found += [(kind, one[key].get("name"), name) for name in one[key]
                          if not same(one[key][name], two[key][name])]
    if not same(viewport.recorder.world, fresh.recorder.world):
        found.append(("world", viewport.recorder.world, fresh.recorder.world))
    if sorted(viewport.target.reports) != sorted(fresh.target.reports):
        found.append(("reports", sorted(viewport.target.reports), sorted(fresh.target.reports)))
    return found


# ------------------------------------------------------------------------------------------------
# What one edit sends


@pytest.fixture
def studio(scene, tmp_path):
    """One of each kind."""
    paint, nodes = material("Paint")
    nodes.surface(nodes.node("BsdfDiffuse"))
    picture = bpy.data.images.new("Picture", 4, 4)
    papered, nodes = material("Papered")
    nodes.surface(nodes.node("BsdfDiffuse", Color=nodes.node("TexImage", image=picture)))
    scene.world = bpy.data.worlds.new("World")
    nodes = Nodes(scene.world)
    nodes.surface(nodes.node("Background"))
    path = write_vdb(tmp_path / "cloud.vdb", density=np.ones((4, 4, 4), np.float32))
    made = SimpleNamespace(
        box=cube("Box", material=paint), wall=cube("Wall", material=papered),
        mist=cube("Mist", material=fog()), cloud=volume_object(path, smoke()),
        lamp=add("Lamp", bpy.data.lights.new("Lamp", 'POINT')), paint=paint, papered=papered,
        picture=picture, fog=bpy.data.materials["Fog"], smoke=bpy.data.materials["Smoke"],
        scene=scene, world=scene.world)
    made.again = add("Again", made.box.data, location=(5, 0, 0))
    return made


def _nudge(ob):
    ob.location.x += 1


def _input(owner, name, index, value):
    node = next(node for node in owner.node_tree.nodes if node.bl_idname == name)
    node.inputs[index].default_value = value


def _stretch(ob):
    ob.data.vertices[0].co.x += 1
    ob.data.update()


EDITS = {
    "nothing": (lambda s: None, []),
    "object moved": (lambda s: _nudge(s.wall), ["instances"]),
    "one of two moved": (lambda s: _nudge(s.again), ["instances"]),
    "lamp moved": (lambda s: _nudge(s.lamp), ["light"]),
    "lamp's energy": (lambda s: setattr(s.lamp.data, "energy", 5), ["light"]),
    "lamp's type": (lambda s: setattr(s.lamp.data, "type", 'SUN'), ["light"]),
    "fog moved": (lambda s: _nudge(s.mist), ["volume"]),
    "cloud moved": (lambda s: _nudge(s.cloud), ["volume"]),
    "mesh edited": (lambda s: _stretch(s.wall), ["mesh"]),
    "shared mesh edited": (lambda s: _stretch(s.box), ["mesh"]),
    "fog's mesh edited": (lambda s: _stretch(s.mist), ["volume"]),
    "modifier": (lambda s: s.wall.modifiers.new("Sub", 'SUBSURF'), ["instances", "mesh"]),
    "colour": (lambda s: _input(s.paint, "ShaderNodeBsdfDiffuse", 0, (1, 0, 0, 1)),
               ["material"]),
    "unused colour": (lambda s: _input(s.papered, "ShaderNodeBsdfDiffuse", 0, (1, 0, 0, 1)), []),
    "node muted": (lambda s: setattr(s.paint.node_tree.nodes["Diffuse BSDF"], "mute", True),
                   ["material"]),
    "fog's density": (lambda s: _input(s.fog, "ShaderNodeVolumeScatter", 1, 9), ["volume"]),
    "cloud's density": (lambda s: _input(s.smoke, "ShaderNodeVolumePrincipled", 2, 9),
                        ["volume"]),
    "world": (lambda s: _input(s.world, "ShaderNodeBackground", 1, 3), ["world"]),
    "image's alpha": (lambda s: setattr(s.picture, "alpha_mode", 'NONE'), ["image"]),
    "image painted": (lambda s: (s.picture.pixels.foreach_set([0.5] * 64),
                                 s.picture.update_tag()), ["image"]),
    "image's colour": (lambda s: setattr(s.picture, "generated_color", (1, 0, 0, 1)), ["image"]),
    "hidden": (lambda s: setattr(s.wall, "hide_viewport", True), []),
    "one of two hidden": (lambda s: s.again.hide_set(True), ["instances"]),
    "invisible to the camera": (lambda s: setattr(s.wall, "visible_camera", False),
                                ["instances"]),
    "slot": (lambda s: setattr(s.wall.material_slots[0], "material", s.paint),
             ["instances", "mesh"]),
    "selected": (lambda s: s.wall.select_set(True), []),
    "setting": (lambda s: setattr(s.scene.brume, "samples", 7), []),
}


def test_textures_follow_what_they_ask(viewport):
    """Where an object is whose coordinates a volume's texture is at, and its own mesh's box."""
    owner, nodes = material("Drifts")
    empty = add("Empty", None)
    coordinates = nodes.node("TexCoord", None, object=empty)
    at = nodes.node("VectorMath", Vector=coordinates.outputs["Object"],
                    Vector_001=coordinates.outputs["Generated"])
    nodes.volume(nodes.node("VolumeScatter", Density=nodes.node("TexNoise", Vector=at)))
    box = cube("Drifts", material=owner)
    viewport.export()
    empty.location.x = 1.0
    assert viewport.export() == ["volume"]
    assert not differences(viewport)
    box.data.vertices[0].co *= 1.5
    box.data.update()
    assert "volume" in viewport.export()
    assert not differences(viewport)


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_sends_what_changed(studio, viewport, edit):
    viewport.export()
    change, wanted = EDITS[edit]
    change(studio)
    bpy.context.view_layer.update()
    assert viewport.export() == wanted
    assert not differences(viewport)


def test_only_what_changed_is_read(studio, viewport, monkeypatch):
    reads = []
    read = scene_export.mesh.read
    monkeypatch.setattr(scene_export.mesh, "read",
                        lambda mesh: (reads.append(mesh.name), read(mesh))[1])
    viewport.export()
    assert sorted(reads) == ["Box", "Mist", "Wall"]
    reads.clear()
    for change in (lambda: _nudge(studio.wall), lambda: setattr(studio.lamp.data, "energy", 5),
                   lambda: _input(studio.paint, "ShaderNodeBsdfDiffuse", 0, (1, 0, 0, 1))):
        change()
        bpy.context.view_layer.update()
        viewport.export()
    assert not reads
    _stretch(studio.wall)
    bpy.context.view_layer.update()
    viewport.export()
    assert reads == ["Wall"]


@pytest.mark.parametrize("modified", [False, True])
def test_edit_mode(studio, viewport, modified):
    if modified:
        studio.wall.modifiers.new("Triangulate", 'TRIANGULATE')
    bpy.context.view_layer.objects.active = studio.wall
    bpy.ops.object.mode_set(mode='EDIT')
    viewport.export()
    before = viewport.recorder.named("mesh", "Wall")["positions"]
    assert before.shape == (8, 3)
    bpy.ops.mesh.select_all(action='SELECT')
    bpy.ops.transform.translate(value=(0, 0, 3))
    bpy.context.view_layer.update()
    assert viewport.export() == ["mesh"]
    after = viewport.recorder.named("mesh", "Wall")["positions"]
    np.testing.assert_allclose(after, before + (0, 0, 3))
    assert not differences(viewport)
    bpy.ops.object.mode_set(mode='OBJECT')
    bpy.context.view_layer.update()
    viewport.export()
    assert not differences(viewport)


@pytest.mark.fluid
def test_a_simulation_is_read_once_a_frame(plume, monkeypatch):
    viewport, reads = Viewport(), []
    read = fluid._read
    monkeypatch.setattr(fluid, "_read", lambda settings, name: (
        reads.append(name), read(settings, name))[1])
    viewport.export()
    assert reads
    scene = bpy.context.scene
    for change, again in ((lambda: None, False), (lambda: _nudge(scene.camera), False),
                          (lambda: scene.frame_set(scene.frame_current - 1), True)):
        reads.clear()
        change()
        bpy.context.view_layer.update()
        # It has but one frame on disk, which Blender shows in all.
        assert viewport.export() == []
        assert bool(reads) == again
        assert not differences(viewport)


def test_kinds_that_were_sent(studio, viewport):
    viewport.export()
    assert viewport.target.sent_kinds == {"mesh", "instances", "material", "image", "light",
                                          "volume", "world"}
    viewport.export()
    assert viewport.target.sent_kinds == set()
    bpy.data.objects.remove(studio.lamp)
    bpy.context.view_layer.update()
    viewport.export()
    assert viewport.target.sent_kinds == {"light"}


# ------------------------------------------------------------------------------------------------
# What is listened to


def test_pending(studio, viewport):
    assert viewport.changes.pending
    viewport.export()
    assert not viewport.changes.pending
    _nudge(studio.wall)
    assert not viewport.changes.pending
    bpy.context.view_layer.update()
    assert viewport.changes.pending
    assert viewport.changes.take() == {"Object:Wall:": changes.TRANSFORM} or (
        bpy.app.version >= (4, 3, 0))
    assert not viewport.changes.pending


def test_a_reloaded_image_is_sent_again(studio, viewport, tmp_path):
    def write(grey):
        source = bpy.data.images.new("Source", 2, 2)
        source.pixels.foreach_set([grey, grey, grey, 1.0] * 4)
        source.filepath_raw, source.file_format = str(tmp_path / "picture.png"), 'PNG'
        source.save()
        bpy.data.images.remove(source)

    write(0.0)
    image = bpy.data.images.load(str(tmp_path / "picture.png"))
    next(node for node in studio.papered.node_tree.nodes
         if node.bl_idname == "ShaderNodeTexImage").image = image
    bpy.context.view_layer.update()
    viewport.export()
    assert not viewport.changes.pending
    write(1.0)
    image.reload()
    time.sleep(0.05)  # images are not looked at all the time
    assert viewport.changes.pending
    assert viewport.export() == ["image"]
    assert not differences(viewport)


def test_another_view_layer_is_not_meant(studio, viewport):
    viewport.export()
    other = studio.scene.view_layers.new("Other")
    bpy.context.view_layer.update()
    viewport.changes.take()
    _nudge(studio.wall)
    other.update()
    assert not viewport.changes.pending
    bpy.context.view_layer.update()
    assert viewport.changes.pending


def test_everything_after_undo_and_load(studio, viewport, saved):
    viewport.export()
    bpy.ops.ed.undo_push(message="before")
    studio.wall.location.x = 9
    bpy.ops.ed.undo_push(message="after")
    viewport.export()
    bpy.ops.ed.undo()
    assert viewport.changes.take() is None
    bpy.ops.ed.redo()
    assert viewport.changes.take() is None
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    assert viewport.changes.take() is None


def test_what_nobody_holds_does_not_listen(studio):
    kept = changes.Changes(studio.scene, bpy.context.view_layer)
    dropped = weakref.ref(changes.Changes(studio.scene, bpy.context.view_layer))
    gc.collect()
    assert dropped() is None
    assert kept in changes._listeners


# ------------------------------------------------------------------------------------------------
# Many edits in a row


class Edits:
    """Random edits; each returns what it did to what, or None where there was nothing to do."""

    FEWEST = 12  # objects: there is to be something to edit

    def __init__(self, rng, folder):
        self.rng, self.folder, self.serial = rng, folder, 0

    def run(self):
        while True:
            name = self.rng.choice([n for n in dir(type(self)) if n.startswith("do_")])
            try:
                said = getattr(self, name)()
            except IndexError:  # there is nothing to choose from
                said = None
            if said is not None:
                return f"{name[3:]} {said}"

    def name(self, kind):
        self.serial += 1
        return f"{kind} {self.serial}"

    def objects(self, *types):
        return [ob for ob in bpy.context.view_layer.objects if ob.type in types]

    def any(self, *types):
        return self.rng.choice(self.objects(*types) if types
                               else list(bpy.context.view_layer.objects))

    def material(self):
        return self.rng.choice(list(bpy.data.materials))

    def link(self, ob):
        bpy.context.scene.collection.objects.link(ob)
        ob.location = [self.rng.uniform(-5, 5) for _ in range(3)]
        return ob.name

    # -- objects

    def do_add_cube(self):
        ob = cube(self.name("Cube"), material=self.material())
        ob.location.x = self.rng.uniform(-5, 5)
        return ob.name

    def do_add_copy(self):
        other = self.any('MESH', 'LIGHT', 'VOLUME')
        return self.link(bpy.data.objects.new(self.name("Copy"), other.data))

    def do_duplicate(self):
        other = self.any('MESH')
        made = other.copy()
        made.data = other.data.copy()
        return self.link(made)

    def do_add_lamp(self):
        kind = self.rng.choice(['POINT', 'SUN', 'SPOT', 'AREA'])
        return self.link(bpy.data.objects.new(self.name("Lamp"), bpy.data.lights.new("L", kind)))

    def do_add_volume(self):
        data = bpy.data.volumes.new(self.name("Volume"))
        data.filepath = str(self.folder / "s_1.vdb")
        data.is_sequence, data.frame_duration = True, 3
        data.materials.append(self.material())
        return self.link(bpy.data.objects.new(data.name, data))

    def do_add_empty(self):
        return self.link(bpy.data.objects.new(self.name("Empty"), None))

    def do_add_metaball(self):
        data = bpy.data.metaballs.new(self.name("Ball"))
        data.elements.new().radius = self.rng.uniform(1, 2)
        return self.link(bpy.data.objects.new(self.rng.choice(["Ball", data.name]), data))

    def do_fog(self):
        ob = self.any('MESH', 'EMPTY', 'META')
        bpy.context.view_layer.objects.active = ob
        if len(ob.brume.fog_sources) > 2:
            bpy.ops.brume.fog_remove()
        else:
            bpy.ops.brume.fog_add()
        return f"{ob.name} {len(ob.brume.fog_sources)}"

    def do_fog_setting(self):
        ob = self.rng.choice([ob for ob in bpy.context.view_layer.objects if ob.brume.fog_sources])
        source = self.rng.choice(list(ob.brume.fog_sources))
        kind = self.rng.choice(["source", "enabled", "radius", "material", "factor_attribute"])
        setattr(source, kind, {
            "source": self.rng.choice(['OBJECT', 'POINTS', 'PARTICLES']),
            "enabled": not source.enabled, "radius": self.rng.uniform(0, 2),
            "material": self.rng.choice([None, self.material()]),
            "factor_attribute": self.rng.choice(["", "crease"])}[kind])
        return f"{ob.name} {kind}"

    def do_delete(self):
        ob = self.any()
        name = ob.name
        if len(bpy.context.view_layer.objects) < self.FEWEST:
            return None
        bpy.data.objects.remove(ob)
        return name

    def do_delete_and_add_under_its_name(self):
        ob = self.any('MESH')
        name, mesh = ob.name, ob.data.name
        bpy.data.objects.remove(ob)
        cube(name, size=self.rng.uniform(1, 3), material=self.material())
        return f"{name} {mesh}"

    def do_delete_data(self):
        if len(bpy.context.view_layer.objects) < self.FEWEST:
            return None
        data = self.rng.choice([*bpy.data.meshes, *bpy.data.lights])
        name = data.name
        (bpy.data.meshes if isinstance(data, bpy.types.Mesh) else bpy.data.lights).remove(data)
        return name

    def do_move(self):
        ob = self.any()
        ob.location = [self.rng.uniform(-5, 5) for _ in range(3)]
        return ob.name

    def do_scale(self):
        ob = self.any()
        ob.scale = [self.rng.uniform(0.5, 2)] * 3
        return ob.name

    def do_rename(self):
        ob = self.any()
        before, ob.name = ob.name, self.name("Renamed")
        return f"{before} to {ob.name}"

    def do_rename_data(self):
        data = self.rng.choice([*bpy.data.meshes, *bpy.data.lights, *bpy.data.materials,
                                *bpy.data.volumes, *bpy.data.images, *bpy.data.worlds])
        before, data.name = data.name, self.name("Data")
        return f"{before} to {data.name}"

    def do_swap_names(self):
        kind = self.rng.choice([bpy.data.objects, bpy.data.materials, bpy.data.meshes,
                                bpy.data.images])
        if len(kind) < 2:
            return None
        one, two = self.rng.sample(list(kind), 2)
        names = one.name, two.name
        one.name = "Swap"
        two.name, one.name = names
        return " and ".join(names)

    def do_swap_data(self):
        one, two = self.any('MESH'), self.any('MESH')
        one.data = two.data
        return f"{one.name} gets that of {two.name}"

    def do_parent(self):
        child, parent = self.any('MESH', 'LIGHT', 'VOLUME'), self.any('MESH', 'LIGHT')
        above = parent
        while above is not None:
            if above == child or above.constraints:
                return None
            above = above.parent
        child.parent = parent
        return f"{child.name} to {parent.name}"

    def do_unparent(self):
        ob = self.rng.choice([ob for ob in bpy.context.view_layer.objects if ob.parent])
        ob.parent = None
        return ob.name

    def do_constrain(self):
        ob, aim = self.any(), self.any()
        if ob.constraints:
            ob.constraints.clear()
        elif ob != aim and not aim.constraints and not aim.parent and not ob.children:
            ob.constraints.new('COPY_LOCATION').target = aim
        return f"{ob.name} {aim.name}"

    def do_hide(self):
        ob = self.any()
        kind = self.rng.choice(["hide_viewport", "visible_camera", "visible_shadow", "is_holdout",
                                "hide_render"])
        setattr(ob, kind, not getattr(ob, kind))
        return f"{ob.name} {kind}"

    def do_show_all(self):
        for ob in bpy.data.objects:
            ob.hide_viewport = False
        for layer in bpy.context.view_layer.layer_collection.children:
            layer.exclude = layer.hide_viewport = False
        return len(bpy.data.objects)

    do_show_all_again = do_show_all

    def do_hide_in_layer(self):
        ob = self.any()
        ob.hide_set(not ob.hide_get())
        return ob.name

    # -- collections

    def do_collect(self):
        if len(bpy.data.collections) > 4:
            return None  # the more the slower
        made = bpy.data.collections.new(self.name("Collection"))
        bpy.context.scene.collection.children.link(made)
        for _ in range(3):
            ob = self.any('MESH', 'LIGHT', 'VOLUME')
            if ob.name not in made.objects:
                made.objects.link(ob)
        return made.name

    def do_instance(self):
        made = bpy.data.objects.new(self.name("Instance"), None)
        made.instance_type = 'COLLECTION'
        made.instance_collection = self.rng.choice(list(bpy.data.collections))
        return self.link(made)

    def do_unlink(self):
        collection = self.rng.choice(list(bpy.data.collections))
        ob = self.rng.choice(list(collection.objects))
        collection.objects.unlink(ob)
        return f"{ob.name} from {collection.name}"

    def do_layer(self):
        layer = self.rng.choice(list(bpy.context.view_layer.layer_collection.children))
        kind = self.rng.choice(["exclude", "hide_viewport", "holdout", "indirect_only"])
        setattr(layer, kind, not getattr(layer, kind))
        return f"{layer.name} {kind}"

    def do_hide_collection(self):
        collection = self.rng.choice(list(bpy.data.collections))
        collection.hide_viewport = not collection.hide_viewport
        return collection.name

    def do_verts(self):
        ob, child = self.any('MESH'), self.any('MESH', 'LIGHT')
        if ob.instance_type == 'VERTS':
            ob.instance_type = 'NONE'
        elif ob != child and ob.parent is None and not child.children:
            child.parent = ob
            ob.instance_type = 'VERTS'
        return f"{ob.name} {child.name}"

    def do_override(self):
        layer = bpy.context.view_layer
        layer.material_override = None if layer.material_override else self.material()
        return layer.material_override and layer.material_override.name or "none"

    # -- meshes

    def do_stretch(self):
        ob = self.any('MESH')
        _stretch(ob)
        return ob.name

    def do_modify(self):
        ob = self.any('MESH')
        if ob.modifiers and self.rng.random() < 0.4:
            ob.modifiers.clear()
        elif len(ob.modifiers) < 2:
            kind = self.rng.choice(['ARRAY', 'SOLIDIFY', 'TRIANGULATE', 'MIRROR'])
            ob.modifiers.new(kind, kind)
        return f"{ob.name} {[m.name for m in ob.modifiers]}"

    def do_modifier_value(self):
        ob = self.rng.choice([ob for ob in self.objects('MESH')
                              if any(m.type == 'ARRAY' for m in ob.modifiers)])
        ob.modifiers["ARRAY"].count = self.rng.randint(1, 3)
        return ob.name

    def do_modifier_off(self):
        ob = self.rng.choice([ob for ob in self.objects('MESH') if ob.modifiers])
        ob.modifiers[0].show_viewport = not ob.modifiers[0].show_viewport
        return ob.name

    def do_boolean(self):
        ob, other = self.any('MESH'), self.any('MESH')
        if ob != other and not other.modifiers and not ob.modifiers:
            ob.modifiers.new("Cut", 'BOOLEAN').object = other
        return f"{ob.name} {other.name}"

    def do_scatter(self):
        ob, other = self.any('MESH'), self.any('MESH', 'LIGHT')
        if ob.modifiers or ob == other or other.modifiers or other.parent:
            return None

        def build(tree, geometry):
            info = tree.nodes.new('GeometryNodeObjectInfo')
            info.inputs[0].default_value = other
            ball = tree.nodes.new('GeometryNodeMeshIcoSphere')
            scatter = tree.nodes.new('GeometryNodeInstanceOnPoints')
            joined = tree.nodes.new('GeometryNodeJoinGeometry')
            tree.links.new(geometry, scatter.inputs["Points"])
            source = self.rng.choice([info.outputs["Geometry"], ball.outputs[0]])
            tree.links.new(source, scatter.inputs["Instance"])
            tree.links.new(scatter.outputs[0], joined.inputs[0])
            tree.links.new(geometry, joined.inputs[0])
            return joined.outputs[0]
        geometry_nodes(ob, build)
        return f"{other.name} on {ob.name}"

    def do_geometry_value(self):
        node = self.rng.choice([node for tree in bpy.data.node_groups for node in tree.nodes
                                if node.bl_idname == 'GeometryNodeMeshIcoSphere'])
        node.inputs["Radius"].default_value = self.rng.uniform(0.1, 1)
        return node.id_data.name

    def do_shape_key(self):
        ob = self.any('MESH')
        if ob.data.shape_keys is None:
            ob.shape_key_add(name="Basis")
            ob.shape_key_add(name="Key").data[0].co.x += 2
        ob.data.shape_keys.key_blocks["Key"].value = self.rng.random()
        return ob.name

    def do_edit_mode(self):
        ob = self.any('MESH')
        if ob.hide_viewport or ob.hide_get():
            return None
        bpy.context.view_layer.objects.active = ob
        bpy.ops.object.mode_set(mode='EDIT')
        bpy.ops.mesh.select_all(action='SELECT')
        bpy.ops.transform.translate(value=(0.5, 0, 0))
        bpy.ops.object.mode_set(mode='OBJECT')
        return ob.name

    def do_curve(self):
        if bpy.data.curves and self.rng.random() < 0.7:
            bpy.data.curves[0].bevel_depth = self.rng.uniform(0.1, 0.4)
            return "changed"
        data = bpy.data.curves.new(self.name("Curve"), 'CURVE')
        data.dimensions, data.bevel_depth = '3D', 0.1
        data.splines.new('POLY').points.add(2)
        data.splines[0].points[1].co = (1, 1, 1, 1)
        return self.link(bpy.data.objects.new(data.name, data))

    # -- materials

    def do_new_material(self):
        owner, nodes = material(self.name("Material"))
        kind = self.rng.choice(["surface", "volume", "both", "neither"])
        if kind in {"surface", "both"}:
            nodes.surface(nodes.node("BsdfDiffuse"))
        if kind in {"volume", "both"}:
            nodes.volume(nodes.node("VolumePrincipled"))
        return f"{owner.name} {kind}"

    def do_slot(self):
        ob, new = self.any('MESH', 'VOLUME'), self.material()
        if not ob.material_slots:
            ob.data.materials.append(new)
        elif self.rng.random() < 0.2:
            ob.data.materials.clear()
        else:
            slot = self.rng.choice(list(ob.material_slots))
            slot.link = self.rng.choice(['OBJECT', 'DATA'])
            slot.material = new
        return f"{ob.name} {new.name}"

    def do_slot_link(self):
        slot = self.rng.choice([slot for ob in self.objects('MESH') for slot in ob.material_slots])
        slot.link = 'OBJECT' if slot.link == 'DATA' else 'DATA'
        return slot.id_data.name

    def do_append_slot(self):
        ob = self.any('MESH')
        if len(ob.material_slots) < 3:
            ob.data.materials.append(self.material())
            ob.data.polygons[0].material_index = len(ob.data.materials) - 1
            ob.data.update()
        return ob.name

    def do_node_value(self):
        tree = self.rng.choice([m.node_tree for m in bpy.data.materials if m.node_tree])
        socket = self.rng.choice([s for node in tree.nodes for s in node.inputs
                                  if s.type == 'RGBA'])
        socket.default_value = [self.rng.random() for _ in range(4)]
        return tree.name

    def do_mute(self):
        tree = self.rng.choice([m.node_tree for m in bpy.data.materials if m.node_tree])
        node = self.rng.choice(list(tree.nodes))
        node.mute = not node.mute
        return node.name

    def do_unlink_node(self):
        tree = self.rng.choice([m.node_tree for m in bpy.data.materials if m.node_tree])
        tree.links.remove(self.rng.choice(list(tree.links)))
        return tree.name

    def do_use_nodes(self):
        owner = self.material()
        owner.use_nodes = not owner.use_nodes
        return owner.name

    def do_group(self):
        owner = self.rng.choice([m for m in bpy.data.materials if m.node_tree])
        group = bpy.data.node_groups.get("Shared")
        if group is None:
            group = bpy.data.node_groups.new("Shared", 'ShaderNodeTree')
            group.nodes.new('NodeGroupOutput')
            shader = group.nodes.new('ShaderNodeEmission')
            from blenders import interface_socket
            interface_socket(group, "Shader", 'OUTPUT', 'NodeSocketShader')
            group.links.new(shader.outputs[0], group.nodes["Group Output"].inputs[0])
        node = owner.node_tree.nodes.new('ShaderNodeGroup')
        node.node_tree = group
        out = next(n for n in owner.node_tree.nodes if n.type == 'OUTPUT_MATERIAL')
        owner.node_tree.links.new(node.outputs[0],
                                  out.inputs[self.rng.choice(["Surface", "Volume"])])
        return owner.name

    def do_in_group(self):
        node = self.rng.choice([node for tree in bpy.data.node_groups for node in tree.nodes
                                if node.bl_idname == 'ShaderNodeEmission'])
        if self.rng.random() < 0.5:
            node.mute = not node.mute
        else:
            node.inputs[1].default_value = self.rng.random()
        return node.name

    def do_delete_material(self):
        if len(bpy.data.materials) < 4:
            return None
        owner = self.material()
        name = owner.name
        bpy.data.materials.remove(owner)
        return name

    # -- images

    def do_image(self):
        tree = self.rng.choice([m.node_tree for m in bpy.data.materials if m.node_tree])
        shader = self.rng.choice([n for n in tree.nodes if n.bl_idname == 'ShaderNodeBsdfDiffuse'])
        node = tree.nodes.new('ShaderNodeTexImage')
        node.image = bpy.data.images.new(self.name("Image"), 2, 2)
        tree.links.new(node.outputs[0], shader.inputs["Color"])
        return node.image.name

    def do_image_setting(self):
        image = self.rng.choice(list(bpy.data.images))
        kind = self.rng.choice(["color", "alpha", "space", "paint"])
        if kind == "color":
            image.generated_color = [self.rng.random() for _ in range(4)]
        elif kind == "alpha":
            image.alpha_mode = self.rng.choice(['NONE', 'STRAIGHT', 'CHANNEL_PACKED'])
        elif kind == "space":
            image.colorspace_settings.name = self.rng.choice(["sRGB", "Non-Color"])
        else:
            image.pixels.foreach_set([self.rng.random()] * len(image.pixels))
            image.update_tag()
        return f"{image.name} {kind}"

    def do_delete_image(self):
        image = self.rng.choice(list(bpy.data.images))
        name = image.name
        bpy.data.images.remove(image)
        return name

    # -- lamps, volumes, world, time

    def do_lamp(self):
        lamp = self.rng.choice(list(bpy.data.lights))
        lamp.energy = self.rng.uniform(1, 9)
        if self.rng.random() < 0.3:
            lamp.type = self.rng.choice(['POINT', 'SUN', 'SPOT', 'AREA'])
        return lamp.name

    def do_lamp_nodes(self):
        lamp = self.rng.choice(list(bpy.data.lights))
        lamp.use_nodes = True
        lamp.node_tree.nodes["Emission"].inputs[1].default_value = self.rng.random()
        return lamp.name

    def do_volume(self):
        data = self.rng.choice(list(bpy.data.volumes))
        kind = self.rng.choice(["path", "offset", "space", "missing"])
        if kind == "offset":
            data.frame_offset = self.rng.randint(0, 2)
        elif kind == "space":
            data.render.space = self.rng.choice(['OBJECT', 'WORLD'])
        else:
            data.filepath = str(self.folder / ("s_1.vdb" if kind == "path" else "none.vdb"))
        return f"{data.name} {kind}"

    def do_world(self):
        scene = bpy.context.scene
        if scene.world is None or self.rng.random() < 0.2:
            scene.world = bpy.data.worlds.new(self.name("World"))
        elif self.rng.random() < 0.2:
            scene.world = None
            return "none"
        scene.world.color = [self.rng.random() for _ in range(3)]
        return scene.world.name

    def do_world_nodes(self):
        world = bpy.context.scene.world
        if world is None:
            return None
        nodes = Nodes(world)
        nodes.surface(nodes.node("Background", Strength=self.rng.random()))
        if self.rng.random() < 0.5:
            nodes.volume(nodes.node("VolumeScatter", Density=self.rng.random()))
        return world.name

    def do_key(self):
        ob = self.any()
        path = self.rng.choice(["location", "scale", "hide_viewport", "visible_camera"])
        ob.keyframe_insert(path, frame=1)
        if path == "location":
            ob.location.x += 3
        elif path == "scale":
            ob.scale.x += 0.5
        else:
            setattr(ob, path, not getattr(ob, path))
        ob.keyframe_insert(path, frame=4)
        return f"{ob.name} {path}"

    def do_drive(self):
        lamp = self.rng.choice(list(bpy.data.lights))
        lamp.driver_remove("energy")
        lamp.driver_add("energy").driver.expression = "frame * 2 + 1"
        return lamp.name

    def do_frame(self):
        frame = self.rng.randint(1, 5)
        bpy.context.scene.frame_set(frame)
        return frame

    do_frame_again = do_frame

    def do_undo(self):
        try:
            bpy.ops.ed.undo()
        except RuntimeError:  # all is undone
            return None
        return "once"

    def do_redo(self):
        try:
            bpy.ops.ed.redo()
        except RuntimeError:  # nothing was undone
            return None
        return "once"


@pytest.mark.parametrize("seed", range(4))
def test_many_edits_end_where_a_full_export_does(scene, tmp_path, seed):
    for frame in (1, 2, 3):
        write_vdb(tmp_path / f"s_{frame}.vdb", density=np.full((frame, 2, 2), 1, np.float32))
    for name in ("One", "Two"):
        cube(name, material=fog(f"Fog {name}") if name == "Two" else material("Plain")[0])
    bpy.ops.ed.undo_push(message="begin")
    viewport = Viewport()
    viewport.export()
    rng = random.Random(seed)
    edits = Edits(rng, tmp_path)
    done, sent = [], 0
    for step in range(400):
        done.append(edits.run())
        bpy.ops.ed.undo_push(message=str(step))
        bpy.context.view_layer.update()
        if rng.random() < 0.7:
            sent += len(viewport.export())
            found = differences(viewport)
            assert not found, f"after {done[-6:]} ({step})"
    # Had nothing happened, nothing could have gone wrong.
    assert sent > 300
