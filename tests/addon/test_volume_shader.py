# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume node trees against numpy: each program is run here, register by register."""

import math

import numpy as np
import pytest
from blenders import interface_socket
from brume.export import expression, volume_shader
from brume.native import OPS, REGISTERS, BrumeError
from conftest import material

CELLS = 64
GRIDS = {
    "density": np.linspace(0.0, 1.8, CELLS) ** 1.1,  # no values on the steps of Snap and Wrap
    "flame": np.linspace(0.0, 1.0, CELLS),
    "temperature": np.linspace(0.5, 3.0, CELLS),
    "color": np.random.default_rng(7).random((CELLS, 3)),
}


def wide(values):
    values = np.asarray(values, np.float64)
    return np.repeat(values[:, None], 3, 1) if values.ndim == 1 else values


def run(program):
    """sigma_s, sigma_a, g and emission of every cell."""
    registers = [None] * REGISTERS
    for op, dst, a, b, c, value in program.instructions:
        name = OPS[op]
        if name == "CONSTANT":
            out = np.broadcast_to(np.array(value), (CELLS, 3))
        elif name == "GRID":
            out = wide(GRIDS[program.grids[a]])
        else:
            count = expression.arity(name)
            args = [registers[r] for r in (a, b, c)[:count]]
            assert all(arg is not None for arg in args), "a register is read before it is written"
            number = b if name in {"COMPONENT", "RAMP"} else None
            out = expression.compute(name, args, number, program.ramps)
        registers[dst] = out
    return [registers[r] for r in (program.sigma_s, program.sigma_a, program.g, program.emission)]


def results(build, available=tuple(GRIDS), expect_warnings=0):
    """build(nodes) gives the socket for the Volume output."""
    owner, nodes = material()
    nodes.volume(build(nodes))
    warnings = []
    program = volume_shader.compile_volume(owner.node_tree, frozenset(available), warnings.append)
    assert len(warnings) == expect_warnings, warnings
    return run(program)


def density_of(build, **options):
    """What arrives at the density of a white scatterer."""
    sigma_s, *_ = results(lambda n: n.node(
        "VolumeScatter", Color=(1, 1, 1, 1), Density=build(n)), **options)
    return sigma_s[:, 0]


def close(actual, wanted, tolerance=1e-6):
    np.testing.assert_allclose(actual, np.broadcast_to(wanted, np.shape(actual)),
                               rtol=tolerance, atol=tolerance)


def test_scatter(scene):
    s, a, g, e = results(lambda n: n.node("VolumeScatter", Color=(0.5, 0.25, 1, 1), Density=3.0,
                                          Anisotropy=0.4))
    close(s, (1.5, 0.75, 3.0))
    close(a, 0)
    close(g, 0.4)
    close(e, 0)


def test_absorption(scene):
    s, a, *_ = results(lambda n: n.node("VolumeAbsorption", Color=(0.5, 0.25, 1, 1), Density=3.0))
    close(s, 0)
    close(a, (1.5, 2.25, 0.0))


def test_principled(scene):
    s, a, g, e = results(lambda n: n.node(
        "VolumePrincipled", Color=(0.5, 0.6, 0.7, 1), Color_Attribute="color", Density=2.0,
        Density_Attribute="density", Anisotropy=0.2, Absorption_Color=(0.25, 0.0, 1.0, 1),
        Emission_Strength=3.0, Emission_Color=(1, 0.5, 0.25, 1)))
    color = np.array((0.5, 0.6, 0.7)) * GRIDS["color"]
    density = 2.0 * wide(GRIDS["density"])
    close(s, color * density)
    close(a, density * (1 - color) * (1 - np.sqrt((0.25, 0.0, 1.0))))
    close(g, 0.2)
    close(e, (3.0, 1.5, 0.75))  # not multiplied by the density


def test_principled_without_its_attributes(scene):
    s, *_ = results(lambda n: n.node(
        "VolumePrincipled", Color=(0.5, 0.5, 0.5, 1), Color_Attribute="tint", Density=2.0,
        Density_Attribute="dust"), available=())
    close(s, 1.0)


