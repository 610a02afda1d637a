# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender: renders the open file once and saves that one result twice, as a picture
through the scene's view transform and as a multi-layer EXR with every pass.

    scripts/blender -b FILE.blend -P scripts/render_demo.py -- PICTURE.png LAYERS.exr
"""

import sys
from pathlib import Path

import bpy
from brume.properties import PASSES


def save(path, file_format, color_depth, color_mode):
    settings = bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5
        layers = file_format == "OPEN_EXR_MULTILAYER"
        settings.media_type = "MULTI_LAYER_IMAGE" if layers else "IMAGE"
    settings.file_format = file_format
    settings.color_mode = color_mode
    settings.color_depth = color_depth
    bpy.data.images["Render Result"].save_render(str(path), scene=bpy.context.scene)


def main():
    picture, layers = (Path(word).resolve()
                       for word in sys.argv[sys.argv.index("--") + 1:])
    scene = bpy.context.scene
    scene.render.engine = "BRUME"
    view_layer = bpy.context.view_layer
    for *_, switch in PASSES:
        owner, _, name = switch.rpartition(".")
        setattr(getattr(view_layer, owner) if owner else view_layer, name, True)
    bpy.ops.render.render()
    save(picture, "PNG", "8", "RGB")
    save(layers, "OPEN_EXR_MULTILAYER", "32", "RGBA")


main()
