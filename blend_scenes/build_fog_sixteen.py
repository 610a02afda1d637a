# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds fog_sixteen.blend: sixteen coloured puffs of fog on the points of a mesh, which a spot and
a point lamp light through one another; and fog_sixteen_twin.blend, the same for Cycles."""
import colorsys
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import gaussians
import staging

NAME = 'fog_sixteen'


def spiral(count=16):
    """Puffs along a spiral that narrows upwards, through the hues."""
    for i in range(count):
        t = i / (count - 1)
        angle, distance = -1.9 + 1.75 * math.tau * t, 1.35 - 0.75 * t
        center = (distance * math.cos(angle), 0.1 + distance * math.sin(angle), 0.55 + 1.9 * t)
        yield gaussians.Gaussian(center, 0.5 - 0.14 * t, 7.0,
                                 colorsys.hsv_to_rgb(0.02 + 0.75 * t, 0.65, 0.99))


scene = staging.begin(NAME)
scene.render.resolution_x = scene.render.resolution_y = 512
chalk = staging.matt('Chalk', (0.30, 0.29, 0.28))
moss = staging.matt('Moss', (0.20, 0.26, 0.14))
plum = staging.matt('Plum', (0.28, 0.14, 0.22))

staging.alcove(4.4, 4.0, 3.4, chalk, moss, plum)
staging.box('Step', (0.9, 0.7, 0.3), (1.45, 1.3, 0.15), chalk, bevel=0.02, rotation=0.2)
staging.sphere('Ball', 0.3, (1.45, 1.3, 0.6), plum)

staging.lamp('Spot', 'SPOT', (-1.3, -1.5, 3.25), (0.15, 0.2, 0.6), 1100.0, (1.0, 0.92, 0.80),
             shadow_soft_size=0.05, spot_size=math.radians(60.0), spot_blend=0.2)
staging.lamp('Point', 'POINT', (0.0, 0.15, 1.35), (0.3, 0.0, 0.0), 90.0, (0.55, 0.75, 1.0),
             shadow_soft_size=0.05)
staging.world((0.0, 0.0, 0.0), 0.0)
staging.camera((0.0, -8.2, 2.0), (0.0, 0.0, 1.6), lens=50.0)
puffs = list(spiral())
fog = gaussians.points('Fog', puffs)
staging.finish(NAME)
gaussians.finish_twin(NAME, fog, puffs, 12)
