# SPDX-License-Identifier: GPL-3.0-or-later
"""The pass over the depsgraph: instances, media, what is hidden, what is sent again."""

import bpy
import numpy as np
import pytest
from blenders import interface_socket
from brume import native
from brume.export import volume
from conftest import Nodes, add, cube, material, write_vdb


def fog(name="Fog", **values):
    owner, nodes = material(name)
    nodes.volume(nodes.node("VolumeScatter", **({"Density": 2.0} | values)))
    return owner


def instances_of(recorder, name):
    """(matrices, visibility) of all instances of a mesh."""
    key, = [k for k, mesh in recorder.blocks["mesh"].items() if mesh["name"] == name]
    found = [block for block in recorder.of("instances") if block["mesh"] == key]
    return found


def test_surface_cube(scene, export):
    ob = cube("Box", location=(1, 2, 3), scale=(1, 1, 2))
    recorder = export()
    block, = instances_of(recorder, "Box")
    np.testing.assert_allclose(block["world_from_object"][0], np.array(ob.matrix_world))
    assert block["visibility"] == native.VISIBLE_CAMERA | native.VISIBLE_SHADOW
    assert recorder.named("mesh", "Box")["materials"][0] in recorder.blocks["material"]


def test_fog_cube_is_no_surface(scene, export):
    ob = cube("Fog", material=fog(), location=(1, 2, 3))
    recorder = export()
    block = recorder.named("volume", "Fog")
    np.testing.assert_allclose(block["world_from_object"], np.array(ob.matrix_world))
    assert block["triangles"].shape == (12, 3)
    assert not recorder.of("mesh")
    assert not recorder.of("instances")


def test_a_second_medium_is_reported(scene, export, target):
    ob = cube("Both", material=fog("One"))
    ob.data.materials.append(fog("Two"))
    ob.data.materials.append(ob.data.materials["One"])
    export()
    (found, sentence), = target.reports
    assert found == "UNSUPPORTED"
    assert all(f'"{name}"' in sentence for name in ("Both", "One", "Two"))


def test_glassy_fog_is_both(scene, export):
    both = fog()
    nodes = both.node_tree.nodes
    both.node_tree.links.new(nodes.new('ShaderNodeBsdfDiffuse').outputs[0],
                             nodes["Material Output"].inputs["Surface"])
    cube("Both", material=both)
    recorder = export()
    assert recorder.named("volume", "Both")
    assert recorder.named("mesh", "Both")


def test_linked_objects_share_a_mesh(scene, export):
    one = cube("One")
    for i in range(3):
        add(f"Copy {i}", one.data, location=(i, 0, 0))
    recorder = export()
    assert len(recorder.of("mesh")) == 1
    block, = recorder.of("instances")
    assert block["world_from_object"].shape == (4, 4, 4)


def test_a_modifier_makes_another_mesh(scene, export):
    one = cube("One")
    add("Two", one.data).modifiers.new("Subdivision", 'SUBSURF')
    recorder = export()
    assert sorted(len(m["triangles"]) for m in recorder.of("mesh")) == [12, 48]


def test_object_materials_make_another_mesh(scene, export):
    one = cube("One", material=bpy.data.materials.new("A"))
    two = add("Two", one.data)
    two.material_slots[0].link = 'OBJECT'
    two.material_slots[0].material = bpy.data.materials.new("B")
    recorder = export()
    assert len({mesh["materials"] for mesh in recorder.of("mesh")}) == 2


def test_visibility(scene, export):
    cube("Seen")
    cube("Shadow").visible_camera = False
    cube("Bright").visible_shadow = False
    cube("Hole").is_holdout = True
    cube("Hidden").hide_viewport = True
    recorder = export()
    camera, shadow, holdout = (native.VISIBLE_CAMERA, native.VISIBLE_SHADOW,
                               native.VISIBLE_HOLDOUT)
    for name, bits in (("Seen", camera | shadow), ("Shadow", shadow), ("Bright", camera),
                       ("Hole", camera | shadow | holdout)):
        block, = instances_of(recorder, name)
        assert block["visibility"] == bits, name
    assert "Hidden" not in [mesh["name"] for mesh in recorder.of("mesh")]


def test_holdout_collection(scene, export):
    collection = bpy.data.collections.new("Cut")
    scene.collection.children.link(collection)
    ob = cube("Hole")
    scene.collection.objects.unlink(ob)
    collection.objects.link(ob)
    bpy.context.view_layer.layer_collection.children["Cut"].holdout = True
    block, = instances_of(export(), "Hole")
    assert block["visibility"] & native.VISIBLE_HOLDOUT


