# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 1 of the paper on light propagation volumes with scattering on this machine: what each part
takes in lattices of 32^3 and 64^3 cells, and the march at full and half resolution. Appends a JSON
line to out/bench/lpv_parts.jsonl:

    python3 bench/lpv_parts.py

The box of bench/opv.py: 16 Gaussians between a floor and two walls, two moving lamps. Medians of
frames, by the GL's timer.
"""
import argparse
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from opv import Box, native, view
from place import here, keep

SIZES = (32, 64)
ITERATIONS = 8
MARCH = native.STAGES.index('march')


def medians(frames):
    return [float(value) for value in np.median(frames, axis=0)]


def render(box, cells, blockers, half_march=False):
    settings = native.Settings(
        method=native.METHODS['LPV'], medium_resolution=64, lattice_resolution=64,
        field_resolution=cells, iterations=ITERATIONS, blockers=native.BLOCKERS[blockers],
        light_samples=1, shadow_resolution=64, world_samples=1)
    look = view()
    look.half_march = half_march
    job = box.scene.render(settings, look)
    job.check(job.wait(-1))
    stats = job.stats()
    job.close()
    return stats


def parts(box, cells, blockers, repeats):
    frames = []
    for number in range(repeats + 1):
        box.move_lights(2)
        stats = render(box, cells, blockers)
        if number:  # the first compiles
            frames.append(list(stats.field_ms))
    return dict(zip(native.FIELD_PARTS, medians(frames)))


def marches(box, repeats):
    frames = [[render(box, 32, 'LINKS', half).stages[MARCH].gpu_ms for half in (False, True)]
              for _ in range(repeats + 1)]
    return dict(zip(('full', 'half'), medians(frames[1:])))


def main():
    parser = argparse.ArgumentParser(prog='lpv_parts.py')
    parser.add_argument('--repeats', type=int, default=7)
    options = parser.parse_args()
    device = native.Device()
    box = Box(device, 16)
    line = {'bench': 'lpv_parts', **here(), 'device': device.describe().renderer.decode(),
            'iterations': ITERATIONS, 'repeats': options.repeats,
            'parts': {blockers: {size: parts(box, size, blockers, options.repeats)
                                 for size in SIZES} for blockers in native.BLOCKERS},
            'march': marches(box, options.repeats)}
    box.close()
    keep(line)


if __name__ == '__main__':
    main()
