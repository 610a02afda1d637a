# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds fog_one.blend: an empty that is one large ball of fog, with a lamp at its rim that shines
through a slatted screen at a ball; and fog_one_twin.blend, the same for Cycles."""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import gaussians
import staging

NAME = 'fog_one'
FOG = gaussians.Gaussian((0.0, 0.2, 1.6), 2.0, 1.2, (0.95, 0.95, 0.95))

scene = staging.begin(NAME)
scene.render.resolution_x = scene.render.resolution_y = 512
scene.brume.light_samples = 24  # fewer show as steps where the slats' shadows are soft
plaster = staging.matt('Plaster', (0.22, 0.21, 0.20))
clay = staging.matt('Clay', (0.26, 0.08, 0.05))
slate = staging.matt('Slate', (0.10, 0.20, 0.30))
wood = staging.matt('Wood', (0.16, 0.10, 0.06))

staging.alcove(4.0, 4.0, 3.4, plaster, clay, slate)
staging.box('Plinth', (0.6, 0.6, 0.75), (0.95, 0.0, 0.375), plaster, bevel=0.02, rotation=0.35)
staging.sphere('Ball', 0.34, (0.95, 0.0, 1.09), plaster)
for i in range(5):  # they fan the light out across the view
    staging.box(f'Slat {i + 1}', (0.05, 1.5, 0.09), (-0.7, 0.2, 0.95 + 0.26 * i), wood)
for i in range(2):
    staging.box(f'Post {i + 1}', (0.06, 0.06, 2.1), (-0.7, -0.55 + 1.5 * i, 1.05), wood)

staging.lamp('Lamp', 'POINT', (-1.2, 0.2, 1.75), (0.0, 0.2, 1.0), 380.0, (1.0, 0.80, 0.55),
             shadow_soft_size=0.02)
staging.world((0.0, 0.0, 0.0), 0.0)
staging.camera((0.0, -7.8, 1.75), (0.0, 0.0, 1.68), lens=50.0)
fog = gaussians.empty('Fog', FOG)
staging.finish(NAME)
gaussians.finish_twin(NAME, fog, [FOG], 24)
