# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a 3D view's region is rendered, and through which matrices."""

from typing import NamedTuple

import numpy as np

from .export.camera import Lens, cropped, lens_of


class Framing(NamedTuple):
    """A part of a region (pixels from the lower left) and what is seen in it. Compares by value:
    a view shows another picture exactly if its framing differs."""
    region: tuple           # width, height
    part: tuple             # x, y, width, height; all of the region, or a border's inside
    view_from_world: tuple  # 16 numbers by rows
    clip_from_view: tuple   # of the part
    clip_near: float
    clip_far: float
    lens: Lens


def state(context):
    """What a region's framing depends on beside the scene, to be compared with another."""
    space, region_view = context.space_data, context.region_data
    return (context.region.width, context.region.height, space.clip_end, space.use_render_border,
            space.render_border_min_x, space.render_border_min_y, space.render_border_max_x,
            space.render_border_max_y, *np.array(region_view.window_matrix).ravel().tolist(),
            *np.array(region_view.view_matrix).ravel().tolist())


def clip_range(window_matrix, clip_end):
    """(near, far) of an OpenGL projection: orthographic views see behind their plane too, which
    they say nowhere else. A perspective's far end is in its matrix, but rounded away where it is
    far: clip_end tells it."""
    scale, offset = window_matrix[2][2], window_matrix[2][3]
    if window_matrix[3][3] == 0.0:
        near = offset / (scale - 1.0)
        return near, max(clip_end, near * (1.0 + 1e-4))
    return (offset + 1.0) / scale, (offset - 1.0) / scale


def camera_frame(camera, scene, window_matrix):
    """The camera's picture within the region, as (x0, y0, x1, y1) in fractions of it."""
    corners = np.ones((4, 4))
    corners[:, :3] = [tuple(corner) for corner in camera.data.view_frame(scene=scene)]
    clip = corners @ np.array(window_matrix).T
    places = clip[:, :2] / clip[:, 3:] * 0.5 + 0.5
    return (*places.min(0).tolist(), *places.max(0).tolist())


def seen_through(space, region_view, scene):
    """The camera object that a 3D view looks through; None if it looks through none, or through an
    object that is no camera."""
    if region_view.view_perspective != 'CAMERA':
        return None
    camera = space.camera if space.use_local_camera else scene.camera
    return camera if camera is not None and camera.type == 'CAMERA' else None


def border(space, region_view, scene):
    """The border that is drawn by hand (Ctrl-B), in fractions of the region; None without."""
    if region_view.view_perspective != 'CAMERA':
        if not space.use_render_border:
            return None
        return (space.render_border_min_x, space.render_border_min_y,
                space.render_border_max_x, space.render_border_max_y)
    render, camera = scene.render, seen_through(space, region_view, scene)
    if not render.use_border or camera is None:
        return None
    x0, y0, x1, y1 = camera_frame(camera, scene, region_view.window_matrix)
    return (x0 + render.border_min_x * (x1 - x0), y0 + render.border_min_y * (y1 - y0),
            x0 + render.border_max_x * (x1 - x0), y0 + render.border_max_y * (y1 - y0))


def part_of(region, fractions):
    """Whole pixels (x, y, width, height) of a region's part, which may reach beyond it."""
    if fractions is None:
        return 0, 0, *region
    x0, y0, x1, y1 = (round(min(max(value, 0.0), 1.0) * side)
                      for value, side in zip(fractions, region * 2))
    return x0, y0, x1 - x0, y1 - y0


def of(context, scene):
    """The framing of a 3D view's region; None if nothing of it is rendered."""
    region = context.region.width, context.region.height
    region_view = context.region_data
    part = part_of(region, border(context.space_data, region_view, scene))
    if part[2] < 1 or part[3] < 1:
        return None
    camera = seen_through(context.space_data, region_view, scene)
    clip_end = camera.data.clip_end if camera else context.space_data.clip_end
    projection = cropped(np.array(region_view.window_matrix, np.float64), region, part)
    return Framing(region, part, tuple(np.array(region_view.view_matrix).ravel().tolist()),
                   tuple(projection.ravel().tolist()),
                   *clip_range(region_view.window_matrix, clip_end), lens_of(camera))
