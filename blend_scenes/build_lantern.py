# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds lantern.blend: a lamp in the middle of a ball of fog, above a floor in the dark.

The ball is two mean free paths from centre to rim. The camera does not see the lamp itself, whose
disk would outshine what it is about: the fog around a lamp. The lamp is small, as Cycles' lamps are
disks that face what they light: one of 0.08 m has a fifth less light for the fog than one of 0 m.
"""
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'lantern'
CENTRE = (0.0, 0.0, 1.2)

scene = staging.begin(NAME)
staging.add('Floor', bpy.ops.mesh.primitive_circle_add, staging.matt('Floor', (0.30, 0.29, 0.28)),
            vertices=96, radius=2.2, fill_type='NGON')
staging.sphere('Ball', 0.3, (1.45, -0.55, 0.3), staging.matt('Chalk', (0.55, 0.52, 0.48)))
fog = staging.sphere('Fog', 1.0, CENTRE, staging.volume(
    'Fog', 'ShaderNodeVolumePrincipled', Color=(0.95, 0.95, 0.95, 1.0), Density=2.0,
    Anisotropy=0.3))    # Volume Scatter would absorb nothing, whatever its colour
fog.display_type = 'WIRE'

lamp = staging.lamp('Lamp', 'POINT', CENTRE, (0.0, 0.0, 0.0), 150.0, (1.0, 0.78, 0.52),
                    shadow_soft_size=0.02)
lamp.visible_camera = False
staging.world((0.0, 0.0, 0.0), 0.0)
staging.camera((0.6, -6.8, 2.2), (0.15, 0.0, 0.95), lens=62.0)
if hasattr(scene, 'brume'):
    scene.brume.method = 'DOM'
staging.finish(NAME, samples=128, bounces=64, volume_bounces=64)
