# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: every kind of view, and what artists do to one."""

import bpy
import numpy as np
from drive import (
    SIZE,
    alone,
    at,
    bare,
    drag,
    drag_pixels,
    look_through_camera,
    press_in,
    regions,
    rendered_views,
    scenario,
    settled,
    shade,
    stages,
    view_area,
    view_areas,
    views,
    windows,
)
from eyes import (
    VIEW_SENSOR,
    alike,
    as_camera_sees,
    as_rendered,
    camera_box,
    different,
    part,
    shown,
)


def from_the_front(area):
    """A view of all there is, about as the scene's camera has it."""
    space, camera = area.spaces.active, bpy.context.scene.camera
    space.lens = camera.data.lens * VIEW_SENSOR / camera.data.sensor_width
    space.region_3d.view_perspective = 'PERSP'
    space.region_3d.view_matrix = camera.matrix_world.inverted()


def alone_rendered(camera=False):
    """A view alone, rendered and settled; gives its area and region."""
    area = yield from alone()
    if camera:
        look_through_camera()
    else:
        from_the_front(area)
    yield from rendered_views()
    return area, regions(area)[0]


def size_of(view):
    return view.picture.framing.region


@scenario()
def camera_offset_zoom_and_shift():
    area, region = yield from alone_rendered(camera=True)
    view = region.data
    before = shown(region)
    view.view_camera_zoom, view.view_camera_offset = 20.0, (0.06, -0.04)
    bpy.context.scene.camera.data.shift_x = 0.1
    bpy.context.scene.camera.data.shift_y = -0.05
    yield from settled()
    different(shown(region), before, "after zoom, offset and shift")
    return as_camera_sees(region, "zoom, offset and shift")


@scenario()
def passepartout():
    area, region = yield from alone_rendered(camera=True)
    camera = bpy.context.scene.camera.data
    region.data.view_camera_zoom = -12.0
    yield from settled()
    plain = shown(region)
    x0, y0, x1, y1 = camera_box(region)
    assert x0 > 0.05, f"the camera's picture fills the view: {x0}"
    beside, within = (0.0, 0.3, x0 - 0.01, 0.7), (x0 + 0.02, y0 + 0.02, x1 - 0.02, y1 - 0.02)
    overlay = area.spaces.active.overlay
    overlay.show_overlays = True
    overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = False
    overlay.show_object_origins = overlay.show_extras = overlay.show_text = False
    overlay.show_outline_selected = overlay.show_relationship_lines = overlay.show_cursor = False
    bpy.data.objects["Fog"].display_type = 'TEXTURED'  # its wires would be drawn
    camera.show_passepartout, camera.passepartout_alpha = True, 1.0
    yield from settled()
    covered = shown(region)
    assert part(plain, beside).mean() > 0.05  # there is a picture to be covered
    assert part(covered, beside).mean() < 0.1 * part(plain, beside).mean()
    alike(part(covered, within), part(plain, within), "inside of the passepartout")


@scenario()
def border_in_camera_view():
    area, region = yield from alone_rendered(camera=True)
    scene = bpy.context.scene
    whole = shown(region)
    x0, y0, x1, y1 = camera_box(region)
    yield from press_in(region, "ctrl+b")
    middle = (x0 + x1) / 2, (y0 + y1) / 2
    yield from drag(region, (x0 + 0.1, y0 + 0.1), middle)
    assert scene.render.use_border
    yield from settled()
    picture = shown(region)
    inside = x0 + 0.12, y0 + 0.12, middle[0] - 0.02, middle[1] - 0.02
    alike(part(picture, inside), part(whole, inside), "inside of the border")
    different(picture, whole, "outside of the border")
    width, height = views()[0].picture.framing.part[2:]
    assert width < 0.6 * region.width and height < 0.6 * region.height
    yield from press_in(region, "ctrl+alt+b")
    assert not scene.render.use_border
    yield from settled()
    alike(shown(region), whole, "without the border")


