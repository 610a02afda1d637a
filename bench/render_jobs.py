# SPDX-License-Identifier: GPL-3.0-or-later
"""Run inside Blender by bench/cycles.py: renders a scene as a list of jobs says, and times each.

blender -b -P render_jobs.py -- '{"scene": NAME, "size": [WIDTH, HEIGHT], "zoom": FACTOR,
                                  "long_s": SECONDS, "report": FILE, "jobs": [...]}'

Each job has "engine"; "settings", which are set of scene.cycles, scene.eevee or scene.brume, in
that order; perhaps the name of a "camera"; and, where its picture is wanted, "out", an .npy of
float32 (height, width, 3), linear, first row at the bottom. A job with a "name" is left out when
the second of that name took longer than "long_s".

The file is opened anew for each, and Brume forgets the scene: a frame is a whole
bpy.ops.render.render, which exports and runs every stage. The report, JSON, has for each job what
it took, or null.
"""
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from brume import native, session

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from place import ROOT

sys.path.insert(0, os.path.join(ROOT, 'tests'))
import openexr

GROUPS = {'CYCLES': 'cycles', 'BLENDER_EEVEE': 'eevee', 'BRUME': 'brume'}


def open_scene(work):
    bpy.ops.wm.open_mainfile(load_ui=False, filepath=os.path.join(
        ROOT, 'blend_scenes', f'{work["scene"]}.blend'))
    scene, render = bpy.context.scene, bpy.context.scene.render
    scene.camera.data.lens *= work['zoom']
    render.resolution_x, render.resolution_y = work['size']
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_border = render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format, render.image_settings.color_depth = 'OPEN_EXR', '32'
    render.image_settings.color_mode = 'RGB'
    return scene


def set_up(scene, job):
    if 'camera' in job:
        scene.camera = bpy.data.objects[job['camera']]
    scene.render.engine = job['engine']
    scene.cycles.device = 'CPU'
    scene.cycles.filter_width = scene.render.filter_size
    scene.brume.preset = 'PREVIEW'  # which sets others
    for name, value in job['settings'].items():
        setattr(getattr(scene, GROUPS[job['engine']]), name, value)


def spent_in_brume():
    stats, export_s, _ = session.last_stats
    return {'export_ms': export_s * 1e3,
            'stages_ms': {name: stats.stages[i].wall_ms for i, name in enumerate(native.STAGES)},
            'field_ms': dict(zip(native.FIELD_PARTS, stats.field_ms)),
            'iterations': stats.iterations, 'peak_bytes': stats.peak_bytes}


def render(work, job, folder):
    """What the job took; processor seconds count all threads, which a busy machine changes less."""
    scene = open_scene(work)
    set_up(scene, job)
    session.drop('final')
    wall, cpu = time.perf_counter(), time.process_time()
    bpy.ops.render.render()
    took = {'wall_s': time.perf_counter() - wall, 'cpu_s': time.process_time() - cpu}
    if job['engine'] == 'BRUME':
        took.update(spent_in_brume())
    elif job['engine'] == 'BLENDER_EEVEE':
        took['samples'] = scene.eevee.taa_render_samples
    if 'out' in job:
        path = os.path.join(folder, 'picture.exr')
        bpy.data.images['Render Result'].save_render(path, scene=scene)
        channels = openexr.read(Path(path))
        np.save(job['out'], np.flipud(np.stack([channels[name] for name in 'RGB'], axis=-1)))
    return took


def main(work):
    report, named = [], {}
    with tempfile.TemporaryDirectory() as folder:
        for job in work['jobs']:
            walls = named.setdefault(job.get('name'), [])
            if 'name' in job and len(walls) > 1 and walls[1] > work['long_s']:
                report.append(None)
                continue
            report.append(render(work, job, folder))
            walls.append(report[-1]['wall_s'])
            told = job.get('name', f'{job["engine"]} {job["settings"].get("samples", "")}')
            print(f'rendered {told} in {walls[-1]:.1f} s', flush=True)
    with open(work['report'], 'w', encoding='utf-8') as file:
        json.dump(report, file)


main(json.loads(sys.argv[sys.argv.index('--') + 1]))
