# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows a flaw of Blender around engines in Python (docs/blenders.md): previews of materials
that begin while panels are drawn leave Python unable to write. In a window, with an empty scene:

    xvfb-run -s "-screen 0 1280x960x24" scripts/blender --factory-startup -p 0 0 1280 960 \
        -P bench/readonly.py -- BRUME 0.0001

The engine, and the seconds after which Python's threads take turns; Python's own are 0.005. Says
after how many previews it happened, and quits with 1; or that it did not, with 0.
"""

import os
import sys

import bpy

PREVIEWS = 40
engine, interval_s = sys.argv[-2], float(sys.argv[-1])
previews = ticks = 0


def told(sentence, status):
    print(f"{engine}, turns of {interval_s} s: {sentence}", flush=True)
    os._exit(status)  # no operator quits Blender in that state


def tick():
    global previews, ticks
    try:
        bpy.context.scene.render.engine = engine
    except AttributeError:
        told(f"read-only after {previews} previews", 1)
    if previews == PREVIEWS:
        told(f"never in {previews} previews", 0)
    ticks += 1
    if ticks % 4 == 0:
        material = bpy.data.materials.new("Preview")
        material.use_nodes = True
        material.asset_generate_preview()
        previews += 1
    for area in bpy.context.window_manager.windows[0].screen.areas:
        area.tag_redraw()
    return 0.05


sys.setswitchinterval(interval_s)
bpy.app.timers.register(tick, first_interval=1.0)
