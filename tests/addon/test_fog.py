# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog made of Gaussians: what each kind of source gives, what is left out, what changes send."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from brume import fog, panels
from brume.export import fog as fog_export
from brume.export import volume_shader
from brume.native import OPS
from conftest import add, material
from test_changes import Viewport, differences
from test_scene import geometry_nodes

CENTER, SCALE, COLOR, AMPLITUDE = slice(0, 3), 3, slice(4, 7), 7


def source(ob, kind='OBJECT', **values):
    """Gives an object a source of fog."""
    made = ob.brume.fog_sources.add()
    for name, value in {"source": kind, **values}.items():
        setattr(made, name, value)
    bpy.context.view_layer.update()
    return made


def dust(name="Dust", points=((0, 0, 0), (1, 0, 0), (0, 2, 0)), faces=(), **more):
    """An object with these vertices."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    return add(name, mesh, **more)


def attribute(ob, name, values, kind='FLOAT', domain='POINT'):
    made = ob.data.attributes.new(name, kind, domain)
    field = {'FLOAT': "value", 'FLOAT_VECTOR': "vector"}.get(kind, "color")
    made.data.foreach_set(field, np.ravel(values).astype(np.float32))


def emitter(name="Emitter", count=100, start=1, end=20, lifetime=10, **more):
    """A square that emits particles."""
    ob = dust(name, [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)], **more)
    settings = ob.modifiers.new("Particles", 'PARTICLE_SYSTEM').particle_system.settings
    settings.count, settings.lifetime = count, lifetime
    settings.frame_end, settings.frame_start = end, start
    settings.particle_size = 0.25
    return ob


def simulate(scene, frame):
    for number in range(1, frame + 1):
        scene.frame_set(number)


def curves(made, **heights):
    """Gives a source curves that go straight from one height to another."""
    with bpy.context.temp_override(object=made.id_data):
        assert bpy.ops.brume.fog_curves_add() == {'FINISHED'}
    for name, ends in heights.items():
        bend(made.curves, name, ends)
    return made.curves


def bend(tree, name, ends):
    mapping = tree.nodes[name].mapping
    for point, height in zip(mapping.curves[0].points, ends):
        point.location.y = height
    mapping.update()
    tree.update_tag()  # as Blender's editor of curves does
    bpy.context.view_layer.update()


def gaussians(recorder, name=None):
    """Those of the only volume (of that name)."""
    found = [block for block in recorder.of("volume") if name in {None, block["name"]}]
    assert len(found) == 1
    return found[0]["gaussians"]


def sentences(target):
    return [sentence for _, sentence in target.reports]


# ------------------------------------------------------------------------------------------------
# What each kind of source gives


def test_an_empty(scene, export, target):
    ob = add("Puff", None, location=(1, 2, 3), scale=(2, 2, 2))
    ob.empty_display_size = 0.5
    source(ob, radius=3.0, density=4.0, color=(0.25, 0.5, 0.75))
    block = export().named("volume", "Puff")
    np.testing.assert_allclose(
        block["gaussians"], [(0, 0, 0, 2 / (0.5 * 3), 0.25, 0.5, 0.75, 4)], rtol=1e-6)
    assert block["gaussians"].dtype == np.float32
    np.testing.assert_allclose(block["world_from_object"], np.array(ob.matrix_world))
    assert block.get("scale", 1.0) == 1.0
    assert not target.reports.ids()


def test_the_radius_is_where_two_percent_are_left(scene, export):
    source(add("Puff", None), radius=1.5)
    scale = gaussians(export())[0, SCALE]
    assert np.exp(-(scale * 1.5) ** 2) == pytest.approx(0.0183, abs=1e-4)


def test_metaballs_are_fog_instead_of_a_surface(scene, export, target):
    bpy.ops.object.metaball_add(radius=2.0)
    ob = bpy.context.object
    ball = ob.data.elements.new()
    ball.co, ball.radius = (3, 0, 1), 0.5
    bpy.ops.object.metaball_add(location=(0, 0, 5))  # one of the family
    assert len(export().of("mesh")) == 1
    made = source(ob, radius=2.0)
    recorder = export()
    assert not recorder.of("mesh")
    assert not recorder.of("instances")
    found = gaussians(recorder)
    np.testing.assert_allclose(found[:, CENTER], [tuple(e.co) for e in ob.data.elements])
    np.testing.assert_allclose(
        found[:, SCALE], [1 / element.radius for element in ob.data.elements])
    made.enabled = False
    bpy.context.view_layer.update()
    assert len(export().of("mesh")) == 1
    assert not recorder.of("volume")
    made.enabled, ball.use_negative = True, True
    bpy.context.view_layer.update()
    assert len(gaussians(export())) == 1
    negative, other = sorted(sentences(target))
    assert "negative" in negative
    assert '"Mball.001"' in other and "family" in other


def test_vertices(scene, export):
    ob = dust(location=(0, 0, 4), faces=[(0, 1, 2)])
    source(ob, 'POINTS', radius=0.5, density=3.0)
    recorder = export()
    block = recorder.named("volume", "Dust")
    np.testing.assert_allclose(block["gaussians"], [
        (x, y, z, 4, 0.8, 0.8, 0.8, 3) for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 2, 0))],
        rtol=1e-6)
    assert block["world_from_object"][2, 3] == 4
    assert recorder.named("mesh", "Dust"), "the surface is drawn as before"


def test_vertices_come_after_the_modifiers(scene, export):
    ob = dust()
    array = ob.modifiers.new("Array", 'ARRAY')
    array.count, array.use_relative_offset, array.use_constant_offset = 2, False, True
    array.constant_offset_displace = (10, 0, 0)
    source(ob, 'POINTS')
    assert sorted(gaussians(export())[:, 0].tolist()) == [0, 0, 1, 10, 10, 11]


def test_edit_mode(scene, export):
    ob = dust()
    source(ob, 'POINTS')
    bpy.context.view_layer.objects.active = ob
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.select_all(action='SELECT')
    bpy.ops.transform.translate(value=(0, 0, 3))
    assert gaussians(export())[:, 2].tolist() == [3, 3, 3]
    bpy.ops.object.mode_set(mode='OBJECT')


def test_points_have_radii(scene, export):
    ob = dust()
    attribute(ob, "radius", (0.5, 1, 4))
    source(ob, 'POINTS')
    assert gaussians(export())[:, SCALE].tolist() == [4, 2, 0.5]


@pytest.mark.parametrize("kind", ['FLOAT_COLOR', 'BYTE_COLOR', 'FLOAT_VECTOR'])
def test_color_attribute(scene, export, target, kind):
    ob = dust()
    channels = 3 if kind == 'FLOAT_VECTOR' else 4
    colors = np.array([(1, 0, 0, 1), (0, 1, 0, 1), (1, 1, 0, 0)])[:, :channels]
    attribute(ob, "Tint", colors, kind)
    source(ob, 'POINTS', color=(0.5, 0.25, 1), color_attribute="Tint")
    np.testing.assert_allclose(gaussians(export())[:, COLOR], colors[:, :3] * (0.5, 0.25, 1),
                               atol=1e-6)
    assert not target.reports.ids()


def test_colors_of_corners_are_averaged(scene, export):
    # Vertex 1 is in both faces, 4 in none.
    ob = dust(points=[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (9, 9, 9)],
              faces=[(0, 1, 3), (1, 2, 3)])
    attribute(ob, "Tint", [(1, 0, 0, 1)] * 3 + [(0, 0, 1, 1)] * 3, 'FLOAT_COLOR', 'CORNER')
    source(ob, 'POINTS', color=(1, 1, 1), color_attribute="Tint")
    np.testing.assert_allclose(gaussians(export())[:, COLOR], [
        (1, 0, 0), (0.5, 0, 0.5), (0, 0, 1), (0.5, 0, 0.5), (1, 1, 1)])


@pytest.mark.parametrize("group", [False, True])
def test_factor_along_the_curves(scene, export, target, group):
    ob = dust()
    factors = (0, 0.5, 1)
    if group:
        made = ob.vertex_groups.new(name="Heat")
        for vertex, factor in enumerate(factors):
            made.add([vertex], factor, 'REPLACE')
    else:
        attribute(ob, "Heat", factors)
    made = source(ob, 'POINTS', factor_attribute="Heat", radius=2.0, density=10.0)
    tree = curves(made, Radius=(0.5, 1), Strength=(1, 0.2))
    np.testing.assert_allclose(gaussians(export())[:, (SCALE, AMPLITUDE)],
                               [(2, 10), (1 / 0.75, 6), (1, 2)], rtol=1e-3)
    tree.nodes["Strength"].mute = True
    bpy.context.view_layer.update()
    assert gaussians(export())[:, AMPLITUDE].tolist() == [10, 10, 10]
    assert not target.reports.ids()


def test_curves_without_a_factor_do_nothing(scene, export):
    made = source(dust(), 'POINTS')
    curves(made, Radius=(0.1, 0.1))
    assert gaussians(export())[:, SCALE].tolist() == [2, 2, 2]


def to_points(tree, geometry):
    made = tree.nodes.new('GeometryNodeMeshToPoints')
    made.inputs["Radius"].default_value = 0.25
    tree.links.new(geometry, made.inputs[0])
    return made.outputs[0]


def test_a_point_cloud_of_geometry_nodes(scene, export, target):
    ob = dust(location=(0, 0, 7))
    geometry_nodes(ob, to_points)
    source(ob, 'POINTS')
    block = export().named("volume", "Dust")
    np.testing.assert_allclose(block["gaussians"][:, CENTER], [(0, 0, 0), (1, 0, 0), (0, 2, 0)])
    assert block["gaussians"][:, SCALE].tolist() == [8, 8, 8]
    assert block["world_from_object"][2, 3] == 7
    assert not target.reports.ids(), "a point cloud that is fog is shown"


def particles_of(ob):
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return evaluated.particle_systems[0].particles


def test_living_particles(scene, export, target):
    ob = emitter(location=(5, 0, 2))
    source(ob, 'PARTICLES', radius=2.0)
    simulate(scene, 15)
    block = export().named("volume", "Emitter")
    alive = [p for p in particles_of(ob) if p.alive_state == 'ALIVE']
    assert 30 < len(alive) < 100
    np.testing.assert_allclose(block["gaussians"][:, CENTER], [tuple(p.location) for p in alive])
    np.testing.assert_allclose(block["gaussians"][:, SCALE], 2 / (2 * 0.25))
    # They are where they are in the world, whatever their emitter does.
    np.testing.assert_array_equal(block["world_from_object"], np.eye(4))
    assert not target.reports.ids()


def test_the_dead_and_the_unborn_where_blender_shows_them(scene, export):
    ob = emitter()
    settings = ob.particle_systems[0].settings
    source(ob, 'PARTICLES')
    settings.use_dead, settings.show_unborn = True, True
    simulate(scene, 15)
    assert len(gaussians(export())) == 100
    settings.display_percentage = 50
    bpy.context.view_layer.update()
    assert len(gaussians(export())) == sum(p.is_visible for p in particles_of(ob)) < 80


def test_particles_age_along_the_curves(scene, export):
    ob = emitter(end=6)
    made = source(ob, 'PARTICLES', density=1.0)
    curves(made, Strength=(1, 0))
    simulate(scene, 8)
    ages = [(8 - p.birth_time) / p.lifetime for p in particles_of(ob)]
    assert 0 < min(ages) < 0.3 < 0.6 < max(ages)
    np.testing.assert_allclose(gaussians(export())[:, AMPLITUDE], 1 - np.array(ages), atol=2e-3)


def test_the_emitter_may_be_hidden(scene, export):
    ob = emitter()
    source(ob, 'PARTICLES')
    ob.show_instancer_for_viewport = False
    simulate(scene, 5)
    recorder = export()
    assert len(gaussians(recorder)) > 10
    assert not recorder.of("mesh")
    ob.hide_viewport = True
    bpy.context.view_layer.update()
    assert not export().of("volume")


def test_the_particle_system_is_chosen_by_name(scene, export, target):
    ob = emitter()
    ob.modifiers.new("More", 'PARTICLE_SYSTEM')
    other = ob.particle_systems[1]
    other.name = "More"
    other.settings.count, other.settings.frame_end = 7, 1
    made = source(ob, 'PARTICLES', particle_system="More")
    simulate(scene, 2)
    assert len(gaussians(export())) == 7
    made.particle_system = "None such"
    bpy.context.view_layer.update()
    assert not export().of("volume")
    assert target.reports.ids() == ["PARTICLES_UNKNOWN"]
    assert '"None such"' in sentences(target)[0]


def test_instances(scene, export):
    """Each gives its fog where it is, that of particles too."""
    collection = bpy.data.collections.new("Group")
    puff, cloud, spray = add("Puff", None), dust("Cloud"), emitter("Spray", location=(0, 0, 1))
    for ob, kind in ((puff, 'OBJECT'), (cloud, 'POINTS'), (spray, 'PARTICLES')):
        scene.collection.objects.unlink(ob)
        collection.objects.link(ob)
        source(ob, kind)
    for x in (10, 20):
        host = add(f"Host {x}", None, location=(x, 0, 0), scale=(2, 2, 2))
        host.instance_type, host.instance_collection = 'COLLECTION', collection
    simulate(scene, 5)
    recorder = export()
    for name in ("Puff", "Cloud", "Spray"):
        blocks = [block for block in recorder.of("volume") if block["name"] == name]
        assert sorted(block["world_from_object"][0, 3] for block in blocks) == [10, 20], name
        assert {block["world_from_object"][0, 0] for block in blocks} == {2}
        np.testing.assert_array_equal(*(block["gaussians"] for block in blocks))
    # A particle at the emitter is at the emitter's instance.
    spray_block = next(b for b in recorder.of("volume") if b["name"] == "Spray")
    np.testing.assert_allclose(spray_block["world_from_object"][:3, 3] % 10, (0, 0, 0), atol=1e-5)
    np.testing.assert_allclose(spray_block["world_from_object"] @ (0, 0, 1, 1),
                               (spray_block["world_from_object"][0, 3], 0, 2, 1), atol=1e-5)


def test_several_sources_of_one_object(scene, export):
    ob = emitter(count=9, end=1)
    source(ob, 'PARTICLES')
    source(ob, 'POINTS', density=2.0)
    source(ob, 'POINTS', enabled=False)
    simulate(scene, 2)
    assert sorted(len(block["gaussians"]) for block in export().of("volume")) == [4, 9]


# ------------------------------------------------------------------------------------------------
# The medium


def run(program, density, color):
    """sigma_s, sigma_a and g of a plain program."""
    registers, grids = {}, [np.full(3, density), np.array(color)]
    arithmetic = {"MULTIPLY": np.multiply, "ADD": np.add, "SUBTRACT": np.subtract,
                  "MAXIMUM": np.maximum, "AVERAGE": lambda a, _: np.full(3, a.mean())}
    for op, dst, a, b, _, value in program.instructions:
        name = OPS[op]
        registers[dst] = (np.array(value) if name == "CONSTANT" else grids[a] if name == "GRID"
                          else arithmetic[name](registers[a], registers.get(b)))
    return [registers[r] for r in (program.sigma_s, program.sigma_a, program.g)]


def test_plain_fog(scene, export):
    source(add("Puff", None), anisotropy=0.5)
    program = export().named("volume", "Puff")["program"]
    assert program.grids == ("density", "color")
    s, a, g = run(program, 2.0, (0.25, 0.5, 1.0))
    np.testing.assert_allclose(s, (0.5, 1, 2))
    np.testing.assert_allclose(a, (1.5, 1, 0))
    np.testing.assert_allclose(g, 0.5)


@pytest.mark.parametrize("order", [("density", "color"), ("color", "density"), ("color",)])
def test_a_material_reads_the_library_s_numbers(scene, export, target, order):
    """Whatever it asks for, and in whatever order."""
    owner, nodes = material("Mist")
    density = nodes.node("Attribute", outlet=2, attribute_name="density")
    color = nodes.node("Attribute", outlet=0, attribute_name="color")
    values = {"density": {"Density": density}, "color": {"Color": color}}
    wanted = {key: value for name in order for key, value in values[name].items()}
    nodes.volume(nodes.node("VolumeScatter", **({"Density": 1.0} | wanted)))
    source(add("Puff", None), material=owner)
    program = export().named("volume", "Puff")["program"]
    s, *_ = run(program, 2.0, (0.25, 0.5, 1.0))
    np.testing.assert_allclose(s, np.array((0.25, 0.5, 1)) * (2 if "density" in order else 1))
    assert not target.reports.ids()


def test_other_attributes_are_named(scene, export, target):
    owner, nodes = material("Mist")
    nodes.volume(nodes.node("VolumePrincipled", Color_Attribute="tint", Anisotropy=nodes.node(
        "Attribute", outlet=2, attribute_name="dust")))
    source(add("Puff", None), material=owner)
    assert len(export().of("volume")) == 1
    assert target.reports.ids() == ["GRID_UNKNOWN", "GRID_UNKNOWN"]
    assert all(any(f'"{name}"' in s for s in sentences(target)) for name in ("tint", "dust"))


def test_materials_that_make_no_fog(scene, export, target):
    paint, nodes = material("Paint")
    nodes.surface(nodes.node("BsdfDiffuse"))
    everywhere, nodes = material("Everywhere")
    nodes.volume(nodes.node("VolumeScatter"))
    for owner in (paint, everywhere):
        source(add(owner.name, None), material=owner)
    assert not export().of("volume")
    assert target.reports.ids() == ["UNSUPPORTED", "GRID_UNKNOWN"]
    assert '"Paint"' in sentences(target)[0]
    assert '"Everywhere"' in sentences(target)[1]


def test_numbers_of_grids_are_given():
    builder = volume_shader.VolumeBuilder(print, frozenset({"a", "b", "c"}), ("a", "b"))
    assert [builder.grid(name).number for name in ("b", "c", "a")] == [1, 2, 0]


def _puff():
    ob = add("Puff", None, scale=(2, 2, 2))
    ob.empty_display_size = 0.25
    return source(ob, radius=2.0)


def _ball():
    bpy.ops.object.metaball_add(radius=0.5)
    return source(bpy.context.object, radius=2.0)


def _point():
    return source(dust(points=[(0, 0, -1)], location=(0, 0, 1)), 'POINTS')


def _particle():
    ob = emitter(count=1, end=1)
    settings = ob.particle_systems[0].settings
    settings.normal_factor = settings.effector_weights.gravity = 0.0
    settings.emit_from, settings.use_emit_random, settings.distribution = 'VERT', False, 'JIT'
    ob.show_instancer_for_render = False
    made = source(ob, 'PARTICLES', radius=4.0)
    simulate(bpy.context.scene, 2)
    particle, = particles_of(ob)
    ob.location = -particle.location  # the simulation begins anew
    simulate(bpy.context.scene, 2)
    return made


@pytest.mark.parametrize("give", [_puff, _ball, _point, _particle])
@pytest.mark.parametrize("shader", [False, True])
def test_what_is_seen(scene, render, give, shader):
    """Of a Gaussian of radius 1 m at the origin, what an orthographic camera sees adds up."""
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = 'ORTHO', 4.0
    scene.camera = add("Camera", camera, location=(0, -6, 0))
    scene.camera.rotation_euler = (np.pi / 2, 0, 0)
    scene.render.film_transparent, scene.brume.samples = True, 64
    density = 0.05
    give().density = density
    if shader:
        owner, nodes = material("Mist")
        nodes.volume(nodes.node("VolumeScatter", Color=(1, 1, 1, 1), Density=nodes.node(
            "VolumeInfo", outlet=1)))
        for ob in bpy.data.objects:
            for made in ob.brume.fog_sources:
                made.material = owner
    seen = render()[..., 3]
    side = 4.0 / 32
    # Its optical depth at x from its axis is density sqrt(pi) / a exp(-a^2 x^2), a = 2 / m.
    x, z = np.meshgrid((np.arange(32) - 15.5) * side, (np.arange(24) - 11.5) * side)
    wanted = 1 - np.exp(-density * np.pi ** 0.5 / 2 * np.exp(-4 * (x * x + z * z)))
    assert seen.sum() == pytest.approx(wanted.sum(), rel=0.01)
    # It changes by up to 21 % from pixel to pixel, and 64 samples are spread over one and a half.
    np.testing.assert_allclose(seen, wanted, atol=0.05 * wanted.max())


# ------------------------------------------------------------------------------------------------
# Bad input


def test_what_is_not_finite_or_negative_is_left_out(scene, export, target):
    points = [(i, 0, 0) for i in range(9)]
    points[1], points[2] = (np.nan, 0, 0), (0, np.inf, 0)
    ob = dust(points=points)
    attribute(ob, "radius", (1, 1, 1, np.nan, -1, 0, np.inf, 1e-42, 1))
    source(ob, 'POINTS')
    for x in (10, 20):
        add(f"Copy {x}", ob.data, location=(x, 0, 0))
    assert gaussians(export(), "Dust")[:, 0].tolist() == [0, 8]
    assert target.reports.ids() == ["POINTS_LEFT_OUT"]
    assert "5 of its 9 points" in sentences(target)[0]
    assert '"Dust"' in sentences(target)[0]


def test_colors_that_are_no_numbers(scene, export, target):
    ob = dust()
    attribute(ob, "Tint", [(np.nan, 0, 0, 1), (-1, 0.5, 9, 1), (1, 1, 1, 1)], 'FLOAT_COLOR')
    source(ob, 'POINTS', color=(1, 1, 1), color_attribute="Tint")
    np.testing.assert_allclose(gaussians(export())[:, COLOR], [(0, 0.5, 9), (1, 1, 1)])
    assert "1 of its 3 points" in sentences(target)[0]


@pytest.mark.parametrize("values", [{"radius": 0.0}, {"density": 0.0}])
def test_nothing_is_no_mistake(scene, export, target, values):
    source(dust(), 'POINTS', **values)
    source(dust("None", points=()), 'POINTS')
    ob = emitter(start=50, end=60)
    source(ob, 'PARTICLES')
    bpy.ops.object.metaball_add()
    ball = bpy.context.object
    ball.data.elements.clear()
    source(ball)
    simulate(scene, 3)
    assert not export().of("volume")
    assert not target.reports.ids()


def test_sources_that_an_object_cannot_have(scene, export, target):
    source(add("Empty", None), 'POINTS')
    source(dust("Mesh"), 'OBJECT')
    source(dust("Still"), 'PARTICLES')
    assert not export().of("volume")
    assert target.reports.ids() == ["UNSUPPORTED", "UNSUPPORTED", "PARTICLES_UNKNOWN"]


def test_hair_and_children_are_named(scene, export, target):
    hair, spray = emitter("Hair"), emitter("Spray")
    hair.particle_systems[0].settings.type = 'HAIR'
    spray.particle_systems[0].settings.child_type = 'SIMPLE'
    for ob in (hair, spray):
        source(ob, 'PARTICLES')
    simulate(scene, 5)
    assert gaussians(export(), "Spray").size
    assert any('"Hair": the hair of' in sentence for sentence in sentences(target))
    assert any("children" in sentence for sentence in sentences(target))


def test_unknown_attributes(scene, export, target):
    ob = dust(faces=[(0, 1, 2)])
    attribute(ob, "Face", (1,), 'FLOAT', 'FACE')
    source(ob, 'POINTS', color_attribute="None such", factor_attribute="Face")
    assert len(gaussians(export())) == 3
    assert target.reports.ids() == ["ATTRIBUTE_UNKNOWN"] * 2


def test_a_radius_of_faces_is_named(scene, export, target):
    ob = dust(faces=[(0, 1, 2)])
    attribute(ob, "radius", (0.25,), 'FLOAT', 'FACE')
    source(ob, 'POINTS')
    np.testing.assert_allclose(gaussians(export())[:, SCALE], 2.0)
    assert target.reports.ids() == ["ATTRIBUTE_UNKNOWN"]


def test_a_bare_curve_is_fog_along_its_points(scene, export, target):
    bpy.ops.curve.primitive_bezier_circle_add(radius=2.0)
    ob = bpy.context.object
    source(ob, 'POINTS', radius=0.5)
    found = gaussians(export())
    assert len(found) > 12
    np.testing.assert_allclose(np.linalg.norm(found[:, :3], axis=1), 2.0, atol=0.01)
    # What a modifier makes of it, faces or none, has the points instead.
    def lines(tree, geometry):
        node = tree.nodes.new('GeometryNodeCurveToMesh')
        tree.links.new(geometry, node.inputs[0])
        return node.outputs[0]
    geometry_nodes(ob, lines)
    assert len(gaussians(export())) == len(found)
    ob.modifiers.clear()
    ob.data.bevel_depth = 0.1  # now its surface has points, more of them
    bpy.context.view_layer.update()
    assert len(gaussians(export())) > 4 * len(found)
    assert not target.reports.ids()


def test_a_flat_instance_costs_only_itself(scene, export, target):
    collection = bpy.data.collections.new("Group")
    ob = emitter(count=9, end=1, scale=(1, 1, 0))
    scene.collection.objects.unlink(ob)
    collection.objects.link(ob)
    source(ob, 'PARTICLES')
    host = add("Host", None)
    host.instance_type, host.instance_collection = 'COLLECTION', collection
    source(add("Puff", None))
    simulate(scene, 2)
    assert [block["name"] for block in export().of("volume")] == ["Puff"]
    assert target.reports.ids() == ["TRANSFORM"]


# ------------------------------------------------------------------------------------------------
# What changes send


@pytest.fixture
def foggy(scene):
    """One of each kind; `reads` tells which are read."""
    owner, nodes = material("Mist")
    nodes.volume(nodes.node("VolumePrincipled"))
    made = SimpleNamespace(scene=scene, mist=owner, puff=add("Puff", None), dust=dust(),
                           spray=emitter("Spray"))
    attribute(made.dust, "Heat", (0, 0.5, 1))
    source(made.puff, material=owner)
    made.tree = curves(source(made.dust, 'POINTS', factor_attribute="Heat"))
    source(made.spray, 'PARTICLES')
    simulate(scene, 5)
    return made


def _set(ob, name, value):
    setattr(ob.brume.fog_sources[0], name, value)


def _thicken(foggy):
    node = next(n for n in foggy.mist.node_tree.nodes if n.bl_idname.endswith("Principled"))
    node.inputs["Density"].default_value = 7


def _stretch(foggy):
    foggy.dust.data.vertices[0].co.z = 4
    foggy.dust.data.update()


EDITS = {
    "nothing": (lambda f: None, "", ""),
    "the same frame": (lambda f: f.scene.frame_set(5), "", "Spray"),
    "the next frame": (lambda f: f.scene.frame_set(6), "Spray", "Spray"),
    "empty moved": (lambda f: setattr(f.puff, "location", (1, 2, 3)), "Puff", ""),
    "empty's size": (lambda f: setattr(f.puff, "empty_display_size", 3), "Puff", "Puff"),
    "points moved": (lambda f: setattr(f.dust, "location", (1, 2, 3)), "Dust", ""),
    "points edited": (_stretch, "Dust", "Dust"),
    "radius": (lambda f: _set(f.puff, "radius", 3), "Puff", "Puff"),
    "colour": (lambda f: _set(f.dust, "color", (1, 0, 0)), "Dust", "Dust"),
    "anisotropy": (lambda f: _set(f.dust, "anisotropy", 0.5), "Dust", "Dust"),
    "curve": (lambda f: bend(f.tree, "Radius", (0.5, 1)), "Dust", "Dust"),
    "curve muted": (lambda f: setattr(f.tree.nodes["Radius"], "mute", True), "", "Dust"),
    "curves taken away": (lambda f: _set(f.dust, "curves", None), "", "Dust"),
    "material": (_thicken, "Puff", ""),
    "another material": (lambda f: _set(f.puff, "material", None), "Puff", "Puff"),
    "attribute": (lambda f: attribute(f.dust, "radius", (2, 2, 2)), "Dust", "Dust"),
    "particles' size": (lambda f: setattr(f.spray.particle_systems[0].settings, "particle_size",
                                          2), "Spray", "Spray"),
    "off": (lambda f: _set(f.puff, "enabled", False), "", ""),
}


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_sends_and_reads_what_changed(foggy, monkeypatch, edit):
    viewport, reads, sent = Viewport(), [], []
    read = fog_export._Reader.read
    monkeypatch.setattr(fog_export._Reader, "read",
                        lambda self: (reads.append(self.ob.name), read(self))[1])
    viewport.export()
    assert sorted(reads) == ["Dust", "Puff", "Spray"]
    reads.clear()
    put = viewport.recorder.set_volume
    monkeypatch.setattr(viewport.recorder, "set_volume", lambda key, **values: (
        sent.append(values["name"]), put(key, **values))[1], raising=False)
    change, wanted, read_again = EDITS[edit]
    change(foggy)
    bpy.context.view_layer.update()
    viewport.export()
    assert " ".join(sent) == wanted
    assert set(reads) <= {read_again}, "only what changed is read"
    assert not differences(viewport)


def test_sources_come_and_go(foggy):
    viewport = Viewport()
    viewport.export()
    with bpy.context.temp_override(object=foggy.puff):
        bpy.ops.brume.fog_add()
    bpy.context.view_layer.update()
    assert viewport.export() == ["volume"]
    assert not differences(viewport)
    for count in (2, 1):
        assert len(foggy.puff.brume.fog_sources) == count
        with bpy.context.temp_override(object=foggy.puff):
            bpy.ops.brume.fog_remove()
        bpy.context.view_layer.update()
        viewport.export()
        assert not differences(viewport)
    assert "Puff" not in [block["name"] for block in viewport.recorder.of("volume")]


def test_a_keyed_radius(scene):
    ob = add("Puff", None)
    made = source(ob)
    for frame, radius in ((1, 1), (5, 5)):
        made.radius = radius
        made.keyframe_insert("radius", frame=frame)
    scene.frame_set(1)
    viewport = Viewport()
    viewport.export()
    scene.frame_set(3)
    assert viewport.export() == ["volume"]
    assert gaussians(viewport.recorder)[0, SCALE] == pytest.approx(2 / 3)


def test_undo(scene):
    ob = add("Puff", None)
    source(ob)
    bpy.ops.ed.undo_push(message="before")
    with bpy.context.temp_override(object=ob):
        bpy.ops.brume.fog_curves_add()
    bpy.ops.ed.undo_push(message="after")
    viewport = Viewport()
    viewport.export()
    bpy.ops.ed.undo()
    assert bpy.data.objects["Puff"].brume.fog_sources[0].curves is None
    viewport.export()
    assert not differences(viewport)
    bpy.ops.ed.redo()
    assert fog.is_curves(bpy.data.objects["Puff"].brume.fog_sources[0].curves)
    viewport.export()
    assert not differences(viewport)


def test_append(scene, tmp_path):
    ob = dust()
    curves(source(ob, 'POINTS', factor_attribute="Heat"), Radius=(0.5, 0.5))
    path = str(tmp_path / "dust.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path) as (found, wanted):
        wanted.objects = ["Dust"]
    made, = wanted.objects
    tree = made.brume.fog_sources[0].curves
    assert tree.nodes["Radius"].mapping.curves[0].points[0].location.y == 0.5


def test_library_override(scene, tmp_path):
    source(add("Puff", None), radius=2.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "puff.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "puff.blend"), link=True) as (found, wanted):
        wanted.objects = ["Puff"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    ob = wanted.objects[0].override_create(remap_local_usages=True)
    with bpy.context.temp_override(object=ob):
        assert bpy.ops.brume.fog_add() == {'FINISHED'}
    ob.brume.fog_sources[0].radius, ob.brume.fog_sources[1].density = 3.0, 7.0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    ob = next(ob for ob in bpy.data.objects if ob.override_library)
    assert [(s.radius, s.density) for s in ob.brume.fog_sources] == [(3.0, 1.0), (1.0, 7.0)]


# ------------------------------------------------------------------------------------------------
# Operators and panels


@pytest.mark.parametrize("kind", ['EMPTY', 'META', 'MESH', 'PARTICLES', 'HAIR'])
def test_what_is_added_fits_the_object(scene, kind):
    if kind == 'META':
        bpy.ops.object.metaball_add()
        ob = bpy.context.object
    elif kind in {'PARTICLES', 'HAIR'}:
        ob = emitter()
        ob.particle_systems[0].settings.type = 'HAIR' if kind == 'HAIR' else 'EMITTER'
    else:
        ob = dust() if kind == 'MESH' else add("Puff", None)
    with bpy.context.temp_override(object=ob):
        assert not bpy.ops.brume.fog_remove.poll()
        assert bpy.ops.brume.fog_add() == {'FINISHED'}
    made = fog.active(ob)
    wanted = {'EMPTY': 'OBJECT', 'META': 'OBJECT', 'PARTICLES': 'PARTICLES'}.get(kind, 'POINTS')
    assert (made.source, made.enabled, made.radius, made.density) == (wanted, True, 1.0, 1.0)
    assert bool(made.particle_system) == (kind == 'PARTICLES')


def test_lamps_have_no_fog(scene):
    ob = add("Lamp", bpy.data.lights.new("Lamp", 'POINT'))
    with bpy.context.temp_override(object=ob):
        assert not bpy.ops.brume.fog_add.poll()


class Layout:
    """Stands for Blender's layouts: notes what is drawn, which must exist."""

    def __init__(self, drawn):
        self.drawn = drawn

    def row(self, **_):
        return Layout(self.drawn)

    column = row

    def prop(self, owner, name, **_):
        assert name in owner.bl_rna.properties
        self.drawn.append(name)

    template_curve_mapping = prop

    def template_ID(self, owner, name, new):
        group, operator = new.split(".")
        assert operator in dir(getattr(bpy.ops, group))
        self.prop(owner, name)

    def template_list(self, kind, _, owner, name, active_owner, active_name, **__):
        assert hasattr(bpy.types, kind)
        self.prop(owner, name)
        self.prop(active_owner, active_name)

    def operator(self, name, **_):
        self.template_ID(SimpleNamespace(bl_rna=SimpleNamespace(properties={name})), name, name)

    def template_node_view(self, tree, node, socket):
        self.drawn.append(socket.name)

    def label(self, text):
        self.drawn.append(text)


