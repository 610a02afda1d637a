# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface node trees to the lobes of brume_material."""

from dataclasses import dataclass, field

import numpy as np

from .. import compat
from . import image, nodes
from .expression import Builder, Unsupported
from .target import key_of, key_of_datablock

DEFAULT_KEY = key_of("default material")
GREY = np.full(3, 0.8)
NO_LOBES = {name: np.zeros(3) for name in ("diffuse", "specular", "metal", "emission")}


@dataclass
class Color:
    """A constant times an image, if there is one."""
    factor: np.ndarray
    texture: object = None
    channel: str = None  # the image's channel; None: the colour itself


@dataclass
class Lobe:
    kind: str            # diffuse, glossy, emission, transparent
    color: Color
    weight: np.ndarray   # three numbers
    roughness: Color = field(default_factory=lambda: Color(np.zeros(3)))
    burley: bool = False # diffuse: Burley's instead of Lambert's
    f0: bool = False     # glossy: its colour is the dielectric's F0, which no image multiplies


class SurfaceBuilder(Builder):
    def __init__(self, warn):
        super().__init__(warn)
        self.handlers["ShaderNodeTexImage"] = type(self)._image

    def _image(self, source):
        node = source.node
        if node.image is None:
            raise Unsupported(f"{nodes.label(node)} without an image")
        if node.projection != 'FLAT':
            raise Unsupported(f"{nodes.label(node)} with {node.projection} projection")
        self._check_uv(source)
        texture = image.Texture(node.image, node.extension, node.interpolation == 'Closest')
        return self.leaf("IMAGE_ALPHA" if source.output.identifier == "Alpha" else "IMAGE",
                         texture)

    def _check_uv(self, source):
        at = nodes.follow(source.input("Vector"))
        if at.node is None:
            return
        name = at.node.bl_idname
        by_uv = name == 'ShaderNodeUVMap' or (
            name == 'ShaderNodeTexCoord' and at.output.identifier == "UV")
        if not by_uv:
            self.warn(f"{nodes.label(source.node)} is placed by the active UV map instead of "
                      f"{nodes.label(at.node)}.")
        elif name == 'ShaderNodeUVMap' and at.node.uv_map:
            self.warn(f'{nodes.label(source.node)} uses the active UV map; "{at.node.uv_map}" '
                      f"is shown only if that is the active one.")

    def color(self, place):
        """An input as Color; what depends on more than one image is reported."""
        expression = self.value(place)
        factor = np.ones(3)
        while expression.op == "MULTIPLY" and any(arg.constant for arg in expression.args):
            known, expression = sorted(expression.args, key=lambda arg: not arg.constant)
            factor = factor * known.value
        if expression.constant:
            return Color(factor * expression.value)
        if expression.op == "IMAGE":
            return Color(factor, expression.number)
        if expression.op == "IMAGE_ALPHA":
            return Color(factor, expression.number, "A")
        inner = expression.args[0]
        if expression.op == "LUMINANCE" and inner.op == "IMAGE":
            return Color(factor, inner.number, "L")
        if expression.op == "COMPONENT" and inner.op == "IMAGE":
            return Color(factor, inner.number, "RGB"[expression.number])
        self.warn(f"{place.socket.name} of {nodes.label(place.socket.node)} takes more than an "
                  f"image times a colour and keeps its own value.")
        return Color(np.array(self.stored(place.socket).value))

    def scalar(self, place):
        """An input as one number; an image in it is reported."""
        color = self.color(place)
        if color.texture is not None:
            self.warn(f"{place.socket.name} of {nodes.label(place.socket.node)} takes no image "
                      f"and keeps its own value.")
            return float(self.stored(place.socket).value[0])
        return float(color.factor[0])


class _Walk:
    """Collects the lobes below a Surface output."""

    def __init__(self, warn):
        self.warn = warn
        self.builder = SurfaceBuilder(warn)
        self.lobes = []
        self.mask = None  # the image whose alpha decides between Transparent and the rest

    def add(self, kind, color, weight, **more):
        self.lobes.append(Lobe(kind, color, weight, **more))

    def closure(self, place, weight):
        source = nodes.follow(place)
        if source.node is None:
            return
        handler = _CLOSURES.get(source.node.bl_idname)
        if handler is not None:
            handler(self, source, weight)
            return
        self.warn(f"{nodes.label(source.node)} is shown as a grey diffuse surface.")
        self.add("diffuse", Color(GREY), weight)

    def ignored(self, source, *identifiers):
        """Names the inputs that are in use and that Brume does not have."""
        for identifier in identifiers:
            place = source.input(identifier)
            if place is None:
                continue
            linked = nodes.follow(place).node is not None
            value = getattr(place.socket, "default_value", 0.0)
            if linked or (isinstance(value, float) and value != 0.0):
                self.warn(f"{place.socket.name} of {nodes.label(source.node)} is not shown.")


