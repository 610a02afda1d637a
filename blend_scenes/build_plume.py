# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds plume.blend: a smoke plume that Mantaflow simulates and caches as OpenVDB in plume_cache/.

The object that renders is the fluid domain itself. Its cache type is MODULAR: once baked, Blender
only ever reads it, so one frame's files are enough and no later run simulates or writes. (REPLAY
would simulate again wherever a file is missing.)
"""
import glob
import os
import shutil
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'plume'
FRAME = 66          # the frame that is kept
RESOLUTION = 88     # cells along the domain's height
CACHE = os.path.join(staging.FOLDER, 'plume_cache')

scene = staging.begin(NAME)
floor = staging.matt('Floor', (0.060, 0.063, 0.070))
clay = staging.matt('Clay', (0.45, 0.16, 0.08))
chalk = staging.matt('Chalk', (0.40, 0.37, 0.33))
slate = staging.matt('Slate', (0.10, 0.14, 0.18))

staging.add('Floor', bpy.ops.mesh.primitive_plane_add, floor, size=60.0)
staging.add('Bowl', bpy.ops.mesh.primitive_cylinder_add, clay, smooth=True, vertices=96,
            radius=0.42, depth=0.30, location=(0.0, 0.0, 0.15))
staging.sphere('Ball', 0.42, (1.75, -0.75, 0.42), chalk)
staging.box('Block', (0.6, 0.6, 1.1), (-1.75, 0.55, 0.55), slate, bevel=0.02, rotation=0.5)

# The smoke: a disc above the bowl breathes it out, a breeze bends it, vorticity curls it.
source = staging.add('Source', bpy.ops.mesh.primitive_cylinder_add, vertices=48, radius=0.26,
                     depth=0.16, location=(0.0, 0.0, 0.46))
source.hide_render = True
source.display_type = 'WIRE'
flow = source.modifiers.new('Fluid', 'FLUID')
flow.fluid_type = 'FLOW'
flow = flow.flow_settings
flow.flow_type = 'SMOKE'
flow.flow_behavior = 'INFLOW'
flow.density = 1.0
flow.temperature = 1.2
flow.use_initial_velocity = True
flow.velocity_coord = (0.0, 0.0, 0.3)

domain = staging.box('Smoke', (2.6, 2.2, 2.9), (0.25, 0.0, 1.81))
domain.display_type = 'BOUNDS'
modifier = domain.modifiers.new('Fluid', 'FLUID')
modifier.fluid_type = 'DOMAIN'
fluid = modifier.domain_settings
fluid.domain_type = 'GAS'
fluid.resolution_max = RESOLUTION
fluid.time_scale = 1.0
fluid.vorticity = 0.3
fluid.alpha = 1.2   # buoyancy of density
fluid.beta = 2.2    # buoyancy of heat
fluid.cache_type = 'MODULAR'
fluid.cache_data_format = 'OPENVDB'
fluid.openvdb_cache_compress_type = 'BLOSC'
fluid.openvdb_data_depth = '16'
fluid.cache_frame_start, fluid.cache_frame_end = 1, FRAME
fluid.cache_directory = '//plume_cache'
domain.data.materials.append(staging.volume(
    'Smoke', 'ShaderNodeVolumePrincipled', Color=(0.97, 0.97, 0.975, 1.0), Density=9.0,
    Anisotropy=0.35))

bpy.ops.object.effector_add(type='TURBULENCE', location=(0.0, 0.0, 1.5))
turbulence = bpy.context.object
turbulence.name = 'Turbulence'
turbulence.field.strength, turbulence.field.size, turbulence.field.noise = 3.0, 0.7, 0.2
bpy.ops.object.effector_add(type='WIND', location=(-2.0, 0.0, 1.0), rotation=(0.0, 1.5708, 0.0))
wind = bpy.context.object
wind.name = 'Wind'
wind.field.strength = 0.08

staging.lamp('Sun', 'SUN', (-3.6, 2.0, 5.2), (0.0, 0.0, 0.0), 17.0, (1.0, 0.93, 0.82), angle=0.02)
staging.lamp('Area', 'AREA', (3.6, -3.2, 3.2), (0.0, 0.0, 1.4), 320.0, (0.80, 0.88, 1.0),
             shape='SQUARE', size=1.6)
staging.world((0.30, 0.45, 0.80), 0.18)
staging.camera((0.9, -9.4, 2.7), (0.25, 0.0, 1.30), lens=54.0)

scene.frame_start, scene.frame_end = 1, FRAME
shutil.rmtree(CACHE, ignore_errors=True)
bpy.ops.object.select_all(action='DESELECT')
bpy.context.view_layer.objects.active = domain
domain.select_set(True)
bpy.context.view_layer.update()
bpy.ops.fluid.bake_data()
scene.frame_start = FRAME
scene.frame_set(FRAME)
for path in glob.glob(os.path.join(CACHE, '*', '*')):
    if f'_{FRAME:04d}.' not in path:
        os.remove(path)
staging.finish(NAME, samples=64)
