# SPDX-License-Identifier: GPL-3.0-or-later
"""What cases change in a scene, by name: its camera, film or world. Run inside Blender; also
imported outside of it, where the functions' text goes into the references' digests."""


def passes(scene):
    """A pixel's samples all through its centre, as the first sample tells the depth."""
    scene.render.filter_size = 0.01


def orthographic(scene):
    scene.camera.data.type = 'ORTHO'
    scene.camera.data.ortho_scale = 5.0


def shifted(scene):
    camera = scene.camera.data
    camera.sensor_fit, camera.sensor_height = 'VERTICAL', 20.0
    camera.shift_x, camera.shift_y = 0.22, -0.10
    scene.render.resolution_x, scene.render.resolution_y = 160, 96
    scene.render.pixel_aspect_x = 1.25


def clipped(scene):
    """Both planes pass through things."""
    scene.camera.data.clip_start, scene.camera.data.clip_end = 5.3, 7.6


def border(scene):
    scene.render.use_border, scene.render.use_crop_to_border = True, False
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.125, 0.875


def cropped(scene):
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.125, 0.875


def film_transparent(scene):
    """Without the floor: the sky shows around things and through them."""
    scene.render.film_transparent = True
    scene.objects['Floor'].hide_render = True


def percentage(scene):
    scene.render.resolution_x = scene.render.resolution_y = 256
    scene.render.resolution_percentage = 50


def inside(scene):
    """The camera in the fog."""
    scene.camera.location = (0.3, -0.5, 1.1)
    scene.camera.rotation_euler = (1.5, 0.0, 0.35)
    scene.camera.data.lens = 24.0


def focused(scene):
    """A wide lens of five blades."""
    camera = scene.camera.data
    camera.dof.use_dof = True
    camera.dof.focus_distance = 7.0
    camera.dof.aperture_fstop = 0.2
    camera.dof.aperture_blades, camera.dof.aperture_rotation = 5, 0.3
    camera.dof.aperture_ratio = 1.5


def fog_on_film(scene):
    scene.render.film_transparent = True
    scene.objects['Floor'].hide_render = True


def isotropic(scene):
    fog = scene.objects['Fog'].active_material.node_tree.nodes['Volume Scatter']
    fog.inputs['Anisotropy'].default_value = 0.0


def forward(scene):
    fog = scene.objects['Fog'].active_material.node_tree.nodes['Volume Scatter']
    fog.inputs['Anisotropy'].default_value = 0.8


def milk(scene):
    """Optical thickness 24 across, nothing absorbed, a light sky."""
    fog = scene.objects['Fog'].active_material.node_tree.nodes['Volume Scatter']
    fog.inputs['Color'].default_value = (1.0, 1.0, 1.0, 1.0)
    fog.inputs['Density'].default_value = 12.0
    fog.inputs['Anisotropy'].default_value = 0.0
    scene.world.node_tree.nodes['Background'].inputs['Strength'].default_value = 1.0


def textured(scene):
    """Drifts of noise in the fog, on one side of a slope askew to it, thinner upwards."""
    tree = scene.objects['Fog'].active_material.node_tree
    new, link = tree.nodes.new, tree.links.new
    noise, coordinates, mapping, slope, place, height = map(new, (
        'ShaderNodeTexNoise', 'ShaderNodeTexCoord', 'ShaderNodeMapping', 'ShaderNodeTexGradient',
        'ShaderNodeNewGeometry', 'ShaderNodeSeparateXYZ'))
    for name, value in (('Scale', 3.5), ('Detail', 2.5), ('Roughness', 0.4), ('Distortion', 0.6)):
        noise.inputs[name].default_value = value  # at generated coordinates
    link(coordinates.outputs['Object'], mapping.inputs['Vector'])
    mapping.inputs['Rotation'].default_value = (0.3, 0.2, 0.8)
    mapping.inputs['Location'].default_value = (0.6, 0.0, 0.0)
    link(mapping.outputs[0], slope.inputs['Vector'])
    link(place.outputs['Position'], height.inputs[0])

    def math(operation, *values):
        node = new('ShaderNodeMath')
        node.operation = operation
        for socket, value in zip(node.inputs, values):
            if isinstance(value, float):
                socket.default_value = value
            else:
                link(value, socket)
        return node.outputs[0]
    drifts = math('MULTIPLY', math('MAXIMUM', math('SUBTRACT', noise.outputs[0], 0.45), 0.0),
                  40.0)
    thinner = math('SUBTRACT', 1.6, math('MULTIPLY', height.outputs['Z'], 0.7))
    density = math('MULTIPLY', math('MULTIPLY', drifts, slope.outputs[1]), thinner)
    link(density, tree.nodes['Volume Scatter'].inputs['Density'])


def graded(scene):
    """The cloud's density along its generated coordinates."""
    tree = scene.objects['Cloud'].active_material.node_tree
    new, link = tree.nodes.new, tree.links.new
    principled = next(n for n in tree.nodes if n.bl_idname == 'ShaderNodeVolumePrincipled')
    slope, steeper = new('ShaderNodeTexGradient'), new('ShaderNodeMath')
    coordinates = new('ShaderNodeTexCoord')
    steeper.operation = 'MULTIPLY'
    steeper.inputs[1].default_value = 2.0 * principled.inputs['Density'].default_value
    link(coordinates.outputs['Generated'], slope.inputs['Vector'])
    link(slope.outputs[1], steeper.inputs[0])
    link(steeper.outputs[0], principled.inputs['Density'])


def sky_alone(scene):
    """A plain sky over matt things that hide it from one another."""
    for thing in scene.objects:
        if thing.type == 'LIGHT':
            thing.hide_render = True
    background = scene.world.node_tree.nodes['Background']
    background.inputs['Color'].default_value = (0.4, 0.6, 1.0, 1.0)
    background.inputs['Strength'].default_value = 1.0


def lamps_seen(scene):
    """From below, where the lamps shine into the camera."""
    for thing in scene.objects:
        if thing.type == 'LIGHT':
            thing.visible_camera = True
            thing.data.energy *= 0.1
    scene.objects['Wall'].hide_render = True
    scene.camera.location = (0.4, 4.5, 0.3)
    scene.camera.rotation_euler = (1.95, 0.0, 3.14)
    scene.camera.data.lens = 26.0


def _mapping(scene):
    return next(node for node in scene.world.node_tree.nodes if node.type == 'MAPPING')


def hdr(scene):
    node = next(node for node in scene.world.node_tree.nodes if node.type == 'TEX_ENVIRONMENT')
    node.image.filepath = '//environment.hdr'
    node.image.reload()


def turned_as_point(scene):
    _mapping(scene).inputs['Rotation'].default_value = (0.5, -0.35, 2.0)


def turned_as_texture(scene):
    _mapping(scene).vector_type = 'TEXTURE'
    _mapping(scene).inputs['Rotation'].default_value = (0.5, -0.35, 2.0)
