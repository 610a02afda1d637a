# SPDX-License-Identifier: GPL-3.0-or-later
"""How far LPV's pictures, and the parts of their light, are from Cycles with all bounces: the
configurations of Figure 5 of the paper on light propagation volumes with scattering. Appends a JSON
line to out/bench/lpv.jsonl, and leaves the pictures in out/bench/lpv, as .npy and as PNGs, Brume |
Cycles | their difference:

    python3 bench/lpv.py [--scenes room arcade ...]

Errors are those of tests/pictures. Cycles renders pairs of seeds until its own noise is below 1 %;
its pictures are kept in build/references for as long as the scene and its settings stay the same.
"""
import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from opv import native
from place import ROOT, here, keep

sys.path.insert(0, os.path.join(ROOT, 'tests', 'pictures'))
import compare

HERE = os.path.dirname(os.path.abspath(__file__))
REFERENCES = os.path.join(ROOT, 'build', 'references')
OUT = os.path.join(ROOT, 'out', 'bench')
PATHS = ('DIRECT', 'REFLECTED', 'SINGLE', 'REFLECTED_MARCHED', 'SUM', 'ALL')
CELLS = 32
FINER = 64  # of ALL alone, as are cascades
SIZE = 256
NOISE = 0.01
# All light: as many bounces as matter, nothing clamped, nothing smoothed.
CYCLES = {'use_adaptive_sampling': False, 'use_denoising': False, 'light_sampling_threshold': 0.0,
          'sample_clamp_direct': 0.0, 'sample_clamp_indirect': 0.0, 'transparent_max_bounces': 256,
          **dict.fromkeys(('max_bounces', 'diffuse_bounces', 'glossy_bounces', 'volume_bounces',
                           'transmission_bounces'), 64)}


@dataclass(frozen=True)
class Case:
    scene: str
    samples: int        # Cycles', a seed
    zoom: float = 1.0   # multiplies the lens, so that the subject fills the square


CASES = {case.scene: case for case in (
    Case('cube', 128, zoom=1.4), Case('room', 192), Case('arcade', 192))}


def run(case, jobs):
    """The jobs' pictures, rendered by one Blender."""
    with tempfile.TemporaryDirectory() as folder:
        for number, job in enumerate(jobs):
            job['out'] = os.path.join(folder, f'{number}.npy')
        work = {'scene': case.scene, 'size': SIZE, 'zoom': case.zoom, 'jobs': jobs}
        done = subprocess.run(
            [os.path.join(ROOT, 'scripts', 'blender'), '-b', '--factory-startup',
             '--python-exit-code', '1', '-P', os.path.join(HERE, 'lpv_render.py'), '--',
             json.dumps(work)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode:
            sys.exit(f'{case.scene} was not rendered:\n{done.stdout[-3000:]}')
        return [np.load(job['out']) for job in jobs]


def digest(case):
    """Of all that Cycles' picture is made from, but for the number of seeds."""
    found = hashlib.sha256(repr((case.samples, case.zoom, SIZE, CYCLES)).encode())
    with open(os.path.join(ROOT, 'blend_scenes', f'{case.scene}.blend'), 'rb') as file:
        found.update(file.read())
    return found.hexdigest()[:16]


def reference(case, most):
    """(Cycles' picture, its noise): the mean of two halves of as many seeds as it takes, or of the
    most that are wanted. Two halves differ by twice the error of their mean."""
    path = os.path.join(REFERENCES, f'{case.scene}-{digest(case)}.npz')
    pairs, halves = 0, [0.0, 0.0]
    if os.path.exists(path):
        with np.load(path) as file:
            pairs, halves = int(file['pairs']), list(file['halves'])
    while True:
        if pairs:
            noise = compare.difference(*(half / pairs for half in halves))[0] / 2
            if noise < NOISE or pairs >= most:
                return (halves[0] + halves[1]) / (2 * pairs), noise
        both = run(case, [{'engine': 'CYCLES', 'settings': {
            **CYCLES, 'seed': 2 * pairs + i, 'samples': case.samples}} for i in (0, 1)])
        halves = [half + picture.astype(np.float64) for half, picture in zip(halves, both)]
        pairs += 1
        os.makedirs(REFERENCES, exist_ok=True)
        np.savez(path, pairs=pairs, halves=np.stack(halves))


def brume(case, kinds):
    """Pictures of (light paths, cells, cascades)."""
    return run(case, [{'engine': 'BRUME', 'settings': {
        'method': 'LPV', 'iterations': 0, 'light_paths': paths, 'field_resolution': cells,
        'cascades': cascades, 'cascade_focus': 'CAMERA'}}
        for paths, cells, cascades in kinds])


def measure(case, most):
    picture, noise = reference(case, most)
    print(f'{case.scene}: Cycles\' noise {noise:.4f}', file=sys.stderr)
    kinds = {**{paths: (paths, CELLS, 1) for paths in PATHS}, f'ALL_{FINER}': ('ALL', FINER, 1),
             'ALL_CASCADES': ('ALL', CELLS, 2)}
    errors = {}
    np.save(os.path.join(OUT, 'lpv', f'{case.scene}-CYCLES.npy'), picture.astype(np.float32))
    for name, found in zip(kinds, brume(case, kinds.values())):
        errors[name] = compare.difference(found, picture)[0]
        path = os.path.join(OUT, 'lpv', f'{case.scene}-{name}')
        np.save(path + '.npy', found)
        compare.side_by_side(path + '.png', found, picture)
        print(f'{case.scene}: {name} {errors[name]:.4f}', file=sys.stderr)
    return {'errors': errors, 'noise': noise}


def main():
    parser = argparse.ArgumentParser(prog='lpv.py')
    parser.add_argument('--scenes', nargs='+', choices=CASES, default=list(CASES))
    parser.add_argument('--pairs', type=int, default=16, help='of seeds, at most, for Cycles')
    parser.add_argument('--references', action='store_true', help='render what Cycles has to alone')
    options = parser.parse_args()
    os.makedirs(os.path.join(OUT, 'lpv'), exist_ok=True)
    if options.references:
        for name in options.scenes:
            print(f'{name}: Cycles\' noise {reference(CASES[name], options.pairs)[1]:.4f}')
        return
    line = {'bench': 'lpv', **here(), 'device': native.Device().describe().renderer.decode(),
            'resolution': [SIZE, SIZE], 'cells': CELLS, 'finer': FINER,
            'scenes': {name: measure(CASES[name], options.pairs) for name in options.scenes}}
    keep(line)


if __name__ == '__main__':
    main()
