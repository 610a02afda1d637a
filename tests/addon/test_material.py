# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface node trees to lobes, and images to linear pixels."""

import bpy
import numpy as np
import pytest
from brume.export import image as images
from brume.export import material as materials
from conftest import material


@pytest.fixture
def lobes(scene, target, recorder):
    """Exports a material built by a function; gives its values."""
    def run(build, warnings=0):
        owner, nodes = material()
        nodes.surface(build(nodes))
        materials.export(target, owner)
        assert len(list(target.reports)) == warnings, list(target.reports)
        return recorder.named("material", "Material")
    return run


def image(name="Image", pixels=((1, 0, 0, 1),), width=1, is_float=False, is_data=False):
    made = bpy.data.images.new(name, width, len(pixels) // width, alpha=True,
                               float_buffer=is_float, is_data=is_data)
    made.pixels.foreach_set(np.array(pixels, np.float32).ravel())
    return made


def close(actual, wanted):
    np.testing.assert_allclose(actual, np.broadcast_to(wanted, np.shape(actual)), rtol=1e-6)


def test_default_is_matt_grey(scene, target, recorder):
    materials.export(target, None)
    block, = recorder.of("material")
    close(block["diffuse"], 0.8)
    close(block["specular"], 0)


@pytest.mark.without_nodes
def test_without_nodes(scene, target, recorder):
    plain = bpy.data.materials.new("Plain")
    plain.diffuse_color = (0.1, 0.2, 0.3, 1)
    materials.export(target, plain)
    close(recorder.named("material", "Plain")["diffuse"], (0.1, 0.2, 0.3))


def test_diffuse(lobes):
    block = lobes(lambda n: n.node("BsdfDiffuse", Color=(0.1, 0.2, 0.3, 1)))
    close(block["diffuse"], (0.1, 0.2, 0.3))
    assert block["alpha_mode"] == 'OPAQUE'


def test_diffuse_part_of_principled(lobes):
    old = bpy.app.version < (4, 0, 0)

    def half(n):
        matt = n.node("BsdfPrincipled", Base_Color=(0.4, 0.4, 0.4, 1), Specular=0.0, Roughness=0.7)
        plain = n.node("BsdfDiffuse", Color=(0.8, 0.8, 0.8, 1))
        return n.node("MixShader", Fac=0.5, Shader=matt, Shader_001=plain)
    block = lobes(half)
    close(block["diffuse"], 0.6)
    close(block["burley"], 0.2 / 0.6 if old else 0.0)
    if old:  # it has nothing glossy that says how rough it is
        close(block["roughness"], 0.7)


def test_glossy(lobes):
    block = lobes(lambda n: n.node("BsdfGlossy", Color=(0.1, 0.2, 0.3, 1), Roughness=0.3))
    close(block["specular"], (0.1, 0.2, 0.3))
    close(block["diffuse"], 0)
    close(block["roughness"], 0.3)


def test_principled(lobes):
    block = lobes(lambda n: n.node(
        "BsdfPrincipled", Base_Color=(0.5, 0.25, 1, 1), Metallic=0.25, Roughness=0.6,
        Specular=0.5, Emission=(1, 0.5, 0, 1), Emission_Strength=2.0))
    base = np.array((0.5, 0.25, 1))
    close(block["diffuse"], 0.75 * base)
    close(block["specular"], 0.75 * 0.04 + 0.25 * base)
    close(block["emission"], (2, 1, 0))
    close(block["roughness"], 0.6)
    assert block["alpha"] == 1.0


def test_principled_alpha(lobes):
    block = lobes(lambda n: n.node("BsdfPrincipled", Base_Color=(0.5, 0.5, 0.5, 1), Alpha=0.25))
    close(block["alpha"], 0.25)
    close(block["diffuse"], 0.5)  # of the part that is there
    close(block["transparent"], 1)
    assert block["alpha_mode"] == 'BLEND'


@pytest.mark.blend_method
def test_alpha_clip(scene, target, recorder):
    owner, nodes = material()
    owner.blend_method, owner.alpha_threshold = 'CLIP', 0.3
    nodes.surface(nodes.node("BsdfPrincipled", Alpha=0.25))
    materials.export(target, owner)
    block, = recorder.of("material")
    assert block["alpha_mode"] == 'CLIP'
    close(block["alpha_threshold"], 0.3)


def test_mix_with_transparent(lobes):
    block = lobes(lambda n: n.node(
        "MixShader", Fac=0.75, Shader=n.node("BsdfTransparent", Color=(1, 0.5, 0, 1)),
        Shader_001=n.node("BsdfDiffuse", Color=(0.2, 0.2, 0.2, 1))))
    close(block["alpha"], 0.75)
    close(block["diffuse"], 0.2)
    close(block["transparent"], (1, 0.5, 0))


def test_add_keeps_the_sums(lobes):
    """Light added over something clear: both at full strength."""
    block = lobes(lambda n: n.node(
        "AddShader", Shader=n.node("BsdfTransparent", Color=(1, 1, 1, 1)),
        Shader_001=n.node("Emission", Color=(1, 0.5, 0, 1), Strength=3.0)))
    close(block["alpha"] * block["emission"], (3, 1.5, 0))
    close((1 - block["alpha"]) * block["transparent"], 1)


def test_mix(lobes):
    block = lobes(lambda n: n.node(
        "MixShader", Fac=0.25, Shader=n.node("BsdfDiffuse", Color=(1, 0, 0, 1)),
        Shader_001=n.node("Emission", Color=(0, 1, 0, 1), Strength=4.0)))
    close(block["diffuse"], (0.75, 0, 0))
    close(block["emission"], (0, 1, 0))


