# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps, the world and the camera."""

import math

import bpy
import numpy as np
import pytest
from brume.export import camera, expression, world
from brume.native import BrumeError
from conftest import Nodes, add, cube
from mathutils import Euler


def lamp(kind, **values):
    made = bpy.data.lights.new("Lamp", kind)
    made.energy, made.color = 10.0, (1.0, 0.5, 0.25)
    for name, value in values.items():
        setattr(made, name, value)
    return made


def close(actual, wanted):
    np.testing.assert_allclose(actual, np.broadcast_to(wanted, np.shape(actual)), rtol=1e-6,
                               atol=1e-6)


@pytest.mark.parametrize("kind, values, wanted", [
    ('SUN', {"angle": 0.3}, {"type": "SUN", "angle": 0.3}),
    ('POINT', {"shadow_soft_size": 0.2}, {"type": "POINT", "radius": 0.2}),
    ('SPOT', {"spot_size": 1.2, "spot_blend": 0.4, "shadow_soft_size": 0.1},
     {"type": "SPOT", "spot_angle": 1.2, "spot_blend": 0.4, "radius": 0.1}),
    ('AREA', {"shape": 'SQUARE', "size": 2.0, "size_y": 9.0},
     {"type": "RECTANGLE", "size": (2.0, 2.0), "spread": math.pi}),
    ('AREA', {"shape": 'RECTANGLE', "size": 2.0, "size_y": 1.0, "spread": 1.0},
     {"type": "RECTANGLE", "size": (2.0, 1.0), "spread": 1.0}),
    ('AREA', {"shape": 'DISK', "size": 2.0, "size_y": 9.0},
     {"type": "ELLIPSE", "size": (2.0, 2.0)}),
    ('AREA', {"shape": 'ELLIPSE', "size": 2.0, "size_y": 1.0},
     {"type": "ELLIPSE", "size": (2.0, 1.0)}),
])
def test_lamp(scene, export, kind, values, wanted):
    ob = add("Lamp", lamp(kind, **values), location=(1, 2, 3), scale=(2, 1, 1))
    block = export().named("light", "Lamp")
    # Cycles' radiance is power / (4 area) until 4.0, power / (pi area) since; ours is the former.
    unit = 4 / math.pi if kind == 'AREA' and bpy.app.version >= (4, 0, 0) else 1.0
    close(block["power"], unit * np.array((10, 5, 2.5)))
    close(block["world_from_light"], np.array(ob.matrix_world))
    for name, value in wanted.items():
        if isinstance(value, str):
            assert block[name] == value
        else:
            close(block[name], value)


@pytest.mark.parametrize("number, flag", enumerate((
    "visible_diffuse", "visible_glossy", "visible_volume_scatter")))
def test_what_a_lamp_reaches(scene, export, number, flag):
    ob = add("Lamp", lamp('POINT'))
    assert export().named("light", "Lamp")["factors"] == (1, 1, 1)
    setattr(ob, flag, False)
    wanted = [1.0] * 3
    wanted[number] = 0.0
    assert export().named("light", "Lamp")["factors"] == tuple(wanted)


@pytest.mark.normalize
@pytest.mark.parametrize("kind, values, factor", [
    ('POINT', {"shadow_soft_size": 0.0}, 4.0),
    ('POINT', {"shadow_soft_size": 0.1}, 0.12566),
    ('SPOT', {"shadow_soft_size": 0.5}, 3.14159),
    ('SUN', {"angle": 0.0}, 1.0),
    ('SUN', {"angle": 1.0}, 0.7221),
    ('AREA', {"shape": 'SQUARE', "size": 0.5}, 1.0),
    ('AREA', {"shape": 'DISK', "size": 0.5}, 0.7854),
    ('AREA', {"shape": 'RECTANGLE', "size": 2.0, "size_y": 0.5}, 4.0),
])
def test_lamp_without_normalization(scene, export, kind, values, factor):
    """How much brighter a lamp of twice the size got in Cycles 5.2."""
    made = lamp(kind, **values)
    add("Lamp", made, scale=(2, 2, 2))
    normal = np.array(export().named("light", "Lamp")["power"])
    made.normalize = False
    bpy.context.view_layer.update()
    np.testing.assert_allclose(export().named("light", "Lamp")["power"], normal * factor,
                               rtol=1e-4)


