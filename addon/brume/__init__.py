# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume: a render engine for fog, smoke and clouds."""

bl_info = {
    "name": "Brume",
    "author": "The Brume developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "category": "Render",
    "description": "Render engine for fog, smoke and clouds",
    "location": "Render Properties > Render Engine",
}

from . import engine, fog, panels, properties, session, viewport  # noqa: E402
from .export import changes  # noqa: E402


def register():
    properties.register()
    fog.register()
    changes.register()
    engine.register()
    panels.register()


def unregister():
    panels.unregister()
    engine.unregister()
    changes.unregister()
    fog.unregister()
    properties.unregister()
    viewport.close()
    session.close()
