# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's renders of a scene, and Cycles' pictures with all bounces: sums of two halves of seeds,
kept in build/references for as long as the scene and the settings stay the same. More seeds are
added to those that are there.
"""
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from place import ROOT

HERE = os.path.dirname(os.path.abspath(__file__))
REFERENCES = os.path.join(ROOT, 'build', 'references')
# All light: as many bounces as matter, nothing clamped, nothing smoothed.
CYCLES = {'use_adaptive_sampling': False, 'use_denoising': False, 'light_sampling_threshold': 0.0,
          'sample_clamp_direct': 0.0, 'sample_clamp_indirect': 0.0, 'transparent_max_bounces': 256,
          **dict.fromkeys(('max_bounces', 'diffuse_bounces', 'glossy_bounces', 'volume_bounces',
                           'transmission_bounces'), 64)}


@dataclass(frozen=True)
class Case:
    scene: str
    samples: int        # Cycles', a seed
    size: object        # pixels: of a square's side, or (width, height)
    zoom: float = 1.0   # multiplies the lens, so that the subject fills the picture


def _play(case, work):
    """Has Blender do the work, and passes on what it says of the jobs that are done."""
    process = subprocess.Popen(
        [os.path.join(ROOT, 'scripts', 'blender'), '-b', '--factory-startup',
         '--python-exit-code', '1', '-P', os.path.join(HERE, 'render_jobs.py'), '--',
         json.dumps(work)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said = []
    for line in process.stdout:
        said.append(line)
        if line.startswith('rendered '):
            print(f'{case.scene}: {line}', end='', file=sys.stderr, flush=True)
    if process.wait():
        sys.exit(f'{case.scene} was not rendered:\n{"".join(said)[-3000:]}')


def run(case, jobs, long_s=float('inf')):
    """(pictures, what each took) of the jobs of bench/render_jobs.py, rendered by one Blender."""
    with tempfile.TemporaryDirectory() as folder:
        jobs = [{**job, 'out': os.path.join(folder, f'{number}.npy')}
                for number, job in enumerate(jobs)]
        size = case.size if isinstance(case.size, tuple) else (case.size, case.size)
        work = {'scene': case.scene, 'size': size, 'zoom': case.zoom, 'long_s': min(long_s, 1e9),
                'report': os.path.join(folder, 'report.json'), 'jobs': jobs}
        _play(case, work)
        with open(work['report'], encoding='utf-8') as file:
            report = json.load(file)
        return [np.load(job['out']) if took else None for job, took in zip(jobs, report)], report


def job(samples, seed):
    return {'engine': 'CYCLES', 'settings': {**CYCLES, 'seed': seed, 'samples': samples}}


def _digest(case):
    """Of all that Cycles' picture is made from, but for the number of seeds."""
    found = hashlib.sha256(repr((case.samples, case.zoom, case.size, CYCLES)).encode())
    with open(os.path.join(ROOT, 'blend_scenes', f'{case.scene}.blend'), 'rb') as file:
        found.update(file.read())
    return found.hexdigest()[:16]


def halves(case, pairs):
    """(pairs of seeds that are there, at least so many; means of their two)."""
    path = os.path.join(REFERENCES, f'{case.scene}-{_digest(case)}.npz')
    found, sums = 0, [0.0, 0.0]
    if os.path.exists(path):
        with np.load(path) as file:
            found, sums = int(file['pairs']), list(file['halves'])
    while found < pairs:
        both, _ = run(case, [job(case.samples, 2 * found + i) for i in (0, 1)])
        sums = [half + picture.astype(np.float64) for half, picture in zip(sums, both)]
        found += 1
        os.makedirs(REFERENCES, exist_ok=True)
        np.savez(path, pairs=found, halves=np.stack(sums))
    return found, [half / found for half in sums]
