# SPDX-License-Identifier: GPL-3.0-or-later
"""Node inputs as expressions: what is constant is computed here, the rest becomes a graph.

An expression stands for three floats (a number fills all three), as the registers of
brume_volume_program do, and its operators are those of brume_op.
"""

import math

import numpy as np

from . import nodes

# Nodes one behind the other; Python's own limit allows about 250.
DEEPEST = 128
REC709_LUMINANCE = np.array((0.2126, 0.7152, 0.0722))


class Expression:
    """op: a name of native.OPS, or "IMAGE". number: what brume_op's line for the op names: grid,
    table, component or space; for IMAGE the texture. value: of a CONSTANT, or the line's own.
    Compared by identity: the builder shares equals."""
    __slots__ = ("op", "args", "number", "value")

    def __init__(self, op, args=(), number=None, value=None):
        self.op, self.args, self.number, self.value = op, args, number, value

    @property
    def constant(self):
        return self.op == "CONSTANT"

    def is_constant(self, number):
        return self.constant and self.value == (number,) * 3


class Unsupported(Exception):
    """Raised for a node or an option that has no expression; the text names it."""


# ------------------------------------------------------------------------------------------------
# Arithmetic, as brume_op describes it.


def _where(condition, value, otherwise=0.0):
    return np.where(condition, value, otherwise)


def _divide(a, b):
    return np.divide(a, b, out=np.zeros(np.broadcast(a, b).shape), where=b != 0)


def _power(a, b, c=None):
    with np.errstate(all="ignore"):
        value = np.power(a, b)
    return _where(np.isfinite(value), value)


def _logarithm(a, b, c=None):
    with np.errstate(all="ignore"):
        value = np.log(a) / np.log(b)
    return _where((a > 0) & (b > 0) & np.isfinite(value), value)


def _modulo(a, b, c=None):
    with np.errstate(all="ignore"):
        return _where(b != 0, np.fmod(a, b))


def _wrap(a, b, c):
    span = b - c
    return _where(span != 0, a - span * np.floor(_divide(a - c, span)), c)


def _pingpong(a, b, c=None):
    turns = _divide(a - b, b * 2)
    return _where(b != 0, np.abs((turns - np.floor(turns)) * b * 2 - b))


def _smooth_min(a, b, c):
    h = _divide(np.maximum(c - np.abs(a - b), 0), c)
    return _where(c != 0, np.minimum(a, b) - h ** 3 * c / 6, np.minimum(a, b))


def _smoothstep(a, b=None, c=None):
    t = np.clip(a, 0, 1)
    return t * t * (3 - 2 * t)


def _smootherstep(a, b=None, c=None):
    t = np.clip(a, 0, 1)
    return t ** 3 * (t * (t * 6 - 15) + 10)


def blackbody(kelvin):
    """Linear Rec.709 of a black body, luminance 1: the Planckian locus as fitted by Krystek
    (Color Research and Application 10, 1985). Held at 800 K and 12000 K as in Cycles, and like
    there without clipping: cool bodies lie outside of the gamut."""
    t = float(np.clip(kelvin, 800.0, 12000.0))
    u = (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) / (
        1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t)
    v = (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) / (
        1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)
    # CIE 1960 uv to XYZ of Y = 1, then to Rec.709 primaries.
    xyz = np.array((1.5 * u / v, 1.0, (4 - u - 10 * v) / (2 * v)))
    return np.array(((3.2404542, -1.5371385, -0.4985314), (-0.9692660, 1.8760108, 0.0415560),
                     (0.0556434, -0.2040259, 1.0572252))) @ xyz


