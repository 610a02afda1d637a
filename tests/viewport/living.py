# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: what Blender does around rendered views while they work."""

import time

import addon_utils
import bpy
import numpy as np
from drive import (
    EEVEE,
    SAMPLES,
    alone,
    at,
    bare,
    count_of,
    events,
    f12,
    heard,
    look_through_camera,
    pictured,
    press_in,
    regions,
    rendered_views,
    scenario,
    settled,
    shade,
    stages,
    undo_step,
    view_area,
    view_areas,
    views,
    windows,
)
from eyes import alike, as_camera_sees, different, final, saved_render, shown, something

ENDLESS = 65536  # samples, that something be under way


def working(area=None):
    """A view through the camera that renders and goes on doing so."""
    area = yield from alone()
    look_through_camera()
    bpy.context.scene.brume.viewport_samples = ENDLESS
    shade('RENDERED')
    yield pictured()
    return area, regions(area)[0]


def rest():
    """Ends what working() began, and waits for it."""
    bpy.context.scene.brume.viewport_samples = SAMPLES
    yield from settled()


@scenario()
def undo_and_redo():
    area, region = yield from working()
    undo_step("begin")
    bpy.data.objects["Post"].location.x += 0.6
    undo_step("move")
    yield 0.4
    bpy.data.lights[0].energy *= 0.3
    undo_step("dim")
    yield from rest()
    moved = shown(region)
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    yield from rest()
    region, = regions(view_area())
    different(shown(region), moved, "after undo")
    found = [as_camera_sees(region, "after undo")]
    bpy.ops.ed.redo()
    bpy.ops.ed.redo()
    yield from rest()
    alike(shown(region), moved, "after redo")
    return found + [as_camera_sees(region, "after redo")]


@scenario()
def files_come_and_go():
    """File load and new file at work."""
    yield from working()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath, load_ui=False)
    yield 0.1
    bpy.context.scene.render.engine = 'BRUME'
    yield pictured()
    bpy.ops.wm.read_homefile(use_factory_startup=True, load_ui=True)
    yield 0.5
    assert not views() and not stages(), f"left: {views()}, {stages()}"
    scene = bpy.context.scene
    scene.render.engine = 'BRUME'
    scene.render.resolution_percentage = 25
    look_through_camera()
    bare(view_area())
    yield from rendered_views()
    assert len(stages()) == 1
    return as_camera_sees(regions(view_area())[0], "the new file")


@scenario()
def other_engines():
    area, region = yield from working()
    yield from rest()
    before = shown(region)
    for engine in ('BLENDER_WORKBENCH', 'BRUME', 'CYCLES', 'BRUME', EEVEE, 'BRUME'):
        bpy.context.scene.render.engine = engine
        yield 0.7
        if engine != 'BRUME':
            assert not views() and not stages(), f"{engine}: {stages()} left"
    yield from settled()
    alike(shown(region), before, "back in Brume")


@scenario()
def disabled_and_enabled():
    area, region = yield from working()
    addon_utils.disable("brume")
    yield 0.5
    assert not hasattr(bpy.types.Scene, "brume") and not views() and not stages()
    addon_utils.enable("brume", default_set=False, persistent=True)
    yield 0.5
    scene = bpy.context.scene
    scene.render.engine = 'BRUME'
    scene.brume.preset = 'DRAFT'
    scene.brume.samples = scene.brume.viewport_samples = SAMPLES
    yield from rendered_views()
    return as_camera_sees(region, "enabled again")


@scenario()
def area_closed():
    area, region = yield from working()
    with at(area):
        bpy.ops.screen.area_split(direction='VERTICAL', factor=0.5)
    yield 0.2
    for area in view_areas():
        shade('RENDERED', area)
    yield pictured(2)
    with at(view_areas()[1]):
        bpy.ops.screen.area_close()
    yield 0.5
    assert len(views()) == 1, f"{len(views())} views"
    yield from rest()
    return as_camera_sees(regions(view_area())[0], "the other view")


