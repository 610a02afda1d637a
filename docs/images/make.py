#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the user guide's pictures: scenes rendered by Brume, and its panels in Blender's window.

    docs/images/make.py [NAME]...      all, or some of: room cloud panels

Needs what scripts/setup installs, and a built library; a virtual display is its own.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
SCENES = ("room", "cloud")
SIZE = 640, 360
FINAL = f"""
import bpy
scene = bpy.context.scene
scene.brume.preset = 'FINAL'
scene.render.resolution_x, scene.render.resolution_y = {SIZE}
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = 'PNG'
scene.render.image_settings.color_mode = 'RGB'
"""
# Two columns of properties in the place of the 3D view, each with one tab.
PANELS = """
import bpy, subprocess
bpy.context.preferences.view.show_splash = False
window = bpy.context.window_manager.windows[0]
bpy.context.scene.render.engine = 'BRUME'
bpy.context.view_layer.objects.active = bpy.data.objects["Area"]
view = next(area for area in window.screen.areas if area.type == 'VIEW_3D')
before = set(window.screen.areas)

def steps():
    with bpy.context.temp_override(window=window, area=view):
        bpy.ops.screen.area_split(direction='VERTICAL', factor=0.5)
    pair = [view, *set(window.screen.areas) - before]
    for area in pair:
        area.type = 'PROPERTIES'
    yield
    left, right = sorted(pair, key=lambda area: area.x)
    left.spaces[0].context, right.spaces[0].context = 'RENDER', 'DATA'
    yield
    yield
    width, top = right.x + right.width - left.x, window.height - left.y - left.height
    subprocess.run(["import", "-window", "root", "-crop", f"{width}x{left.height}+{left.x}+{top}",
                    "+repage", "-depth", "8", "FILE"], check=True)

step = steps()

def tick():
    try:
        next(step)
        return 0.5
    except StopIteration:
        bpy.ops.wm.quit_blender()
    except BaseException:
        bpy.ops.wm.quit_blender()
        raise

bpy.app.timers.register(tick, first_interval=1.0)
"""


def blender(*arguments, display=None):
    command = [ROOT / "scripts" / "blender", "--factory-startup", *arguments]
    if display:
        command = ["xvfb-run", "-a", "-s", f"-ac -screen 0 {display}x24", *command]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(done.stdout)


def scene(name):
    with tempfile.TemporaryDirectory() as folder:
        blender("-b", ROOT / "blend_scenes" / f"{name}.blend", "-E", "BRUME", "--python-expr",
                FINAL, "-o", f"{folder}/####", "-f", "1")
        picture, = Path(folder).iterdir()
        (HERE / f"{name}.png").write_bytes(picture.read_bytes())


def panels():
    width, height = (str(side) for side in (820, 560))
    blender("-p", "0", "0", width, height, ROOT / "blend_scenes" / "plume.blend", "--python-expr",
            PANELS.replace("FILE", str(HERE / "panels.png")), display=f"{width}x{height}")


for wanted in sys.argv[1:] or (*SCENES, "panels"):
    if wanted == "panels":
        panels()
    elif wanted in SCENES:
        scene(wanted)
    else:
        sys.exit(f"make.py: there is no picture {wanted}")
    # Blender stamps the file's path into a picture.
    subprocess.run(["mogrify", "-strip", HERE / f"{wanted}.png"], check=True)
    print(HERE / f"{wanted}.png")