@scenario()
def border_in_free_view():
    area, region = yield from alone_rendered()
    whole = shown(region)
    yield from press_in(region, "ctrl+b")
    yield from drag(region, (0.25, 0.25), (0.75, 0.75))
    assert area.spaces.active.use_render_border
    yield from settled()
    picture = shown(region)
    inside = 0.27, 0.27, 0.73, 0.73
    alike(part(picture, inside), part(whole, inside), "inside of the border")
    different(picture, whole, "outside of the border")
    yield from press_in(region, "ctrl+alt+b")
    yield from settled()
    alike(shown(region), whole, "without the border")


def select_only(*names):
    for ob in bpy.context.view_layer.objects:
        ob.select_set(ob.name in names)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]


@scenario("lamps")
def local_view():
    area, region = yield from alone_rendered()
    scene = bpy.context.scene
    before = shown(region)
    local = "Ball", "Spot"
    select_only(*local)
    yield from press_in(region, "KP_Divide")
    assert area.spaces.active.local_view
    yield from settled()
    view = region.data  # entering it also turned to what is selected
    for ob in scene.objects:
        ob.hide_render = ob.name not in local
    found = as_rendered(region, "local view")
    yield from press_in(region, "KP_Divide")
    assert not area.spaces.active.local_view
    view.view_matrix = scene.camera.matrix_world.inverted()
    yield from settled()
    alike(shown(region), before, "after local view")
    assert len(stages()) == 1, f"local view left its scene: {stages()}"
    return found


@scenario("lamps")
def hidden():
    area, region = yield from alone_rendered()
    before = shown(region)
    select_only("Ball")
    yield from press_in(region, "h")
    ball = bpy.data.objects["Ball"]
    assert ball.hide_get()
    yield from settled()
    ball.hide_render = True
    found = as_rendered(region, "hidden")
    different(shown(region), before, "without the hidden object", 0.005)
    ball.hide_render = False
    yield from press_in(region, "alt+h")
    assert not ball.hide_get()
    yield from settled()
    alike(shown(region), before, "shown again")
    return found


@scenario("lamps")
def holdout():
    area, region = yield from alone_rendered()
    before = shown(region)
    # A hole shows what is behind the picture: black in a file, the theme's background in a view.
    gradients = bpy.context.preferences.themes[0].view_3d.space.gradients
    kept, gradients.high_gradient = tuple(gradients.high_gradient), (0.0, 0.0, 0.0)
    bpy.data.objects["Block"].is_holdout = True
    yield from settled()
    different(shown(region), before, "with a holdout")
    found = as_rendered(region, "holdout")
    gradients.high_gradient = kept
    return found


@scenario()
def clipping():
    area, region = yield from alone_rendered()
    before = shown(region)
    space = area.spaces.active
    distance = bpy.context.scene.camera.matrix_world.translation.length
    space.clip_start, space.clip_end = distance - 0.5, distance + 1.0
    yield from settled()
    different(shown(region), before, "clipped")
    return as_rendered(region, "clipped")


@scenario()
def two_views():
    """One scene, a target each; each shows its own."""
    area, region = yield from alone_rendered()
    with at(area):
        bpy.ops.screen.area_split(direction='VERTICAL', factor=0.4)
    yield 0.2
    for area in view_areas():
        bare(area)
        shade('RENDERED', area)
    other = next(area for area in view_areas() if area != view_area())
    other.spaces.active.region_3d.view_perspective = 'ORTHO'
    yield from settled(2)
    assert len(views()) == 2 and len(stages()) == 1
    found = [as_rendered(regions(area)[0], f"view {number}")
             for number, area in enumerate(view_areas())]
    # A change gets into both.
    before = [shown(regions(area)[0]) for area in view_areas()]
    bpy.data.lights[0].energy *= 0.3
    yield from settled(2)
    for area, picture in zip(view_areas(), before):
        different(shown(regions(area)[0]), picture, "after the light's change", 0.1)
    return found


