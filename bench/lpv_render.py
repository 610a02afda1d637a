# SPDX-License-Identifier: GPL-3.0-or-later
"""Run inside Blender by bench/lpv.py: renders a scene as a list of jobs says.

blender -b -P lpv_render.py -- '{"scene": NAME, "size": PIXELS, "zoom": FACTOR, "jobs": [...]}'

Each job has "engine", "settings", which are set of scene.cycles or scene.brume, perhaps the name of
a "camera", and "out", an .npy of float32 (height, width, 3), linear, first row at the bottom.
"""
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from place import ROOT

sys.path.insert(0, os.path.join(ROOT, 'tests'))
import openexr


def set_up(scene, engine, settings):
    scene.render.engine = engine
    if engine == 'CYCLES':
        scene.cycles.device = 'CPU'
        scene.cycles.filter_width = scene.render.filter_size
    else:
        scene.brume.preset = 'PREVIEW'  # which sets others
    for name, value in settings.items():
        setattr(scene.cycles if engine == 'CYCLES' else scene.brume, name, value)


def main(work):
    bpy.ops.wm.open_mainfile(load_ui=False, filepath=os.path.join(
        ROOT, 'blend_scenes', f'{work["scene"]}.blend'))
    scene, render = bpy.context.scene, bpy.context.scene.render
    scene.camera.data.lens *= work['zoom']
    render.resolution_x = render.resolution_y = work['size']
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_border = render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format, render.image_settings.color_depth = 'OPEN_EXR', '32'
    render.image_settings.color_mode = 'RGB'
    with tempfile.TemporaryDirectory() as folder:
        render.filepath = os.path.join(folder, 'picture.exr')
        for job in work['jobs']:
            if 'camera' in job:
                scene.camera = bpy.data.objects[job['camera']]
            set_up(scene, job['engine'], job['settings'])
            started = time.monotonic()
            bpy.ops.render.render(write_still=True)
            channels = openexr.read(Path(render.filepath))
            np.save(job['out'], np.flipud(np.stack([channels[name] for name in 'RGB'], axis=-1)))
            print(f'rendered {job["out"]} in {time.monotonic() - started:.1f} s', flush=True)


main(json.loads(sys.argv[sys.argv.index('--') + 1]))