_ARITHMETIC = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: _divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": _power,
    "LOGARITHM": _logarithm,
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: _power(np.maximum(a, 0), -0.5),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "EXPONENT": lambda a, b, c: np.exp(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS": lambda a, b, c: _where(a < b, 1.0),
    "GREATER": lambda a, b, c: _where(a > b, 1.0),
    "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: _where(np.abs(a - b) <= np.maximum(c, 1e-5), 1.0),
    "SMOOTH_MIN": _smooth_min,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_min(-a, -b, c),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNCATE": lambda a, b, c: np.trunc(a),
    "FRACTION": lambda a, b, c: a - np.floor(a),
    "MODULO": _modulo,
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: np.floor(_divide(a, b)) * b,
    "PINGPONG": _pingpong,
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: _where(np.abs(a) <= 1, np.arcsin(np.clip(a, -1, 1))),
    "ARCCOSINE": lambda a, b, c: _where(np.abs(a) <= 1, np.arccos(np.clip(a, -1, 1))),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTANGENT2": lambda a, b, c: np.arctan2(a, b),
    "HYPERBOLIC_SINE": lambda a, b, c: np.sinh(a),
    "HYPERBOLIC_COSINE": lambda a, b, c: np.cosh(a),
    "HYPERBOLIC_TANGENT": lambda a, b, c: np.tanh(a),
    "CLAMP01": lambda a, b, c: np.clip(a, 0, 1),
    "MIX": lambda a, b, c: a + (b - a) * c,
    "SMOOTHSTEP": _smoothstep,
    "SMOOTHERSTEP": _smootherstep,
    "AVERAGE": lambda a, b, c: np.repeat(a.mean(-1, keepdims=True), 3, -1),
    "LUMINANCE": lambda a, b, c: np.repeat((a * REC709_LUMINANCE).sum(-1, keepdims=True), 3, -1),
    "COMBINE": lambda a, b, c: np.stack((a[..., 0], b[..., 0], c[..., 0]), -1),
}
_ARITY = {"MULTIPLY_ADD": 3, "COMPARE": 3, "SMOOTH_MIN": 3, "SMOOTH_MAX": 3, "WRAP": 3, "MIX": 3,
          "COMBINE": 3}
_UNARY = set(
    "SQRT INVERSE_SQRT ABSOLUTE EXPONENT SIGN ROUND FLOOR CEIL TRUNCATE FRACTION SINE COSINE "
    "TANGENT ARCSINE ARCCOSINE ARCTANGENT HYPERBOLIC_SINE HYPERBOLIC_COSINE HYPERBOLIC_TANGENT "
    "CLAMP01 SMOOTHSTEP SMOOTHERSTEP AVERAGE LUMINANCE COMPONENT RAMP BLACKBODY".split())


def arity(op):
    return 1 if op in _UNARY else _ARITY.get(op, 2)


def compute(op, args, number=None, ramps=()):
    """One operation on arrays of shape (..., 3), in double precision."""
    if op == "COMPONENT":
        return np.repeat(args[0][..., number:number + 1], 3, -1)
    if op == "RAMP":
        at = np.clip(args[0][..., 0], 0, 1) * (len(ramps[number]) - 1)
        steps = np.arange(len(ramps[number]))
        return np.stack([np.interp(at, steps, ramps[number][:, i]) for i in range(3)], -1)
    if op == "BLACKBODY":
        kelvin = args[0][..., 0]
        return np.array([blackbody(k) for k in kelvin.ravel()]).reshape(*kelvin.shape, 3)
    a, b, c = (*args, *(None,) * (3 - len(args)))
    return _ARITHMETIC[op](a, b, c)


# ------------------------------------------------------------------------------------------------
# Building


