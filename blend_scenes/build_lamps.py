# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds lamps.blend: one lamp of each kind over matt things, a black world and no medium.

The lamps are the objects Sun, Point, Spot, Rectangle and Disk; scripts switch them by hide_render.
"""
import math
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'lamps'

staging.begin(NAME)
grey = staging.matt('Grey', (0.34, 0.34, 0.34))
white = staging.matt('White', (0.80, 0.80, 0.80))
ochre = staging.matt('Ochre', (0.62, 0.36, 0.12))
teal = staging.matt('Teal', (0.08, 0.34, 0.36))

staging.add('Floor', bpy.ops.mesh.primitive_plane_add, grey, size=12.0)
wall = staging.add('Wall', bpy.ops.mesh.primitive_plane_add, grey, size=12.0,
                   location=(0.0, 2.6, 6.0), rotation=(math.pi / 2, 0.0, 0.0))
staging.sphere('Ball', 0.6, (-0.95, 0.5, 0.6), white)
staging.box('Block', (0.8, 0.8, 1.5), (0.95, 1.0, 0.75), ochre, rotation=0.5)
staging.add('Ring', bpy.ops.mesh.primitive_torus_add, teal, smooth=True, major_radius=0.42,
            minor_radius=0.14, major_segments=64, minor_segments=24, location=(0.35, -0.75, 0.14))

staging.lamp('Sun', 'SUN', (-3.0, -4.0, 5.0), (0.0, 0.0, 0.0), 0.5, (1.0, 0.95, 0.85), angle=0.03)
staging.lamp('Point', 'POINT', (-2.4, 0.9, 2.1), (-2.4, 0.9, 0.0), 60.0, (1.0, 0.62, 0.30),
             shadow_soft_size=0.08)
staging.lamp('Spot', 'SPOT', (2.2, -2.2, 3.4), (0.2, 0.4, 0.3), 420.0, (0.70, 0.85, 1.0),
             shadow_soft_size=0.06, spot_size=math.radians(42.0), spot_blend=0.25)
staging.lamp('Rectangle', 'AREA', (0.2, -0.4, 3.6), (0.1, 0.5, 0.0), 26.0, (0.95, 1.0, 0.92),
             shape='RECTANGLE', size=1.4, size_y=0.7)
staging.lamp('Disk', 'AREA', (3.0, 0.4, 2.0), (0.6, 0.8, 0.6), 60.0, (1.0, 0.42, 0.75),
             shape='DISK', size=0.9)
staging.world((0.0, 0.0, 0.0), 0.0)
staging.camera((0.0, -7.6, 3.0), (0.05, 0.4, 0.95), lens=50.0)
staging.finish(NAME)
