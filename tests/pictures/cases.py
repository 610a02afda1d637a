# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures that are compared with Cycles: a scene, the lamps that are lit, and a tolerance.

All but those of LPV and DOM are direct light and single scattering only. Cycles' samples are chosen
so that its own noise stays below a quarter of the tolerance; the tests assert that too.
"""
import os
from dataclasses import dataclass

import changes

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
    step_rate: float = 1.0  # Cycles' volume step, in voxels
    change: str = ''        # a function of changes.py that sets scene or camera up
    # (name, pass index, tolerance): objects that are measured by themselves
    groups: tuple = ()
    world_samples: int = 0  # Brume's; 0: the default
    passes: tuple = ()      # beyond Combined: of "Depth", "Normal", "Emit", "Env"
    method: str = 'OPV'     # Brume's; with another, Cycles goes on for `bounces`
    twin: bool = False      # Cycles renders SCENE_twin.blend, which looks the same to it
    bounces: int = 64       # Cycles', with methods other than OPV
    # Only the blocks count that look otherwise without the media
    medium_only: bool = False

    @property
    def samples(self):
        """Brume's a pixel. With all bounces blocks cannot tell more from fewer."""
        return 64 if self.method == 'OPV' else 16

    @property
    def name(self):
        return '-'.join(self._parts(self.method))

    @property
    def reference(self):
        """The name of what Cycles rendered, which serves all methods that go on alike."""
        return '-'.join(self._parts('all_bounces'))

    def _parts(self, beyond):
        lamp = self.lamps if len(self.lamps) == 1 else ()
        return (self.scene, *lamp, *([self.change] if self.change else []),
                *([beyond] if self.method != 'OPV' else []))

    def apply(self, scene):
        if self.change:
            getattr(changes, self.change)(scene)

    def blend(self, engine):
        twin = '_twin' if self.twin and engine == 'CYCLES' else ''
        return os.path.join(SCENES, f'{self.scene}{twin}.blend')


# Matt things agree as well as lamps and shadow maps do; glossy ones also differ by what stands for
# the microfacets' mutual masking and for the world in the mirror; through what is half seen, 64
# samples leave grain.
GROUPS = (('matt', 1, 0.03), ('glossy', 2, 0.10), ('clear', 3, 0.04))
ROUND = (('matt', 1, 0.03), ('glossy', 2, 0.10))

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
    Case('fog_one', (), 0.04, 256, twin=True),
    Case('fog_sixteen', (), 0.04, 256, twin=True),
    Case('fog_lights', (), 0.04, 768, twin=True),
    Case('surfaces', (), 0.03, 512, size=256, groups=GROUPS),
    Case('surfaces', (), 0.03, 256, size=256, change='passes', groups=GROUPS,
         passes=('Depth', 'Normal', 'Emit', 'Env')),
    Case('surfaces', (), 0.03, 256, change='orthographic'),
    Case('surfaces', (), 0.03, 256, change='shifted'),
    Case('surfaces', (), 0.03, 256, change='clipped'),
    Case('surfaces', (), 0.03, 256, change='border'),
    Case('surfaces', (), 0.03, 256, change='cropped'),
    # Nearly all of it is glossy or seen through.
    Case('surfaces', (), 0.05, 256, change='film_transparent'),
    Case('surfaces', (), 0.03, 256, change='percentage'),
    Case('cube', (), 0.04, 512, change='inside'),
    Case('cube', (), 0.04, 512, change='focused'),
    Case('surfaces', (), 0.03, 512, size=256, groups=GROUPS, change='focused'),
    Case('cube', (), 0.04, 512, change='fog_on_film'),
    Case('cube', (), 0.04, 512, zoom=1.4, step_rate=0.1, change='textured'),
    Case('cloud', (), 0.04, 512, zoom=1.15, change='graded'),
    # With the default of 32 directions the sky's shadows have steps: 0.055.
    Case('lamps', (), 0.03, 1024, zoom=1.3, change='sky_alone', world_samples=128),
    Case('lamps', (), 0.02, 512, change='lamps_seen'),
    Case('environment', (), 0.04, 1024, groups=ROUND),
    Case('environment', (), 0.04, 1024, change='hdr', groups=ROUND),
    Case('environment', (), 0.04, 1024, change='turned_as_point', groups=ROUND),
    Case('environment', (), 0.04, 1024, change='turned_as_texture', groups=ROUND),
    Case('cube', (), 0.05, 512, zoom=1.4, method='LPV'),
    Case('cloud', (), 0.05, 512, zoom=1.15, method='LPV'),
    Case('room', (), 0.10, 2048, method='LPV'),
    Case('room_smoke', (), 0.10, 1024, method='LPV'),
    Case('cube', (), 0.02, 512, zoom=1.4, method='DOM'),
    Case('cloud', (), 0.03, 512, zoom=1.15, method='DOM'),
    Case('room', (), 0.06, 2048, method='DOM'),
    Case('room_smoke', (), 0.09, 1024, method='DOM'),
    Case('arcade', (), 0.06, 1024, method='DOM'),
    Case('cube', (), 0.03, 256, zoom=1.4, change='isotropic', method='DOM', medium_only=True),
    Case('cube', (), 0.05, 1024, zoom=1.4, change='forward', method='DOM', medium_only=True),
    # White media of this thickness scatter a tenth of their light more often than 64 times.
    Case('cube', (), 0.08, 256, zoom=1.4, change='milk', method='DOM', medium_only=True,
         bounces=1024),
    Case('plume', (), 0.06, 256, zoom=1.6, method='DOM', medium_only=True),
    Case('smoke_sky', (), 0.06, 768, method='DOM', medium_only=True),
    Case('lantern', (), 0.08, 1024, method='DOM', medium_only=True),
)}
