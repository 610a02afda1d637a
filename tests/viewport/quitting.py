# SPDX-License-Identifier: GPL-3.0-or-later
"""A scenario: quits while a view works; that it ends well is seen outside."""

import os

import bpy
from drive import look_through_camera, scenario, shade

ENDLESS = 65536


@scenario("cloud")
def quit_at_work():
    look_through_camera()
    bpy.context.scene.brume.viewport_samples = ENDLESS
    shade('RENDERED')
    yield float(os.environ["BRUME_QUIT_AFTER"])
