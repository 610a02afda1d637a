# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture nodes of volume shaders: coordinates and noise as Blender has them. The noise's values
are the library's; tests/data/noise.txt, which its test reads, is checked here against Blender."""

import bpy
import numpy as np
import pytest
from brume.export import volume_shader
from brume.native import OPS, SPACES
from conftest import ROOT, Nodes, add, cube, lit, material
from test_scene import geometry_nodes

NOISE = ROOT / "tests" / "data" / "noise.txt"


def compiled(build, spaces=volume_shader.SPACES):
    """The program with what build(nodes) gives as density, and what was warned of."""
    owner, nodes = material()
    nodes.volume(nodes.node("VolumeScatter", Color=(1, 1, 1, 1), Density=build(nodes)))
    warnings = []
    return volume_shader.compile_volume(owner.node_tree, frozenset(), warnings.append, (),
                                        spaces), warnings


def spaces_of(program):
    names = {number: name for name, number in SPACES.items()}
    return [names[a] for op, _, a, *_ in program.instructions if OPS[op] == "POSITION"]


def noise_of(program):
    return [value for op, *_, value in program.instructions if OPS[op] == "NOISE"]


def test_a_texture_without_a_vector_is_at_generated_coordinates(scene):
    program, warnings = compiled(lambda n: n.node("TexNoise"))
    assert not warnings
    assert spaces_of(program) == ["GENERATED"]
    assert noise_of(program) == [(3.0, 1.0, 0.0)]


@pytest.mark.parametrize("node, output, space", (
    ("TexCoord", "Generated", "GENERATED"), ("TexCoord", "Object", "OBJECT"),
    ("NewGeometry", "Position", "WORLD")))
def test_coordinates(scene, node, output, space):
    program, warnings = compiled(lambda n: n.node("TexNoise", 1, Vector=n.node(node, None).outputs[
        output]))
    assert not warnings
    assert spaces_of(program) == [space]
    assert noise_of(program) == [(3.0, 1.0, 1.0)]  # of all outputs the second is the colour


def test_of_one_dimension_only_w_counts(scene):
    program, warnings = compiled(lambda n: n.node("TexNoise", noise_dimensions='1D', W=0.3))
    assert not warnings
    assert not spaces_of(program)
    assert noise_of(program) == [(1.0, 1.0, 0.0)]


def test_what_is_not_known_has_a_sentence(scene):
    def window(n):
        return n.node("TexNoise", Vector=n.node("TexCoord", None).outputs["Window"])

    def other(n):
        coordinates = n.node("TexCoord", None, object=add("Empty", None, scale=(1, 0, 1)))
        return n.node("TexNoise", Vector=coordinates.outputs["Object"])

    def turned(n):
        return n.node("TexNoise", Vector=n.node("Mapping", Rotation=n.node(
            "NewGeometry", None).outputs["Position"]))
    for build, words in ((window, "Window"), (other, "Empty"), (turned, "rotation that varies"),
                         (lambda n: n.node("TexVoronoi"), "Voronoi")):
        program, warnings = compiled(build)
        assert len(warnings) == 1 and words in warnings[0], warnings
        assert "keeps its own value" in warnings[0]


def test_fog_of_gaussians_has_no_generated_coordinates(scene):
    program, warnings = compiled(lambda n: n.node("TexNoise"), volume_shader.FOG_SPACES)
    assert len(warnings) == 1 and "Generated" in warnings[0]
    program, warnings = compiled(lambda n: n.node(
        "TexNoise", Vector=n.node("TexCoord", None).outputs["Object"]), volume_shader.FOG_SPACES)
    assert not warnings and spaces_of(program) == ["OBJECT"]


def test_the_world_s_medium_is_the_same_everywhere(scene, export, target):
    scene.world = bpy.data.worlds.new("World")
    nodes = Nodes(scene.world)
    nodes.volume(nodes.node("VolumeScatter", Color=(1, 1, 1, 1), Density=0.25))
    scatter = nodes.tree.nodes["Volume Scatter"]
    for name in ("TexNoise", "NewGeometry"):
        nodes.tree.links.new(nodes.node(name), scatter.inputs["Density"])
        assert export().world["volume"][0] == pytest.approx((0.25,) * 3)
        said = [sentence for _, sentence in target.reports]
        assert len(said) == 1 and "keeps its own value" in said[0], said


# ------------------------------------------------------------------------------------------------
# Pictures of emission alone: a ray's radiance is the density that it passes.