def test_principled_blackbody(scene):
    *_, e = results(lambda n: n.node(
        "VolumePrincipled", Blackbody_Intensity=0.25, Blackbody_Tint=(1, 0.5, 1, 1),
        Temperature=900.0, Temperature_Attribute="temperature"))
    kelvin = 900.0 * GRIDS["temperature"]
    power = 5.670373e-8 * 1e-6 / math.pi * (0.75 + 0.25 * kelvin ** 4)
    color = np.array([expression.blackbody(k) for k in kelvin]) * (1, 0.5, 1)
    close(e, np.maximum(color * power[:, None], 0))


def test_blackbody_reference():
    # Planck's law over the CIE 1931 tables at 5 nm, to Rec.709, luminance 1.
    for kelvin, wanted in ((1500, (3.26428, 0.43405, -0.06423)),
                           (3000, (1.77065, 0.84428, 0.27210)),
                           (6500, (1.04316, 0.98365, 1.03488))):
        close(expression.blackbody(kelvin), wanted, 2e-3)


def test_mix_and_add(scene):
    def build(n):
        scatter = n.node("VolumeScatter", Color=(1, 1, 1, 1), Density=4.0, Anisotropy=0.8)
        back = n.node("VolumeScatter", Color=(1, 1, 1, 1), Density=2.0, Anisotropy=-0.4)
        absorb = n.node("VolumeAbsorption", Color=(0, 0, 0, 1), Density=8.0)
        both = n.node("AddShader", Shader=scatter, Shader_001=back)
        return n.node("MixShader", Fac=0.25, Shader=both, Shader_001=absorb)
    s, a, g, _ = results(build)
    close(s, 0.75 * 6.0)
    close(a, 0.25 * 8.0)
    close(g, (4 * 0.8 - 2 * 0.4) / 6.0)


def test_mix_by_grid(scene):
    def build(n):
        flame = n.node("Attribute", outlet=2, attribute_name="flame")
        one = n.node("VolumeScatter", Color=(1, 1, 1, 1), Density=1.0, Anisotropy=0.5)
        two = n.node("VolumeScatter", Color=(1, 1, 1, 1), Density=3.0, Anisotropy=-0.5)
        return n.node("MixShader", Fac=flame, Shader=one, Shader_001=two)
    s, _, g, _ = results(build)
    f = GRIDS["flame"]
    close(s[:, 0], 1 - f + 3 * f)
    close(g[:, 0], (0.5 * (1 - f) - 0.5 * 3 * f) / (1 - f + 3 * f))


def test_emission(scene):
    *_, e = results(lambda n: n.node("Emission", Color=(1, 0.5, 0, 1), Strength=2.0))
    close(e, (2, 1, 0))


def test_volume_info(scene):
    close(density_of(lambda n: n.node("VolumeInfo", outlet=1)), GRIDS["density"])
    close(density_of(lambda n: n.node("VolumeInfo", outlet=2), available=("density",)), 0)


def test_attribute_conversions(scene):
    color = GRIDS["color"]
    close(density_of(lambda n: n.node("Attribute", outlet=2, attribute_name="color")),
          color.mean(1))
    close(density_of(lambda n: n.node("Attribute", outlet=0, attribute_name="color")),
          color @ (0.2126, 0.7152, 0.0722))


X = GRIDS["density"]
Y = GRIDS["flame"] + 0.25