def test_collection_instances(scene, export):
    collection = bpy.data.collections.new("Group")
    for name, shader in (("Box", None), ("Mist", fog())):
        ob = cube(name, material=shader)
        scene.collection.objects.unlink(ob)
        collection.objects.link(ob)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", 'POINT'))
    collection.objects.link(lamp)
    for i in range(3):
        empty = add(f"Empty {i}", None, location=(10 * i, 0, 0))
        empty.instance_type, empty.instance_collection = 'COLLECTION', collection
    recorder = export()
    block, = instances_of(recorder, "Box")
    assert sorted(block["world_from_object"][:, 0, 3].tolist()) == [0, 10, 20]
    assert sorted(v["world_from_object"][0, 3] for v in recorder.of("volume")) == [0, 10, 20]
    assert sorted(v["world_from_light"][0, 3] for v in recorder.of("light")) == [0, 10, 20]


def test_particles(scene, export):
    ball = cube("Ball", size=0.1)
    ground = cube("Ground")
    modifier = ground.modifiers.new("Particles", 'PARTICLE_SYSTEM')
    settings = modifier.particle_system.settings
    settings.count, settings.frame_start, settings.frame_end = 50, 1, 1
    settings.render_type, settings.instance_object = 'OBJECT', ball
    scene.frame_set(1)
    scene.frame_set(2)
    blocks = instances_of(export(), "Ball")
    assert sum(len(block["world_from_object"]) for block in blocks) == 51


def geometry_nodes(ob, build):
    """Gives an object a geometry nodes modifier; build(tree, input socket) gives the output."""
    tree = bpy.data.node_groups.new("Geometry", 'GeometryNodeTree')
    for in_out in ('INPUT', 'OUTPUT'):
        interface_socket(tree, "Geometry", in_out, 'NodeSocketGeometry')
    enter, leave = tree.nodes.new('NodeGroupInput'), tree.nodes.new('NodeGroupOutput')
    tree.links.new(build(tree, enter.outputs[0]), leave.inputs[0])
    ob.modifiers.new("Geometry", 'NODES').node_group = tree
    bpy.context.view_layer.update()


def test_geometry_nodes_instances(scene, export):
    def build(tree, geometry):
        ball = tree.nodes.new('GeometryNodeMeshIcoSphere')
        scatter = tree.nodes.new('GeometryNodeInstanceOnPoints')
        tree.links.new(geometry, scatter.inputs["Points"])
        tree.links.new(ball.outputs[0], scatter.inputs["Instance"])
        return scatter.outputs[0]
    ob = cube("Host", size=4.0)
    geometry_nodes(ob, build)
    recorder = export()
    block, = recorder.of("instances")
    assert len(block["world_from_object"]) == 8
    assert set(np.abs(block["world_from_object"][:, :3, 3]).ravel().tolist()) == {2.0}


def test_fog_instances_by_geometry_nodes(scene, export):
    """Instances of a real object keep that object's materials."""
    mist = cube("Mist", size=0.5, material=fog())
    mist.hide_viewport = True
    host = cube("Host", size=4.0)

    def build(tree, geometry):
        info = tree.nodes.new('GeometryNodeObjectInfo')
        info.inputs[0].default_value = mist
        scatter = tree.nodes.new('GeometryNodeInstanceOnPoints')
        tree.links.new(geometry, scatter.inputs["Points"])
        tree.links.new(info.outputs["Geometry"], scatter.inputs["Instance"])
        return scatter.outputs[0]
    geometry_nodes(host, build)
    assert len(export().of("volume")) == 8


def test_two_volumes_of_geometry_nodes_without_a_file(scene, export, target):
    def build(tree, geometry):
        made = tree.nodes.new('GeometryNodeVolumeCube')
        for name, value in (("Resolution X", 8), ("Resolution Y", 8), ("Resolution Z", 8)):
            made.inputs[name].default_value = value
        paint = tree.nodes.new('GeometryNodeSetMaterial')
        paint.inputs["Material"].default_value = smoke
        tree.links.new(made.outputs[0], paint.inputs[0])
        return paint.outputs[0]
    smoke, nodes = material("Smoke")
    nodes.volume(nodes.node("VolumePrincipled"))
    ob = cube("Host")
    ob.data.materials.append(smoke)
    geometry_nodes(ob, build)
    block = export().named("volume", "Host")
    info = block["grids"][0].describe()
    assert (info.name, list(info.dims)) == (b"density", [8, 8, 8])
    assert not target.reports.ids()


# -- volume objects


