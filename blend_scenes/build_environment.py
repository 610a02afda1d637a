# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds environment.blend and its environment.exr and environment.hdr: matt and glossy things and
a small cube of fog, lit by an equirectangular image alone, which is turned and seen by the camera.
"""
import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'environment'
WIDTH, HEIGHT = 128, 64


def sky():
    """(height, width, 3), bottom row first: a gradient alike in no axis, and a bright spot."""
    v, u = (np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5) / np.array((HEIGHT, WIDTH))[:, None, None]
    azimuth, polar = 2.0 * np.pi * u, np.pi * (v - 0.5)
    pixels = np.stack((0.10 + 0.30 * v * (1.0 + np.sin(azimuth)),
                       0.12 + 0.25 * v,
                       0.08 + 0.40 * v ** 2 * (1.0 + np.cos(azimuth + 0.6))), axis=-1)
    spot_u, spot_v = 0.62, 0.74
    across = (u - spot_u) * 2.0 * np.pi * np.cos(polar)
    away = np.hypot(across, (v - spot_v) * np.pi)
    return pixels + np.array((90.0, 70.0, 45.0)) * np.exp(-(away / 0.12) ** 2)[..., None]


def write(name, pixels, file_format):
    block = bpy.data.images.new(name, WIDTH, HEIGHT, float_buffer=True)
    rgba = np.ones((HEIGHT, WIDTH, 4), np.float32)
    rgba[..., :3] = pixels
    block.pixels.foreach_set(rgba.ravel())
    block.filepath_raw = os.path.join(staging.FOLDER, name)
    block.file_format = file_format
    block.save()
    bpy.data.images.remove(block)


staging.begin(NAME)
write('environment.exr', sky(), 'OPEN_EXR')
write('environment.hdr', sky(), 'HDR')

grey = staging.matt('Grey', (0.5, 0.5, 0.5))
staging.add('Floor', bpy.ops.mesh.primitive_circle_add, grey, vertices=64, radius=2.6,
            fill_type='NGON').pass_index = 1
white = staging.matt('White', (0.8, 0.8, 0.8))
staging.sphere('Ball', 0.5, (-0.95, 0.2, 0.5), white).pass_index = 1
metal = bpy.data.materials.new('Metal')
metal.use_nodes = True
shader = metal.node_tree.nodes['Principled BSDF']
shader.inputs['Base Color'].default_value = (0.9, 0.85, 0.8, 1.0)
shader.inputs['Metallic'].default_value, shader.inputs['Roughness'].default_value = 1.0, 0.4
staging.sphere('Metal', 0.4, (0.15, -0.8, 0.4), metal).pass_index = 2
fog = staging.box('Fog', (1.0, 1.0, 1.0), (0.95, 0.5, 0.501), staging.volume(
    'Fog', 'ShaderNodeVolumeScatter', Color=(0.9, 0.9, 0.9, 1.0), Density=1.0, Anisotropy=0.3),
    rotation=0.4)
fog.display_type = 'WIRE'

world = staging.world((1.0, 1.0, 1.0), 1.0)
tree = world.node_tree
coordinate = tree.nodes.new('ShaderNodeTexCoord')
mapping = tree.nodes.new('ShaderNodeMapping')
mapping.inputs['Rotation'].default_value = (0.0, 0.0, 0.7)
environment = tree.nodes.new('ShaderNodeTexEnvironment')
environment.image = bpy.data.images.load(os.path.join(staging.FOLDER, 'environment.exr'))
environment.image.filepath = '//environment.exr'
tree.links.new(coordinate.outputs['Generated'], mapping.inputs['Vector'])
tree.links.new(mapping.outputs['Vector'], environment.inputs['Vector'])
tree.links.new(environment.outputs['Color'], tree.nodes['Background'].inputs['Color'])
for number, found in enumerate((coordinate, mapping, environment)):
    found.location = (-900 + 250 * number, 0)
staging.camera((0.2, -5.2, 1.5), (0.0, 0.0, 0.85), lens=32.0)
staging.finish(NAME)
