# SPDX-License-Identifier: GPL-3.0-or-later
"""Times one frame of a scene in Brume, EEVEE and Cycles, in turn, in one Blender process.

    scripts/blender -b --factory-startup -P bench/peers.py -- [--scene NAME] [--repeats N]
        [--engines BRUME BLENDER_EEVEE CYCLES] [--out FILE]

Each engine has its default settings, Cycles 64 samples without denoising. A frame is a whole
bpy.ops.render.render, which gets the scene and leaves the picture in Blender. The first frame of
each engine also compiles its shaders; it is kept as first_s and left out of the median. Brume
forgets the scene before each frame, so that it exports and runs every stage each time.

Prints one JSON line per engine and appends it to FILE (out/bench/peers.jsonl).
"""

import argparse
import json
import os
import statistics
import sys
import time

import bpy
from brume import native, session

sys.path.append(os.path.dirname(os.path.abspath(__file__)))
from place import ROOT, here

ENGINES = ('BRUME', 'BLENDER_EEVEE', 'CYCLES')
CYCLES_SAMPLES = 64
SIZE = 640, 360
MEMORY = ('medium_bytes', 'transport_bytes', 'shadow_bytes', 'mesh_bytes', 'image_bytes',
          'target_bytes', 'total_bytes', 'peak_bytes')

details = []  # of each Brume frame


def note_details():
    """Keeps the figures of the Brume frame that was rendered last."""
    stats, export_s, _ = session.last_stats
    details.append({
        'export_ms': export_s * 1e3,
        'stages_ms': {name: stats.stages[i].wall_ms for i, name in enumerate(native.STAGES)},
        'memory': {name: getattr(stats, name) for name in MEMORY},
        'medium_dims': list(stats.medium_dims), 'transport_dims': list(stats.transport_dims)})


def open_scene(name, engine):
    bpy.ops.wm.open_mainfile(filepath=os.path.join(ROOT, 'blend_scenes', name + '.blend'),
                             load_ui=False)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.engine = engine
    scene.cycles.samples = CYCLES_SAMPLES
    return scene


def frame(name, engine):
    """(wall, processor) seconds that one frame takes; opening the file is not among them.

    Processor seconds count all threads: they say the same on a busy machine.
    """
    open_scene(name, engine)
    if engine == 'BRUME':
        session.drop('final')
    wall, cpu = time.perf_counter(), time.process_time()
    bpy.ops.render.render()
    spent = time.perf_counter() - wall, time.process_time() - cpu
    if engine == 'BRUME':
        note_details()
    return spent


def samples_of(engine):
    scene = bpy.context.scene
    return {'BRUME': lambda: scene.brume.samples, 'CYCLES': lambda: scene.cycles.samples,
            'BLENDER_EEVEE': lambda: scene.eevee.taa_render_samples}[engine]()


def place():
    """Where and with what: the same for all lines of a run."""
    info = session.device().describe()
    return {**here(), 'blender': bpy.app.version_string,
            'device': info.renderer.decode(), 'driver': info.version.decode()}


def median_of(items, key):
    return {name: statistics.median(item[key][name] for item in items) for name in items[0][key]}


def line(where, scene, engine, samples, times):
    first, *frames = (wall for wall, _ in times)
    cpu = statistics.median(seconds for _, seconds in times[1:])
    entry = {**where, 'scene': scene, 'resolution': list(SIZE), 'engine': engine,
             'samples': samples, 'repeats': len(frames), 'first_s': first,
             'median_s': statistics.median(frames), 'spread_s': max(frames) - min(frames),
             'cpu_s': cpu}
    if engine == 'BRUME':
        warm = details[1:]
        entry['export_ms'] = statistics.median(item['export_ms'] for item in warm)
        entry['stages_ms'] = median_of(warm, 'stages_ms')
        entry.update({key: warm[-1][key] for key in ('memory', 'medium_dims', 'transport_dims')})
    return entry


def rounded(value):
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return round(value, 4) if isinstance(value, float) else value


def main(arguments):
    parser = argparse.ArgumentParser(prog='peers.py')
    parser.add_argument('--scene', default='plume')
    parser.add_argument('--repeats', type=int, default=5)
    parser.add_argument('--engines', nargs='+', choices=ENGINES, default=ENGINES)
    parser.add_argument('--out', default=os.path.join(ROOT, 'out', 'bench', 'peers.jsonl'))
    options = parser.parse_args(arguments)

    where = place()
    times = {engine: [] for engine in options.engines}
    samples = {}
    for _ in range(1 + max(options.repeats, 1)):
        for engine in options.engines:
            times[engine].append(frame(options.scene, engine))
            samples[engine] = samples_of(engine)
    os.makedirs(os.path.dirname(os.path.abspath(options.out)), exist_ok=True)
    with open(options.out, 'a', encoding='utf-8') as file:
        for engine in options.engines:
            text = json.dumps(rounded(line(where, options.scene, engine, samples[engine],
                                           times[engine])))
            print(text, flush=True)
            file.write(text + '\n')


main(sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else [])