def volume_object(path, shader, **more):
    data = bpy.data.volumes.new("Cloud")
    data.filepath = path
    if shader:
        data.materials.append(shader)
    return add("Cloud", data, **more)


def smoke(name="Smoke", **values):
    owner, nodes = material(name)
    nodes.volume(nodes.node("VolumePrincipled", **values))
    return owner


def block_of(shape=(4, 5, 6), value=1.0):
    return np.full(shape, value, np.float32)


def test_volume_object(scene, export, tmp_path):
    path = write_vdb(tmp_path / "a.vdb", density=block_of(), heat=block_of())
    volume_object(path, smoke(Density=3.0), scale=(2, 2, 2))
    block = export().named("volume", "Cloud")
    assert block["program"].grids == ("density",)
    info = block["grids"][0].describe()
    assert list(info.dims) == [4, 5, 6]
    # In object space a stretched volume keeps its optical depth.
    assert block["scale"] == pytest.approx(0.5)


def test_volume_in_world_space(scene, export, tmp_path):
    path = write_vdb(tmp_path / "a.vdb", density=block_of())
    volume_object(path, smoke(), scale=(2, 2, 2)).data.render.space = 'WORLD'
    assert export().named("volume", "Cloud")["scale"] == 1.0


def test_density_scale_is_that_of_cycles():
    # Measured in Cycles 3.4: absorption of a box of 1/m, scaled, per metre along z.
    for scale, wanted in (((1, 1, 1), 1.0), ((2, 2, 2), 0.5), ((2, 1, 1), 0.70711),
                          ((1, 1, 2), 0.70711)):
        assert volume.density_scale(np.diag((*scale, 1))) == pytest.approx(wanted, rel=1e-4)


def test_volume_without_material_is_cycles_default(scene, export, tmp_path):
    path = write_vdb(tmp_path / "a.vdb", density=block_of())
    volume_object(path, None)
    assert export().named("volume", "Cloud")["program"].grids == ("density",)


def test_grids_are_loaded_once(scene, export, recorder, tmp_path):
    path = write_vdb(tmp_path / "a.vdb", density=block_of())
    ob = volume_object(path, smoke())
    first = export().named("volume", "Cloud")["grids"][0]
    ob.location.x = 5
    bpy.context.view_layer.update()
    assert export().named("volume", "Cloud")["grids"][0] is first
    assert recorder.sent.count("volume") == 2
    export()
    assert recorder.sent.count("volume") == 2


def test_sequence_by_frame(scene, export, tmp_path):
    for frame in (1, 2, 3):
        write_vdb(tmp_path / f"s_{frame:03}.vdb", density=block_of((frame, 2, 2)))
    ob = volume_object(str(tmp_path / "s_001.vdb"), smoke())
    ob.data.is_sequence, ob.data.frame_duration = True, 3
    ob.data.sequence_mode = 'CLIP'
    for frame in (2, 3):
        scene.frame_set(frame)
        grid = export().named("volume", "Cloud")["grids"][0]
        assert grid.describe().dims[0] == frame
    scene.frame_set(9)
    assert export().of("volume") == []


def test_missing_file_leaves_the_rest(scene, export, target):
    volume_object("/nowhere/none.vdb", smoke())
    cube("Box")
    recorder = export()
    assert recorder.named("mesh", "Box")
    assert target.reports.ids() == ["FILE_MISSING"]
    sentence = next(iter(target.reports))[1]
    assert "Cloud" in sentence
    assert "none.vdb" in sentence


def test_what_is_no_vdb(scene, export, target, tmp_path):
    # A truncated file is test_native's: Blender 3.4 itself aborts on one.
    (tmp_path / "a.vdb").write_text("this is no volume " * 10)
    volume_object(str(tmp_path / "a.vdb"), smoke())
    assert export().of("volume") == []
    assert target.reports.ids() == ["FILE_FORMAT"]


def test_unknown_grid_is_named(scene, export, target, tmp_path):
    path = write_vdb(tmp_path / "a.vdb", density=block_of())
    owner, nodes = material()
    nodes.volume(nodes.node("VolumeScatter", Density=nodes.node("Attribute", outlet=2,
                                                                attribute_name="dust")))
    volume_object(path, owner)
    assert export().of("volume") == []
    assert set(target.reports.ids()) == {"GRID_UNKNOWN"}
    assert any("dust" in sentence for _, sentence in target.reports)


def test_packed_volume(scene, export, tmp_path):
    path = write_vdb(tmp_path / "a.vdb", density=block_of())
    ob = volume_object(path, smoke())
    with bpy.context.temp_override(id=ob.data):
        bpy.ops.file.pack_all()
    assert ob.data.packed_file
    (tmp_path / "a.vdb").unlink()
    assert list(export().named("volume", "Cloud")["grids"][0].describe().dims) == [4, 5, 6]