class Builder:
    """Turns sockets into expressions. `warn` gets a sentence for each node that has none; the
    socket's own value then stands in. Subclasses add the nodes of their context to `handlers`."""

    def __init__(self, warn):
        self.warn = warn
        self.ramps = []
        self._shared = {}
        self._outputs = {}
        self._depth = 0
        self.handlers = dict(_HANDLERS)

    # -- expressions

    def _share(self, op, args=(), number=None, value=None):
        key = (op, tuple(id(arg) for arg in args), number, value)
        return self._shared.setdefault(key, Expression(op, args, number, value))

    def constant(self, value):
        numbers = np.broadcast_to(np.asarray(value, np.float64), 3).tolist()
        return self._share("CONSTANT", value=tuple(numbers))

    def op(self, op, *args, number=None):
        args = tuple(arg if isinstance(arg, Expression) else self.constant(arg) for arg in args)
        if all(arg.constant for arg in args):
            with np.errstate(over="ignore"):
                folded = compute(op, [np.array(arg.value) for arg in args], number, self.ramps)
            return self.constant(folded)
        if op == "MULTIPLY":
            for this, other in (args, args[::-1]):
                if this.is_constant(1):
                    return other
                if this.is_constant(0):
                    return this
        if op == "ADD":
            for this, other in (args, args[::-1]):
                if this.is_constant(0):
                    return other
        if op in {"SUBTRACT", "DIVIDE"} and args[1].is_constant(op == "DIVIDE"):
            return args[0]
        if op == "MIX" and args[2].constant and args[2].value in {(0,) * 3, (1,) * 3}:
            return args[int(args[2].value[0])]
        return self._share(op, args, number)

    def leaf(self, op, number):
        return self._share(op, number=number)

    def texture(self, op, *args, value):
        """What only the library computes; value: what brume_op's line for the op says."""
        return self._share(op, args, value=value)

    def ramp(self, table):
        """The number of a table of 256 colours."""
        table = np.asarray(table, np.float32)
        for number, known in enumerate(self.ramps):
            if np.array_equal(known, table):
                return number
        self.ramps.append(table)
        return len(self.ramps) - 1

    # -- sockets

    def value(self, place):
        """The expression of an input, converted to the input's type."""
        source = nodes.follow(place)
        if source.node is None:
            return self._convert(self.stored(source.socket), source.socket.type,
                                 place.socket.type)
        self._depth += 1
        try:
            return self._convert(self._output(source), source.output.type, place.socket.type)
        except Unsupported as problem:
            self.warn(f"{problem} is not supported; {place.socket.name} "
                      f"of {nodes.label(place.socket.node)} keeps its own value.")
            return self.stored(place.socket)
        finally:
            self._depth -= 1

    def number(self, place):
        """An input as three floats, or None if it is not constant."""
        expression = self.value(place)
        return np.array(expression.value) if expression.constant else None

    def stored(self, socket):
        value = getattr(socket, "default_value", 0.0)
        return self.constant(value if isinstance(value, (int, float)) else tuple(value)[:3])

    def _convert(self, expression, source, target):
        if target in {'VALUE', 'INT', 'BOOLEAN'}:
            if source == 'RGBA':
                return self.op("LUMINANCE", expression)
            if source == 'VECTOR':
                return self.op("AVERAGE", expression)
        return expression

    def _output(self, source):
        key = (source.node.as_pointer(), source.output.identifier,
               tuple(group.as_pointer() for group in source.path))
        if key not in self._outputs:
            if self._depth > DEEPEST:
                raise Unsupported(f"a chain of more than {DEEPEST} nodes")
            handler = self.handlers.get(source.node.bl_idname)
            if handler is None:
                raise Unsupported(nodes.label(source.node))
            self._outputs[key] = handler(self, source)
        return self._outputs[key]


def _inputs(builder, source, *identifiers):
    return [builder.value(source.input(identifier)) for identifier in identifiers]


_MATH = {
    "LESS_THAN": "LESS", "GREATER_THAN": "GREATER", "TRUNC": "TRUNCATE", "FRACT": "FRACTION",
    "ARCTAN2": "ARCTANGENT2", "SINH": "HYPERBOLIC_SINE", "COSH": "HYPERBOLIC_COSINE",
    "TANH": "HYPERBOLIC_TANGENT"}


def _math(builder, source):
    operation = source.node.operation
    inputs = _inputs(builder, source, "Value", "Value_001", "Value_002")
    if operation in {"RADIANS", "DEGREES"}:
        turn = math.pi / 180 if operation == "RADIANS" else 180 / math.pi
        result = builder.op("MULTIPLY", inputs[0], turn)
    else:
        op = _MATH.get(operation, operation)
        if op not in _ARITHMETIC:
            raise Unsupported(f"{nodes.label(source.node)} with {operation}")
        result = builder.op(op, *inputs[:arity(op)])
    return builder.op("CLAMP01", result) if source.node.use_clamp else result


def dot(op, a, b):
    """Of two vectors, in all components; op: a builder's."""
    return op("MULTIPLY", op("AVERAGE", op("MULTIPLY", a, b)), 3.0)


def length(op, vector):
    return op("SQRT", dot(op, vector, vector))


def _vector_math(builder, source):
    operation = source.node.operation
    op = builder.op
    a, b, c = _inputs(builder, source, "Vector", "Vector_001", "Vector_002")
    if operation == "SCALE":
        return op("MULTIPLY", a, *_inputs(builder, source, "Scale"))
    if operation == "DOT_PRODUCT":
        return dot(op, a, b)
    if operation == "LENGTH":
        return length(op, a)
    if operation == "DISTANCE":
        return length(op, op("SUBTRACT", a, b))
    if operation == "NORMALIZE":
        return op("DIVIDE", a, length(op, a))
    if operation not in {"ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "ABSOLUTE",
                         "MINIMUM", "MAXIMUM", "FLOOR", "CEIL", "FRACTION", "MODULO", "WRAP",
                         "SNAP", "SINE", "COSINE", "TANGENT"}:
        raise Unsupported(f"{nodes.label(source.node)} with {operation}")
    return op(operation, *(a, b, c)[:arity(operation)])