@pytest.mark.parametrize("operation, wanted", [
    ('ADD', X + Y), ('SUBTRACT', X - Y), ('MULTIPLY', X * Y), ('DIVIDE', X / Y),
    ('MULTIPLY_ADD', X * Y + 0.5), ('POWER', X ** Y), ('SQRT', np.sqrt(X)),
    ('LOGARITHM', np.where(X > 0, np.log(np.maximum(X, 1e-30)) / np.log(Y), 0)),
    ('INVERSE_SQRT', np.where(X > 0, np.maximum(X, 1e-30) ** -0.5, 0)),
    ('ABSOLUTE', X), ('EXPONENT', np.exp(X)), ('MINIMUM', np.minimum(X, Y)),
    ('MAXIMUM', np.maximum(X, Y)), ('LESS_THAN', X < Y), ('GREATER_THAN', X > Y),
    ('SIGN', np.sign(X)), ('COMPARE', np.abs(X - Y) <= 0.5), ('ROUND', np.floor(X + 0.5)),
    ('FLOOR', np.floor(X)), ('CEIL', np.ceil(X)), ('TRUNC', np.trunc(X)),
    ('FRACT', X - np.floor(X)), ('MODULO', np.fmod(X, Y)), ('SNAP', np.floor(X / Y) * Y),
    ('SINE', np.sin(X)), ('COSINE', np.cos(X)), ('TANGENT', np.tan(X)),
    ('ARCSINE', np.where(X <= 1, np.arcsin(np.minimum(X, 1)), 0)),
    ('ARCCOSINE', np.where(X <= 1, np.arccos(np.minimum(X, 1)), 0)),
    ('ARCTANGENT', np.arctan(X)), ('ARCTAN2', np.arctan2(X, Y)), ('SINH', np.sinh(X)),
    ('COSH', np.cosh(X)), ('TANH', np.tanh(X)), ('RADIANS', np.radians(X)),
    ('DEGREES', np.degrees(X)),
    ('WRAP', X - (Y - 0.5) * np.floor(np.divide(X - 0.5, Y - 0.5, out=np.zeros(CELLS),
                                                where=Y != 0.5))),
    ('PINGPONG', np.abs(((X - Y) / (2 * Y) - np.floor((X - Y) / (2 * Y))) * 2 * Y - Y)),
    ('SMOOTH_MIN', np.minimum(X, Y) - (np.maximum(0.5 - abs(X - Y), 0) / 0.5) ** 3 * 0.5 / 6),
    ('SMOOTH_MAX', np.maximum(X, Y) + (np.maximum(0.5 - abs(X - Y), 0) / 0.5) ** 3 * 0.5 / 6),
])
def test_math(scene, operation, wanted):
    def build(n):
        y = n.node("Math", operation='ADD', Value=n.node("Attribute", outlet=2,
                                                         attribute_name="flame"), Value_001=0.25)
        x = n.node("Attribute", outlet=2, attribute_name="density")
        return n.node("Math", operation=operation, Value=x, Value_001=y, Value_002=0.5)
    # A density is never negative.
    close(density_of(build), np.maximum(np.asarray(wanted, float), 0), 1e-5)


@pytest.mark.parametrize("blend, wanted", [
    ('MIX', lambda a, b: b), ('ADD', lambda a, b: a + b), ('SUBTRACT', lambda a, b: a - b),
    ('MULTIPLY', lambda a, b: a * b), ('SCREEN', lambda a, b: 1 - (1 - a) * (1 - b)),
    ('DIFFERENCE', lambda a, b: abs(a - b)), ('DARKEN', np.minimum), ('LIGHTEN', np.maximum),
    ('DIVIDE', lambda a, b: np.where(b != 0, a / np.where(b != 0, b, 1), a)),
    ('OVERLAY', lambda a, b: np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))),
    ('SOFT_LIGHT', lambda a, b: (1 - a) * a * b + a * (1 - (1 - a) * (1 - b))),
    ('LINEAR_LIGHT', lambda a, b: a + 2 * b - 1),
])
@pytest.mark.parametrize("node", ["Mix", "MixRGB"])
def test_blend(scene, node, blend, wanted):
    b = np.array((0.25, 0.0, 0.75))

    def build(n):
        a = n.node("Attribute", outlet=0, attribute_name="color")
        if node == "Mix":
            mixed = n.node("Mix", outlet=2, data_type='RGBA', blend_type=blend, Factor_Float=0.5,
                           A_Color=a, B_Color=(*b, 1))
        else:
            mixed = n.node("MixRGB", blend_type=blend, Fac=0.5, Color1=a, Color2=(*b, 1))
        return n.node("VolumeScatter", Color=mixed, Density=1.0)
    a = GRIDS["color"]
    # Every blend mode goes linearly from the first colour to its full effect, but Overlay and
    # Screen, whose effect is linear in the second colour's share.
    full = 0.5 * a + 0.5 * wanted(a, np.broadcast_to(b, a.shape))
    close(results(build)[0], np.maximum(full, 0), 1e-5)