def test_mesh_to_volume_modifier(scene, export):
    source = cube("Source")
    source.hide_viewport = True
    ob = add("Cloud", bpy.data.volumes.new("Cloud"))
    ob.data.materials.append(smoke())
    modifier = ob.modifiers.new("Volume", 'MESH_TO_VOLUME')
    modifier.object = source
    bpy.context.view_layer.update()
    info = export().named("volume", "Cloud")["grids"][0].describe()
    assert min(info.dims) > 8


# -- fluid domains


@pytest.mark.fluid
def test_fluid_domain(plume, export, target):
    recorder = export()
    block = recorder.named("volume", plume.name)
    grid = block["grids"][block["program"].grids.index("density")].describe()
    assert min(grid.dims) > 8
    assert grid.maximum > 0.1
    # The grids fill the domain's box.
    corner = np.array(grid.object_from_array).reshape(4, 4).T @ (*grid.dims, 1)
    np.testing.assert_allclose(corner[:3], np.array(plume.bound_box).max(0), rtol=1e-5)
    assert plume.name not in [mesh["name"] for mesh in recorder.of("mesh")]
    assert block.get("scale", 1.0) == 1.0


@pytest.mark.fluid
def test_fluid_color_is_not_multiplied_by_density(plume, export):
    nodes = Nodes(plume.material_slots[0].material)
    nodes.volume(nodes.node("VolumePrincipled", Color_Attribute="color", Density=1.0))
    block = export().named("volume", plume.name)
    color = block["grids"][block["program"].grids.index("color")].describe()
    assert color.channels == 3
    assert 0.0 < color.maximum <= 1.01


@pytest.mark.fluid
def test_adaptive_domain_with_noise(scene, tmp_path, monkeypatch, export):
    """The grids of a domain that shrinks around its smoke lie where the smoke's source is."""
    from brume.export import fluid
    domain = cube("Domain", size=2.0, location=(0, 0, 1), material=smoke())
    modifier = domain.modifiers.new("Fluid", 'FLUID')
    modifier.fluid_type = 'DOMAIN'
    settings = modifier.domain_settings
    settings.domain_type, settings.resolution_max = 'GAS', 16
    settings.use_adaptive_domain = settings.use_noise = True
    settings.cache_type, settings.cache_directory = 'REPLAY', str(tmp_path)
    source = cube("Source", size=0.3, location=(0.5, -0.4, 0.6))
    flow = source.modifiers.new("Fluid", 'FLUID')
    flow.fluid_type = 'FLOW'
    flow.flow_settings.flow_behavior = 'INFLOW'
    grids = []
    create = fluid.Grid.create
    monkeypatch.setattr(fluid.Grid, "create", lambda name, data, to_object: (
        grids.append((data, to_object)), create(name, data, to_object))[1])
    for frame in (1, 2, 3):
        scene.frame_set(frame)
    export()
    (density, to_object), = grids
    cells = density.shape[::-1]
    assert max(cells) < 2 * 16, "the domain has not shrunk"
    x, y, z = np.meshgrid(*[np.arange(n) + 0.5 for n in cells], indexing='ij')
    weight = density.transpose(2, 1, 0)
    centre = [(axis * weight).sum() / weight.sum() for axis in (x, y, z)]
    # A cell of the coarse grid is an eighth of a metre, and smoke has begun to rise.
    np.testing.assert_allclose((np.array(domain.matrix_world) @ to_object @ (*centre, 1))[:3],
                               (0.5, -0.4, 0.6), atol=0.13)


# -- the rest


def test_zero_scale_is_reported_by_name(scene, target, tmp_path):
    """By the library, when the scene is a real one."""
    class Refusing:
        def __getattr__(self, name):
            if name == "set_volume":
                def refuse(key, **values):
                    raise native.BrumeError("TRANSFORM", "the transform is singular")
                return refuse
            return lambda *args, **values: None
    from brume.export import scene as scene_export
    target.scene = Refusing()
    cube("Flat", material=fog(), scale=(1, 1, 0))
    cube("Box")
    scene_export.export(bpy.context.evaluated_depsgraph_get(), target)
    assert target.reports.ids() == ["TRANSFORM"]
    assert "Flat" in next(iter(target.reports))[1]