def _diffuse(walk, source, weight):
    walk.ignored(source, "Roughness", "Normal")
    walk.add("diffuse", walk.builder.color(source.input("Color")), weight)


def _glossy(walk, source, weight):
    walk.ignored(source, "Normal", "Anisotropy")
    rough = walk.builder.color(source.input("Roughness"))
    if getattr(source.node, "distribution", 'GGX') == 'SHARP':
        rough = Color(np.zeros(3))
    walk.add("glossy", walk.builder.color(source.input("Color")), weight, roughness=rough)


def _emission(walk, source, weight):
    strength = walk.builder.scalar(source.input("Strength"))
    color = walk.builder.color(source.input("Color"))
    walk.add("emission", Color(color.factor * strength, color.texture), weight)


def _transparent(walk, source, weight):
    walk.add("transparent", walk.builder.color(source.input("Color")), weight)


def _is_transparent(place):
    source = nodes.follow(place)
    return source.node is not None and source.node.bl_idname == 'ShaderNodeBsdfTransparent'


def _mix(walk, source, weight):
    one, two = source.input("Shader"), source.input("Shader_001")
    place = source.input("Fac")
    factor = walk.builder.color(place)
    if factor.texture is not None and factor.channel == "A" and _is_transparent(one):
        walk.mask = factor.texture
        walk.closure(two, weight)
        return
    share = min(max(walk.builder.scalar(place) if factor.texture is not None
                    else float(factor.factor[0]), 0.0), 1.0)
    if share < 1.0:
        walk.closure(one, weight * (1.0 - share))
    if share > 0.0:
        walk.closure(two, weight * share)


def _add(walk, source, weight):
    walk.closure(source.input("Shader"), weight)
    walk.closure(source.input("Shader_001"), weight)


def _first(source, *identifiers):
    """The input under the first of the names it had in Blender's versions."""
    return next(filter(None, map(source.input, identifiers)), None)


def _principled(walk, source, weight):
    builder = walk.builder
    walk.ignored(source, "Subsurface", "Subsurface Weight", "Transmission", "Transmission Weight",
                 "Sheen", "Sheen Weight", "Clearcoat", "Coat Weight", "Anisotropic", "Normal")
    alpha = builder.color(source.input("Alpha"))
    if alpha.texture is not None:
        if alpha.channel == "A":
            walk.mask = alpha.texture
        else:
            builder.scalar(source.input("Alpha"))  # reports the image
            alpha = Color(np.array(builder.stored(source.input("Alpha").socket).value))
    cover = min(max(float(alpha.factor[0]), 0.0), 1.0)
    if cover < 1.0:
        walk.add("transparent", Color(np.ones(3)), weight * (1.0 - cover))
    weight = weight * cover
    if cover == 0.0:
        return
    base = builder.color(source.input("Base Color"))
    metallic = min(max(builder.scalar(source.input("Metallic")), 0.0), 1.0)
    rough = builder.color(source.input("Roughness"))
    specular = builder.scalar(_first(source, "Specular", "Specular IOR Level"))
    if metallic < 1.0:
        walk.add("diffuse", base, weight * (1.0 - metallic), roughness=rough,
                 burley=compat.principled_is_burley())
        if specular > 0.0:
            walk.add("glossy", Color(np.full(3, 0.08 * specular)), weight * (1.0 - metallic),
                     roughness=rough, f0=True)
    if metallic > 0.0:
        walk.add("glossy", base, weight * metallic, roughness=rough)
    glow = builder.color(_first(source, "Emission", "Emission Color"))
    strength = builder.scalar(source.input("Emission Strength"))
    if strength != 0.0 and (glow.factor > 0.0).any():
        walk.add("emission", Color(glow.factor * strength, glow.texture), weight)


_CLOSURES = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfAnisotropic": _glossy,  # what Glossy is called from 4.0 on
    "ShaderNodeEmission": _emission,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}


def _base_texture(walk):
    """The one image of the colours."""
    textures = [walk.mask] if walk.mask else []
    textures += [lobe.color.texture for lobe in walk.lobes
                 if lobe.kind in {"diffuse", "glossy"} and lobe.color.texture]
    if walk.mask and len(textures) == 1:
        return walk.mask, "W"
    if not textures:
        return None, None
    base = textures[-1] if walk.mask is None else textures[1]
    if any(texture != base for texture in textures):
        walk.warn(f'only one image per material is shown: "{base.image.name}".')
        if walk.mask != base:
            walk.mask = None
    channel = next(lobe.color.channel for lobe in walk.lobes if lobe.color.texture == base)
    return base, channel


