# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture nodes of volume shaders, and the coordinates that they are asked at."""

import math

import numpy as np
from mathutils import Euler

from ..native import SPACES
from . import nodes
from .expression import Unsupported, length


def _position(builder, source, space):
    if space not in builder.spaces:
        raise Unsupported(f"{nodes.label(source.node)}'s {space.capitalize()} coordinates here")
    return builder.leaf("POSITION", SPACES[space])


def _coordinates(builder, source):
    name, node = source.output.identifier, source.node
    if name not in {"Generated", "Object"}:
        raise Unsupported(f"{nodes.label(node)}'s {name}")
    if name == "Object" and node.object:
        return _object_position(builder, source, node.object)
    return _position(builder, source, name.upper())


def _object_position(builder, source, ob):
    """In another object's space."""
    try:
        from_world = np.linalg.inv(np.array(ob.matrix_world))
    except np.linalg.LinAlgError as error:
        raise Unsupported(f"{nodes.label(source.node)} with {ob.name}, which has a scale of "
                          f"zero,") from error
    return builder.op("ADD", _times(builder, from_world[:3, :3],
                                    _position(builder, source, "WORLD")), from_world[:3, 3])


def _geometry(builder, source):
    if source.output.identifier != "Position":
        raise Unsupported(f"{nodes.label(source.node)}'s {source.output.name}")
    return _position(builder, source, "WORLD")


def _vector(builder, source):
    """Where a texture is asked: where nothing is linked, at generated coordinates."""
    place = source.input("Vector")
    found = nodes.follow(place)
    if found.node is None and found.socket == place.socket:
        return _position(builder, source, "GENERATED")
    return builder.value(place)


def _components(builder, vector):
    return [builder.op("COMPONENT", vector, number=i) for i in range(3)]


def _times(builder, matrix, vector):
    """A constant matrix times a vector."""
    if np.array_equal(matrix, np.eye(3)):
        return vector
    x, y, z = _components(builder, vector)
    columns = [builder.constant(matrix[:, i]) for i in range(3)]
    return builder.op("MULTIPLY_ADD", z, columns[2], builder.op(
        "MULTIPLY_ADD", y, columns[1], builder.op("MULTIPLY", x, columns[0])))


def _mapping(builder, source):
    node, op = source.node, builder.op
    vector, scale = builder.inputs(source, "Vector", "Scale")
    angles = builder.number(source.input("Rotation"))
    if angles is None:
        raise Unsupported(f"{nodes.label(node)} with a rotation that varies")
    turn = np.array(Euler(angles).to_matrix())
    if node.vector_type == 'NORMAL':
        turned = _times(builder, turn, op("DIVIDE", vector, scale))
        return op("DIVIDE", turned, length(op, turned))
    if node.vector_type == 'VECTOR':
        return _times(builder, turn, op("MULTIPLY", vector, scale))
    location, = builder.inputs(source, "Location")
    if node.vector_type == 'TEXTURE':
        return op("DIVIDE", _times(builder, turn.T, op("SUBTRACT", vector, location)), scale)
    return op("ADD", _times(builder, turn, op("MULTIPLY", vector, scale)), location)


def _gradient_noise(builder, source, dimensions, detail, roughness, lacunarity, distortion,
                    normalized):
    """BRUME_OP_NOISE at a texture node's vector, W and scale."""
    op = builder.op
    scale, w = builder.inputs(source, "Scale", "W")
    vector = _vector(builder, source) if dimensions > 1 else builder.constant(0.0)
    is_color = source.output.identifier == "Color"
    return builder.texture(
        "NOISE", op("MULTIPLY", vector, scale), op("COMBINE", detail, roughness, lacunarity),
        op("COMBINE", op("MULTIPLY", w, scale), distortion, 0.0),
        value=(float(dimensions), float(normalized), float(is_color)))


def _noise(builder, source):
    node = source.node
    if getattr(node, "noise_type", 'FBM') != 'FBM':
        raise Unsupported(f"{nodes.label(node)} of type {node.noise_type}")
    detail, roughness, distortion = builder.inputs(source, "Detail", "Roughness", "Distortion")
    if source.input("Lacunarity"):
        lacunarity, = builder.inputs(source, "Lacunarity")
    else:  # before Blender 4.0
        lacunarity = builder.constant(2.0)
        roughness = builder.op("CLAMP01", roughness)
    return _gradient_noise(builder, source, int(node.noise_dimensions[0]), detail, roughness,
                           lacunarity, distortion, getattr(node, "normalize", True))


def _musgrave(builder, source):
    """That of Blender before 4.1: its first octave counts as one of detail."""
    node, op = source.node, builder.op
    if node.musgrave_type != 'FBM':
        raise Unsupported(f"{nodes.label(node)} of type {node.musgrave_type}")
    detail, dimension, lacunarity = builder.inputs(source, "Detail", "Dimension", "Lacunarity")
    lacunarity = op("MAXIMUM", lacunarity, 1e-5)
    roughness = op("POWER", lacunarity, op("MULTIPLY", op("MAXIMUM", dimension, 1e-5), -1.0))
    octaves = op("SUBTRACT", op("MINIMUM", detail, 15.0), 1.0)
    noise = _gradient_noise(builder, source, int(node.musgrave_dimensions[0]), octaves, roughness,
                            lacunarity, 0.0, False)
    return op("MULTIPLY", noise, op("CLAMP01", detail))


def _gradient(builder, source):
    op, kind = builder.op, source.node.gradient_type
    vector = _vector(builder, source)
    x, y, z = _components(builder, vector)
    if kind == 'LINEAR':
        value = x
    elif kind == 'QUADRATIC':
        value = op("MULTIPLY", op("MAXIMUM", x, 0.0), op("MAXIMUM", x, 0.0))
    elif kind == 'EASING':
        value = op("SMOOTHSTEP", x)
    elif kind == 'DIAGONAL':
        value = op("MULTIPLY", op("ADD", x, y), 0.5)
    elif kind == 'RADIAL':
        value = op("MULTIPLY_ADD", op("ARCTANGENT2", y, x), 0.5 / math.pi, 0.5)
    else:
        value = op("MAXIMUM", op("SUBTRACT", 0.999999, length(op, vector)), 0.0)
        if kind == 'QUADRATIC_SPHERE':
            value = op("MULTIPLY", value, value)
    return op("CLAMP01", value)


HANDLERS = {
    "ShaderNodeTexCoord": _coordinates,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeTexNoise": _noise,
    "ShaderNodeTexMusgrave": _musgrave,
    "ShaderNodeTexGradient": _gradient,
}
