# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: its colour, environment texture and medium."""

import numpy as np
from mathutils import Euler, Matrix

from .. import compat
from . import image, nodes
from .expression import Builder, Unsupported
from .volume_shader import compile_volume


def _mapping(node, builder, source):
    """The linear part of a Mapping node; moving directions has no meaning here."""
    rotation, scale = (builder.number(source.input(name)) for name in ("Rotation", "Scale"))
    if rotation is None or scale is None:
        raise Unsupported(f"{nodes.label(node)} with values that vary")
    turn = Euler(rotation, 'XYZ').to_matrix().to_4x4()
    grow = Matrix.Diagonal((*scale, 1.0))
    if node.vector_type == 'TEXTURE':
        return (turn @ grow).inverted_safe()
    if node.vector_type == 'NORMAL':
        return turn @ grow.inverted_safe()
    return turn @ grow


class WorldBuilder(Builder):
    def __init__(self, warn):
        super().__init__(warn)
        self.image_from_world = Matrix.Identity(4)
        self.handlers["ShaderNodeTexEnvironment"] = type(self)._environment

    def _environment(self, source):
        node = source.node
        if node.image is None:
            raise Unsupported(f"{nodes.label(node)} without an image")
        if node.projection != 'EQUIRECTANGULAR':
            raise Unsupported(f"{nodes.label(node)} with {node.projection} projection")
        self.image_from_world = self._direction(nodes.follow(source.input("Vector")))
        return self.leaf("IMAGE", image.Texture(node.image, "REPEAT",
                                                node.interpolation == 'Closest'))

    def _direction(self, source):
        """What turns a world direction into the texture's."""
        if source.node is None:
            return Matrix.Identity(4)
        if source.node.bl_idname == 'ShaderNodeMapping':
            inner = self._direction(nodes.follow(source.input("Vector")))
            return _mapping(source.node, self, source) @ inner
        if source.node.bl_idname == 'ShaderNodeTexCoord' and source.output.identifier in {
                "Generated", "Object"}:
            return Matrix.Identity(4)
        if source.node.bl_idname == 'ShaderNodeNewGeometry' and (
                source.output.identifier == "Position"):
            return Matrix.Identity(4)
        self.warn(f"{nodes.label(source.node)} does not turn the environment texture.")
        return Matrix.Identity(4)

    def light(self, place, weight):
        """(colour, texture) of what feeds a Surface output."""
        source = nodes.follow(place)
        if source.node is None:
            return np.zeros(3), None
        name = source.node.bl_idname
        if name in {'ShaderNodeBackground', 'ShaderNodeEmission'}:
            return self._background(source, weight)
        if name == 'ShaderNodeMixShader':
            factor = self.number(source.input("Fac"))
            if factor is not None:
                share = float(np.clip(factor[0], 0.0, 1.0))
                return self._sum(source, weight * (1.0 - share), weight * share)
        if name == 'ShaderNodeAddShader':
            return self._sum(source, weight, weight)
        self.warn(f"{nodes.label(source.node)} is not shown.")
        return np.zeros(3), None

    def _sum(self, source, one, two):
        parts = [self.light(source.input(i), w) for i, w in (("Shader", one),
                                                            ("Shader_001", two)) if w > 0.0]
        textures = [part for part in parts if part[1] is not None]
        if textures:
            if len(parts) > 1 and any(part is not textures[0] and part[0].any()
                                      for part in parts):
                self.warn("an environment texture is shown without what is mixed with it.")
            return textures[0]
        return sum((part[0] for part in parts), np.zeros(3)), None

    def _background(self, source, weight):
        place = source.input("Color")
        strength = self.number(source.input("Strength"))
        if strength is None:
            self.warn(f"Strength of {nodes.label(source.node)} varies and is taken as 1.")
            strength = np.ones(3)
        expression, factor = self.value(place), np.full(3, weight) * strength
        while expression.op == "MULTIPLY" and any(arg.constant for arg in expression.args):
            known, expression = sorted(expression.args, key=lambda arg: not arg.constant)
            factor = factor * known.value
        if expression.constant:
            return factor * expression.value, None
        if expression.op == "IMAGE":
            return factor, expression.number
        self.warn(f"Color of {nodes.label(source.node)} takes more than an image times a colour "
                  f"and keeps its own value.")
        return factor * self.stored(place.socket).value, None


def export(target, world, reach):
    """Puts the world; None is black."""
    if world is None:
        target.put_world(color=(0.0, 0.0, 0.0))
        return
    target.part(("world", compat.identity(world)), reach, nodes.identities(world),
                lambda: _export(target, world, reach))


def _export(target, world, reach):

    def warn(sentence):
        target.reports.unsupported(f'World "{world.name}"', sentence)

    tree = compat.node_tree(world)
    if tree is None:
        target.put_world(color=tuple(world.color))
        return
    builder = WorldBuilder(warn)
    place = nodes.output_place(tree, "Surface")
    color, texture = builder.light(place, 1.0) if place else (np.zeros(3), None)
    program = compile_volume(tree, (), warn)
    volume = None
    if program is not None:
        # Without grids every expression is constant.
        values = program.constants
        volume = (values["sigma_s"], values["sigma_a"], values["emission"], values["g"][0])
        if not any(any(values[name]) for name in ("sigma_s", "sigma_a", "emission")):
            volume = None
    target.put_world(color=tuple(color.tolist()),
                     image=image.export(target, texture) if texture else 0,
                     image_from_world=np.array(builder.image_from_world), volume=volume,
                     reach=reach)
