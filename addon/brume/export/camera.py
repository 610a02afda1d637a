# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of a final render: matrices of the pixels that are asked for."""

from typing import NamedTuple

import numpy as np

from ..native import BrumeError


class Lens(NamedTuple):
    """A thin lens; compares by value. Without one all is sharp."""
    radius: float = 0.0    # m, of the circle around its opening
    focus: float = 1.0     # m along the view axis, of what is sharp
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0


class Camera(NamedTuple):
    view_from_world: np.ndarray
    clip_from_view: np.ndarray
    clip_near: float
    clip_far: float
    lens: Lens


def _focus(ob):
    """How far along its axis a camera is focused: on an object, on a bone of one, or as it says."""
    dof = ob.data.dof
    if dof.focus_object is None:
        return dof.focus_distance
    place = dof.focus_object.matrix_world
    bone = dof.focus_object.pose and dof.focus_object.pose.bones.get(dof.focus_subtarget)
    if bone:
        place = place @ bone.matrix
    axis = ob.matrix_world.to_3x3().col[2].normalized()
    return abs(axis.dot(place.translation - ob.matrix_world.translation))


def lens_of(ob):
    """The lens of an object, as Cycles has it: of a parallel view as if it were one of 1 m."""
    if ob is None or ob.type != 'CAMERA' or not ob.data.dof.use_dof:
        return Lens()
    data, dof = ob.data, ob.data.dof
    length = 1.0 if data.type == 'ORTHO' else data.lens * 1e-3
    # Within what the library takes; Blender has no upper ends.
    return Lens(min(0.5 * length / max(dof.aperture_fstop, 1e-5), 1e6),
                min(max(_focus(ob), 1e-5), 1e30), dof.aperture_blades, dof.aperture_rotation,
                min(max(dof.aperture_ratio, 0.01), 100.0))


def border_pixels(render, width, height):
    """x, y, width and height of the border in pixels, as Blender cuts it; the whole without."""
    if not render.use_border:
        return 0, 0, width, height
    # Blender multiplies and truncates single-precision floats.
    x0, x1 = (int(np.float32(f) * np.float32(width))
              for f in (render.border_min_x, render.border_max_x))
    y0, y1 = (int(np.float32(f) * np.float32(height))
              for f in (render.border_min_y, render.border_max_y))
    return x0, y0, x1 - x0, y1 - y0


def cropped(clip_from_view, full, part):
    """The projection of a part (x, y, width, height) of full (width, height)."""
    x, y, width, height = part
    low = np.array((x / full[0], y / full[1])) * 2 - 1
    high = np.array(((x + width) / full[0], (y + height) / full[1])) * 2 - 1
    crop = np.eye(4)
    crop[0, 0], crop[1, 1] = 2 / (high - low)
    crop[0, 3], crop[1, 3] = -(high + low) / (high - low)
    return crop @ clip_from_view


def final(engine, depsgraph, target, full, part):
    """The scene's camera for part (x, y, width, height) of full (width, height) pixels."""
    scene = depsgraph.scene_eval
    ob = engine.camera_override or scene.camera
    if ob is None:
        raise BrumeError("NO_CAMERA", f'Scene "{scene.name}" has no camera.')
    ob = ob.evaluated_get(depsgraph)
    owner = f'Camera "{ob.name}"'
    if ob.type == 'CAMERA':
        if ob.data.type not in {'PERSP', 'ORTHO'}:
            target.reports.unsupported(owner, f"type {ob.data.type} is shown as perspective.")
    if scene.render.use_motion_blur:
        target.reports.unsupported(f'Scene "{scene.name}"', "motion blur is not shown.")
    render = scene.render
    projection = ob.calc_matrix_camera(depsgraph, x=full[0], y=full[1],
                                       scale_x=render.pixel_aspect_x,
                                       scale_y=render.pixel_aspect_y)
    pose = engine.camera_model_matrix(ob).normalized()
    near, far = (ob.data.clip_start, ob.data.clip_end) if ob.type == 'CAMERA' else (0.1, 100.0)
    return Camera(np.array(pose.inverted()), cropped(np.array(projection), full, part), near, far,
                  lens_of(ob))