@scenario()
def two_windows():
    """The second one closes at work."""
    area, region = yield from working()
    with at(area):
        bpy.ops.wm.window_new()
    yield 0.5
    assert len(windows()) == 2
    other = windows()[1]
    other.screen.areas[0].type = 'VIEW_3D'
    yield 0.2
    shade('RENDERED', view_areas(other)[0])
    yield pictured(2)
    assert len(stages()) == 1
    with at(view_areas(other)[0], window=other):
        bpy.ops.wm.window_close()
    yield 0.5
    assert len(windows()) == 1 and len(views()) == 1
    yield from rest()
    return as_camera_sees(regions(view_area())[0], "the first window")


def escaped(region):
    """Breaks off the render by key; gives the seconds until it ended."""
    cancelled = count_of("render_cancel")
    asked = time.perf_counter()
    yield from press_in(region, "Escape")
    yield heard("render_cancel", cancelled + 1)
    return events[-1][1] - asked


@scenario()
def final_render_beside():
    """F12 while the view renders: the view goes on, Escape ends the render, and what the view
    frees meanwhile is not waited for."""
    area, region = yield from working()
    scene = bpy.context.scene
    scene.brume.samples = ENDLESS
    before = count_of("render_pre")
    yield from press_in(region, "F12")
    yield heard("render_pre", before + 1)
    shown_before = views()[0].picture.serial
    bpy.data.objects["Post"].location.x += 0.3
    # While it renders Blender's own interface is not locked: neither by Brume.
    yield lambda: views()[0].picture.serial > shown_before
    ticks = [time.perf_counter()]
    for _ in range(20):
        yield 0.03
        ticks.append(time.perf_counter())
    shade('SOLID')
    yield 0.3
    assert not views() and not stages()
    shade('RENDERED')
    yield pictured()
    waited = yield from escaped(region)
    scene.brume.samples = SAMPLES
    yield from f12()
    yield from rest()
    found = as_camera_sees(region, "beside a render")
    # Some tenths to redraw on a busy machine; a render that is waited for takes minutes.
    assert max(np.diff(ticks)) < 2.0, f"the main thread was away for {max(np.diff(ticks)):.2f} s"
    assert waited < 5.0, f"Escape took {waited:.2f} s"
    return {"apart": found, "away_s": float(max(np.diff(ticks))), "escape_s": waited}


@scenario()
def f12_in_the_window():
    """A final render alone: Escape, then to the end."""
    area = yield from alone()
    region, = regions(area)
    scene = bpy.context.scene
    scene.brume.samples = ENDLESS
    begun = count_of("render_pre")
    yield from press_in(region, "F12")
    yield heard("render_pre", begun + 1)
    yield 2.0
    waited = yield from escaped(region)
    scene.brume.samples = SAMPLES
    yield from f12()
    picture = saved_render()
    something(picture)
    alike(picture, final(), "rendered by key and by script", 1e-6)
    assert waited < 5.0, f"Escape took {waited:.2f} s"
    return {"escape_s": waited}


@scenario("lamps")
def material_previews():
    """A red and a blue material: their previews are red and blue."""
    yield from alone()
    bpy.context.scene.brume.viewport_samples = ENDLESS
    shade('RENDERED')
    yield pictured()
    found = {}
    for name, colour in (("Red", (0.8, 0.05, 0.05, 1)), ("Blue", (0.05, 0.05, 0.8, 1))):
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        shader = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
        shader.inputs["Base Color"].default_value = colour
        material.asset_generate_preview()
        yield lambda material=material: (material.preview is not None
                                         and any(material.preview.image_pixels_float))
        yield 1.0  # more than the first rows
        pixels = np.array(material.preview.image_pixels_float).reshape(
            *reversed(material.preview.image_size), 4)
        middle = pixels[pixels.shape[0] // 3:, pixels.shape[1] // 3:][:24, :24, :3]
        found[name] = middle.mean((0, 1)).tolist()
    red, blue = found["Red"], found["Blue"]
    assert red[0] > 2 * red[2] and blue[2] > 2 * blue[0], found
    return found
