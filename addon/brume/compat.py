# SPDX-License-Identifier: GPL-3.0-or-later
"""What differs between Blender's versions (3.4 to 5.2): the only place that knows."""

import math

import bpy
import numpy as np


def set_pass(render_pass, pixels):
    """Writes a float32 pass; until 4.1 foreach_set wanted one row per pixel, since then it wants
    a flat array."""
    pixels = np.ascontiguousarray(pixels, np.float32)
    if render_pass.channels > 1 and bpy.app.version < (4, 1, 0):
        render_pass.rect.foreach_set(pixels.reshape(-1, render_pass.channels))
    else:
        render_pass.rect.foreach_set(pixels.reshape(-1))


def identity(datablock):
    """A string that names a datablock through its life: the session's number where there is one
    (4.3), else name and library."""
    original = datablock.original
    uid = getattr(original, "session_uid", None)
    if uid is not None:
        return f"{type(original).__name__}:{uid}"
    library = original.library
    return f"{type(original).__name__}:{original.name_full}:{library.filepath if library else ''}"


# Until 5.0 Cycles and EEVEE show the value at an index of a .vdb file half a voxel further along
# each axis than OpenVDB places it.
VOXELS_AT_CORNERS = bpy.app.version < (5, 0, 0)


def has_use_nodes():
    """From 5.0 on use_nodes is always true and warns when read."""
    return bpy.app.version < (5, 0, 0)


def node_tree(owner):
    """The node tree that counts for a material, world or light, or None."""
    if owner.node_tree is None:
        return None
    if has_use_nodes() and not owner.use_nodes:
        return None
    return owner.node_tree


def corner_normals(mesh):
    """Normals of all corners, (loops, 3), that respect flat, smooth and custom normals."""
    normals = np.empty(len(mesh.loops) * 3, np.float32)
    if hasattr(mesh, "corner_normals"):
        mesh.corner_normals.foreach_get("vector", normals)
    else:
        mesh.calc_normals_split()
        mesh.loops.foreach_get("normal", normals)
        mesh.free_normals_split()
    return normals.reshape(-1, 3)


def corner_uvs(layer, count):
    """Coordinates of all corners of a UV layer, (loops, 2)."""
    uvs = np.empty(count * 2, np.float32)
    if bpy.app.version >= (3, 5, 0):
        layer.uv.foreach_get("vector", uvs)
    else:
        layer.data.foreach_get("uv", uvs)
    return uvs.reshape(-1, 2)


def positions(data, points):
    """Positions of all vertices of a mesh or points of a point cloud, (points, 3)."""
    values = np.empty(len(points) * 3, np.float32)
    attribute = data.attributes.get("position")
    if attribute is not None:
        attribute.data.foreach_get("vector", values)
    else:
        points.foreach_get("co", values)
    return values.reshape(-1, 3)


def _lamp_size(light, matrix):
    """What Cycles divides the power of a normalized lamp by: the area that shines."""
    if light.type == 'SUN':
        return math.pi * math.sin(min(light.angle, math.pi) / 2) ** 2 or 1.0
    if light.type != 'AREA':
        return 4.0 * math.pi * light.shadow_soft_size ** 2 or 4.0
    width, height = light.size, light.size_y
    if light.shape in {'SQUARE', 'DISK'}:
        height = width
    stretch = math.prod(np.linalg.norm(matrix[:3, axis]) for axis in (0, 1))
    return width * height * stretch * (math.pi / 4 if light.shape in {'DISK', 'ELLIPSE'} else 1.0)


def light_scale(light, matrix):
    """What multiplies a lamp's energy beside its colour: exposure, normalization (4.5) and the
    unit. 4.0 made an area lamp's radiance power / (pi area), after power / (4 area), and scaled
    older files."""
    scale = 2.0 ** getattr(light, "exposure", 0.0)
    if not getattr(light, "normalize", True):
        scale *= _lamp_size(light, matrix)
    if light.type == 'AREA' and bpy.app.version >= (4, 0, 0):
        scale *= 4.0 / math.pi
    return scale


def light_temperature(light):
    """The lamp's temperature in kelvin where it has one in use (4.5), else None."""
    return light.temperature if getattr(light, "use_temperature", False) else None


def light_casts_shadow(light):
    """Cycles had a switch of its own until 4.2; a lamp casts none if either is off."""
    return light.use_shadow and getattr(getattr(light, "cycles", None), "cast_shadow", True)


def light_is_seen(light):
    """Cycles shows a lamp to the camera only where it samples it from both sides."""
    return getattr(getattr(light, "cycles", None), "use_multiple_importance_sampling", True)


def light_is_portal(light):
    return bool(getattr(getattr(light, "cycles", None), "is_portal", False))


# Of lamps, since 4.5.
LIGHT_PROPERTIES = ("exposure", "normalize", "use_temperature", "temperature")


def principled_is_burley():
    """Until 4.0 the diffuse part of Principled BSDF was Burley's, after that Lambert's."""
    return bpy.app.version < (4, 0, 0)


def has_blend_method():
    """4.2 took EEVEE's blend methods away."""
    return bpy.app.version < (4, 2, 0)


def alpha_clips(material):
    """EEVEE's alpha clip."""
    return has_blend_method() and material.blend_method == 'CLIP'



def needs_node_categories():
    """Before 4.0 the Add menu hid the common shader nodes from engines it did not know."""
    return bpy.app.version < (4, 0, 0)