def drawn(ob):
    found = []
    for panel in (fog.BRUME_PT_fog, fog.BRUME_PT_fog_curves, fog.BRUME_PT_fog_material):
        context = SimpleNamespace(engine='BRUME', object=ob)
        if panel.poll(context):
            pane = SimpleNamespace(layout=Layout(found))
            pane.split = lambda pane=pane: panels.EnginePanel.split(pane)
            panel.draw(pane, context)
    for made in ob.brume.fog_sources:
        item = SimpleNamespace(_ICONS=fog.BRUME_UL_fog._ICONS)
        fog.BRUME_UL_fog.draw_item(item, None, Layout(found), None, made, 0, None, "", 0)
    return found


def test_panels_draw_what_applies(scene):
    ob = dust()
    assert drawn(ob) == ["fog_sources", "fog_active", "brume.fog_add", "brume.fog_remove"]
    made = source(ob, 'POINTS')
    assert {"radius", "color_attribute", "factor_attribute", "curves", "anisotropy"} <= {
        *drawn(ob)}
    assert "particle_system" not in drawn(ob)
    curves(made)
    made.material, nodes = material("Mist")
    made.source = 'PARTICLES'
    assert {"particle_system", "mapping", "Volume", "Radius", "Strength"} <= {*drawn(ob)}
    assert not {"factor_attribute", "anisotropy", "color_attribute"} & {*drawn(ob)}
    made.source = 'OBJECT'
    assert "curves" not in drawn(ob)
    lamp = add("Lamp", bpy.data.lights.new("Lamp", 'POINT'))
    assert drawn(lamp) == []


def test_names_are_offered(scene):
    ob = dust()
    attribute(ob, "Tint", [(1, 1, 1, 1)] * 3, 'FLOAT_COLOR')
    ob.vertex_groups.new(name="Heat")
    made = source(ob, 'POINTS')
    assert "Tint" in fog._color_names(made, bpy.context, "")
    assert {"Tint", "Heat"} <= {*fog._attribute_names(made, bpy.context, "")}
    assert fog._system_names(source(emitter(), 'PARTICLES'), bpy.context, "") == ["Particles"]
