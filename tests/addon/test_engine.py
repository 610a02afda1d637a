# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole renders inside Blender, with the real library, and Blender processes with broken ones."""

import signal
import subprocess
import time

import blenders
import bpy
import numpy as np
import pytest
from brume import engine, native, properties, session
from conftest import ROOT, Nodes, add, blender, cube, lit, material, write_vdb

SIZE = 24, 32  # rows, columns


@pytest.fixture
def reported(monkeypatch):
    """The sentences of the engine's warnings."""
    sentences = []
    monkeypatch.setattr(engine.BrumeEngine, "_warn", lambda self, entries: sentences.extend(
        sentence for _, sentence in entries))
    return sentences


def test_fog_cube(scene, render):
    lit(scene)
    pixels = render()
    assert pixels.shape == (*SIZE, 4)
    assert np.isfinite(pixels).all()
    middle, corner = pixels[12, 16], pixels[0, 0]
    assert middle[:3].min() > 0.05
    # 2 m of fog of 2/m: next to nothing passes.
    assert middle[3] > 0.9
    assert not corner.any()


def test_light_is_linear_in_power(scene, render):
    lit(scene)
    one = render()
    bpy.data.lights["Sun"].energy *= 2
    np.testing.assert_allclose(render("b")[..., :3], 2 * one[..., :3], rtol=1e-3, atol=1e-4)


def test_same_pixels_every_time(scene, render):
    lit(scene)
    first = render()
    session.drop("final")
    assert np.array_equal(render("b"), first)


def test_camera_moves_reuse_the_medium(scene, render):
    lit(scene)
    render()
    first = session.last_stats.stats
    scene.camera.location.z = 0.3
    render("b")
    second = session.last_stats.stats
    medium = native.STAGES.index("medium")
    march = native.STAGES.index("march")
    assert first.stages[medium].revision == second.stages[medium].revision
    assert first.stages[march].runs < second.stages[march].runs


def test_last_stats(scene, render):
    lit(scene)
    render()
    stats, export_s, whole_s = session.last_stats
    assert 0 < export_s < whole_s
    assert stats.total_ms / 1000 < whole_s
    assert stats.samples == scene.brume.samples


def test_half_resolution_arrives(scene, render, monkeypatch):
    lit(scene)
    views, asked = [], native.Scene.render
    monkeypatch.setattr(native.Scene, "render", lambda self, settings, view: (
        views.append(view.half_march), asked(self, settings, view))[1])
    scene.render.resolution_x, scene.render.resolution_y = 128, 96  # silhouettes are softer
    whole = render()
    scene.brume.half_resolution_volumes = True
    half = render("b")
    assert views == [0, 1]
    assert not np.array_equal(half, whole)
    np.testing.assert_allclose(half.mean(axis=(0, 1)), whole.mean(axis=(0, 1)), rtol=0.02)


def test_light_propagation(scene, render, monkeypatch):
    """More light than single scattering, and each part of it no more than all."""
    lit(scene)
    scene.brume.field_resolution = 8
    asked = []
    native_render = native.Scene.render
    monkeypatch.setattr(native.Scene, "render", lambda self, settings, view: (
        asked.append((settings.method, settings.light_paths, settings.blockers,
                      settings.field_resolution, settings.cascades, settings.cascade_focus)),
        native_render(self, settings, view))[1])
    scene.brume.method = 'OPV'
    single = render()[..., :3].sum()
    scene.brume.method = 'LPV'
    found = {}
    for paths in native.LIGHT_PATHS:
        scene.brume.light_paths = paths
        found[paths] = render(paths)[..., :3].sum()
    scene.brume.light_paths, scene.brume.blockers = 'ALL', 'FUZZY'
    render("fuzzy")
    scene.brume.cascades, scene.brume.cascade_focus = 2, 'CAMERA'
    render("cascades")
    assert asked == [(0, 0, 0, 8, 0, 0), *((1, number, 0, 8, 0, 0) for number in range(6)),
                     (1, 0, 1, 8, 0, 0), (1, 0, 1, 8, 2, 1)]
    assert found["ALL"] > 1.02 * single
    np.testing.assert_allclose(found["SINGLE"], single, rtol=1e-3)
    assert found["DIRECT"] < found["SINGLE"] <= found["SUM"] <= found["ALL"]