def glow(scene, render, build, **place):
    """Columns of a picture of a box of 2 m, seen from the front, that emits build(nodes)."""
    lit(scene)
    for ob in list(scene.objects):
        if ob.type not in {'CAMERA', 'EMPTY'}:
            bpy.data.objects.remove(ob)
    owner, nodes = material("Glow")
    nodes.volume(nodes.node("Emission", Color=(1, 1, 1, 1), Strength=build(nodes)))
    cube("Glow", material=owner, **place)
    scene.camera.data.type = 'ORTHO'
    scene.camera.data.ortho_scale = 2.0
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.brume.samples = 16
    return render()[2:-2, :, 0].mean(0) / 2.0


def test_pictures_of_coordinates(scene, render):
    middles = np.linspace(-1, 1, 33)[1::2]

    def along(node, output):
        def build(n):
            if node is other:
                node_of = n.node("TexCoord", None, object=other)
            else:
                node_of = n.node(node, None)
            position = node_of.outputs[output]
            x = n.node("SeparateXYZ", Vector=position)
            return n.node("Math", operation='ADD', Value=x, Value_001=5.0)
        return build
    # A box half as large, twice its size: its middle is 0.25 to the right in the world.
    box = {"size": 1.0, "scale": (2, 2, 2), "location": (0.25, 0, 0)}
    inside = slice(3, -1)
    other = add("Empty", None, location=(0.5, 0, 0), scale=(-2, 1, 1))
    for node, output, expected in (("TexCoord", "Object", (middles - 0.25) / 2.0),
                                   ("TexCoord", "Generated", (middles - 0.25) / 2.0 + 0.5),
                                   ("NewGeometry", "Position", middles),
                                   (other, "Object", (middles - 0.5) / -2.0)):
        found = glow(scene, render, along(node, output), **box) - 5.0
        np.testing.assert_allclose(found[inside], expected[inside], atol=0.02)


def test_a_mapping_scales_turns_and_moves(scene, render):
    middles = np.linspace(-1, 1, 33)[1::2]
    expected = {'POINT': -2.0 * middles + 0.5, 'TEXTURE': (middles - 0.5) * -0.5,
                'VECTOR': -2.0 * middles}
    for kind, wanted in expected.items():
        def build(n, kind=kind):
            mapping = n.node("Mapping", vector_type=kind,
                             Vector=n.node("TexCoord", None).outputs["Object"],
                             Rotation=(0, 0, np.pi), Scale=(2, 1, 1))
            if kind != 'VECTOR':
                mapping.node.inputs["Location"].default_value = (0.5, 0, 0)
            x = n.node("SeparateXYZ", Vector=mapping)
            return n.node("Math", operation='ADD', Value=x, Value_001=5.0)
        found = glow(scene, render, build) - 5.0
        np.testing.assert_allclose(found[1:-1], wanted[1:-1], atol=0.02)


def ball(x, y, z):
    return np.maximum(1 - np.sqrt(x * x + y * y + z * z), 0)


GRADIENTS = {
    'LINEAR': lambda x, y, z: x, 'QUADRATIC': lambda x, y, z: np.maximum(x, 0) ** 2,
    'EASING': lambda x, y, z: np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1)),
    'DIAGONAL': lambda x, y, z: (x + y) / 2,
    'RADIAL': lambda x, y, z: np.arctan2(y, x) / (2 * np.pi) + 0.5,
    'SPHERICAL': ball, 'QUADRATIC_SPHERE': lambda x, y, z: ball(x, y, z) ** 2}


@pytest.mark.parametrize("kind", GRADIENTS)
def test_gradients(scene, render, kind):
    middles = np.linspace(-1, 1, 33)[1::2]
    x, y, z = np.meshgrid(middles, np.linspace(-1, 1, 65)[1::2], middles[2:-2], indexing='ij')
    expected = np.clip(GRADIENTS[kind](x, y, z), 0, 1).mean((1, 2))
    found = glow(scene, render, lambda n: n.node(
        "TexGradient", 1, gradient_type=kind, Vector=n.node("TexCoord", None).outputs["Object"]))
    np.testing.assert_allclose(found[1:-1], expected[1:-1], atol=0.02)


def test_a_texture_follows_its_mesh_s_box(scene, export):
    """What generated coordinates span is told with each volume."""
    owner, nodes = material("Fog")
    nodes.volume(nodes.node("VolumeScatter", Density=nodes.node("TexNoise")))
    cube("Fog", size=3.0, material=owner, scale=(2, 1, 1))
    volume, = export().of("volume")
    np.testing.assert_allclose(volume["generated"], ((-1.5,) * 3, (1.5,) * 3), atol=1e-6)


def test_a_texture_goes_with_its_object(scene, export, recorder):
    owner, nodes = material("Fog")
    empty = add("Empty", None)
    coordinates = nodes.node("TexCoord", None, object=empty)
    nodes.volume(nodes.node("VolumeScatter", Density=nodes.node(
        "TexNoise", Vector=coordinates.outputs["Object"])))
    cube("Fog", material=owner)
    before = export().of("volume")[0]["program"].instructions
    recorder.sent.clear()
    export()
    assert "volume" not in recorder.sent
    empty.location.x = 1.0
    bpy.context.view_layer.update()
    assert export().of("volume")[0]["program"].instructions != before


