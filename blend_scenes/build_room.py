# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds room.blend: a closed room, the sun through a slit in its wall, thin fog from wall to wall.

The shell is six boxes with thickness, so that nothing but the slit lets light in; the camera
stands inside room and fog.
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'room'
WIDTH, DEPTH, HEIGHT, WALL = 6.0, 8.0, 3.2, 0.2
SLIT_Y, SLIT_Z = (0.2, 1.5), (1.2, 2.7)  # the hole in the wall at x = -WIDTH / 2

staging.begin(NAME)
plaster = staging.matt('Plaster', (0.62, 0.58, 0.52))
boards = staging.matt('Boards', (0.30, 0.19, 0.11))
iron = staging.matt('Iron', (0.12, 0.13, 0.14))
velvet = staging.matt('Velvet', (0.42, 0.06, 0.07))

slab = staging.slab
x, y, top = WIDTH / 2, DEPTH / 2, HEIGHT
slab('Floor', (-x - WALL, -y - WALL, -WALL), (x + WALL, y + WALL, 0), boards)
slab('Ceiling', (-x - WALL, -y - WALL, top), (x + WALL, y + WALL, top + WALL), plaster)
slab('Back', (-x, y, 0), (x, y + WALL, top), plaster)
slab('Front', (-x, -y - WALL, 0), (x, -y, top), plaster)
slab('Right', (x, -y - WALL, 0), (x + WALL, y + WALL, top), plaster)
(y0, y1), (z0, z1) = SLIT_Y, SLIT_Z
slab('Left near', (-x - WALL, -y - WALL, 0), (-x, y0, top), plaster)
slab('Left far', (-x - WALL, y1, 0), (-x, y + WALL, top), plaster)
slab('Left sill', (-x - WALL, y0, 0), (-x, y1, z0), plaster)
slab('Left lintel', (-x - WALL, y0, z1), (-x, y1, top), plaster)
for i in range(3):  # bars that cut the beam into shafts
    bar = y0 + (i + 1) * (y1 - y0) / 4
    middle = -x - WALL / 2
    slab(f'Bar {i + 1}', (middle - 0.03, bar - 0.05, z0), (middle + 0.03, bar + 0.05, z1), iron)

staging.box('Plinth', (0.7, 0.7, 0.9), (0.55, 1.35, 0.45), plaster, bevel=0.02, rotation=0.3)
staging.sphere('Ball', 0.33, (0.55, 1.35, 1.23), velvet)

# Its faces lie inside the walls: coincident faces would leave their order to chance.
fog = staging.box('Fog', (WIDTH + WALL, DEPTH + WALL, HEIGHT + WALL),
                  (0.0, 0.0, HEIGHT / 2), staging.volume(
    'Fog', 'ShaderNodeVolumeScatter', Color=(0.95, 0.95, 0.95, 1.0), Density=0.09, Anisotropy=0.4))
fog.display_type = 'BOUNDS'

staging.lamp('Sun', 'SUN', (-6.0, 1.6, 4.6), (0.4, 0.4, 0.2), 60.0, (1.0, 0.86, 0.66), angle=0.009)
staging.world((0.35, 0.50, 0.80), 1.0)
staging.camera((2.2, -3.7, 1.55), (-0.35, 1.6, 1.25), lens=24.0)
staging.finish(NAME, samples=128, bounces=4)
