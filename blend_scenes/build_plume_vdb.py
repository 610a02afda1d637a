# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds plume_vdb.blend: plume.blend with a Volume object in the fluid domain's place.

It reads the same cache as a plain OpenVDB file, so it opens where Mantaflow cannot: Debian 13's
Blender 4.3 dies of any fluid domain.
"""
import os
import sys

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

bpy.ops.wm.open_mainfile(filepath=os.path.join(staging.FOLDER, 'plume.blend'))
scene = bpy.context.scene
domain = bpy.data.objects['Smoke']
fluid = domain.evaluated_get(bpy.context.evaluated_depsgraph_get()).modifiers['Fluid']
cells = list(fluid.domain_settings.domain_resolution)
corner, size = Vector(domain.bound_box[0]), domain.dimensions

data = bpy.data.volumes.new('Smoke')
data.filepath = f'//plume_cache/data/fluid_data_{scene.frame_current:04d}.vdb'
data.materials.append(domain.material_slots[0].material)
smoke = bpy.data.objects.new('Smoke', data)
scene.collection.objects.link(smoke)
# The file's voxels are cubes, as many to the domain's height as it has cells there, and the first
# one's centre is the origin; the domain stretches its cells to fill its box.
voxel = size.z / cells[2]
stretch = [size[i] / cells[i] / voxel for i in range(3)]
smoke.matrix_world = (domain.matrix_world @ Matrix.Translation(corner)
                      @ Matrix.Diagonal((*stretch, 1.0))
                      @ Matrix.Translation((voxel / 2,) * 3))
for thing in [ob for ob in scene.objects
              if ob.field and ob.field.type != 'NONE' or 'Fluid' in ob.modifiers]:
    bpy.data.objects.remove(thing)
smoke.name = data.name = 'Smoke'
scene.name = 'plume_vdb'
staging.finish('plume_vdb', samples=64)