def test_nodes_multiply_the_lamp(scene, export):
    made = lamp('POINT')
    nodes = Nodes(made)
    nodes.surface(nodes.node("Emission", Strength=3.0,
                             Color=nodes.node("Blackbody", Temperature=3000.0)))
    add("Lamp", made)
    close(export().named("light", "Lamp")["power"],
          np.array((10, 5, 2.5)) * 3 * expression.blackbody(3000))


def test_unknown_lamp_nodes_are_named(scene, export, target):
    made = lamp('POINT')
    nodes = Nodes(made)
    nodes.surface(nodes.node("Emission", Strength=nodes.node("LightFalloff")))
    nodes.tree.nodes["Emission"].inputs["Strength"].default_value = 2.0
    add("Lamp", made)
    close(export().named("light", "Lamp")["power"], (20, 10, 5))
    assert len(list(target.reports)) == 1


def test_shadow_and_visibility(scene, export):
    ob = add("Lamp", lamp('POINT', use_shadow=False))
    ob.visible_camera = False
    block = export().named("light", "Lamp")
    assert not block["cast_shadow"]
    assert not block["camera_visible"]


def test_hidden_lamp_goes(scene, export):
    ob = add("Lamp", lamp('POINT'))
    assert len(export().of("light")) == 1
    ob.hide_viewport = True
    assert export().of("light") == []


# -- world


@pytest.fixture
def exported_world(scene, target, recorder):
    """Exports a world whose nodes a function builds."""
    def run(build=None, warnings=0):
        made = bpy.data.worlds.new("World")
        if build:
            nodes = Nodes(made)
            build(nodes)
        world.export(target, made, 7.0)
        assert len(list(target.reports)) == warnings, list(target.reports)
        return recorder.world
    return run


def test_no_world_is_black(scene, target, recorder):
    world.export(target, None, 0.0)
    close(recorder.world["color"], 0)


@pytest.mark.without_nodes
def test_world_without_nodes(scene, target, recorder):
    made = bpy.data.worlds.new("World")
    made.color = (0.1, 0.2, 0.3)
    world.export(target, made, 0.0)
    close(recorder.world["color"], (0.1, 0.2, 0.3))


def test_background(exported_world):
    block = exported_world(lambda n: n.surface(
        n.node("Background", Color=(0.1, 0.2, 0.3, 1), Strength=2.0)))
    close(block["color"], (0.2, 0.4, 0.6))
    assert block["volume"] is None


def test_mixed_backgrounds(exported_world):
    block = exported_world(lambda n: n.surface(n.node(
        "MixShader", Fac=0.25, Shader=n.node("Background", Color=(1, 0, 0, 1)),
        Shader_001=n.node("Background", Color=(0, 1, 0, 1), Strength=4.0))))
    close(block["color"], (0.75, 1.0, 0))


def test_environment(exported_world, recorder):
    picture = bpy.data.images.new("Sky", 4, 2, float_buffer=True)

    def build(n):
        mapping = n.node("Mapping", Vector=n.node("TexCoord"), Rotation=(0.1, 0.2, 0.3))
        n.surface(n.node("Background", Strength=2.0, Color=n.node(
            "TexEnvironment", image=picture, Vector=mapping)))
    block = exported_world(build)
    close(block["color"], 2)
    assert block["image"] in recorder.blocks["image"]
    close(np.array(block["image_from_world"])[:3, :3],
          np.array(Euler((0.1, 0.2, 0.3)).to_matrix()))


def test_world_volume(exported_world):
    block = exported_world(lambda n: n.volume(n.node(
        "VolumePrincipled", Color=(0.5, 0.5, 0.5, 1), Density=0.1, Anisotropy=0.3,
        Emission_Strength=2.0, Emission_Color=(1, 0, 0, 1))))
    sigma_s, sigma_a, emission, g = block["volume"]
    close(sigma_s, 0.05)
    close(sigma_a, 0.05)
    close(emission, (2, 0, 0))
    close(g, 0.3)
    assert block["reach"] == 7.0


def test_sky_is_named(exported_world):
    block = exported_world(lambda n: (n.surface(n.node(
        "Background", Color=n.node("TexSky"))), setattr(
            n.tree.nodes["Background"].inputs["Color"], "default_value", (0.1, 0.1, 0.1, 1))),
        warnings=1)
    close(block["color"], 0.1)


# -- camera


class Engine:
    """As much of a RenderEngine as the camera needs."""
    camera_override = None

    def camera_model_matrix(self, ob):
        return ob.matrix_world