def _gather(walk):
    """The lobes' sums, and the textures of base and roughness."""
    sums = {name: value.copy() for name, value in NO_LOBES.items()}
    base, channel = _base_texture(walk)
    through, solid = np.zeros(3), 0.0
    rough_sum, rough_weight, rough_texture = 0.0, 0.0, None
    burley_sum, burley_rough = 0.0, None
    for lobe in walk.lobes:
        amount = lobe.color.factor * lobe.weight
        textured = lobe.color.texture is not None and lobe.color.texture == base
        if lobe.kind == "transparent":
            through += amount
            continue
        if not lobe.f0:
            solid += float(np.mean(lobe.weight))
        if lobe.kind == "emission":
            if lobe.color.texture is not None:
                walk.warn("an image on emission is not shown; the emission is even.")
            sums["emission"] += amount
        elif lobe.kind == "diffuse":
            if base and not textured and channel != "W":
                walk.warn("the diffuse colour is multiplied by the material's image.")
            sums["diffuse"] += amount
            if lobe.burley:
                burley_sum += float(np.mean(amount))
                burley_rough = burley_rough or lobe.roughness
        else:
            sums["metal" if textured else "specular"] += amount
            share = float(np.mean(amount))
            rough_sum += share * float(lobe.roughness.factor[0])
            rough_weight += share
            rough_texture = rough_texture or (lobe.roughness.texture and lobe.roughness)
    if len({float(lobe.roughness.factor[0]) for lobe in walk.lobes if lobe.kind == "glossy"}) > 1:
        walk.warn("glossy parts of different roughness are shown with their mean.")
    roughness = rough_sum / rough_weight if rough_weight else 0.5
    if not rough_weight and burley_rough:
        roughness = float(burley_rough.factor[0])
        rough_texture = burley_rough.texture and burley_rough
    burley = burley_sum / max(float(np.mean(sums["diffuse"])), 1e-20)
    return sums, base, channel, through, solid, roughness, rough_texture, burley


def _cover(through, solid):
    """Alpha, and the colour of what passes, that keep the sums: Mix gives through + solid = 1, but
    Add may give more, and then both parts are scaled up by what alpha takes."""
    amount = float(through.max())
    if amount <= 0.0:
        return 1.0, np.ones(3)
    alpha = solid / (solid + amount)
    return alpha, through / (1.0 - alpha)


def has_surface(material):
    """Whether the material is seen on a surface. One without any output is: it is black."""
    tree = compat.node_tree(material) if material else None
    return tree is None or nodes.output_source(tree, "Surface") is not None or (
        nodes.output_source(tree, "Volume") is None)


def volume_tree(material):
    """The tree of a material with a volume shader, else None."""
    tree = compat.node_tree(material) if material else None
    return tree if tree and nodes.output_source(tree, "Volume") else None


def _plain(target, key, name, diffuse):
    target.put("material", key, name=name, **(NO_LOBES | {"diffuse": diffuse}),
               transparent=np.ones(3), roughness=0.5, alpha=1.0, alpha_mode='OPAQUE')


def key_of_material(material):
    """In the library's scene."""
    return DEFAULT_KEY if material is None else key_of_datablock(material)


def export(target, material):
    """Puts a material; None is grey."""
    key = key_of_material(material)
    if material is None:
        _plain(target, key, "default", GREY)
    else:
        target.part(("material", key), None, nodes.identities(material),
                    lambda: _export(target, material, key))


def _export(target, material, key):
    tree = compat.node_tree(material)
    if tree is None:
        _plain(target, key, material.name, np.array(material.diffuse_color[:3]))
        return
    owner = f'Material "{material.name}"'
    walk = _Walk(lambda sentence: target.reports.unsupported(owner, sentence))
    place = nodes.output_place(tree, "Surface")
    if place is not None:
        walk.closure(place, np.ones(3))
    if nodes.output_source(tree, "Displacement"):
        walk.warn("displacement is not shown.")
    sums, base, channel, through, solid, roughness, rough, burley = _gather(walk)
    alpha, passes = _cover(through, solid)
    if alpha > 0.0:
        sums = {name: value / alpha for name, value in sums.items()}
    see_through = alpha < 1.0 or walk.mask is not None
    # Cycles blends whatever the blend mode; only a chosen clip is kept.
    mode = ('CLIP' if compat.alpha_clips(material) else 'BLEND') if see_through else 'OPAQUE'
    target.put(
        "material", key, name=material.name, **sums, transparent=passes, roughness=roughness,
        alpha=alpha, alpha_mode=mode,
        alpha_threshold=getattr(material, "alpha_threshold", 0.5) or 0.5,
        base_image=image.export(target, base, channel) if base else 0,
        roughness_image=image.export(target, rough.texture, rough.channel or "L") if rough else 0,
        alpha_from_base_image=walk.mask is not None, burley=burley)
