# SPDX-License-Identifier: GPL-3.0-or-later
"""What DOM's iterations cost: beside the same in plain C, and against cells, directions and
iterations; and what memory a cell takes. Appends a JSON line to out/bench/dom.jsonl:

    python3 bench/dom.py

A cube of a medium that glows; times by the GL's timer. All configurations take turns, times are
medians. Builds bench_dom_sweep first, whose C is compiled for this processor.
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from opv import matrix, native
from place import ROOT, here, keep

BUILD = os.path.join(ROOT, 'build')
BESIDE = ((16, 48), (32, 26), (32, 48), (32, 96), (64, 48))  # cells, directions
CELLS = (16, 24, 32, 48, 64)
ORDINATES = (26, 48, 96)
ITERATIONS = (4, 8, 16)
USUAL = {'cells': 32, 'ordinates': 48, 'iterations': 4}
SERIES = {'cells': CELLS, 'ordinates': ORDINATES, 'iterations': ITERATIONS}
AT_PEAK = ((32, 48), (32, 96), (64, 48))


# --- Beside plain C


def middle(rounds):
    return {key: statistics.median(found[key] for found in rounds) for key in rounds[0]}


def beside(cells, ordinates, iterations, rounds):
    done = subprocess.run(
        [os.path.join(BUILD, 'bench', 'bench_dom_sweep'),
         *map(str, (cells, ordinates, iterations, rounds))],
        check=True, stdout=subprocess.PIPE, text=True)
    found = json.loads(done.stdout)
    found.update(middle(found.pop('rounds')[1:]))  # the first compiles
    found['plain_ms'] = sum(found[f'{part}_ms'] for part in ('source', 'sweep', 'gather'))
    return found


# --- Against cells, directions, iterations


class Cube:
    """A cube of 1 m of a medium that glows."""

    def __init__(self, device):
        self.scene, self.number = native.Scene(device), 0
        self.corners = np.array([(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5)
                                 for x in (-0.5, 0.5)], np.float32)
        self.faces = np.array([(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
                               (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)],
                              np.uint32)

    def change(self):
        """The glow, by next to nothing: what did not change is not found anew."""
        self.number += 1
        values = ((4.0,) * 3, (0.5,) * 3, (1.0 + 1e-5 * self.number,) * 3, (0.5,) * 3)
        program = SimpleNamespace(
            instructions=[(native.OP['CONSTANT'], i, 0, 0, 0, value)
                          for i, value in enumerate(values)],
            ramps=np.zeros((0, native.RAMP_SIZE, 3), np.float32), sigma_s=0, sigma_a=1, emission=2,
            g=3)
        self.scene.set_volume(1, name='glow', program=program, world_from_object=np.eye(4),
                              positions=self.corners, triangles=self.faces)

    def render(self, cells, ordinates, iterations):
        self.change()
        settings = native.Settings(
            method=native.METHODS['DOM'], medium_resolution=64, lattice_resolution=16,
            field_resolution=cells, ordinates=ordinates, iterations=iterations, light_samples=1,
            shadow_resolution=16, world_samples=1)
        far, near = 10.0, 0.1
        clip = np.diag([1.0, 1.0, -2.0 / (far - near), 1.0])
        clip[2, 3] = -(far + near) / (far - near)
        view_from_world = np.eye(4)
        view_from_world[2, 3] = -4.0
        job = self.scene.render(settings, native.View(
            width=16, height=16, view_from_world=matrix(view_from_world),
            clip_from_view=matrix(clip), clip_near=near, clip_far=far, samples=1))
        job.check(job.wait(-1))
        stats = job.stats()
        job.close()
        return stats


def line_off(sizes, times):
    """How far each time is from the line of least relative squares, in shares of it."""
    x, t = np.array(sizes, float), np.array(times)
    line = np.linalg.lstsq(np.stack([1 / t, x / t], axis=1), np.ones_like(t), rcond=None)[0]
    return [float(value) for value in t / (line[0] + line[1] * x) - 1.0]


def costs(cube, repeats):
    """Of each series: milliseconds of all iterations."""
    kinds = [(name, value) for name, values in SERIES.items() for value in values]
    times = {kind: [] for kind in kinds}
    for number in range(repeats + 1):
        for name, value in kinds:
            stats = cube.render(**{**USUAL, name: value})
            if number:  # the first compiles
                times[name, value].append(stats.field_ms[native.FIELD_PARTS.index('iterations')])
    found = {}
    for name, values in SERIES.items():
        ms = [statistics.median(times[name, value]) for value in values]
        work = [np.prod([float(size ** 3 if key == 'cells' else size)
                         for key, size in {**USUAL, name: value}.items()]) for value in values]
        found[name] = [{'value': value, 'ms': time, 'ns': time * 1e6 / float(amount), 'off': off}
                       for value, time, amount, off in zip(values, ms, work, line_off(work, ms))]
    return found


# --- Memory


def memory(device):
    """Bytes of transport and cell, in the end and at most; the rest is the same at both times."""
    found = []
    for cells, ordinates in AT_PEAK:
        cube = Cube(device)
        stats = cube.render(cells, ordinates, 1)
        cube.scene.close()
        count = cells ** 3
        found.append({'cells': cells, 'ordinates': ordinates,
                      'kept': stats.transport_bytes / count,
                      'most': (stats.peak_bytes - stats.total_bytes + stats.transport_bytes)
                      / count})
    return found


def main():
    parser = argparse.ArgumentParser(prog='dom.py')
    parser.add_argument('--repeats', type=int, default=5)
    parser.add_argument('--only', choices=('beside', 'costs', 'memory'), nargs='+',
                        default=['beside', 'costs', 'memory'])
    options = parser.parse_args()
    subprocess.run(['cmake', '--build', BUILD, '--target', 'bench_dom_sweep'], check=True,
                   stdout=subprocess.DEVNULL)
    device = native.Device()
    line = {'bench': 'dom', **here(), 'device': device.describe().renderer.decode(),
            'repeats': options.repeats, 'usual': USUAL}
    if 'memory' in options.only:
        line['memory'] = memory(device)
    if 'costs' in options.only:
        line['costs'] = costs(Cube(device), options.repeats)
    if 'beside' in options.only:
        line['beside'] = [beside(cells, ordinates, 4, options.repeats + 1)
                          for cells, ordinates in BESIDE]
    keep(line)


if __name__ == '__main__':
    main()