def matrices(scene, target, full=(40, 30), part=None, **values):
    data = bpy.data.cameras.new("Camera")
    for name, value in values.items():
        setattr(data, name, value)
    scene.camera = add("Camera", data, location=(1, 2, 3))
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return camera.final(Engine(), depsgraph, target, full, part or (0, 0, *full))


def project(seen, point):
    clip = seen.clip_from_view @ seen.view_from_world @ (*point, 1.0)
    return clip[:3] / clip[3]


def test_camera(scene, target):
    seen = matrices(scene, target, lens=18.0, sensor_width=36.0, clip_start=0.5, clip_end=50.0)
    # 36 mm at 18 mm: half a width at half a width's distance.
    close(project(seen, (1, 2, 3 - 2.0)), (0, 0, project(seen, (1, 2, 1))[2]))
    close(project(seen, (1 + 2.0, 2, 3 - 2.0))[:2], (1, 0))
    close(project(seen, (1, 2 + 2.0 * 0.75, 3 - 2.0))[:2], (0, 1))
    close(project(seen, (1, 2, 3 - 0.5))[2], -1)
    close(project(seen, (1, 2, 3 - 50))[2], 1)


def test_orthographic_and_shift(scene, target):
    seen = matrices(scene, target, type='ORTHO', ortho_scale=4.0, shift_x=0.25)
    close(project(seen, (1 + 1.0, 2, 0))[:2], (0, 0))
    close(project(seen, (1 + 3.0, 2, -5))[:2], (1, 0))


def test_border_is_a_window_of_the_picture(scene, target):
    full, part = (40, 30), (10, 6, 20, 12)
    whole = matrices(scene, target, full)
    cut = matrices(scene, target, full, part)
    for point in ((1.3, 2.2, 0), (0.7, 1.7, -2)):
        pixel = (project(whole, point)[:2] + 1) / 2 * full
        pixel_in_part = (project(cut, point)[:2] + 1) / 2 * part[2:]
        close(pixel - pixel_in_part, part[:2])


def lens(scene, target, data=None, **values):
    seen = matrices(scene, target, **(data or {}))
    assert seen.lens == camera.Lens()
    dof = scene.camera.data.dof
    dof.use_dof = True
    for name, value in values.items():
        setattr(dof, name, value)
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return camera.final(Engine(), depsgraph, target, (4, 4), (0, 0, 4, 4)).lens


def test_lens(scene, target):
    found = lens(scene, target, {"lens": 50.0}, aperture_fstop=2.5, focus_distance=3.0,
                 aperture_blades=5, aperture_rotation=0.25, aperture_ratio=1.5)
    close(found, (0.01, 3.0, 5, 0.25, 1.5))  # half of 50 mm / 2.5
    # As Cycles, which takes a parallel view for one of 1 m.
    found = lens(scene, target, {"type": 'ORTHO'}, aperture_fstop=2.5, focus_distance=0.0)
    close(found[0], 0.2)
    assert found.focus > 0
    assert not list(target.reports)


def test_focus_on_an_object_and_on_a_bone(scene, target):
    # The camera stands at (1, 2, 3) and looks along -z: what is aside of its axis does not count.
    post = add("Post", bpy.data.armatures.new("Post"), location=(7, 8, -2))
    close(lens(scene, target, focus_object=post).focus, 5.0)
    bpy.context.view_layer.objects.active = post
    bpy.ops.object.mode_set(mode='EDIT')
    bone = post.data.edit_bones.new("Tip")
    bone.head, bone.tail = (0, 0, 1.5), (0, 1, 1.5)
    bpy.ops.object.mode_set(mode='OBJECT')
    close(lens(scene, target, focus_object=post, focus_subtarget="Tip").focus, 3.5)
    close(lens(scene, target, focus_object=post, focus_subtarget="none").focus, 5.0)


def test_no_camera(scene, target):
    scene.camera = None
    with pytest.raises(BrumeError) as caught:
        camera.final(Engine(), bpy.context.evaluated_depsgraph_get(), target, (4, 4),
                     (0, 0, 4, 4))
    assert caught.value.id == "NO_CAMERA"


def test_panorama_and_blur_are_named(scene, target):
    cube()
    scene.render.use_motion_blur = True
    matrices(scene, target, type='PANO')
    assert len(list(target.reports)) == 2