@pytest.mark.parametrize("interpolation, wanted", [
    ('LINEAR', lambda t: t), ('STEPPED', lambda t: np.floor(t * 5) / 4),
    ('SMOOTHSTEP', lambda t: np.clip(t, 0, 1) ** 2 * (3 - 2 * np.clip(t, 0, 1))),
    ('SMOOTHERSTEP', lambda t: np.clip(t, 0, 1) ** 3 * (
        np.clip(t, 0, 1) * (np.clip(t, 0, 1) * 6 - 15) + 10)),
])
@pytest.mark.parametrize("clamp", [True, False])
@pytest.mark.parametrize("low, high", [(0.5, 1.5), (1.5, 0.5), (1.0, 1.0)])
def test_map_range(scene, interpolation, wanted, clamp, low, high):
    value = density_of(lambda n: n.node(
        "MapRange", interpolation_type=interpolation, clamp=clamp, From_Min=low, From_Max=high,
        To_Min=2.0, To_Max=1.0, Steps=4.0,
        Value=n.node("Attribute", outlet=2, attribute_name="density")))
    if low == high:
        # An empty range gives 0, which clamping then moves into [1, 2].
        expected = 1.0 if clamp and interpolation in {'LINEAR', 'STEPPED'} else 0.0
    else:
        expected = 2.0 - wanted((X - low) / (high - low))
        if clamp:
            expected = np.clip(expected, 1.0, 2.0)
    close(value, np.maximum(expected, 0), 1e-5)


def test_color_ramp(scene):
    def build(n):
        node = n.node("ValToRGB", outlet=None,
                      Fac=n.node("Attribute", outlet=2, attribute_name="flame"))
        node.color_ramp.elements[0].color = (1, 0, 0.5, 0.25)
        node.color_ramp.elements[1].color = (0, 1, 0.5, 0.75)
        return n.node("VolumeScatter", Color=node.outputs["Color"], Density=node.outputs["Alpha"])
    f = GRIDS["flame"]
    color = np.stack((1 - f, f, np.full(CELLS, 0.5)), 1)
    close(results(build)[0], color * (0.25 + 0.5 * f)[:, None], 1e-5)


def test_small_nodes(scene):
    color = GRIDS["color"]

    def of(build):
        return results(lambda n: n.node(
            "VolumeScatter", Density=1.0,
            Color=build(n, n.node("Attribute", outlet=0, attribute_name="color"))))[0]

    close(of(lambda n, c: n.node("Invert", Fac=0.5, Color=c)), 0.5)
    close(of(lambda n, c: n.node("Gamma", Color=c, Gamma=2.0)), color ** 2)
    close(of(lambda n, c: n.node("RGBToBW", Color=c)),
          wide(color @ (0.2126, 0.7152, 0.0722)))
    close(of(lambda n, c: n.node("BrightContrast", Color=c, Bright=0.1, Contrast=1.0)),
          np.maximum(2 * color + 0.1 - 0.5, 0))
    separated = lambda n, c: n.node("SeparateColor", outlet=None, Color=c).outputs  # noqa: E731

    def swapped(n, c):
        parts = separated(n, c)
        return n.node("CombineColor", Red=parts[2], Green=parts[0], Blue=parts[1])
    close(of(swapped), color[:, (2, 0, 1)])
    close(of(lambda n, c: n.node("VectorMath", operation='SCALE', Vector=c, Scale=2.0)),
          2 * color)
    clamped = density_of(lambda n: n.node(
        "Clamp", Min=0.5, Max=1.0, Value=n.node("Attribute", outlet=2, attribute_name="density")))
    close(clamped, np.clip(X, 0.5, 1.0))


def test_constants_are_folded(scene):
    owner, n = material()
    value = n.node("Value", outlet=None)
    value.outputs[0].default_value = 3.0
    n.volume(n.node("VolumeScatter", Color=(1, 1, 1, 1), Density=n.node(
        "Math", operation='MULTIPLY', Value=value.outputs[0], Value_001=2.0)))
    program = volume_shader.compile_volume(owner.node_tree, frozenset(), print)
    assert {OPS[op] for op, *_ in program.instructions} == {"CONSTANT"}
    close(program.constants["sigma_s"], 6.0)


