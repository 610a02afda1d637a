# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume node trees to brume_volume_program: closures to coefficients, expressions to registers.

The coefficients are Cycles' (kernel/svm/closure.h): Mix and Add Shader combine them linearly, and
the mean cosine of a mixture is the mean weighted by sigma_s.
"""

import hashlib
import math
from dataclasses import dataclass, field

import numpy as np

from ..native import OP, RAMP_SIZE, REGISTERS, BrumeError
from . import nodes, texture
from .expression import Builder, Unsupported

# Stefan-Boltzmann constant of Cycles' principled volume, in its units.
STEFAN_BOLTZMANN = 5.670373e-8 * 1e-6 / math.pi


@dataclass
class Program:
    """What brume_volume_program holds. grids: the names that BRUME_OP_GRID numbers."""
    instructions: list
    ramps: np.ndarray
    sigma_s: int
    sigma_a: int
    g: int
    emission: int
    grids: tuple
    unknown: tuple = ()  # attributes that the medium lacks and that read as 0
    unused: tuple = ()   # attributes of Principled Volumes that the medium lacks
    constants: dict = field(default_factory=dict)  # results that are the same everywhere

    def fingerprint(self):
        digest = hashlib.blake2b(self.ramps.tobytes(), digest_size=16)
        digest.update(repr((self.instructions, self.sigma_s, self.sigma_a, self.g, self.emission,
                            self.grids)).encode())
        return digest.digest()


@dataclass
class Medium:
    """A closure's coefficients as expressions; scatter lists (sigma_s, g) of each lobe."""
    scatter: list
    sigma_a: object
    emission: object


# What a program for Gaussians reads: the library gives it these two under these numbers.
FOG_GRIDS = ("density", "color")

# Where textures can be asked. Gaussians have no box of their own, the world has no lattice at all.
SPACES = ("OBJECT", "WORLD", "GENERATED")
FOG_SPACES = ("OBJECT", "WORLD")


class VolumeBuilder(Builder):
    """available: names of the medium's grids; None where every name is taken on trust. numbered:
    those whose numbers are given; the others get theirs as they are asked for. spaces: those
    whose coordinates it knows."""

    def __init__(self, warn, available, numbered=(), spaces=()):
        super().__init__(warn)
        self.available = available
        self.spaces = spaces
        self.grids = list(numbered)
        self.unknown = []
        self.unused = []
        self.handlers["ShaderNodeAttribute"] = type(self)._attribute
        self.handlers["ShaderNodeVolumeInfo"] = type(self)._volume_info
        self.handlers.update(texture.HANDLERS)

    def has(self, name):
        return bool(name) and (self.available is None or name in self.available)

    def grid(self, name):
        if not self.has(name):
            if name and name not in self.unknown:
                self.unknown.append(name)
            return self.constant(0.0)
        if name not in self.grids:
            self.grids.append(name)
        return self.leaf("GRID", self.grids.index(name))

    def factor(self, name):
        """The grid that an attribute of a Principled Volume names; None leaves its factor alone,
        as in Cycles."""
        if self.has(name):
            return self.grid(name)
        # Meshes and worlds have no grids at all; the node's own "density" is no mistake there.
        if name and self.available and name not in self.unused:
            self.unused.append(name)
        return None

    def _attribute(self, source):
        node = source.node
        if getattr(node, "attribute_type", 'GEOMETRY') != 'GEOMETRY':
            raise Unsupported(f"{nodes.label(node)} of type {node.attribute_type}")
        value = self.grid(node.attribute_name)
        if source.output.identifier == "Alpha":
            return self.constant(1.0)
        return self.op("AVERAGE", value) if source.output.identifier == "Fac" else value

    def _volume_info(self, source):
        name = source.output.identifier.lower()
        # Every medium lacks some of these; that is no mistake of the user's.
        return self.grid(name) if self.has(name) else self.constant(0.0)

    # -- closures

    def nothing(self):
        zero = self.constant(0.0)
        return Medium([], zero, zero)

    def closure(self, place):
        source = nodes.follow(place)
        if source.node is None:
            return self.nothing()
        handler = _CLOSURES.get(source.node.bl_idname)
        if handler is None:
            self.warn(f"{nodes.label(source.node)} is no volume shader of Brume's and adds "
                      f"nothing to the medium.")
            return self.nothing()
        return handler(self, source)

    def scaled(self, medium, weight):
        return Medium([(self.op("MULTIPLY", s, weight), g) for s, g in medium.scatter],
                      self.op("MULTIPLY", medium.sigma_a, weight),
                      self.op("MULTIPLY", medium.emission, weight))

    def sum(self, one, two):
        return Medium(one.scatter + two.scatter, self.op("ADD", one.sigma_a, two.sigma_a),
                      self.op("ADD", one.emission, two.emission))

    def inputs(self, source, *identifiers):
        return [self.value(source.input(identifier)) for identifier in identifiers]

    def clear(self, color):
        """max(1 - color, 0)."""
        return self.op("MAXIMUM", self.op("SUBTRACT", 1.0, color), 0.0)


