# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays scenarios one after another inside a Blender with a window, writes down how each ended,
and quits as a user does. Started by launch.py:

    blender --python play.py -- THEME RESULTS.jsonl NAME...
"""

import faulthandler
import importlib
import json
import os
import sys
import time
import traceback
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import blenders  # noqa: E402
import drive  # noqa: E402
import launch  # noqa: E402

TICK_S = 0.03
PATIENCE_S = 150.0


def prepare(scene_name):
    """A scenario's scene in the window it was saved with, the factory's."""
    if scene_name == "plume" and "fluid" in blenders.unable(bpy.app.version, sys.version_info):
        scene_name = "plume_vdb"
    bpy.ops.wm.open_mainfile(load_ui=True, filepath=str(
        HERE.parents[1] / "blend_scenes" / f"{scene_name}.blend"))
    yield 0.2
    view = bpy.context.preferences.view
    view.show_splash, view.render_display_type, view.ui_scale = False, 'NONE', 1.0
    bpy.context.preferences.use_preferences_save = False
    bpy.context.preferences.filepaths.use_auto_save_temporary_files = False  # would take its time
    scene = bpy.context.scene
    scene.render.engine = 'BRUME'
    scene.view_settings.view_transform = 'Standard'
    scene.render.dither_intensity = 0.0  # brightens what is black
    scene.render.resolution_percentage = 100
    scene.render.resolution_x, scene.render.resolution_y = 480, 270
    scene.brume.preset = 'DRAFT'
    scene.brume.samples = scene.brume.viewport_samples = drive.SAMPLES
    scene.brume.world_samples = drive.WORLD_SAMPLES
    drive.events.clear()
    yield 0.1


def show(theme, results, names):
    """Generates what all of the scenarios wait for."""
    importlib.import_module(theme)
    for name in names:
        entry = {"name": name, "error": None, "values": None}
        began = time.perf_counter()
        try:
            function, scene = drive.scenarios[name]
            yield from prepare(scene)
            entry["values"] = yield from function()
        except Exception:
            entry["error"] = traceback.format_exc()
            if launch.is_read_only(entry["error"]):
                leave(launch.FROZEN)
        entry["seconds"] = round(time.perf_counter() - began, 2)
        with open(results, "a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")
    try:
        bpy.ops.wm.quit_blender()
    except Exception:
        said = traceback.format_exc()
        if launch.is_read_only(said):  # no fault of ours: it is played again, and not told
            leave(launch.FROZEN)
        print(said, flush=True)
        leave(1)


def leave(status):
    """Ends Blender without its doing: nothing else would, once Python may not write."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


class Player:
    """Advances the show from a timer."""

    def __init__(self, show):
        self.show, self.wait, self.since = show, 0.0, 0.0

    def tick(self):
        """Gives the seconds until it wants to be called again. While a scenario waits for a time,
        nothing is done that could keep Blender from its rest."""
        try:
            self.wait = self.advance()
        except StopIteration:
            return None
        return TICK_S if callable(self.wait) else self.wait

    def advance(self):
        if callable(self.wait):
            try:
                if not self.wait():
                    if time.perf_counter() < self.since + PATIENCE_S:
                        return self.wait
                    raise TimeoutError(f"waited for {PATIENCE_S} s")
            except Exception as error:
                wait = self.show.throw(error)
            else:
                wait = next(self.show)
        else:
            wait = next(self.show)
        self.since = time.perf_counter()
        return wait


for handler in ("render_pre", "render_complete", "render_cancel"):
    drive.note(handler)
faulthandler.dump_traceback_later(launch.TIMEOUT_S - 10)
# Blender notes for the whole process that Python may not write while it draws a panel, and a render
# that begins in its thread meanwhile makes that stay: no timer could go on (docs/blenders.md). So
# threads take turns only where one waits, or after longer than a drawing takes. Where it happens
# all the same, this Blender is given up, and launch.py goes on in another.
sys.setswitchinterval(1.0)
theme, results, *names = sys.argv[sys.argv.index("--") + 1:]
bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(Player(show(theme, results, names)).tick, first_interval=1.0,
                        persistent=True)