def test_groups_reroutes_and_muted_nodes(scene):
    import bpy
    group = bpy.data.node_groups.new("Twice", 'ShaderNodeTree')
    interface_socket(group, "In", 'INPUT', 'NodeSocketFloat')
    interface_socket(group, "Out", 'OUTPUT', 'NodeSocketFloat')
    enter, leave = group.nodes.new('NodeGroupInput'), group.nodes.new('NodeGroupOutput')
    double = group.nodes.new('ShaderNodeMath')
    double.operation = 'MULTIPLY'
    double.inputs[1].default_value = 2.0
    group.links.new(enter.outputs[0], double.inputs[0])
    group.links.new(double.outputs[0], leave.inputs[0])

    def build(n):
        flame = n.node("Attribute", outlet=2, attribute_name="flame")
        dot = n.tree.nodes.new("NodeReroute")
        n.tree.links.new(flame, dot.inputs[0])
        muted = n.node("Math", outlet=None, operation='ADD', Value=dot.outputs[0], Value_001=9.0)
        muted.mute = True
        twice = n.tree.nodes.new("ShaderNodeGroup")
        twice.node_tree = group
        n.tree.links.new(muted.outputs[0], twice.inputs[0])
        return twice.outputs[0]
    close(density_of(build), 2 * GRIDS["flame"])


def test_unknown_node_is_named_once_and_replaced(scene):
    owner, n = material()
    noise = n.node("TexNoise")
    n.volume(n.node("VolumeScatter", Color=(1, 1, 1, 1), Density=n.node(
        "Math", operation='MULTIPLY', Value=noise, Value_001=4.0)))
    n.tree.nodes["Math"].inputs[0].default_value = 0.5
    warnings = []
    program = volume_shader.compile_volume(owner.node_tree, frozenset(), warnings.append)
    assert len(warnings) == 1
    assert "Noise Texture" in warnings[0]
    close(program.constants["sigma_s"], 2.0)


def test_missing_attribute_is_remembered(scene):
    owner, n = material()
    n.volume(n.node("VolumeScatter", Density=n.node("Attribute", outlet=2,
                                                    attribute_name="dust")))
    program = volume_shader.compile_volume(owner.node_tree, frozenset(GRIDS), print)
    assert program.unknown == ("dust",)


def test_default_program():
    program = volume_shader.default_program(frozenset(GRIDS))
    s, a, g, e = run(program)
    close(s, 0.5 * wide(X))
    close(a, 0.5 * wide(X))
    close(e, 0)


def test_registers_are_reused(scene):
    """100 sums in a row: far more values than registers, never more than a few at once."""
    def build(n):
        x = n.node("Attribute", outlet=2, attribute_name="flame")
        total = x
        for i in range(100):
            total = n.node("Math", operation='ADD', Value=total, Value_001=float(i))
        return total
    close(density_of(build), GRIDS["flame"] + sum(range(100)))


def test_endless_chain_is_reported(scene):
    def build(n):
        total = n.node("Attribute", outlet=2, attribute_name="flame")
        for _ in range(expression.DEEPEST + 50):
            total = n.node("Math", operation='ADD', Value=total, Value_001=1.0)
        return total
    density_of(build, expect_warnings=1)


def test_too_many_values_at_once(scene):
    def build(n):
        x = n.node("Attribute", outlet=2, attribute_name="flame")
        values = [n.node("Math", operation='POWER', Value=x, Value_001=1.0 + i / 8)
                  for i in range(70)]

        def total(sockets):
            if len(sockets) == 1:
                return sockets[0]
            half = len(sockets) // 2
            return n.node("Math", operation='ADD', Value=total(sockets[:half]),
                          Value_001=total(sockets[half:]))
        # Every value is needed by the first sum and again by the second.
        return n.node("Math", operation='MULTIPLY', Value=total(values),
                      Value_001=total(values[::-1]))
    with pytest.raises(BrumeError) as caught:
        density_of(build)
    assert caught.value.id == "SHADER_TOO_LARGE"