def _scatter(builder, source):
    if getattr(source.node, "phase", 'HENYEY_GREENSTEIN') != 'HENYEY_GREENSTEIN':
        builder.warn(f"{nodes.label(source.node)} scatters by Henyey-Greenstein instead of "
                     f"{source.node.phase}.")
    color, density, g = builder.inputs(source, "Color", "Density", "Anisotropy")
    medium = builder.nothing()
    density = builder.op("MAXIMUM", density, 0.0)
    medium.scatter = [(builder.op("MULTIPLY", color, density), g)]
    return medium


def _absorption(builder, source):
    color, density = builder.inputs(source, "Color", "Density")
    medium = builder.nothing()
    density = builder.op("MAXIMUM", density, 0.0)
    medium.sigma_a = builder.op("MULTIPLY", builder.clear(color), density)
    return medium


def _emission(builder, source):
    medium = builder.nothing()
    medium.emission = builder.op("MULTIPLY", *builder.inputs(source, "Color", "Strength"))
    return medium


def _attribute_name(source, identifier):
    place = source.input(identifier)
    return place.socket.default_value if place else ""


def _principled(builder, source):
    op = builder.op
    color, density, g, absorption, strength, glow, bb_share, bb_tint, kelvin = builder.inputs(
        source, "Color", "Density", "Anisotropy", "Absorption Color", "Emission Strength",
        "Emission Color", "Blackbody Intensity", "Blackbody Tint", "Temperature")
    density = op("MAXIMUM", density, 0.0)
    field = builder.factor(_attribute_name(source, "Density Attribute"))
    if field is not None:
        density = op("MAXIMUM", op("MULTIPLY", density, op("AVERAGE", field)), 0.0)
    field = builder.factor(_attribute_name(source, "Color Attribute"))
    if field is not None:
        color = op("MULTIPLY", color, field)
    root = op("SQRT", op("MAXIMUM", absorption, 0.0))
    sigma_a = op("MULTIPLY", op("MULTIPLY", builder.clear(color), builder.clear(root)), density)
    emission = op("MULTIPLY", strength, glow)
    if not bb_share.is_constant(0):
        field = builder.factor(_attribute_name(source, "Temperature Attribute"))
        if field is not None:
            kelvin = op("MULTIPLY", kelvin, op("AVERAGE", field))
        kelvin = op("MAXIMUM", kelvin, 0.0)
        square = op("MULTIPLY", kelvin, kelvin)
        power = op("MULTIPLY", op("MIX", 1.0, op("MULTIPLY", square, square), bb_share),
                   STEFAN_BOLTZMANN)
        # Cycles adds nothing where the intensity is not above 0.
        power = op("MULTIPLY", power, op("GREATER", bb_share, 0.0))
        emission = op("ADD", emission, op("MULTIPLY", op("MULTIPLY", bb_tint, power),
                                          op("BLACKBODY", kelvin)))
    return Medium([(op("MULTIPLY", color, density), g)], sigma_a, emission)


def _coefficients(builder, source):
    absorb, scatter, g, emission = builder.inputs(
        source, "Absorption Coefficients", "Scatter Coefficients", "Anisotropy",
        "Emission Coefficients")
    return Medium([(scatter, g)], absorb, emission)


def _mix(builder, source):
    factor, = builder.inputs(source, "Fac")
    factor = builder.op("CLAMP01", factor)
    one, two = (builder.closure(source.input(i)) for i in ("Shader", "Shader_001"))
    return builder.sum(builder.scaled(one, builder.op("SUBTRACT", 1.0, factor)),
                       builder.scaled(two, factor))


def _add(builder, source):
    return builder.sum(*(builder.closure(source.input(i)) for i in ("Shader", "Shader_001")))


_CLOSURES = {
    "ShaderNodeVolumeScatter": _scatter,
    "ShaderNodeVolumeAbsorption": _absorption,
    "ShaderNodeVolumePrincipled": _principled,
    "ShaderNodeVolumeCoefficients": _coefficients,
    "ShaderNodeEmission": _emission,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}