def test_nothing_changed_nothing_sent(scene, export, recorder):
    cube("Box", material=bpy.data.materials.new("A"))
    cube("Mist", material=fog())
    add("Lamp", bpy.data.lights.new("Lamp", 'POINT'))
    export()
    count = len(recorder.sent)
    export()
    assert len(recorder.sent) == count
    bpy.data.objects["Box"].location.x = 1
    bpy.context.view_layer.update()
    export()
    assert recorder.sent[count:] == ["instances"]


def test_deleted_objects_go(scene, export):
    ob = cube("Box")
    export()
    bpy.data.objects.remove(ob)
    recorder = export()
    assert not recorder.of("mesh")
    assert not recorder.of("instances")


def test_material_override(scene, export):
    cube("Box")
    override = bpy.data.materials.new("Clay")
    bpy.context.view_layer.material_override = override
    recorder = export()
    assert [m["name"] for m in recorder.of("material")] == ["Clay"]


def test_visibility_that_means_nothing_is_named(scene, export, target):
    usual, hidden = (cube(name, material=fog(name)) for name in ("Usual", "Hidden"))
    catcher, kept = cube("Catcher"), cube("Kept")
    usual.visible_glossy = False  # what mirrors show of media is the lattice's
    hidden.visible_camera = hidden.visible_shadow = False
    catcher.is_shadow_catcher = True
    kept.visible_diffuse = False
    export()
    sentences = [sentence for _, sentence in target.reports]
    assert len(sentences) == 3
    assert any("Hidden" in s and "Camera, Shadow under" in s for s in sentences)
    assert any("Catcher" in s and "shadow catcher" in s for s in sentences)
    assert any("Kept" in s and "Diffuse" in s for s in sentences)


def test_what_is_not_shown_is_named(scene, export, target):
    add("Hair", bpy.data.hair_curves.new("Hair"))
    export()
    assert any('"Hair"' in sentence and "CURVES" in sentence for _, sentence in target.reports)


def test_keys_do_not_depend_on_the_run():
    from brume.export.target import key_of
    assert key_of("a", 1) == key_of("a", 1) != key_of("a", 2)
    assert key_of("Mesh:Cube:", "mesh", 1) == 1474453074855972488


@pytest.mark.parametrize("kind", ['CURVE', 'FONT', 'META'])
def test_other_kinds_are_drawn_once(scene, export, kind):
    if kind == 'CURVE':
        bpy.ops.curve.primitive_bezier_circle_add()
        bpy.context.object.data.bevel_depth = 0.1
    elif kind == 'FONT':
        bpy.ops.object.text_add()
    else:
        bpy.ops.object.metaball_add()
    recorder = export()
    assert len(recorder.of("mesh")) == 1
    block, = recorder.of("instances")
    assert len(block["world_from_object"]) == 1


@pytest.mark.parametrize("name", ["smoke_007.vdb", "12.vdb", "v2.smoke9.vdb", "smoke.vdb",
                                  "smoke_3_.vdb", "00001.vdb"])
def test_files_of_sequences(scene, tmp_path, name):
    """Brume finds the file of a frame as Blender does."""
    digits = len(name) - 4 - len(name[:-4].rstrip("0123456789"))
    for frame in range(-3, 15):
        number = f"{'-' if frame < 0 else ''}{abs(frame):0{digits}}" if digits else ""
        write_vdb(tmp_path / f"{name[:-4 - digits]}{number}.vdb",
                  density=np.ones((2, 2, 2), np.float32))
    cloud = bpy.data.volumes.new("Cloud")
    cloud.filepath = str(tmp_path / name)
    ob = add("Cloud", cloud)
    compared = set()
    for is_sequence in (False, True):
        for mode in ('CLIP', 'EXTEND', 'REPEAT', 'PING_PONG'):
            for start, duration, offset in ((1, 5, 0), (3, 4, -2), (-2, 6, 7), (1, 0, 0)):
                cloud.is_sequence, cloud.sequence_mode = is_sequence, mode
                cloud.frame_start, cloud.frame_duration = start, duration
                cloud.frame_offset = offset
                for frame in (-4, 0, 1, 2, 5, 6, 9):
                    scene.frame_set(frame)
                    found = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
                    path = volume.frame_path(found)
                    found.grids.load()
                    assert (path or "") == found.grids.frame_filepath
                    compared.add(path)
    if digits:
        assert len(compared) > 5


def test_reach_of_the_worlds_volume(scene, export):
    scene.world = bpy.data.worlds.new("World")
    Nodes(scene.world)
    assert export().world["reach"] == 0.0
    scene.brume.world_reach = 7.0
    assert export().world["reach"] == 7.0
    scene.brume.world_unlimited = True
    assert export().world["reach"] == -1.0
