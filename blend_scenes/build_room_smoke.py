# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds room_smoke.blend: room.blend with a cloud of smoke in the sun's shafts, cloud.vdb."""
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'room_smoke'

bpy.ops.wm.open_mainfile(filepath=os.path.join(staging.FOLDER, 'room.blend'))
scene = bpy.context.scene
scene.name = NAME
data = bpy.data.volumes.new('Smoke')
data.filepath = '//cloud.vdb'
data.materials.append(staging.volume(
    'Smoke', 'ShaderNodeVolumePrincipled', Color=(0.85, 0.85, 0.85, 1.0), Density=2.5,
    Anisotropy=0.4))  # as the fog: what differs, Cycles 3.4 adds up too bright
smoke = bpy.data.objects.new('Smoke', data)
scene.collection.objects.link(smoke)
smoke.location, smoke.scale = (-1.3, 1.0, 0.35), (0.55,) * 3
if hasattr(scene, 'brume'):
    scene.brume.method = 'LPV'
staging.finish(NAME, samples=128, bounces=16, volume_bounces=16)
