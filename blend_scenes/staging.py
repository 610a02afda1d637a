# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scene builders share: an empty metric scene, matt things, lamps, a camera, a saved file.

Metres, radians, watts. Run the builders with `blender -b --factory-startup -P build_<name>.py`.
"""
import os

import bpy
from mathutils import Matrix, Vector

FOLDER = os.path.dirname(os.path.abspath(__file__))


def begin(name):
    """Empties the factory scene, not its workspaces, and saves it: // paths need a root."""
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.lights, bpy.data.cameras,
                       bpy.data.materials, bpy.data.worlds):
        for block in list(collection):
            collection.remove(block)
    scene = bpy.context.scene
    scene.name = name
    scene.unit_settings.system = 'METRIC'
    scene.render.resolution_x, scene.render.resolution_y = 640, 360
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = False
    scene.render.use_persistent_data = False
    scene.view_settings.view_transform = 'Filmic'
    scene.frame_start = scene.frame_end = 1
    scene.frame_set(1)
    save(name)
    return scene


def save(name):
    """Writes <name>.blend beside this module, compressed, with relative paths."""
    bpy.context.preferences.filepaths.save_version = 0  # no .blend1 beside it
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, name + '.blend'), compress=True,
                                relative_remap=True)


def finish(name, samples=64, bounces=4, engine='BRUME', volume_bounces=0):
    """Sets both engines up, looks through the camera in every 3D view, and saves the file with
    `engine` chosen if it is there, else Cycles.

    Cycles gets single scattering, unless volume_bounces says otherwise, without clamping or
    denoising: what Brume's single scattering is compared with.
    """
    scene = bpy.context.scene
    scene.render.engine = 'CYCLES'
    cycles = scene.cycles
    cycles.device = 'CPU'
    cycles.samples = samples
    cycles.preview_samples = 16
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.max_bounces = bounces
    cycles.volume_bounces = volume_bounces
    # A volume's hull is jagged: with the default of 8, rays that cross it often end in black.
    cycles.transparent_max_bounces = 256
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.volume_step_rate = 0.5
    cycles.volume_max_steps = 1024
    if any(kind.bl_idname == engine for kind in bpy.types.RenderEngine.__subclasses__()):
        scene.render.engine = engine
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == 'VIEW_3D':
                area.spaces.active.region_3d.view_perspective = 'CAMERA'
    bpy.ops.object.select_all(action='DESELECT')
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    save(name)


def add(name, operator, material=None, smooth=False, **arguments):
    """Runs a primitive operator, names what it made and gives it its material."""
    operator(**arguments)
    thing = bpy.context.object
    thing.name = thing.data.name = name
    if material:
        thing.data.materials.append(material)
    if smooth:
        bpy.ops.object.shade_smooth(use_auto_smooth=True)
    return thing


def box(name, size, location, material=None, bevel=0.0, rotation=0.0):
    """A box of full extents `size`; the size is applied to the mesh, the bevel a modifier."""
    thing = add(name, bpy.ops.mesh.primitive_cube_add, material, size=1.0, location=location)
    thing.data.transform(Matrix.Diagonal((*size, 1.0)))
    thing.rotation_euler.z = rotation
    if bevel:
        modifier = thing.modifiers.new('Bevel', 'BEVEL')
        modifier.width, modifier.segments = bevel, 3
    return thing


def slab(name, low, high, material):
    """A box between two corners."""
    return box(name, [b - a for a, b in zip(low, high)], [(a + b) / 2 for a, b in zip(low, high)],
               material)


def alcove(width, depth, height, rest, left, right, wall=0.2):
    """A room without its front wall, which is at y = -depth / 2; its floor is at z = 0."""
    x, y = width / 2, depth / 2
    slab('Floor', (-x - wall, -y, -wall), (x + wall, y + wall, 0.0), rest)
    slab('Ceiling', (-x - wall, -y, height), (x + wall, y + wall, height + wall), rest)
    slab('Back', (-x, y, 0.0), (x, y + wall, height), rest)
    slab('Left', (-x - wall, -y, 0.0), (-x, y + wall, height), left)
    slab('Right', (x, -y, 0.0), (x + wall, y + wall, height), right)


def sphere(name, radius, location, material=None):
    return add(name, bpy.ops.mesh.primitive_uv_sphere_add, material, smooth=True, segments=64,
               ring_count=32, radius=radius, location=location)


def matt(name, color):
    """A Diffuse BSDF without roughness: Lambert in every engine."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.diffuse_color = (*color, 1.0)
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new('ShaderNodeBsdfDiffuse')
    shader.inputs['Color'].default_value = (*color, 1.0)
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    output.location.x = 300
    tree.links.new(shader.outputs[0], output.inputs['Surface'])
    return material


def volume(name, shader_type, **inputs):
    """A material with a volume shader alone; Emission_Color=... sets input "Emission Color"."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(shader_type)
    for key, value in inputs.items():
        shader.inputs[key.replace('_', ' ')].default_value = value
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    output.location.x = 300
    tree.links.new(shader.outputs[0], output.inputs['Volume'])
    return material


def aim(thing, location, target):
    thing.location = location
    thing.rotation_euler = (Vector(target) - Vector(location)).to_track_quat('-Z', 'Y').to_euler()


def lamp(name, kind, location, target, energy, color=(1.0, 1.0, 1.0), **settings):
    """A lamp at `location` that shines at `target`. Kinds and settings are Blender's."""
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    for key, value in settings.items():
        setattr(data, key, value)
    thing = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(thing)
    aim(thing, location, target)
    return thing


def camera(location, target, lens=50.0, **settings):
    data = bpy.data.cameras.new('Camera')
    data.lens = lens
    for key, value in settings.items():
        setattr(data, key, value)
    thing = bpy.data.objects.new('Camera', data)
    bpy.context.collection.objects.link(thing)
    aim(thing, location, target)
    bpy.context.scene.camera = thing
    return thing


def world(color, strength=1.0):
    """A plain sky of one radiance."""
    block = bpy.data.worlds.new('World')
    bpy.context.scene.world = block
    block.use_nodes = True
    background = block.node_tree.nodes['Background']
    background.inputs['Color'].default_value = (*color, 1.0)
    background.inputs['Strength'].default_value = strength
    return block
