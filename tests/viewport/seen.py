# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: what a rendered view shows is what a final render shows, in camera view, perspective
and orthographic."""

import bpy
from drive import SAMPLES, alone, look_through_camera, regions, rendered_views, scenario, settled
from eyes import as_camera_sees, as_rendered


def compared():
    area = yield from alone()
    region, = regions(area)
    view = region.data
    scene = bpy.context.scene
    camera, settings = scene.camera, scene.brume
    # In camera view the pixels are others than the render's, and so is their noise.
    settings.samples = settings.viewport_samples = 8
    look_through_camera()
    yield from rendered_views()
    found = {"CAMERA": as_camera_sees(region, "camera view")}
    settings.samples = settings.viewport_samples = SAMPLES
    for kind in ('PERSP', 'ORTHO'):
        view.view_perspective = kind
        area.spaces.active.lens = 50.0
        view.view_matrix = camera.matrix_world.inverted()
        yield from settled()
        found[kind] = as_rendered(region, f"{kind} view")
    return found


@scenario("plume")
def plume():
    return (yield from compared())


@scenario("cloud")
def cloud():
    return (yield from compared())


@scenario("room")
def room():
    return (yield from compared())


@scenario("lamps")
def lamps():
    return (yield from compared())
