# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' pictures of the cases, kept in tests/data/cycles/ so that the tests need not wait for it.

`pytest tests/pictures --refresh` renders them again (about ten minutes on two cores). Each file
holds the mean of two seeds in half floats (depth and object numbers: the first seed's), the
difference between the two, and a digest of what it was made from; with all bounces also the blocks
that the media change, found by a coarse picture without them.
"""
import glob
import hashlib
import inspect
import os
import subprocess
import tempfile

import changes
import numpy as np
from cases import REFERENCES, SCENES, Case
from compare import changed, difference

HERE = os.path.dirname(os.path.abspath(__file__))


def render(blender, engine, case, *options, seed=0, timeout=900):
    """The case's passes from a Blender process of its own. `blender`: the command, a list;
    `options`: more of render_pair.py's."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [*blender, '-b', '--python-exit-code', '1',
             '-P', os.path.join(HERE, 'render_pair.py'), '--', '--engine', engine,
             '--seed', str(seed), '--out', folder, *options, case.name],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=timeout)
        path = os.path.join(folder, case.name + '.npz')
        if done.returncode or not os.path.exists(path):
            tail = '\n'.join(done.stdout.splitlines()[-30:])
            raise RuntimeError(f'{engine} did not render {case.name} '
                               f'(exit status {done.returncode}):\n{tail}')
        with np.load(path) as file:
            return dict(file)


def digest(case):
    """Of the scene's files and the case's settings: a reference fits only what it was made from."""
    found = hashlib.sha256(repr((case.scene, case.lamps, case.size, case.zoom, case.step_rate,
                                 case.cycles_samples)).encode())
    if case.change:
        found.update(inspect.getsource(getattr(changes, case.change)).encode())
    if case.method != 'OPV':
        found.update(b'all bounces')
    if case.bounces != Case.bounces:
        found.update(repr(case.bounces).encode())
    if case.groups or case.passes:
        found.update(repr((bool(case.groups), case.passes)).encode())
    data = sorted(glob.glob(os.path.join(SCENES, case.scene + '.[eh][xd]r')))
    data += sorted(glob.glob(os.path.join(SCENES, case.scene + '_cache', '*', '*')))
    blend = case.blend('CYCLES')
    for path in [blend, os.path.splitext(blend)[0] + '.vdb', *data]:
        if os.path.exists(path):
            with open(path, 'rb') as file:
                found.update(file.read())
    return found.hexdigest()


def path_of(case):
    return os.path.join(REFERENCES, case.reference + '.npz')


def refresh(case):
    """Renders the case in Cycles with two seeds and writes its file."""
    blender = [os.environ.get('BLENDER', 'blender'), '--factory-startup']
    one, two = (render(blender, 'CYCLES', case, seed=seed) for seed in (0, 1))
    found = {name: ((one[name] + two[name]) / 2).astype(np.float16)
             for name in one if name not in {'Depth', 'IndexOB'}}
    if 'Depth' in one:
        found['Depth'] = one['Depth']
    if 'IndexOB' in one:
        found['IndexOB'] = one['IndexOB'].astype(np.uint8)
    one, two = one['Combined'][..., :3], two['Combined'][..., :3]
    where = None
    if case.method != 'OPV':    # all methods share the file, medium_only or not
        plain = render(blender, 'CYCLES', case, '--without-media')['Combined'][..., :3]
        found['medium'] = changed((one + two) / 2, plain)
        where = found['medium'] if case.medium_only else None
    os.makedirs(REFERENCES, exist_ok=True)
    np.savez_compressed(path_of(case), digest=digest(case), **found,
                        apart=difference(one, two, where=where)[0])


def load(case):
    """(passes, difference between the two halves, which blocks count or None for all)."""
    with np.load(path_of(case)) as file:
        if str(file['digest']) != digest(case):
            raise RuntimeError(f'{path_of(case)} was made from other files or settings than '
                               f'{case.name} has now: run pytest tests/pictures --refresh')
        passes = {name: file[name].astype(np.float32) for name in file
                  if name not in {'digest', 'apart', 'medium'}}
        return passes, float(file['apart']), file['medium'] if case.medium_only else None
