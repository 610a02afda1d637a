# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's versions have in different places for the tests, and what a Blender cannot do."""

import re
import subprocess
import sys

try:
    import openvdb as vdb
except ImportError:
    import pyopenvdb as vdb  # until OpenVDB 11

__all__ = ["RENAMED", "auto_smooth", "deselect", "interface_socket", "leaks_when_resized",
           "multilayer", "vdb"]

# Inputs of the Principled BSDF: what 4.0 calls them.
RENAMED = {"Specular": "Specular_IOR_Level", "Emission": "Emission_Color",
           "Transmission": "Transmission_Weight"}


def unable(blender, python):
    """Marker of tests -> why this Blender cannot run them, by the versions of Blender and of its
    Python."""
    reasons = {}
    if blender < (4, 5):
        reasons["normalize"] = "lamps have no normalization before Blender 4.5"
    if blender < (5, 0) and python >= (3, 13):
        reasons["fluid"] = ("a Fluid domain ends Blender: its Mantaflow calls "
                            "PyImport_AppendInittab() in a running Python, which 3.13 forbids")
    if blender >= (4, 1):
        reasons["musgrave"] = "Blender 4.1 made the Musgrave Texture a part of the Noise Texture"
    if blender >= (4, 2):
        reasons["blend_method"] = "Blender 4.2 took EEVEE's blend methods away"
    if blender >= (5, 0):
        reasons["without_nodes"] = "since Blender 5.0 every material and world has nodes"
    return reasons


def leaks_when_resized(blender):
    """Whether Blender keeps memory each time a region of a window gets another size, with any
    engine: in Debian sid's 5.2.2 with llvmpipe of Mesa 26, 7 to 9 MiB with Workbench."""
    return blender >= (5, 2)


def versions(command):
    """Of the Blender that a command starts, and of its Python."""
    said = subprocess.run(
        [*command, "-b", "--factory-startup", "--python-expr",
         "import bpy, sys; print('versions', *bpy.app.version, *sys.version_info[:2])"],
        check=True, capture_output=True, text=True, timeout=60).stdout
    numbers = tuple(map(int, re.search(r"^versions ([\d ]+)$", said, re.MULTILINE)[1].split()))
    return numbers[:3], numbers[3:]


def deselect(config, items, command=None):
    """Leaves out what a Blender cannot do, and says so: a skipped test would count as failed.
    command starts that Blender; None: it is the one around us."""
    if command is None:
        import bpy
        reasons = unable(bpy.app.version, sys.version_info)
    else:
        reasons = unable(*versions(command))
    kept = []
    for item in items:
        marker = next((mark.name for mark in item.iter_markers() if mark.name in reasons), None)
        if marker is None:
            kept.append(item)
            continue
        config.hook.pytest_deselected(items=[item])
        print(f"left out: {item.nodeid}: {reasons[marker]}")
    items[:] = kept


def interface_socket(tree, name, in_out, kind):
    """Gives a node group a socket of a kind such as 'NodeSocketFloat'."""
    if hasattr(tree, "interface"):  # 4.0
        tree.interface.new_socket(name, in_out=in_out, socket_type=kind)
    else:
        (tree.inputs if in_out == 'INPUT' else tree.outputs).new(kind, name)


def auto_smooth(mesh):
    """Lets custom normals and sharp edges count, as they always do since 4.1."""
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True


def multilayer(settings):
    """Sets a scene's image settings to one multi-layer EXR part of floats."""
    if hasattr(settings, "media_type"):  # 5.0
        settings.media_type = 'MULTI_LAYER_IMAGE'
        settings.use_exr_interleave = True
    settings.file_format, settings.color_depth = 'OPEN_EXR_MULTILAYER', '32'