@scenario()
def quad_view():
    area, region = yield from alone_rendered()
    yield from press_in(region, "ctrl+alt+q")
    assert len(area.spaces.active.region_quadviews) == 4
    for view in area.spaces.active.region_quadviews:
        view.view_location, view.view_distance = (0.0, 0.0, 0.8), 6.0
    yield from settled(4)
    assert len(views()) == 4 and len(stages()) == 1
    found = [as_rendered(region, f"quarter {number}")
             for number, region in enumerate(regions(view_area()))]
    yield from press_in(regions(view_area())[-1], "ctrl+alt+q")
    yield from settled()
    assert len(views()) == 1
    return found


@scenario()
def resized():
    area, region = yield from alone_rendered()
    below = min(windows()[0].screen.areas, key=lambda area: area.y)
    edge = windows()[0].height - area.y
    assert below.height > 40
    middle = region.x + region.width // 2
    yield from drag_pixels((middle, edge), (middle, edge - 80))
    region, = regions(view_area())
    assert region.height < SIZE[1] - 40, f"the edge did not move: {region.height}"
    yield from settled()
    assert size_of(views()[0]) == (region.width, region.height)
    return as_rendered(region, "resized")


@scenario()
def side_panel():
    area, region = yield from alone_rendered()
    yield from press_in(region, "n")
    assert area.spaces.active.show_region_ui
    yield from settled()
    panel, = regions(area, 'UI')
    assert panel.width > 100
    region, = regions(area)
    assert size_of(views()[0]) == (region.width, region.height)
    yield from press_in(region, "n")
    yield from settled()
    return as_rendered(region, "after the panel")


@scenario()
def coarse_pixels():
    area, region = yield from alone_rendered()
    fine = shown(region)
    found = {}
    for size in ('2', '8'):
        bpy.context.scene.render.preview_pixel_size = size
        yield from settled()
        view, = views()
        height, width = view.picture.pixels.shape[:2]
        assert (width, height) == (round(region.width / int(size)),
                                   round(region.height / int(size)))
        found[size] = alike(shown(region), fine, f"pixels of {size}", 0.02 * int(size))
    return found


@scenario()
def large_interface():
    """A scale of 2 makes Blender's own pixels two wide, and so the automatic pixel size."""
    area, region = yield from alone_rendered()
    bpy.context.preferences.view.ui_scale = 2.0
    yield 0.5
    from_the_front(area)
    yield from settled()
    view, = views()
    region, = regions(view_area())
    assert size_of(view) == (region.width, region.height)
    assert view.picture.size == 2.0, view.picture.size
    bpy.context.scene.render.preview_pixel_size = '1'
    yield from settled()
    return as_rendered(region, "interface at 2")


@scenario()
def statistics():
    """In the corner, when asked for: samples, stages, lattices, memory; and warnings always."""
    area, region = yield from alone_rendered()
    view, settings = views()[0], bpy.context.scene.brume
    assert view.corner(settings) == ""
    settings.show_statistics = True
    yield from settled()
    said = view.corner(settings)
    for word in (f"Sample {settings.viewport_samples}/{settings.viewport_samples}", "march",
                 "volumes", "light", "MiB"):
        assert word in said, said
    area.spaces.active.overlay.show_overlays = True  # with them Blender shows it
    yield from settled()
    before = shown(region)
    settings.show_statistics = False
    yield from settled()
    height, width = before.shape[:2]
    corner = np.abs(shown(region) - before)[:height // 3, :width].max(2)
    assert (corner > 0.1).sum() > 200, "it is not shown"
    tree = bpy.data.objects["Floor"].active_material.node_tree
    texture = tree.nodes.new("ShaderNodeTexVoronoi")
    surface = next(node for node in tree.nodes if node.bl_idname.startswith("ShaderNodeBsdf"))
    tree.links.new(texture.outputs["Color"], surface.inputs[0])
    yield from settled()
    assert "Voronoi" in view.corner(settings), view.corner(settings)
