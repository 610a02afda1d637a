# SPDX-License-Identifier: GPL-3.0-or-later
"""Run inside Blender: renders one half of each pair, the cases named, with the engine asked for.

blender -b -P render_pair.py -- --engine CYCLES --seed 0 --out FOLDER CASE...

--preset FINAL has Brume's settings changed at once before the case's; --without-media leaves fog
and smoke out and takes few samples. It writes FOLDER/CASE.npz: float32 (height, width, channels) by
pass, linear, first row at the bottom. It goes the way that users go: bpy.ops.render.render to a
multi-layer EXR, which is read back.
"""
import argparse
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import blenders
import openexr
from cases import CASES

# Channels of a pass in the file, and the switch of the view layer that asks for it.
PASSES = {'Combined': ('RGBA', 'use_pass_combined'), 'Depth': ('Z', 'use_pass_z'),
          'Normal': ('XYZ', 'use_pass_normal'), 'Emit': ('RGB', 'use_pass_emit'),
          'Env': ('RGB', 'use_pass_environment'), 'IndexOB': ('X', 'use_pass_object_index')}


def set_up(scene, case):
    """The case's lamps and size."""
    for thing in scene.objects:
        if thing.type == 'LIGHT' and case.lamps:
            thing.hide_render = thing.name not in case.lamps
    missing = [name for name in case.lamps if name not in scene.objects]
    if missing:
        raise KeyError(f'{case.scene}.blend has no lamp {missing[0]}')
    for layer in scene.view_layers:
        layer.use_pass_z = False
        for name in case.passes:
            setattr(layer, PASSES[name][1], True)
    scene.camera.data.lens *= case.zoom
    render = scene.render
    render.resolution_x = render.resolution_y = case.size
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_border = render.use_compositing = render.use_sequencer = False
    blenders.multilayer(render.image_settings)
    render.image_settings.exr_codec = 'ZIP'
    stand_as_before_5(scene)
    case.apply(scene)


def stand_as_before_5(scene):
    """The references' Blender shows voxels half a voxel further along each axis."""
    if bpy.app.version < (5, 0, 0):
        return
    for thing in scene.objects:
        if thing.type == 'VOLUME' and thing.data.grids.load():
            object_from_index = thing.data.grids[0].matrix_object
            half = object_from_index.to_3x3() @ Vector((0.5, 0.5, 0.5))
            thing.matrix_world = thing.matrix_world @ Matrix.Translation(half)


def _input(tree, name):
    """The socket of that name of the output that renders, or None."""
    output = tree.get_output_node('ALL') or tree.get_output_node('CYCLES') if tree else None
    return output.inputs[name] if output else None


def leave_media_out(scene):
    """Objects of volumes alone go; of others, and of the world, the volume does."""
    for thing in scene.objects:
        trees = [slot.material.node_tree for slot in thing.material_slots if slot.material]
        media = [tree for tree in trees if (socket := _input(tree, 'Volume')) and socket.is_linked]
        if media and not any(_input(tree, 'Surface').is_linked for tree in media):
            thing.hide_render = True
    for tree in [block.node_tree for block in (*bpy.data.materials, scene.world)]:
        socket = _input(tree, 'Volume')
        if socket and socket.is_linked:
            tree.links.remove(socket.links[0])


def set_up_cycles(scene, case, seed):
    cycles = scene.cycles
    cycles.device, cycles.seed = 'CPU', seed
    cycles.samples = case.cycles_samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    # No bounce beyond the first scattering, unless the method has them.
    bounces = 0 if case.method == 'OPV' else case.bounces
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    cycles.transmission_bounces = cycles.volume_bounces = bounces
    cycles.transparent_max_bounces = 256
    cycles.volume_step_rate, cycles.volume_max_steps = case.step_rate, 65536
    cycles.filter_width = scene.render.filter_size
    for layer in scene.view_layers:
        layer.use_pass_object_index = bool(case.groups)


def render(scene, engine, path):
    """Pass name -> pixels."""
    scene.render.engine = engine
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    channels = openexr.read(Path(path))
    os.remove(path)
    passes = {}
    for name, (letters, _) in PASSES.items():
        found = [value for letter in letters for channel, value in channels.items()
                 if channel.endswith(f'.{name}.{letter}')]
        if found:
            passes[name] = np.flipud(np.stack(found, axis=-1))
    return passes


def main(arguments):
    parser = argparse.ArgumentParser(prog='render_pair.py')
    parser.add_argument('--engine', required=True)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--out', required=True)
    parser.add_argument('--preset')
    parser.add_argument('--without-media', action='store_true')
    parser.add_argument('cases', nargs='+', choices=CASES)
    options = parser.parse_args(arguments)
    for name in options.cases:
        case = CASES[name]
        bpy.ops.wm.open_mainfile(filepath=case.blend(options.engine), load_ui=False)
        scene = bpy.context.scene
        set_up(scene, case)
        if options.engine == 'CYCLES':
            set_up_cycles(scene, case, options.seed)
            if options.without_media:
                leave_media_out(scene)
                scene.cycles.samples = min(case.cycles_samples, 128)
        elif options.engine == 'BRUME':
            if options.preset:
                scene.brume.preset = options.preset
            scene.brume.samples = case.samples
            scene.brume.method = case.method
            if case.world_samples:
                scene.brume.world_samples = case.world_samples
        passes = render(scene, options.engine, os.path.join(options.out, name + '.exr'))
        np.savez(os.path.join(options.out, name + '.npz'), **passes)


main(sys.argv[sys.argv.index('--') + 1:])
