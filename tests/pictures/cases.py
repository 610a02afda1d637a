# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures that are compared with Cycles: a scene, the lamps that are lit, and a tolerance.

All are direct light and single scattering only. Cycles' samples are chosen so that its own noise
stays below a quarter of the tolerance; the tests assert that too.
"""
import os
from dataclasses import dataclass

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SCENES = os.path.join(ROOT, 'blend_scenes')
REFERENCES = os.path.join(ROOT, 'tests', 'data', 'cycles')


@dataclass(frozen=True)
class Case:
    scene: str
    lamps: tuple            # names of the lamps that shine; empty: as the file has them
    tolerance: float        # sum of absolute differences of the block means / sum of the reference
    cycles_samples: int     # per seed; a reference is the mean of two seeds
    zoom: float = 1.0       # multiplies the lens, so that the subject fills the square
    size: int = 128         # pixels a side
    samples: int = 64       # Brume's
    step_rate: float = 1.0  # Cycles' volume step, in voxels

    @property
    def name(self):
        return '-'.join((self.scene, *(self.lamps if len(self.lamps) == 1 else ())))

    @property
    def blend(self):
        return os.path.join(SCENES, self.scene + '.blend')


CASES = {case.name: case for case in (
    Case('lamps', ('Sun',), 0.02, 256, zoom=1.3),
    Case('lamps', ('Point',), 0.02, 256, zoom=1.3),
    Case('lamps', ('Spot',), 0.02, 256, zoom=1.3),
    Case('lamps', ('Rectangle',), 0.02, 256, zoom=1.3),
    Case('lamps', ('Disk',), 0.02, 256, zoom=1.3),
    Case('lamps', (), 0.02, 512, zoom=1.3),
    Case('cube', (), 0.04, 512, zoom=1.4),
    Case('plume', (), 0.04, 512, zoom=1.6),
    Case('cloud', (), 0.04, 512, zoom=1.15),
)}
