# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside a Blender with a window: plays one scenario with real key presses, writes down what
was seen, and quits as a user does. Started by test_viewport.py:

    blender FILE.blend --python drive.py -- SCENARIO RESULT.npz

A scenario is a generator on Blender's main thread. It yields seconds to wait or a condition to
wait for, and returns arrays for the result.
"""

import subprocess
import sys
import time
import traceback

import bpy
import numpy as np
from brume import session, viewport
from mathutils import Vector

TICK_S = 0.05
PATIENCE_S = 120.0
BLOCKS = 6, 9  # rows, columns

events = []  # (name, time) of the render handlers
gaps = []    # seconds between two ticks: how long the main thread was away


def press(key):
    subprocess.run(["xdotool", "key", key], check=True)


def screen():
    """The display's pixels as (height, width, 3), linear in nothing: 0 to 1 as shown, rows from
    the top."""
    size = subprocess.run(["xdotool", "getdisplaygeometry"], check=True, capture_output=True)
    width, height = (int(word) for word in size.stdout.split())
    shot = subprocess.run(["import", "-window", "root", "-depth", "8", "rgb:-"], check=True,
                          capture_output=True).stdout
    return np.frombuffer(shot, np.uint8).reshape(height, width, 3) / 255.0


def window():
    return bpy.context.window_manager.windows[0]


def view_area():
    return next(area for area in window().screen.areas if area.type == 'VIEW_3D')


def region_of(area):
    return next(region for region in area.regions if region.type == 'WINDOW')


def only_one_area():
    """Leaves the 3D view alone in the window, with nothing drawn on the picture."""
    area = view_area()
    space = area.spaces.active
    space.show_gizmo = space.overlay.show_overlays = False
    for name in ("show_region_header", "show_region_tool_header", "show_region_toolbar",
                 "show_region_ui"):
        setattr(space, name, False)
    with bpy.context.temp_override(window=window(), area=area, region=region_of(area)):
        bpy.ops.screen.screen_full_area(use_hide_panels=True)


def shade(kind):
    view_area().spaces.active.shading.type = kind


def views():
    return list(viewport._views)


def settled():
    """Whether all that is wanted was rendered and shown."""
    return views() and all(view.picture is not None and view.job is None and not view.steps
                           for view in views())


def finish_of(name, count=1):
    return lambda: sum(event == name for event, _ in events) >= count


def blocks(picture, x0=0.0, y0=0.0, x1=None, y1=None):
    """Block means of a part of a picture, given in pixels from the top left."""
    rows, columns = BLOCKS
    height, width = picture.shape[:2]
    ys = np.linspace(y0, height if y1 is None else y1, rows + 1).round().astype(int)
    xs = np.linspace(x0, width if x1 is None else x1, columns + 1).round().astype(int)
    return np.array([[picture[a:b, c:d].mean((0, 1)) for c, d in zip(xs, xs[1:])]
                     for a, b in zip(ys, ys[1:])])


def saved_render():
    """The last final render as it is shown, rows from the top."""
    path = sys.argv[-1] + ".png"
    bpy.data.images["Render Result"].save_render(path)
    image = bpy.data.images.load(path, check_existing=False)
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1, :, :3]


# -- scenarios


def rendered(samples):
    """Renders by F12 to the end."""
    bpy.context.scene.brume.samples = samples
    yield 1.0  # a render that was just broken off may still be clearing up
    before = sum(event == "render_complete" for event, _ in events)
    press("F12")
    yield finish_of("render_complete", before + 1)


def final():
    """F12 and Esc, then F12 to the end. A Blender whose last render was broken off quits with
    status 1, by the way."""
    scene = bpy.context.scene
    samples, scene.brume.samples = scene.brume.samples, 65536
    press("F12")
    yield finish_of("render_pre")
    yield 3.0
    asked = time.perf_counter()
    press("Escape")
    yield finish_of("render_cancel")
    waited = events[-1][1] - asked
    yield from rendered(samples)
    return {"picture": blocks(saved_render()), "cancel_s": waited}


def seen():
    """The 3D view as shown against a final render of the same: in camera view, in perspective
    and orthographic."""
    only_one_area()
    yield 1.0
    scene, area = bpy.context.scene, view_area()
    region, space = region_of(area), area.spaces.active
    shade('RENDERED')
    result = {}
    for kind in ('CAMERA', 'PERSP', 'ORTHO'):
        view = space.region_3d
        if kind == 'CAMERA':
            frame = [scene.camera.matrix_world @ corner
                     for corner in scene.camera.data.view_frame(scene=scene)]
        else:
            # The camera that sees what the 3D view sees: Blender's has a sensor of 72 mm.
            camera = scene.camera
            view.view_perspective = kind
            space.lens = 50.0
            view.view_matrix = camera.matrix_world.inverted()
            view.update()
            camera.data.sensor_width, camera.data.lens = 72.0, space.lens
            camera.data.type = kind
            camera.data.ortho_scale = view.view_distance * 72.0 / space.lens
            camera.matrix_world = view.view_matrix.inverted()
            scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
        view.view_perspective = kind
        yield 0.5
        yield settled
        yield 0.5  # until the last picture has been drawn
        shown = screen()
        if kind == 'CAMERA':
            from bpy_extras.view3d_utils import location_3d_to_region_2d
            corners = np.array([location_3d_to_region_2d(region, view, Vector(corner))
                                for corner in frame])
            (x0, y0), (x1, y1) = corners.min(0), corners.max(0)
        else:
            x0, y0, x1, y1 = 0, 0, region.width, region.height
        top = shown.shape[0] - region.y
        result[f"{kind}_shown"] = blocks(shown, region.x + x0, top - y1, region.x + x1, top - y0)
        bpy.ops.render.render()
        result[f"{kind}_rendered"] = blocks(saved_render())
    return result


def survive():
    """What happens to rendered views while they work."""
    shade('RENDERED')
    yield lambda: views() and views()[0].picture is not None
    for name in ("one", "two"):
        bpy.context.object.location.x += 0.1
        bpy.ops.ed.undo_push(message=name)
        yield 0.3
    bpy.ops.ed.undo()
    yield 0.3
    bpy.ops.ed.redo()
    yield 0.3
    for engine in ('BLENDER_WORKBENCH', 'BRUME', 'CYCLES', 'BRUME'):
        bpy.context.scene.render.engine = engine
        yield 0.5
    # A long final render beside it, during which the view goes on being asked.
    bpy.context.scene.brume.samples = 65536
    press("F12")
    yield finish_of("render_pre")
    gaps.clear()
    for _ in range(4):
        view_area().spaces.active.region_3d.view_distance *= 1.05
        yield 0.3
    shade('SOLID')  # frees the view's scene, behind the render in the library's queue
    yield 0.5
    shade('RENDERED')
    yield 0.5
    away = max(gaps)
    press("Escape")
    yield finish_of("render_cancel")
    yield from rendered(samples=1)
    # A second view, closed at work.
    with bpy.context.temp_override(window=window(), area=view_area()):
        bpy.ops.screen.area_split(direction='VERTICAL', factor=0.5)
    for area in window().screen.areas:
        if area.type == 'VIEW_3D':
            area.spaces.active.shading.type = 'RENDERED'
    yield lambda: len(views()) == 2
    yield 0.3
    with bpy.context.temp_override(window=window(), area=view_area()):
        bpy.ops.screen.area_close()
    yield 0.5
    after_close = len(views())
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    yield 0.5
    bpy.context.scene.render.engine = 'BRUME'
    shade('RENDERED')
    yield lambda: views() and views()[0].picture is not None
    # Quits while it still refines.
    bpy.context.scene.brume.viewport_samples = 65536
    yield 0.3
    return {"away_s": away, "after_close": after_close, "stages": len(session._stages)}


def broken():
    """A library that is not there: said in the view, no crash."""
    shade('RENDERED')
    yield lambda: views() and views()[0].failed
    yield 0.5
    return {"pictures": sum(view.picture is not None for view in views())}


# -- the player


def play(scenario, path):
    """Advances the scenario at each tick."""
    state = {"wait": 1.0, "since": time.perf_counter(), "last": time.perf_counter()}

    def ended(result):
        np.savez(path, **result)
        bpy.ops.wm.quit_blender()

    def tick():
        now = time.perf_counter()
        gaps.append(now - state["last"])
        state["last"] = now
        wait, waited = state["wait"], now - state["since"]
        try:
            ready = wait() if callable(wait) else waited >= wait
            if not ready:
                if waited > PATIENCE_S:
                    raise TimeoutError(f"nothing happened for {PATIENCE_S} s; seen: {events}")
                return TICK_S
            state["wait"] = next(scenario)
        except StopIteration as end:
            ended(end.value)
            return None
        except BaseException:
            traceback.print_exc()
            ended({"error": traceback.format_exc()})
            return None
        state["since"] = state["last"] = time.perf_counter()
        return TICK_S

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)


def note(name):
    @bpy.app.handlers.persistent
    def handler(*_):
        events.append((name, time.perf_counter()))
    getattr(bpy.app.handlers, name).append(handler)


for name in ("render_pre", "render_complete", "render_cancel"):
    note(name)
preferences = bpy.context.preferences.view
preferences.show_splash = False
preferences.render_display_type = 'NONE'
bpy.context.preferences.use_preferences_save = False
scene = bpy.context.scene
scene.render.engine = 'BRUME'
scene.view_settings.view_transform = 'Standard'
scene.brume.preset = 'DRAFT'
scene.brume.viewport_samples = 4
scene.render.resolution_percentage = 100
scene.render.resolution_x, scene.render.resolution_y = 320, 180
play(globals()[sys.argv[-2]](), sys.argv[-1])
