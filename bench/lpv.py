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
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import cycles
from cycles import Case
from opv import native
from place import ROOT, here, keep

sys.path.insert(0, os.path.join(ROOT, 'tests', 'pictures'))
import compare

OUT = os.path.join(ROOT, 'out', 'bench')
PATHS = ('DIRECT', 'REFLECTED', 'SINGLE', 'REFLECTED_MARCHED', 'SUM', 'ALL')
CELLS = 32
FINER = 64  # of ALL alone, as are cascades
SIZE = 256
NOISE = 0.01

CASES = {case.scene: case for case in (
    Case('cube', 128, SIZE, zoom=1.4), Case('room', 192, SIZE), Case('arcade', 192, SIZE))}


def reference(case, most):
    """(Cycles' picture, its noise): the mean of two halves of as many seeds as it takes, or of the
    most that are wanted. Two halves differ by twice the error of their mean."""
    pairs = 1
    while True:
        pairs, halves = cycles.halves(case, pairs)
        noise = compare.difference(*halves)[0] / 2
        if noise < NOISE or pairs >= most:
            return (halves[0] + halves[1]) / 2, noise
        pairs += 1


def brume(case, kinds):
    """Pictures of (light paths, cells, cascades)."""
    return cycles.run(case, [{'engine': 'BRUME', 'settings': {
        'method': 'LPV', 'iterations': 0, 'light_paths': paths, 'field_resolution': cells,
        'cascades': cascades, 'cascade_focus': 'CAMERA'}}
        for paths, cells, cascades in kinds])[0]


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