def test_panels_are_those_of_the_method(scene):
    propagation = [bpy.types.BRUME_PT_light_propagation,
                   bpy.types.BRUME_PT_light_propagation_comparison]
    ordinates = [bpy.types.BRUME_PT_discrete_ordinates]
    scene.render.engine = 'BRUME'
    for method, shown in (('OPV', []), ('LPV', propagation), ('DOM', ordinates)):
        scene.brume.method = method
        for panel in propagation + ordinates:
            assert panel.poll(bpy.context) == (panel in shown)


def test_zero_scale_leaves_the_rest(scene, render, reported):
    lit(scene)
    whole = render()
    cube("Flat", material=bpy.data.materials["Fog"], scale=(1, 1, 0))
    assert np.array_equal(render("b"), whole)
    assert any("Flat" in sentence for sentence in reported)


def test_voxels_stand_where_cycles_has_them(scene, render, tmp_path):
    """Half a voxel beside OpenVDB's place until Blender 5.0."""
    shader, nodes = material("Glow")
    density = nodes.node("Attribute", "Fac", attribute_name="density")
    nodes.volume(nodes.node("Emission", Strength=density))
    data = bpy.data.volumes.new("Glow")
    data.filepath = write_vdb(tmp_path / "a.vdb", density=np.ones((3, 4, 2), np.float32))
    data.materials.append(shader)
    add("Glow", data, scale=(5, 5, 5))
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = 'ORTHO', 4.0
    scene.camera = add("Camera", camera, location=(1, 1, 6))
    scene.cycles.samples, scene.cycles.use_denoising = 64, False

    def middle(engine):
        scene.render.engine = engine
        image = render(engine)[..., 0]
        rows, columns = np.indices(image.shape)
        return np.array([(columns * image).sum(), (rows * image).sum()]) / image.sum()
    brume, cycles = middle('BRUME'), middle('CYCLES')
    # Half a voxel is two pixels.
    assert np.abs(brume - cycles).max() < 0.1


@pytest.mark.parametrize("crop", [True, False])
def test_border(scene, render, crop):
    lit(scene)
    scene.brume.samples = 32
    whole = render()
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    (scene.render.border_min_x, scene.render.border_max_x, scene.render.border_min_y,
     scene.render.border_max_y) = 0.25, 0.75, 0.25, 0.5
    part = render("part")
    inside = whole[6:12, 8:24]
    if crop:
        assert part.shape == inside.shape
    else:
        assert part.shape == whole.shape
        assert not part[:6].any()
        part = part[6:12, 8:24]
    # The samples' jitter differs between the two; the picture is smooth in here.
    assert np.abs(part - inside).mean() < 0.03 * inside.mean()


def test_resolution_percentage_and_pixel_aspect(scene, render):
    lit(scene)
    scene.render.resolution_percentage = 50
    assert render().shape == (12, 16, 4)
    scene.render.resolution_percentage = 100
    scene.camera.data.sensor_fit = 'HORIZONTAL'
    square = render("b")[..., 3]
    scene.render.pixel_aspect_y = 2.0
    # Pixels twice as high: the cube covers half as many rows.
    tall = render("c")[..., 3]
    rows = [(picture[:, 16] > 0.5).sum() for picture in (square, tall)]
    assert abs(rows[0] - 2 * rows[1]) <= 2


def test_world_is_drawn(scene, render):
    lit(scene)
    scene.render.film_transparent = False
    scene.world = bpy.data.worlds.new("World")
    nodes = Nodes(scene.world)
    nodes.surface(nodes.node("Background", Color=(0.1, 0.2, 0.3, 1)))
    np.testing.assert_allclose(render()[0, 0], (0.1, 0.2, 0.3, 1.0), rtol=1e-3)


