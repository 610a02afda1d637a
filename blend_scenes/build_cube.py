# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds cube.blend: a homogeneous cube of fog on a floor in the sun, the plainest medium."""
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'cube'

staging.begin(NAME)
staging.add('Floor', bpy.ops.mesh.primitive_plane_add, staging.matt('Floor', (0.045, 0.05, 0.06)),
            size=40.0)
staging.box('Post', (0.16, 0.16, 1.5), (0.25, 0.35, 0.75), staging.matt('Post', (0.60, 0.16, 0.06)))
fog = staging.box('Fog', (2.0, 2.0, 2.0), (0.0, 0.0, 1.001), staging.volume(
    'Fog', 'ShaderNodeVolumeScatter', Color=(0.90, 0.93, 0.97, 1.0), Density=0.7, Anisotropy=0.3),
    rotation=0.55)
fog.display_type = 'WIRE'

staging.lamp('Sun', 'SUN', (-4.0, 2.2, 4.2), (0.0, 0.0, 0.0), 14.0, (1.0, 0.94, 0.84), angle=0.02)
staging.world((0.25, 0.38, 0.62), 0.12)
staging.camera((0.7, -8.2, 3.3), (0.35, 0.0, 0.85), lens=60.0)
staging.finish(NAME)
