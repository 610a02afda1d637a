# SPDX-License-Identifier: GPL-3.0-or-later
"""Run inside Blender: renders one half of each pair, the cases named, with the engine asked for.

blender -b -P render_pair.py -- --engine CYCLES --seed 0 --out FOLDER CASE...

writes FOLDER/CASE.npy, float32 (height, width, 3), linear, first row at the bottom. It goes the
way that users go: bpy.ops.render.render to a float EXR, which is read back.
"""
import argparse
import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from cases import CASES


def set_up(scene, case):
    """The case's lamps, size and light paths: no bounce beyond the first scattering."""
    for thing in scene.objects:
        if thing.type == 'LIGHT' and case.lamps:
            thing.hide_render = thing.name not in case.lamps
    missing = [name for name in case.lamps if name not in scene.objects]
    if missing:
        raise KeyError(f'{case.scene}.blend has no lamp {missing[0]}')
    scene.camera.data.lens *= case.zoom
    render = scene.render
    render.resolution_x = render.resolution_y = case.size
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_border = render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format = 'OPEN_EXR'
    render.image_settings.color_mode = 'RGBA'
    render.image_settings.color_depth = '32'


def set_up_cycles(scene, case, seed):
    cycles = scene.cycles
    cycles.device, cycles.seed = 'CPU', seed
    cycles.samples = case.cycles_samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
    cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.transparent_max_bounces = 256
    cycles.volume_step_rate, cycles.volume_max_steps = case.step_rate, 65536


def render(scene, engine, path):
    scene.render.engine = engine
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    os.remove(path)
    return pixels.reshape(height, width, 4)[..., :3]


def main(arguments):
    parser = argparse.ArgumentParser(prog='render_pair.py')
    parser.add_argument('--engine', required=True)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--out', required=True)
    parser.add_argument('cases', nargs='+', choices=CASES)
    options = parser.parse_args(arguments)
    for name in options.cases:
        case = CASES[name]
        bpy.ops.wm.open_mainfile(filepath=case.blend, load_ui=False)
        scene = bpy.context.scene
        set_up(scene, case)
        if options.engine == 'CYCLES':
            set_up_cycles(scene, case, options.seed)
        elif options.engine == 'BRUME':
            scene.brume.samples = case.samples
        picture = render(scene, options.engine, os.path.join(options.out, name + '.exr'))
        np.save(os.path.join(options.out, name + '.npy'), picture)


main(sys.argv[sys.argv.index('--') + 1:])
