# SPDX-License-Identifier: GPL-3.0-or-later
"""What scenarios are made of, inside a Blender with a window: its window, areas and regions, real
keys and mouse, and what to wait for.

A scenario is a generator function marked by @scenario. It yields seconds to wait, or a condition
to wait for, and asserts. What it returns goes into the result; play.py plays it.
"""

import itertools
import subprocess
import time

import bpy
from brume import session, viewport

SIZE = 640, 360  # of a view alone
# Of views and of the final renders that they are compared with, which mostly have the same pixels
# and so the same noise: samples, that a picture gathers; directions of the world, more than the
# eight that rough pictures take.
SAMPLES, WORLD_SAMPLES = 2, 16
# Keys that xdotool would press together with Alt: in the keyboard maps of newer X servers they have
# several levels, all alike.
KEYCODES = {"F12": 96, "KP_Divide": 106}
EEVEE = 'BLENDER_EEVEE_NEXT' if (4, 2, 0) <= bpy.app.version < (5, 0, 0) else 'BLENDER_EEVEE'

events = []      # (name, time) of the render handlers
scenarios = {}   # by name: (function, the name of its scene)


def scenario(scene="cube", slow=False, fluid=False):
    """Marks a scenario that is played in blend_scenes/SCENE.blend. What is slow is only played
    where all is, and what makes a Fluid domain where Blender can; test_viewport.py reads that from
    the source."""
    def mark(function):
        scenarios[function.__name__] = function, scene
        return function
    return mark


# -- the window


def windows():
    return bpy.context.window_manager.windows


def view_areas(window=None):
    return [area for area in (window or windows()[0]).screen.areas if area.type == 'VIEW_3D']


def view_area():
    return view_areas()[0]


def regions(area, kind='WINDOW'):
    return [region for region in area.regions if region.type == kind]


def at(area, region=None, window=None):
    """The context of operators that work in an area. To be left before the scenario waits: while
    a context is overridden, Blender's main loop looks into Python's dictionary of it without the
    interpreter's lock, which crashes when another thread runs Python (seen in 3.4)."""
    return bpy.context.temp_override(window=window or windows()[0], area=area,
                                     region=region or regions(area)[-1])


def bare(area):
    """Nothing drawn on the picture, no bars around it."""
    space = area.spaces.active
    space.show_gizmo = space.overlay.show_overlays = False
    for name in ("show_region_header", "show_region_tool_header", "show_region_toolbar",
                 "show_region_ui"):
        setattr(space, name, False)


def alone(size=SIZE):
    """Leaves one bare 3D view of this size in the window, above what is left of it. Gives its
    area."""
    screen = windows()[0].screen
    while len(screen.areas) > 1:
        with at(next(area for area in screen.areas if area != view_area())):
            bpy.ops.screen.area_close()
        yield 0.1
    area = view_area()
    bare(area)
    if area.height > size[1]:
        with at(area):
            bpy.ops.screen.area_split(direction='HORIZONTAL', factor=1 - size[1] / area.height)
        yield 0.1
        rest = min(screen.areas, key=lambda area: area.y)
        rest.type = 'CONSOLE'
        yield 0.2
    area = view_area()
    found = regions(area)[0]
    # Blender 5 has borders at the window's edges too.
    off = size[0] - found.width, size[1] - found.height
    assert off == (0, 0) or bpy.app.version >= (5, 0, 0) and max(map(abs, off)) <= 4, off
    return area


def shade(kind, area=None):
    (area or view_area()).spaces.active.shading.type = kind


def look_through_camera(area=None):
    (area or view_area()).spaces.active.region_3d.view_perspective = 'CAMERA'


# -- keys and mouse


def xdotool(*words):
    subprocess.run(["xdotool", *(str(word) for word in words)], check=True)


def place(region, x=0.5, y=0.5):
    """Pixels of the display, from the top left, of a place in a region given in fractions from
    the lower left."""
    return (round(region.x + x * (region.width - 1)),
            windows()[0].height - 1 - round(region.y + y * (region.height - 1)))


def point(region, x=0.5, y=0.5):
    """Moves the mouse to a place in a region."""
    xdotool("mousemove", *place(region, x, y))
    yield 0.15


def press(key):
    xdotool("key", KEYCODES.get(key, key))
    yield 0.15


def press_in(region, key):
    yield from point(region)
    yield from press(key)


def drag_pixels(start, end, button=1, moves=12):
    """Drags from one place of the display to another."""
    xdotool("mousemove", *start)
    yield 0.1
    xdotool("mousedown", button)
    yield 0.1
    for step in range(1, moves + 1):
        xdotool("mousemove", *(round(a + (b - a) * step / moves) for a, b in zip(start, end)))
        yield 0.03
    xdotool("mouseup", button)
    yield 0.15


def drag(region, start, end, button=1, moves=12):
    """Drags from one place of a region to another, given in fractions from the lower left."""
    yield from drag_pixels(place(region, *start), place(region, *end), button, moves)


class Orbit:
    """The middle button held while the mouse moves over a region in circles, 60 times a second,
    by a process of its own: Blender gets the moves as it finds time for them."""

    def __init__(self, region, seconds):
        x, y = place(region)
        words = ["mousemove", x, y, "mousedown", 2]
        steps = itertools.cycle([(4, 1)] * 30 + [(-4, 1)] * 30 + [(-4, -1)] * 30 + [(4, -1)] * 30)
        for step in itertools.islice(steps, round(60 * seconds)):
            words += ["mousemove_relative", "--", *step, "sleep", 1 / 60]
        self.process = subprocess.Popen(["xdotool", *map(str, words), "mouseup", "2"])

    def ended(self):
        status = self.process.poll()
        assert not status, f"xdotool ended with status {status}"
        return status is not None


# -- what to wait for


def views():
    return viewport.views()


def working_views():
    """All views; none may have failed."""
    assert not any(view.failed for view in views()), "a view failed; its corner says why"
    return views()


def pictured(count=1):
    """Until so many views show a picture."""
    def ready():
        return sum(view.picture is not None for view in working_views()) >= count
    return ready


def settled(count=1):
    """Until so many views, and all there are, show what they should; what was changed has first
    to be noticed, and the last picture to get to the display."""
    yield 0.3
    yield lambda: (len(working_views()) >= count
                   and all(view.settled for view in views()))
    yield 0.2


def rendered_views():
    """Until a view in the window's first 3D view shows what it should."""
    shade('RENDERED')
    yield from settled()


def heard(name, count=1):
    """Until a render handler was called so often."""
    return lambda: sum(event == name for event, _ in events) >= count


def count_of(name):
    return sum(event == name for event, _ in events)


def note(name):
    @bpy.app.handlers.persistent
    def handler(*_):
        events.append((name, time.perf_counter()))
    getattr(bpy.app.handlers, name).append(handler)


def stages():
    """The names of the scenes that are held for views."""
    return [name for name in session._stages if name.startswith("viewport ")]


def f12():
    """Renders by the key, to the end. A Blender whose last render was broken off quits with
    status 1."""
    yield 1.0  # a render that was just broken off may still be clearing up
    before = count_of("render_complete")
    yield from press_in(regions(view_area())[-1], "F12")
    yield heard("render_complete", before + 1)


def undo_step(name):
    bpy.ops.ed.undo_push(message=name)