# ------------------------------------------------------------------------------------------------
# Blender's own noise, by geometry nodes


def blender_s_noise(dimensions, rows, kind="Noise", third="Roughness", fourth="Distortion"):
    """Fac and Color of the node at rows of x, y, z, w, detail, roughness, distortion; or of another
    node of noise, with inputs of its own in the place of the last two, without a colour."""
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata([tuple(row) for row in rows[:, :3]], [], [])
    inputs = "W", "Detail", third, fourth
    for column, name in enumerate(inputs, 3):
        attribute = mesh.attributes.new(name, 'FLOAT', 'POINT')
        attribute.data.foreach_set("value", np.ascontiguousarray(rows[:, column], np.float32))
    ob = add("Points", mesh)

    def socket(sockets, name):
        return next(s for s in sockets if s.enabled and s.name == name)

    def build(tree, geometry):
        new, link = tree.nodes.new, tree.links.new
        noise = new(f'ShaderNodeTex{kind}')
        setattr(noise, f"{kind.lower()}_dimensions", f"{dimensions}D")
        noise.inputs["Scale"].default_value = 1.0
        for name in inputs:
            if name == "W" and dimensions in (2, 3):
                continue
            read = new('GeometryNodeInputNamedAttribute')
            read.data_type = 'FLOAT'
            read.inputs["Name"].default_value = name
            link(socket(read.outputs, "Attribute"), noise.inputs[name])
        for name, data_type, output in (("fac", 'FLOAT', 0), ("color", 'FLOAT_VECTOR', -1)):
            store = new('GeometryNodeStoreNamedAttribute')
            store.data_type, store.domain = data_type, 'POINT'
            store.inputs["Name"].default_value = name
            link(geometry, store.inputs["Geometry"])
            link(noise.outputs[output], socket(store.inputs, "Value"))
            geometry = store.outputs[0]
        return geometry
    geometry_nodes(ob, build)
    data = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = np.empty((len(rows), 4), np.float32)
    for columns, name, field in ((slice(0, 1), "fac", "value"),
                                 (slice(1, 4), "color", "vector")):
        values = np.empty(found[:, columns].size, np.float32)
        data.attributes[name].data.foreach_get(field, values)
        found[:, columns] = values.reshape(len(rows), -1)
    return found


@pytest.mark.parametrize("dimensions", (1, 2, 3, 4))
def test_the_noise_that_the_library_is_held_against_is_blender_s(scene, dimensions):
    table = np.loadtxt(NOISE)
    rows = table[table[:, 0] == dimensions]
    assert len(rows) >= 20
    np.testing.assert_allclose(blender_s_noise(dimensions, rows[:, 1:8]), rows[:, 8:], atol=2e-5)


def along_x(n, scale):
    """Coordinates that grow along x alone."""
    return n.node("Mapping", Scale=(scale, 0, 0), Vector=n.node("TexCoord", None).outputs["Object"])


def test_a_picture_of_noise(scene, render):
    middles = np.linspace(-1, 1, 33)[1::2]
    rows = np.zeros((16, 7), np.float32)
    rows[:, 0], rows[:, 4], rows[:, 5] = 0.6 * middles, 1.5, 0.4
    found = glow(scene, render, lambda n: n.node(
        "TexNoise", Vector=along_x(n, 0.3), Scale=2.0, Detail=1.5, Roughness=0.4))
    np.testing.assert_allclose(found[1:-1], blender_s_noise(3, rows)[1:-1, 0], atol=0.02)


@pytest.mark.musgrave
@pytest.mark.parametrize("detail", (0.4, 2.3))
def test_a_picture_of_musgrave_s_noise(scene, render, detail):
    middles = np.linspace(-1, 1, 33)[1::2]
    rows = np.zeros((16, 7), np.float32)
    rows[:, 0], rows[:, 4], rows[:, 5], rows[:, 6] = 0.6 * middles, detail, 1.2, 1.8
    wanted = blender_s_noise(3, rows, "Musgrave", "Dimension", "Lacunarity")[:, 0]

    def build(n):
        noise = n.node("TexMusgrave", Vector=along_x(n, 0.3), Scale=2.0, Detail=detail,
                       Dimension=1.2, Lacunarity=1.8)
        return n.node("Math", operation='ADD', Value=noise, Value_001=2.0)
    found = glow(scene, render, build) - 2.0
    np.testing.assert_allclose(found[1:-1], wanted[1:-1], atol=0.02)