def test_passes_reach_the_file(scene, tmp_path):
    lit(scene)
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = True
    layer.use_pass_emit = layer.use_pass_environment = True
    layer.brume.use_pass_volume_direct = layer.brume.use_pass_transmittance = True
    layer.brume.use_pass_volume_indirect = True
    blenders.multilayer(scene.render.image_settings)
    scene.render.filepath = str(tmp_path / "layers.exr")
    bpy.ops.render.render(write_still=True)
    names = header_channels(tmp_path / "layers.exr")
    wanted = {f"ViewLayer.{name}.{c}" for name, channels in (
        ("Combined", "RGBA"), ("Depth", "Z"), ("Normal", "XYZ"), ("Emit", "RGB"), ("Env", "RGB"),
        ("VolumeDir", "RGB"), ("VolumeInd", "RGB"), ("Transmittance", "RGB")) for c in channels}
    assert wanted == {name for name in names if name.startswith("ViewLayer.")}


def header_channels(path):
    """Channel names from the header of an EXR file."""
    data = path.read_bytes()
    at = data.index(b"channels\0chlist\0") + len(b"channels\0chlist\0") + 4
    names = []
    while data[at]:
        end = data.index(b"\0", at)
        names.append(data[at:end].decode())
        at = end + 1 + 16
    return names


def test_two_view_layers(scene, tmp_path):
    lit(scene)
    second = scene.view_layers.new("Second")
    second.use_pass_z = True
    scene.view_layers[0].use_pass_z = False
    blenders.multilayer(scene.render.image_settings)
    scene.render.filepath = str(tmp_path / "layers.exr")
    bpy.ops.render.render(write_still=True)
    names = header_channels(tmp_path / "layers.exr")
    assert "ViewLayer.Combined.R" in names
    assert "Second.Combined.R" in names
    assert "Second.Depth.Z" in names
    assert "ViewLayer.Depth.Z" not in names


def test_stereoscopy_is_reported(scene, render, reported, tmp_path):
    lit(scene)
    whole = render()
    scene.render.use_multiview = True
    scene.render.filepath = str(tmp_path / "view.exr")
    bpy.ops.render.render(write_still=True)
    for name in "LR":
        assert np.array_equal(native.exr_read(tmp_path / f"view_{name}.exr"), whole)
    assert len(reported) == 1
    assert "stereoscopy" in reported[0]


def test_no_camera(scene, render):
    lit(scene)
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match="camera"):
        render()


def test_a_failed_render_is_no_crash_and_the_next_works(scene, render, monkeypatch):
    lit(scene)

    def broken(*args):
        raise native.BrumeError("GPU", "the driver is on fire")
    with monkeypatch.context() as patch:
        patch.setattr(session, "stage", broken)
        with pytest.raises(RuntimeError, match="the driver is on fire"):
            render()
    assert render("b")[12, 16, 3] > 0.9


@pytest.mark.parametrize("persistent", [False, True])
def test_animation(scene, tmp_path, persistent):
    lit(scene)
    fog = bpy.data.objects["Fog"]
    for frame, height in ((1, 0.0), (2, 0.7), (3, 0.0)):
        fog.location.z = height
        fog.keyframe_insert("location", frame=frame)
    scene.render.use_persistent_data = persistent
    scene.render.filepath = str(tmp_path / "frame_")
    scene.frame_start, scene.frame_end = 1, 3
    bpy.ops.render.render(animation=True)
    one, two, three = (native.exr_read(path) for path in sorted(tmp_path.glob("frame_*.exr")))
    assert np.array_equal(one, three)
    assert not np.array_equal(one, two)


def test_linked_collection(scene, render, tmp_path):
    """An instance of a library's collection looks as its objects do where they are at home,
    whatever unit the scene shows its lengths in."""
    lit(scene)
    kit = bpy.data.collections.new("Kit")
    scene.collection.children.link(kit)
    for name in ("Fog", "Sun"):
        ob = bpy.data.objects[name]
        scene.collection.objects.unlink(ob)
        kit.objects.link(ob)
    whole = render()
    path = tmp_path / "kit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.data.collections.remove(kit)
    for name in ("Fog", "Sun"):
        bpy.data.objects.remove(bpy.data.objects[name])
    with bpy.data.libraries.load(str(path), link=True) as (_, linked):
        linked.collections = ["Kit"]
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = 'COLLECTION', linked.collections[0]
    scene.collection.objects.link(empty)
    scene.unit_settings.scale_length = 0.01
    assert np.array_equal(render("b"), whole)


