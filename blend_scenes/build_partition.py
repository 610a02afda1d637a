# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds partition.blend: what is hard for lattices of light. A closed room, a thin board across,
and a strong spot close to the board: "Camera" sees the dark side of it, "Lit side" the other.

After Figure 6 of "Light Propagation Volumes with scattering": light that bleeds through thin walls,
light that begins in a few cells, and, with one iteration, light that does not get far.
"""
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'partition'
X, Y, HEIGHT, WALL = 2.0, 2.6, 2.6, 0.15

staging.begin(NAME)
plaster = staging.matt('Plaster', (0.66, 0.62, 0.56))
tiles = staging.matt('Tiles', (0.38, 0.36, 0.34))
board = staging.matt('Board', (0.70, 0.55, 0.38))
red = staging.matt('Red', (0.55, 0.08, 0.07))
slab = staging.slab
slab('Floor', (-X - WALL, -Y - WALL, -WALL), (X + WALL, Y + WALL, 0), tiles)
slab('Ceiling', (-X - WALL, -Y - WALL, HEIGHT), (X + WALL, Y + WALL, HEIGHT + WALL), plaster)
slab('Front', (-X, -Y - WALL, 0), (X, -Y, HEIGHT), plaster)
slab('Back', (-X, Y, 0), (X, Y + WALL, HEIGHT), plaster)
slab('Left', (-X - WALL, -Y - WALL, 0), (-X, Y + WALL, HEIGHT), plaster)
slab('Right', (X, -Y - WALL, 0), (X + WALL, Y + WALL, HEIGHT), plaster)
# 2 cm thick; open beside the right wall, so that some light does go round it
slab('Board', (-X, -0.01, 0), (1.1, 0.01, HEIGHT), board)
staging.sphere('Ball', 0.3, (-0.6, -0.9, 0.3), red)
fog = staging.box('Fog', (2 * X + WALL, 2 * Y + WALL, HEIGHT + WALL), (0.0, 0.0, HEIGHT / 2),
                  staging.volume('Fog', 'ShaderNodeVolumeScatter', Color=(0.95, 0.95, 0.95, 1.0),
                                 Density=0.08, Anisotropy=0.0))
fog.display_type = 'BOUNDS'
staging.lamp('Spot', 'SPOT', (-0.7, 0.7, 1.9), (-0.7, 0.0, 1.3), 150.0, (1.0, 0.9, 0.75),
             spot_size=0.9, spot_blend=0.3, shadow_soft_size=0.02)
staging.world((0.0, 0.0, 0.0), 1.0)
lit = staging.camera((1.5, 2.3, 1.6), (-0.7, 0.0, 1.1), lens=22.0)
lit.name = 'Lit side'
staging.camera((1.2, -2.3, 1.6), (-0.5, 0.0, 1.1), lens=22.0)
scene = bpy.context.scene
scene.view_settings.exposure = 1.0
if hasattr(scene, 'brume'):
    scene.brume.method = 'LPV'
staging.finish(NAME, samples=128, bounces=16, volume_bounces=16)