def _overlay(op, a, b, t):
    keep = op("SUBTRACT", 1.0, t)
    dark = op("MULTIPLY", a, op("MULTIPLY_ADD", op("MULTIPLY", t, 2.0), b, keep))
    light_b = op("MULTIPLY_ADD", op("MULTIPLY", t, 2.0), op("SUBTRACT", 1.0, b), keep)
    light = op("SUBTRACT", 1.0, op("MULTIPLY", light_b, op("SUBTRACT", 1.0, a)))
    return op("MIX", light, dark, op("LESS", a, 0.5))


def _soft_light(op, a, b, t):
    rest = op("SUBTRACT", 1.0, a)
    screen = op("SUBTRACT", 1.0, op("MULTIPLY", op("SUBTRACT", 1.0, b), rest))
    soft = op("ADD", op("MULTIPLY", op("MULTIPLY", rest, b), a), op("MULTIPLY", a, screen))
    return op("MIX", a, soft, t)


def _divide_blend(op, a, b, t):
    # Cycles leaves a channel alone where the divisor is 0.
    safe = op("ADD", op("DIVIDE", a, b), op("MULTIPLY", a, op("COMPARE", b, 0.0, 0.0)))
    return op("MIX", a, safe, t)


_BLENDS = {
    "MIX": lambda op, a, b, t: op("MIX", a, b, t),
    "ADD": lambda op, a, b, t: op("MULTIPLY_ADD", b, t, a),
    "SUBTRACT": lambda op, a, b, t: op("SUBTRACT", a, op("MULTIPLY", b, t)),
    "MULTIPLY": lambda op, a, b, t: op("MIX", a, op("MULTIPLY", a, b), t),
    "SCREEN": lambda op, a, b, t: op("MULTIPLY_ADD", op("MULTIPLY", b, t),
                                     op("SUBTRACT", 1.0, a), a),
    "DIFFERENCE": lambda op, a, b, t: op("MIX", a, op("ABSOLUTE", op("SUBTRACT", a, b)), t),
    "DARKEN": lambda op, a, b, t: op("MIX", a, op("MINIMUM", a, b), t),
    "LIGHTEN": lambda op, a, b, t: op("MIX", a, op("MAXIMUM", a, b), t),
    "DIVIDE": _divide_blend,
    "OVERLAY": _overlay,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda op, a, b, t: op("ADD", a, op(
        "MULTIPLY", t, op("MULTIPLY", op("SUBTRACT", b, 0.5), 2.0))),
}


def _blend(builder, node, factor, a, b, clamp_factor, clamp_result):
    blend = _BLENDS.get(node.blend_type)
    if blend is None:
        raise Unsupported(f"{nodes.label(node)} with {node.blend_type}")
    factor = builder.op("CLAMP01", factor) if clamp_factor else factor
    result = blend(builder.op, a, b, factor)
    return builder.op("CLAMP01", result) if clamp_result else result


def _mix_rgb(builder, source):
    return _blend(builder, source.node, *_inputs(builder, source, "Fac", "Color1", "Color2"),
                  True, source.node.use_clamp)


def _mix(builder, source):
    node = source.node
    if node.data_type == 'RGBA':
        inputs = _inputs(builder, source, "Factor_Float", "A_Color", "B_Color")
        return _blend(builder, node, *inputs, node.clamp_factor, node.clamp_result)
    if node.data_type == 'FLOAT':
        names = "Factor_Float", "A_Float", "B_Float"
    elif node.data_type == 'VECTOR':
        uniform = node.factor_mode == 'UNIFORM'
        names = "Factor_Float" if uniform else "Factor_Vector", "A_Vector", "B_Vector"
    else:
        raise Unsupported(f"{nodes.label(node)} of {node.data_type}")
    factor, a, b = _inputs(builder, source, *names)
    return builder.op("MIX", a, b, builder.op("CLAMP01", factor) if node.clamp_factor else factor)


