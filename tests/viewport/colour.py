# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: the scene's display transform, film over the theme's background, and what Blender
draws over the picture."""

import bpy
import numpy as np
from drive import scenario, settled
from eyes import as_rendered, different, eye, final, part, shown
from views import alone_rendered

# From this part on two displayed values are not the same, whatever rounds.
CHANGED = 0.02


def choices(owner, name):
    """What an enumeration offers that depends on the colour configuration."""
    try:
        setattr(owner, name, "")
    except TypeError as error:  # 'enum "" not found in (...)'
        return [word for word in str(error).split("'") if word not in {"(", ", ", ")"}][1:-1]
    return []


@scenario()
def display_transforms():
    """Exposure, look, and the transforms that this Blender has."""
    area, region = yield from alone_rendered()
    settings = bpy.context.scene.view_settings
    plain, found = shown(region), {}
    settings.exposure, settings.gamma = 1.0, 0.9
    yield from settled()
    different(shown(region), plain, "with exposure")
    found["exposure"] = as_rendered(region, "exposure")
    settings.exposure, settings.gamma = 0.0, 1.0
    offered = choices(settings, "view_transform")
    tried = [name for name in ("Filmic", "AgX") if name in offered]
    assert tried, f"no such transform in {offered}"
    for name in tried:
        settings.view_transform = name
        yield from settled()
        different(shown(region), plain, f"through {name}")
        found[name] = as_rendered(region, name)
        before = shown(region)
        look = next(look for look in choices(settings, "look") if look.endswith("High Contrast"))
        settings.look = look
        yield from settled()
        different(shown(region), before, f"with the look {look}")
        found[look] = as_rendered(region, look)
        settings.look = 'None'
    return found


@scenario()
def transparent_film():
    """Over the theme's background, as another engine shows it where there is nothing."""
    bpy.data.objects["Floor"].hide_viewport = bpy.data.objects["Floor"].hide_render = True
    area, region = yield from alone_rendered()
    with_world = shown(region)
    bpy.context.scene.render.film_transparent = True
    yield from settled()
    picture = shown(region)
    different(picture, with_world, "with transparent film")
    bpy.context.scene.render.engine = 'BLENDER_WORKBENCH'
    for ob in bpy.context.scene.objects:
        ob.hide_set(True)
    yield 0.5
    background = shown(region)
    for box in ((0.0, 0.0, 0.1, 0.1), (0.9, 0.9, 1.0, 1.0)):
        off = np.abs(part(picture, box) - part(background, box)).max()
        assert off < CHANGED, f"{off} off the theme's background at {box}"
    different(part(picture, (0.4, 0.4, 0.6, 0.6)), part(background, (0.4, 0.4, 0.6, 0.6)), "fog")


def changed(picture, before):
    """Where a picture changed."""
    return np.abs(picture - before).max(-1) > CHANGED


def only(overlay, *names):
    """Overlays, of which these alone are on."""
    overlay.show_overlays = True
    for name in ("show_floor", "show_ortho_grid", "show_axis_x", "show_axis_y", "show_axis_z",
                 "show_cursor", "show_text", "show_stats", "show_extras", "show_bones",
                 "show_relationship_lines", "show_outline_selected", "show_object_origins",
                 "show_annotation", "show_motion_paths"):
        setattr(overlay, name, name in names)


def silhouette(region, name, grow=3):
    """The pixels of an object, and those of its surroundings that are surely not its own: seen by
    a final render of it alone."""
    scene = bpy.context.scene
    kept = {ob: ob.hide_render for ob in scene.objects}
    film, scene.render.film_transparent = scene.render.film_transparent, True
    for ob in kept:
        ob.hide_render = ob.type != 'LIGHT' and ob.name != name
    with eye(region):
        # A matt thing in light is brighter than transparent film, which is saved as black.
        covered = final().max(-1) > 0.01
    for ob, hide in kept.items():
        ob.hide_render = hide
    scene.render.film_transparent = film
    inner, outer = covered.copy(), covered.copy()
    for axis in (0, 1):
        for step in range(-grow, grow + 1):
            inner &= np.roll(covered, step, axis)
            outer |= np.roll(covered, step, axis)
    assert inner.sum() > 200, f"{name} covers {covered.sum()} pixels"
    return inner, ~outer


@scenario("lamps")
def overlays():
    """What an object hides of the grid and of things behind it, and what is over the picture."""
    bpy.data.objects["Floor"].hide_viewport = bpy.data.objects["Floor"].hide_render = True
    bpy.data.objects["Wall"].hide_viewport = bpy.data.objects["Wall"].hide_render = True
    background = next(node for node in bpy.context.scene.world.node_tree.nodes
                      if node.type == 'BACKGROUND')
    background.inputs["Color"].default_value = (0.3, 0.3, 0.3, 1.0)
    background.inputs["Strength"].default_value = 1.0
    area, region = yield from alone_rendered()
    overlay = area.spaces.active.overlay
    ball = bpy.data.objects["Ball"]
    inside, outside = silhouette(region, "Ball")
    yield from settled()
    plain = shown(region)

    only(overlay, "show_floor")
    yield from settled()
    grid = changed(shown(region), plain)
    assert grid[outside].sum() > 100, "there is no grid"
    # Seen from above its plane, the ball stands before all of the grid that is behind it.
    assert grid[inside].sum() == 0, f"{grid[inside].sum()} pixels of grid before the ball"

    # An empty at the far side of the ball, larger than it, among the lamps' own lines.
    only(overlay, "show_extras")
    yield from settled()
    plain = shown(region)
    away = ball.matrix_world.translation - region.data.view_matrix.inverted().translation
    empty = bpy.data.objects.new("Behind", None)
    empty.empty_display_type, empty.empty_display_size = 'SPHERE', 1.2
    empty.location = ball.matrix_world.translation + 2.0 * away.normalized()
    bpy.context.scene.collection.objects.link(empty)
    yield from settled()
    lines = changed(shown(region), plain)
    assert lines[outside].sum() > 50, "there is no empty"
    assert lines[inside].sum() == 0, f"{lines[inside].sum()} pixels of empty before the ball"

    only(overlay)
    bpy.context.view_layer.objects.active = ball
    ball.select_set(True)
    yield from settled()
    plain = shown(region)
    only(overlay, "show_outline_selected")
    yield from settled()
    outlined = changed(shown(region), plain)
    edge = ~inside & ~outside
    assert outlined[edge].sum() > 100, "there is no outline"
    assert outlined[outside].sum() < outlined[edge].sum()

    overlay.show_overlays = False
    yield from settled()
    plain = shown(region)
    area.spaces.active.show_gizmo = True
    yield from settled()
    drawn = changed(shown(region), plain)
    height, width = drawn.shape
    assert drawn[:height // 2, width * 3 // 4:].sum() > 500, "there is no navigation gizmo"
    assert drawn[:, :width // 2].sum() == 0
