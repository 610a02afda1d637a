# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds cumulus.blend: clouds of a Noise Texture in a box over hills at the sea, low sun."""
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'cumulus'

staging.begin(NAME)
staging.add('Sea', bpy.ops.mesh.primitive_plane_add, staging.matt('Sea', (0.02, 0.05, 0.08)),
            size=2000.0)
land = staging.matt('Land', (0.09, 0.12, 0.05))
for number, (x, y, radius, height) in enumerate((
        (-36.0, 30.0, 22.0, 7.0), (-12.0, 52.0, 26.0, 11.0), (30.0, 58.0, 20.0, 8.0),
        (44.0, 26.0, 12.0, 3.5))):
    staging.add(f'Hill {number + 1}', bpy.ops.mesh.primitive_uv_sphere_add, land, smooth=True,
                location=(x, y, 0.0), scale=(radius, radius, height))

material = staging.volume('Clouds', 'ShaderNodeVolumePrincipled', Color=(0.99, 0.99, 0.99, 1.0),
                          Anisotropy=0.6)
tree = material.node_tree
new, link = tree.nodes.new, tree.links.new
place, noise, inside = map(new, ('ShaderNodeNewGeometry', 'ShaderNodeTexNoise',
                                 'ShaderNodeTexCoord'))
for name, value in (('Scale', 0.075), ('Detail', 4.0), ('Roughness', 0.55)):
    noise.inputs[name].default_value = value
link(place.outputs['Position'], noise.inputs['Vector'])


def math(operation, *values):
    node = new('ShaderNodeMath')
    node.operation = operation
    for socket, value in zip(node.inputs, values):
        if isinstance(value, float):
            socket.default_value = value
        else:
            link(value, socket)
    return node.outputs[0]


# Flat below, towers above: the noise must be the higher, the further up a place is in the box.
split = new('ShaderNodeSeparateXYZ')
link(inside.outputs['Generated'], split.inputs[0])
up = split.outputs['Z']
threshold = math('MULTIPLY_ADD', up, 0.24, 0.47)
base = math('MINIMUM', math('MULTIPLY', up, 10.0), 1.0)
density = math('MULTIPLY', math('MAXIMUM', math('SUBTRACT', noise.outputs[0], threshold), 0.0),
               base)
principled = next(n for n in tree.nodes if n.bl_idname == 'ShaderNodeVolumePrincipled')
link(math('MULTIPLY', density, 30.0), principled.inputs['Density'])
clouds = staging.box('Clouds', (110.0, 80.0, 15.0), (0.0, 45.0, 22.0), material)
clouds.display_type = 'WIRE'

staging.lamp('Sun', 'SUN', (-60.0, 10.0, 34.0), (0.0, 40.0, 0.0), 7.0, (1.0, 0.86, 0.68),
             angle=0.02)
staging.world((0.22, 0.42, 0.85), 0.7)
staging.camera((0.0, -42.0, 4.0), (0.0, 10.0, 13.5), lens=26.0)
if hasattr(bpy.context.scene, 'brume'):
    bpy.context.scene.brume.method = 'DOM'
staging.finish(NAME, samples=128, bounces=32, volume_bounces=32)