def _clamp_between(builder, value, low, high, ordered):
    if not ordered:
        low, high = builder.op("MINIMUM", low, high), builder.op("MAXIMUM", low, high)
    return builder.op("MINIMUM", builder.op("MAXIMUM", value, low), high)


def _clamp(builder, source):
    return _clamp_between(builder, *_inputs(builder, source, "Value", "Min", "Max"),
                          ordered=source.node.clamp_type == 'MINMAX')


def _map_range(builder, source):
    node, op = source.node, builder.op
    if getattr(node, "data_type", 'FLOAT') == 'FLOAT':
        names = "Value", "From Min", "From Max", "To Min", "To Max", "Steps"
    else:
        names = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3",
                 "To_Max_FLOAT3", "Steps_FLOAT3")
    value, from_min, from_max, to_min, to_max, steps = _inputs(builder, source, *names)
    span = op("SUBTRACT", from_max, from_min)
    factor = op("DIVIDE", op("SUBTRACT", value, from_min), span)
    if node.interpolation_type == 'STEPPED':
        factor = op("DIVIDE", op("FLOOR", op("MULTIPLY", factor, op("ADD", steps, 1.0))), steps)
    elif node.interpolation_type in {'SMOOTHSTEP', 'SMOOTHERSTEP'}:
        factor = op(node.interpolation_type, factor)
    result = op("MIX", to_min, to_max, factor)
    # An empty range gives 0, whatever To Min is.
    result = op("MULTIPLY", result, op("SUBTRACT", 1.0, op("COMPARE", span, 0.0, 0.0)))
    if node.clamp and node.interpolation_type in {'LINEAR', 'STEPPED'}:
        result = _clamp_between(builder, result, to_min, to_max, ordered=False)
    return result


def _color_ramp(builder, source):
    colors = [source.node.color_ramp.evaluate(i / 255.0) for i in range(256)]
    if source.output.identifier == "Alpha":
        table = [(color[3],) * 3 for color in colors]
    else:
        table = [tuple(color)[:3] for color in colors]
    return builder.op("RAMP", *_inputs(builder, source, "Fac"), number=builder.ramp(table))


def _separate(builder, source):
    if getattr(source.node, "mode", 'RGB') != 'RGB':
        raise Unsupported(f"{nodes.label(source.node)} with {source.node.mode}")
    component = list(source.node.outputs).index(source.output)
    color = builder.value(nodes.Place(source.node.inputs[0], source.path))
    return builder.op("COMPONENT", color, number=component)


def _combine(builder, source):
    if getattr(source.node, "mode", 'RGB') != 'RGB':
        raise Unsupported(f"{nodes.label(source.node)} with {source.node.mode}")
    return builder.op("COMBINE", *[builder.value(nodes.Place(source.node.inputs[i], source.path))
                                   for i in range(3)])


def _invert(builder, source):
    factor, color = _inputs(builder, source, "Fac", "Color")
    return builder.op("MIX", color, builder.op("SUBTRACT", 1.0, color), factor)


def _gamma(builder, source):
    return builder.op("POWER", *_inputs(builder, source, "Color", "Gamma"))


def _bright_contrast(builder, source):
    color, bright, contrast = _inputs(builder, source, "Color", "Bright", "Contrast")
    offset = builder.op("SUBTRACT", bright, builder.op("MULTIPLY", contrast, 0.5))
    scaled = builder.op("MULTIPLY_ADD", color, builder.op("ADD", contrast, 1.0), offset)
    return builder.op("MAXIMUM", scaled, 0.0)


def _blackbody(builder, source):
    color = builder.op("BLACKBODY", *_inputs(builder, source, "Temperature"))
    return builder.op("MAXIMUM", color, 0.0)


_HANDLERS = {
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeMix": _mix,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeValToRGB": _color_ramp,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeSeparateRGB": _separate,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineRGB": _combine,
    "ShaderNodeCombineXYZ": _combine,
    "ShaderNodeInvert": _invert,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeBrightContrast": _bright_contrast,
    "ShaderNodeBlackbody": _blackbody,
    "ShaderNodeRGBToBW":
        lambda builder, source: builder.op("LUMINANCE", *_inputs(builder, source, "Color")),
    "ShaderNodeRGB": lambda builder, source: builder.stored(source.output),
    "ShaderNodeValue": lambda builder, source: builder.stored(source.output),
}
