# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds surfaces.blend: one thing of each kind of material, mesh and instance, in sun, lamp and
sky, without a medium.

Pass index of the objects: 1 matt, 2 glossy, 3 seen through; scripts measure them apart.
"""
import math
import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'surfaces'
MATT, GLOSSY, CLEAR = 1, 2, 3


def tree_of(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    output.location.x = 600
    return material, tree, output


def add_node(tree, kind, x, **inputs):
    found = tree.nodes.new(kind)
    found.location.x = x
    for key, value in inputs.items():
        found.inputs[key.replace('_', ' ')].default_value = value
    return found


def shaded(name, kind, **inputs):
    """A material of one shader node; colours as triples."""
    material, tree, output = tree_of(name)
    inputs = {key: (*value, 1.0) if isinstance(value, tuple) else value
              for key, value in inputs.items()}
    shader = add_node(tree, kind, 300, **inputs)
    tree.links.new(shader.outputs[0], output.inputs['Surface'])
    return material


def principled(name, color, **inputs):
    return shaded(name, 'ShaderNodeBsdfPrincipled', Base_Color=color, **inputs)


def mixed(name, factor, one, two):
    """Mix Shader of two (node kind, inputs)."""
    material, tree, output = tree_of(name)
    mix = add_node(tree, 'ShaderNodeMixShader', 300, Fac=factor)
    for i, (kind, color) in enumerate((one, two)):
        shader = add_node(tree, kind, 0, Color=(*color, 1.0))
        tree.links.new(shader.outputs[0], mix.inputs[1 + i])
        if kind == 'ShaderNodeBsdfGlossy':
            shader.inputs['Roughness'].default_value = 0.4
    tree.links.new(mix.outputs[0], output.inputs['Surface'])
    return material


def image(name, pixels, color=True):
    """A packed image; pixels (height, width, 4) as an sRGB file would hold them, bottom row
    first."""
    height, width, _ = pixels.shape
    block = bpy.data.images.new(name, width, height, alpha=True)
    block.colorspace_settings.name = 'sRGB' if color else 'Non-Color'
    block.pixels.foreach_set(pixels.astype(np.float32).ravel())
    block.pack()
    return block


def checker_image():
    """Coloured tiles that are no two alike, so that a wrong turn or flip is seen."""
    rng = np.random.default_rng(3)
    tiles = rng.uniform(0.25, 0.95, (4, 4, 3))
    pixels = np.ones((32, 32, 4))
    pixels[..., :3] = tiles.repeat(8, 0).repeat(8, 1)
    return image('Tiles', pixels)


def roughness_image():
    y, x = np.mgrid[0:32, 0:32] / 31.0
    pixels = np.ones((32, 32, 4))
    pixels[..., :3] = (0.25 + 0.6 * x * (0.5 + 0.5 * y))[..., None]
    return image('Roughness', pixels, color=False)


def leaf_image(name, soft):
    """A leaf, longer than wide and lopsided; alpha falls over the rim if soft."""
    y, x = (np.mgrid[0:64, 0:64] + 0.5) / 64.0
    inside = 0.30 * np.sin(math.pi * y) ** 0.8 * (1.0 - 0.35 * y) - np.abs(x - 0.45 - 0.1 * y)
    pixels = np.empty((64, 64, 4))
    pixels[..., 0] = 0.35 + 0.3 * y
    pixels[..., 1] = 0.62
    pixels[..., 2] = 0.22 + 0.2 * x
    pixels[..., 3] = np.clip(inside / 0.12, 0.0, 1.0) if soft else inside > 0.0
    return image(name, pixels)


def leaf(name, soft):
    """Diffuse by an image, cut out by its alpha."""
    material, tree, output = tree_of(name)
    texture = add_node(tree, 'ShaderNodeTexImage', -300)
    texture.image = leaf_image(name, soft)
    through = add_node(tree, 'ShaderNodeBsdfTransparent', 0)
    solid = add_node(tree, 'ShaderNodeBsdfDiffuse', 0)
    mix = add_node(tree, 'ShaderNodeMixShader', 300)
    tree.links.new(texture.outputs['Color'], solid.inputs['Color'])
    tree.links.new(texture.outputs['Alpha'], mix.inputs['Fac'])
    tree.links.new(through.outputs[0], mix.inputs[1])
    tree.links.new(solid.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs['Surface'])
    material.blend_method = 'BLEND' if soft else 'CLIP'
    material.shadow_method = 'HASHED' if soft else 'CLIP'
    return material


def tiled(name):
    """Principled with images on colour and roughness."""
    material, tree, output = tree_of(name)
    shader = add_node(tree, 'ShaderNodeBsdfPrincipled', 300, Specular=0.5)
    for socket, block in (('Base Color', checker_image()), ('Roughness', roughness_image())):
        texture = add_node(tree, 'ShaderNodeTexImage', 0)
        texture.image = block
        tree.links.new(texture.outputs['Color'], shader.inputs[socket])
    tree.links.new(shader.outputs[0], output.inputs['Surface'])
    return material


def place(thing, index, rotation=None):
    thing.pass_index = index
    if rotation:
        thing.rotation_euler = rotation
    return thing


def card(name, location, material, index, turn=0.25):
    thing = staging.add(name, bpy.ops.mesh.primitive_plane_add, material, size=0.9,
                        location=location)
    return place(thing, index, (math.pi / 2, 0.0, turn))


staging.begin(NAME)
grey = staging.matt('Grey', (0.36, 0.36, 0.36))
clay = staging.matt('Clay', (0.60, 0.30, 0.18))
blue = staging.matt('Blue', (0.12, 0.22, 0.55))
place(staging.add('Floor', bpy.ops.mesh.primitive_plane_add, grey, size=14.0), MATT)

# Front row: balls of the common materials.
for number, (name, index, material) in enumerate((
        ('Matt', MATT, principled('Matt', (0.7, 0.6, 0.2), Roughness=1.0, Specular=0.0)),
        ('Plastic', GLOSSY, principled('Plastic', (0.6, 0.06, 0.05), Roughness=0.4)),
        ('Metal', GLOSSY, principled('Metal', (0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.2)),
        ('Rough metal', GLOSSY, principled('Rough metal', (0.75, 0.78, 0.8), Metallic=1.0,
                                           Roughness=0.55)),
        ('Glossy', GLOSSY, shaded('Glossy', 'ShaderNodeBsdfGlossy', Color=(0.3, 0.7, 0.5),
                                  Roughness=0.35)),
        ('Mix', GLOSSY, mixed('Mix', 0.3, ('ShaderNodeBsdfDiffuse', (0.5, 0.2, 0.6)),
                              ('ShaderNodeBsdfGlossy', (0.8, 0.8, 0.8)))))):
    place(staging.sphere(name, 0.32, (-2.0 + 0.8 * number, -1.5, 0.32), material), index)

# Middle row: what is seen through, and what carries images.
card('Coloured glass', (-2.1, -0.3, 0.45), shaded(
    'Coloured glass', 'ShaderNodeBsdfTransparent', Color=(0.85, 0.35, 0.15)), CLEAR)
card('Half', (-1.05, -0.3, 0.45), principled('Half', (0.15, 0.4, 0.65), Roughness=1.0,
                                             Specular=0.0, Alpha=0.5), CLEAR)
card('Leaf', (-0.05, -0.3, 0.45), leaf('Leaf', True), CLEAR)
card('Cut leaf', (0.85, -0.3, 0.45), leaf('Cut leaf', False), CLEAR)
place(staging.box('Tiled', (0.6, 0.6, 0.6), (1.75, -0.2, 0.3), tiled('Tiled'), rotation=0.6),
      GLOSSY)
glow = place(staging.box('Glow', (0.3, 0.3, 0.3), (2.35, -0.75, 0.15), shaded(
    'Glow', 'ShaderNodeEmission', Color=(0.2, 0.8, 1.0), Strength=1.5), rotation=0.2), MATT)
# Seen, but lighting nothing: a mesh that glows is no lamp.
glow.visible_diffuse = glow.visible_glossy = glow.visible_volume_scatter = False

# Back row: kinds of mesh and of instance.
ball = staging.add('Facets', bpy.ops.mesh.primitive_ico_sphere_add, clay, subdivisions=2,
                   radius=0.35, location=(-2.3, 0.9, 0.35))
place(ball, MATT)
block = place(staging.box('Slots', (0.55, 0.55, 0.55), (-1.5, 1.0, 0.275), clay, rotation=0.7),
              MATT)
for material in (blue, grey):
    block.data.materials.append(material)
for number, polygon in enumerate(block.data.polygons):
    polygon.material_index = number % 3
bent = place(staging.box('Custom normals', (0.5, 0.5, 0.5), (-0.75, 1.0, 0.25), grey), MATT)
bent.data.use_auto_smooth = True
bent.data.normals_split_custom_set(
    [tuple((bent.data.vertices[loop.vertex_index].co / 0.433)[:]) for loop in bent.data.loops])
bpy.ops.object.text_add(location=(-0.3, 0.95, 0.0), rotation=(math.pi / 2, 0.0, 0.1))
text = place(bpy.context.object, MATT)
text.name, text.data.body, text.data.size, text.data.extrude = 'Text', 'Fog', 0.55, 0.06
text.data.materials.append(blue)
bpy.ops.curve.primitive_bezier_circle_add(radius=0.3, location=(1.05, 0.95, 0.36),
                                          rotation=(1.2, 0.0, 0.5))
ring = place(bpy.context.object, MATT)
ring.name, ring.data.bevel_depth, ring.data.bevel_resolution = 'Curve', 0.07, 6
ring.data.materials.append(clay)

# A collection, hidden itself, that two empties place.
parts = bpy.data.collections.new('Parts')
for thing in (staging.add('Cone', bpy.ops.mesh.primitive_cone_add, blue, smooth=True, vertices=48,
                          radius1=0.16, depth=0.4, location=(0.0, 0.0, 0.2)),
              staging.box('Foot', (0.4, 0.4, 0.06), (0.0, 0.0, 0.03), clay)):
    place(thing, MATT)
    for collection in thing.users_collection:
        collection.objects.unlink(thing)
    parts.objects.link(thing)
for number in range(2):
    empty = bpy.data.objects.new(f'Copy {number + 1}', None)
    empty.instance_type, empty.instance_collection = 'COLLECTION', parts
    empty.location = (1.75 + 0.6 * number, 0.95, 0.0)
    empty.rotation_euler.z = 0.5 * number
    empty.scale.z = 1.0 + 0.5 * number
    bpy.context.scene.collection.objects.link(empty)

# Balls on the points of a grid, by geometry nodes.
points = place(staging.add('Points', bpy.ops.mesh.primitive_grid_add, clay, x_subdivisions=5,
                           y_subdivisions=2, size=1.0, location=(-1.6, 1.9, 0.12)), MATT)
points.scale = (1.2, 0.35, 1.0)
group = bpy.data.node_groups.new('Balls', 'GeometryNodeTree')
group.inputs.new('NodeSocketGeometry', 'Geometry')
group.outputs.new('NodeSocketGeometry', 'Geometry')
source, target = group.nodes.new('NodeGroupInput'), group.nodes.new('NodeGroupOutput')
shape = group.nodes.new('GeometryNodeMeshIcoSphere')
shape.inputs['Radius'].default_value, shape.inputs['Subdivisions'].default_value = 0.1, 3
paint = group.nodes.new('GeometryNodeSetMaterial')
paint.inputs['Material'].default_value = clay
smooth = group.nodes.new('GeometryNodeSetShadeSmooth')
copies = group.nodes.new('GeometryNodeInstanceOnPoints')
for a, b in ((source.outputs[0], copies.inputs['Points']), (shape.outputs[0], paint.inputs[0]),
             (paint.outputs[0], smooth.inputs[0]), (smooth.outputs[0], copies.inputs['Instance']),
             (copies.outputs[0], target.inputs[0])):
    group.links.new(a, b)
points.modifiers.new('Balls', 'NODES').node_group = group

# Cubes by a particle system; the emitter itself is not shown.
bit = place(staging.box('Bit', (0.12, 0.12, 0.12), (0.0, 0.0, -3.0), blue), MATT)
bit.hide_render = True
emitter = staging.add('Emitter', bpy.ops.mesh.primitive_plane_add, size=1.0,
                      location=(0.9, 1.9, 0.1))
emitter.scale = (1.3, 0.35, 1.0)
emitter.modifiers.new('Bits', 'PARTICLE_SYSTEM')
settings = emitter.particle_systems[0].settings
settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 24, 1, 1, 1000
settings.physics_type = 'NO'
settings.render_type, settings.instance_object = 'OBJECT', bit
settings.particle_size, settings.size_random = 1.0, 0.5
settings.use_rotations, settings.rotation_mode = True, 'OB_X'
settings.use_rotation_instance = True
emitter.show_instancer_for_render = False

staging.lamp('Sun', 'SUN', (-3.0, -4.0, 5.0), (0.0, 0.0, 0.0), 1.6, (1.0, 0.95, 0.85), angle=0.03)
staging.lamp('Point', 'POINT', (2.2, -2.4, 2.0), (2.2, -2.4, 0.0), 90.0, (0.8, 0.9, 1.0),
             shadow_soft_size=0.15)
staging.world((0.45, 0.60, 0.90), 0.5)
staging.camera((0.1, -6.2, 3.1), (0.1, 0.0, 0.35), lens=42.0)
staging.finish(NAME)