def _results(builder, medium):
    """The four results as expressions."""
    op = builder.op
    total = builder.constant(0.0)
    for sigma_s, _ in medium.scatter:
        total = op("ADD", total, sigma_s)
    lobes = {id(g): g for sigma_s, g in medium.scatter if not sigma_s.is_constant(0)}
    if len(lobes) <= 1:
        g = next(iter(lobes.values()), builder.constant(0.0))
    else:
        share, g = builder.constant(0.0), builder.constant(0.0)
        for sigma_s, lobe_g in medium.scatter:
            weight = op("AVERAGE", sigma_s)
            share = op("ADD", share, weight)
            g = op("ADD", g, op("MULTIPLY", weight, lobe_g))
        g = op("DIVIDE", g, share)
    # A negative coefficient has no meaning, and Cycles drops the closure.
    return {"sigma_s": op("MAXIMUM", total, 0.0), "sigma_a": op("MAXIMUM", medium.sigma_a, 0.0),
            "g": g, "emission": op("MAXIMUM", medium.emission, 0.0)}


def _order(roots):
    """Every expression below the roots once, arguments first."""
    ordered, done = [], set()

    def visit(expression):
        if id(expression) in done:
            return
        done.add(id(expression))
        for arg in expression.args:
            visit(arg)
        ordered.append(expression)

    for root in roots:
        visit(root)
    return ordered


def _assemble(results):
    """Instructions and the register of each result. A register is free again after the last
    instruction that reads it, but not for that instruction's own result: an operation may write
    its first component before it reads the others."""
    ordered = _order(results.values())
    last_use = {}
    for index, expression in enumerate(ordered):
        for arg in expression.args:
            last_use[id(arg)] = index
    for root in results.values():
        last_use[id(root)] = len(ordered)
    free = list(range(REGISTERS - 1, -1, -1))
    register, code = {}, []
    for index, expression in enumerate(ordered):
        if not free:
            raise BrumeError("SHADER_TOO_LARGE",
                             f"the volume shader needs more than {REGISTERS} values at once")
        dst = register[id(expression)] = free.pop()
        operands = [register[id(arg)] for arg in expression.args]
        if expression.op in {"GRID", "POSITION"}:
            operands = [expression.number]
        elif expression.number is not None:
            operands = [operands[0], expression.number]
        code.append((OP[expression.op], dst, *operands, *(0,) * (3 - len(operands)),
                     expression.value or (0.0, 0.0, 0.0)))
        for arg in {id(arg) for arg in expression.args}:
            if last_use[arg] == index:
                free.append(register[arg])
    return code, {name: register[id(root)] for name, root in results.items()}


def _program(builder, medium):
    results = _results(builder, medium)
    code, registers = _assemble(results)
    ramps = np.array(builder.ramps, np.float32).reshape(-1, RAMP_SIZE, 3)
    constants = {name: root.value for name, root in results.items() if root.constant}
    return Program(code, ramps, **registers, grids=tuple(builder.grids),
                   unknown=tuple(builder.unknown), unused=tuple(builder.unused),
                   constants=constants)


def compile_volume(tree, available, warn, numbered=(), spaces=()):
    """The program of a node tree's Volume output, or None if nothing is linked there.
    available: names of the medium's grids, empty for a mesh or a world; numbered and spaces: as
    VolumeBuilder."""
    place = nodes.output_place(tree, "Volume")
    if place is None or nodes.follow(place).node is None:
        return None
    builder = VolumeBuilder(warn, available, numbered, spaces)
    return _program(builder, builder.closure(place))


def default_program(available):
    """Cycles' shader for a volume object without a material: Principled Volume's defaults."""
    builder = VolumeBuilder(lambda sentence: None, available)
    density = builder.grid("density") if builder.has("density") else builder.constant(1.0)
    half = builder.op("MULTIPLY", density, 0.5)
    # Absorption colour black: sigma_a = density * (1 - 0.5).
    return _program(builder, Medium([(half, builder.constant(0.0))], half,
                                    builder.constant(0.0)))


def plain_program(g):
    """That of Gaussians without a material: their colour is the share of light that is scattered,
    the rest is absorbed."""
    builder = VolumeBuilder(lambda sentence: None, FOG_GRIDS, FOG_GRIDS)
    density, color = map(builder.grid, FOG_GRIDS)
    return _program(builder, Medium(
        [(builder.op("MULTIPLY", density, color), builder.constant(g))],
        builder.op("MULTIPLY", density, builder.clear(color)), builder.constant(0.0)))
