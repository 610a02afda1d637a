#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the user guide's pictures: scenes rendered by Brume, and its panels in Blender's window.

    docs/images/make.py [NAME]...    all, or some: room cloud cumulus fog_lights fog_sixteen panels
                                     viewport lpv_paths lpv_hard

Needs what scripts/setup installs, and a built library; a virtual display is its own. lpv_paths sets
side by side what `bench/lpv.py --scenes room` left in out/bench/lpv; lpv_hard takes some minutes,
for Cycles.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "pictures"))
import compare
import cycles
import lpv

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
SCENES = ("room", "cloud", "cumulus", "fog_lights", "fog_sixteen")
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
# Plays steps(), which yields while Blender is to go on, in its window.
WINDOW = """
import bpy, subprocess
bpy.context.preferences.view.show_splash = False
bpy.context.scene.render.engine = 'BRUME'
window = bpy.context.window_manager.windows[0]
view = next(area for area in window.screen.areas if area.type == 'VIEW_3D')

def shoot(x, y, width, height):
    top = window.height - y - height
    subprocess.run(["import", "-window", "root", "-crop", f"{width}x{height}+{x}+{top}",
                    "+repage", "-depth", "8", "FILE"], check=True)

STEPS

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
# Two columns of properties in the place of the 3D view, each with one tab.
PANELS = """
def steps():
    bpy.context.view_layer.objects.active = bpy.data.objects["Area"]
    before = set(window.screen.areas)
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
    shoot(left.x, left.y, right.x + right.width - left.x, left.height)
"""
# The rendered view with its statistics, while the lamp is selected.
VIEWPORT = """
def steps():
    from brume import viewport
    scene, space = bpy.context.scene, view.spaces.active
    scene.brume.show_statistics = True
    for ob in bpy.context.view_layer.objects:
        ob.select_set(ob.name == "Area")
    bpy.context.view_layer.objects.active = bpy.data.objects["Area"]
    looked = scene.camera.matrix_world
    space.region_3d.view_perspective = 'PERSP'
    scene.camera.hide_set(True)  # it would stand in the way
    space.region_3d.view_rotation = looked.to_quaternion()
    space.region_3d.view_location = bpy.data.objects["Smoke"].matrix_world.translation
    space.region_3d.view_distance = 0.75 * looked.translation.length
    space.shading.type = 'RENDERED'
    yield
    while not (viewport.views() and viewport.views()[0].settled):
        yield
    yield
    shoot(view.x, view.y, view.width, view.height)
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


def window(name, steps, width, height):
    blender("-p", "0", "0", str(width), str(height), ROOT / "blend_scenes" / "plume.blend",
            "--python-expr",
            WINDOW.replace("STEPS", steps).replace("FILE", str(HERE / f"{name}.png")),
            display=f"{width}x{height}")


def sheet(name, pictures, across, exposures):
    """Linear pictures, so many in a row, each times its exposure."""
    side, gap = pictures[0].shape[0], 8
    down = -(-len(pictures) // across)
    page = np.ones((down * (side + gap) - gap, across * (side + gap) - gap, 3))
    for number, (picture, exposure) in enumerate(zip(pictures, exposures)):
        row, column = divmod(number, across)
        y, x = (down - 1 - row) * (side + gap), column * (side + gap)  # the first row is the lowest
        page[y:y + side, x:x + side] = compare.srgb(picture * exposure)
    compare.write_png(HERE / f"{name}.png", page)


def exposure_of(picture):
    return 0.8 / np.percentile(picture, 97)


def lpv_paths(name):
    """The room's light in parts, in the order of bench/lpv.py, and last Cycles: four in a row."""
    files = [Path(lpv.OUT) / "lpv" / f"room-{kind}.npy" for kind in (*lpv.PATHS, "CYCLES")]
    missing = [file for file in files if not file.exists()]
    if missing:
        sys.exit(f"make.py: {missing[0]} is not there: run bench/lpv.py --scenes room")
    pictures = [np.load(file) for file in files]
    sheet(name, pictures, 4, [exposure_of(pictures[-1])] * len(pictures))


def lpv_hard(name):
    """Figure 6 of LPV's paper: the dark side of a thin board, exact, fuzzy and Cycles; its lit
    side, whole, with one iteration, and Cycles."""
    jobs = []
    for camera, brume in (("Camera", ({"blockers": 'LINKS'}, {"blockers": 'FUZZY'})),
                          ("Lit side", ({"iterations": 0}, {"iterations": 1}))):
        jobs += [{"camera": camera, "engine": 'BRUME',
                  "settings": {"method": 'LPV', "blockers": 'LINKS', "iterations": 0, **settings}}
                 for settings in brume]
        jobs.append({"camera": camera, "engine": 'CYCLES',
                     "settings": {**cycles.CYCLES, "samples": 384}})
    pictures, _ = cycles.run(cycles.Case("partition", 0, lpv.SIZE), jobs)
    dark, lit = exposure_of(pictures[1]), exposure_of(pictures[3])
    sheet(name, pictures, 3, [dark] * 3 + [lit] * 3)


SHEETS = {"lpv_paths": lpv_paths, "lpv_hard": lpv_hard}
WINDOWS = {"panels": (PANELS, 820, 560), "viewport": (VIEWPORT, 1100, 720)}

for wanted in sys.argv[1:] or (*SCENES, *WINDOWS, *SHEETS):
    if wanted in WINDOWS:
        window(wanted, *WINDOWS[wanted])
    elif wanted in SCENES:
        scene(wanted)
    elif wanted in SHEETS:
        SHEETS[wanted](wanted)
    else:
        sys.exit(f"make.py: there is no picture {wanted}")
    # Blender stamps the file's path into a picture.
    subprocess.run(["mogrify", "-strip", HERE / f"{wanted}.png"], check=True)
    print(HERE / f"{wanted}.png")
