# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds smoke_sky.blend and its smoke_sky.exr: smoke that scatters forwards, lit by an
equirectangular image alone, a sky with a small sun in it. The smoke is cloud.vdb.
"""
import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'smoke_sky'
WIDTH, HEIGHT = 256, 128
TOWARDS_SUN = np.array((-3.5, 2.6, 4.4))   # as in cloud.blend: from the left, behind and above
SUN_RADIUS = 0.05                          # rad, where it has fallen to 1/e: two pixels
SUN_IRRADIANCE = np.array((9.0, 7.8, 6.0))


def sky():
    """(height, width, 3), bottom row first; columns go from -x by +y, +x and -y."""
    v, u = (np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5) / np.array((HEIGHT, WIDTH))[:, None, None]
    azimuth, height = np.pi - 2.0 * np.pi * u, np.pi * (v - 0.5)
    direction = np.stack((np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth),
                          np.sin(height)), axis=-1)
    up = direction[..., 2:]
    pale, blue, ground = (np.array(c) for c in ((0.55, 0.62, 0.70), (0.12, 0.26, 0.60),
                                                (0.10, 0.09, 0.08)))
    pixels = np.where(up > 0.0, pale + (blue - pale) * np.clip(up, 0.0, 1.0) ** 0.5, ground)
    away = np.arccos(np.clip(direction @ (TOWARDS_SUN / np.linalg.norm(TOWARDS_SUN)), -1.0, 1.0))
    sun = np.exp(-(away / SUN_RADIUS) ** 2)[..., None]
    return pixels + SUN_IRRADIANCE * sun / (np.pi * SUN_RADIUS ** 2)


def write(name, pixels):
    """As half floats, which Image.save() would not choose."""
    block = bpy.data.images.new(name, WIDTH, HEIGHT, float_buffer=True)
    rgba = np.ones((HEIGHT, WIDTH, 4), np.float32)
    rgba[..., :3] = pixels
    block.pixels.foreach_set(rgba.ravel())
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = 'OPEN_EXR', 'RGB', '16'
    settings.exr_codec = 'ZIP'
    block.save_render(os.path.join(staging.FOLDER, name))
    settings.file_format = 'PNG'
    bpy.data.images.remove(block)


scene = staging.begin(NAME)
write('smoke_sky.exr', sky())

staging.add('Floor', bpy.ops.mesh.primitive_circle_add, staging.matt('Floor', (0.12, 0.12, 0.12)),
            vertices=96, radius=4.0, fill_type='NGON')
data = bpy.data.volumes.new('Smoke')
data.filepath = '//cloud.vdb'
data.materials.append(staging.volume(
    'Smoke', 'ShaderNodeVolumePrincipled', Color=(0.95, 0.95, 0.95, 1.0), Density=3.0,
    Anisotropy=0.85))
smoke = bpy.data.objects.new('Smoke', data)
scene.collection.objects.link(smoke)

tree = staging.world((1.0, 1.0, 1.0), 1.0).node_tree
environment = tree.nodes.new('ShaderNodeTexEnvironment')
environment.image = bpy.data.images.load(os.path.join(staging.FOLDER, 'smoke_sky.exr'))
environment.image.filepath = '//smoke_sky.exr'
environment.location.x = -300
tree.links.new(environment.outputs['Color'], tree.nodes['Background'].inputs['Color'])
staging.camera((0.0, -9.0, 1.6), (0.0, 0.0, 1.15), lens=60.0)
if hasattr(scene, 'brume'):
    scene.brume.method = 'DOM'
staging.finish(NAME, samples=128, bounces=64, volume_bounces=64)