def test_another_scene_between(scene, render, tmp_path):
    lit(scene)
    whole = render()
    other = bpy.data.scenes.new("Other")
    other.render.engine = 'BRUME'
    other.render.resolution_x, other.render.resolution_y = 16, 12
    other.render.filepath = str(tmp_path / "other.png")
    other.collection.objects.link(scene.camera)
    other.camera = scene.camera
    bpy.ops.render.render(write_still=True, scene="Other")
    assert (tmp_path / "other.png").exists()
    assert np.array_equal(render("b"), whole)


@pytest.mark.fluid
def test_a_simulation_beyond_its_cache(tmp_path):
    """Frame 66 alone is cached: before and after, there is no smoke, and no report."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "blend_scenes" / "plume.blend"))
    scene = bpy.context.scene
    scene.render.engine = 'BRUME'
    scene.brume.preset = 'DRAFT'
    scene.render.resolution_x, scene.render.resolution_y = 32, 18
    scene.render.image_settings.file_format = 'OPEN_EXR'
    scene.render.image_settings.color_depth = '32'
    scene.frame_start, scene.frame_end = 65, 67
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    before, smoke, after = (native.exr_read(path) for path in sorted(tmp_path.glob("frame_*.exr")))
    assert np.array_equal(before, after)
    assert np.abs(smoke - before).mean() > 0.01 * before.mean()


def test_presets(scene):
    for name, values in properties.PRESETS.items():
        scene.brume.preset = name
        for key, value in values.items():
            assert getattr(scene.brume, key) == value
        settings = properties.native_settings(scene.brume)
        assert settings.medium_resolution == values["medium_resolution"]
    for key, value in properties.PRESETS['PREVIEW'].items():
        assert scene.brume.bl_rna.properties[key].default == value


def test_panels_apply():
    marked = [panel.__name__ for panel in bpy.types.Panel.__subclasses__()
              if 'BRUME' in getattr(panel, "COMPAT_ENGINES", ())]
    for name in ('EEVEE_MATERIAL_PT_surface', 'EEVEE_MATERIAL_PT_volume', 'BRUME_PT_light',
                 'EEVEE_WORLD_PT_surface', 'RENDER_PT_format', 'DATA_PT_volume_file'):
        assert name in marked, name


def test_no_panel_is_there_twice():
    """None in one tab under one name, but where the kind of object decides."""
    found = {}
    for panel in bpy.types.Panel.__subclasses__():
        if 'BRUME' not in getattr(panel, "COMPAT_ENGINES", ()):
            continue
        if panel.bl_space_type == 'PROPERTIES' and not hasattr(panel, "bl_parent_id"):
            found.setdefault((getattr(panel, "bl_context", ""), panel.bl_label), []).append(panel)
    assert [panel.__name__ for panel in found["data", "Light"]] == ['BRUME_PT_light']
    for (context, label), panels in found.items():
        if context in {"render", "output", "view_layer", "scene", "world", "object"} and label:
            assert len(panels) == 1, (context, label)


# -- other processes


def test_engine_from_the_command_line(saved, tmp_path):
    done = blender(saved, "-E", "BRUME", "-o", tmp_path / "out_####", "-f", "1")
    assert done.returncode == 0, done.stderr
    assert "Brume | " in done.stdout
    assert (tmp_path / "out_0001.exr").exists()


def test_cancel(saved, tmp_path):
    """Ctrl-C is how a render in background is broken off. Half a second and one stage, and what
    Blender itself takes to end."""
    process = subprocess.Popen(
        [ROOT / "scripts" / "blender", "-b", saved, "--python-expr",
         "import bpy; bpy.context.scene.brume.samples = 65536", "-E", "BRUME",
         "-o", tmp_path / "out_####", "-f", "1"], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        if "Sample" in line:
            break
    process.send_signal(signal.SIGINT)
    asked = time.perf_counter()
    rest, _ = process.communicate(timeout=60)
    assert time.perf_counter() - asked < 2.0
    assert process.returncode in {0, 1}, "Blender crashed"
    assert "Saved" not in rest
    assert not (tmp_path / "out_0001.exr").exists()


def test_add_on_goes_and_comes(scene):
    import addon_utils
    addon_utils.disable("brume")
    assert not hasattr(bpy.types.Scene, "brume")
    addon_utils.enable("brume", persistent=True)
    assert bpy.context.scene.brume.method == 'DOM'