def test_image_on_base_color(lobes, recorder):
    picture = image()
    block = lobes(lambda n: n.node(
        "BsdfPrincipled", Base_Color=n.node("TexImage", image=picture), Metallic=0.5,
        Specular=0.5))
    assert block["base_image"] in recorder.blocks["image"]
    close(block["diffuse"], 0.5)
    close(block["metal"], 0.5)
    close(block["specular"], 0.5 * 0.04)
    assert not block["alpha_from_base_image"]


def test_image_times_color_with_its_alpha(lobes, recorder):
    picture = image()

    def build(n):
        texture = n.node("TexImage", outlet=None, image=picture, extension='CLIP',
                         interpolation='Closest')
        tinted = n.node("MixRGB", blend_type='MULTIPLY', Fac=1.0, Color1=texture.outputs[0],
                        Color2=(0.5, 1, 1, 1))
        return n.node("BsdfPrincipled", Base_Color=tinted, Alpha=texture.outputs[1])
    block = lobes(build)
    close(block["diffuse"], (0.5, 1, 1))
    assert block["alpha_from_base_image"]
    assert block["alpha_mode"] == 'BLEND'
    exported, = recorder.of("image")
    assert exported["extend"] == 'CLIP'
    assert exported["nearest"]


def test_transparent_by_image_alpha(lobes, recorder):
    picture = image(pixels=((1, 0, 0, 0.25),))
    block = lobes(lambda n: n.node(
        "MixShader", Fac=n.node("TexImage", outlet=1, image=picture),
        Shader=n.node("BsdfTransparent"),
        Shader_001=n.node("BsdfDiffuse", Color=(0.2, 0.4, 0.6, 1))))
    assert block["alpha_from_base_image"]
    close(block["diffuse"], (0.2, 0.4, 0.6))
    exported, = recorder.of("image")
    np.testing.assert_allclose(exported["pixels"][0, 0], (1, 1, 1, 0.25), atol=2e-3)


@pytest.mark.parametrize("channel, wanted", [(None, 0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.6),
                                             (0, 0.2), (1, 0.4), (2, 0.6)])
def test_image_on_roughness(lobes, recorder, channel, wanted):
    picture = image(pixels=((0.2, 0.4, 0.6, 1),), is_float=True)

    def build(n):
        socket = n.node("TexImage", image=picture)
        if channel is not None:
            socket = n.node("SeparateColor", outlet=channel, Color=socket)
        return n.node("BsdfGlossy", Roughness=socket)
    block = lobes(build)
    close(block["roughness"], 1.0)
    close(recorder.blocks["image"][block["roughness_image"]]["pixels"][0, 0, 0], wanted)


def test_what_is_not_shown_is_named(lobes, target):
    lobes(lambda n: n.node("BsdfPrincipled", Transmission=1.0), warnings=1)
    assert "Transmission" in next(iter(target.reports))[1]


def test_unknown_shader_is_grey(lobes, target):
    block = lobes(lambda n: n.node("BsdfGlass"), warnings=1)
    close(block["diffuse"], 0.8)
    assert "Glass BSDF" in next(iter(target.reports))[1]


def test_surface_or_volume(scene):
    both, n = material()
    n.surface(n.node("BsdfDiffuse"))
    assert materials.has_surface(both)
    assert materials.volume_tree(both) is None
    n.volume(n.node("VolumeScatter"))
    assert materials.has_surface(both)
    assert materials.volume_tree(both) is not None
    fog, n = material()
    n.volume(n.node("VolumeScatter"))
    assert not materials.has_surface(fog)
    assert materials.has_surface(None)


# -- images


def linear(made):
    return images.linear(made, images._raw(made))


def test_bytes_are_decoded(scene):
    stored = np.array(((0.0, 0.04, 128 / 255, 0.5), (1, 1, 1, 1)))
    rgba = linear(image(pixels=stored))
    levels = np.round(stored * 255) / 255
    decoded = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(rgba[..., :3].reshape(-1, 3), decoded[:, :3], rtol=1e-5)
    np.testing.assert_allclose(rgba[0, 0, 3], levels[0, 3], rtol=1e-5)


def test_data_is_left_alone(scene):
    made = image(pixels=((0.0, 0.2, 0.4, 1),), is_data=True)
    np.testing.assert_allclose(linear(made)[0, 0, :3], (0.0, 51 / 255, 102 / 255),
                               rtol=1e-6)


def test_float_images_lose_their_multiplied_alpha(scene):
    made = image(pixels=((0.1, 0.2, 0.4, 0.5),), is_float=True)
    close(linear(made)[0, 0], (0.2, 0.4, 0.8, 0.5))


def test_rows_start_at_the_bottom(scene):
    made = image(pixels=((1, 0, 0, 1), (0, 1, 0, 1)), width=1)
    rgba = linear(made)
    close(rgba[0, 0], (1, 0, 0, 1))
    close(rgba[1, 0], (0, 1, 0, 1))


def test_missing_image(scene, target, recorder):
    made = bpy.data.images.new("Gone", 1, 1)
    made.source = 'FILE'
    made.filepath = "//nowhere/gone.png"
    made.reload()
    images.export(target, images.Texture(made))
    assert target.reports.ids() == ["IMAGE_MISSING"]
    close(recorder.named("image", "Gone")["pixels"], (1, 0, 1, 1))


def test_an_unchanged_image_is_not_sent_again(scene, target, recorder):
    made = image()
    for _ in range(2):
        target.begin()
        images.export(target, images.Texture(made))
        target.end()
    assert recorder.sent.count("image") == 1
    made.pixels.foreach_set(np.array((0, 1, 0, 1), np.float32))
    target.begin()
    images.export(target, images.Texture(made))
    assert recorder.sent.count("image") == 2
