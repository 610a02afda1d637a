# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps to brume_light, at Cycles' radiometry."""

import numpy as np

from .. import compat
from . import nodes
from .expression import Builder, blackbody
from .target import key_of_datablock


def _node_factor(light, warn):
    """What the lamp's nodes multiply its light by."""
    tree = compat.node_tree(light)
    if tree is None:
        return np.ones(3)
    source = nodes.output_source(tree, "Surface")
    if source is None:
        return np.zeros(3)
    if source.node.bl_idname != 'ShaderNodeEmission':
        warn(f"{nodes.label(source.node)} is not supported on a lamp; it shines without nodes.")
        return np.ones(3)
    builder = Builder(warn)
    return (builder.number(source.input("Color")) * builder.number(source.input("Strength")))


def _shape(light):
    """The values of brume_light that depend on the lamp's type."""
    if light.type == 'SUN':
        return {"type": "SUN", "angle": light.angle}
    if light.type == 'POINT':
        return {"type": "POINT", "radius": light.shadow_soft_size}
    if light.type == 'SPOT':
        return {"type": "SPOT", "radius": light.shadow_soft_size, "spot_angle": light.spot_size,
                "spot_blend": light.spot_blend}
    round_shape = light.shape in {'DISK', 'ELLIPSE'}
    height = light.size if light.shape in {'SQUARE', 'DISK'} else light.size_y
    return {"type": "ELLIPSE" if round_shape else "RECTANGLE", "size": (light.size, height),
            "spread": light.spread}


def _reaches(ob):
    """Whether it lights what scatters diffusely, mirrors and fills: Cycles' ray visibility."""
    return ob.visible_diffuse, ob.visible_glossy, ob.visible_volume_scatter


def export(target, ob, matrix, persistent_id=(), camera_visible=True):
    """Puts one lamp; matrix is the instance's, by rows."""
    key = key_of_datablock(ob, *persistent_id)
    stamp = (compat.identity(ob.data), ob.name, matrix.tobytes(), camera_visible,
             _reaches(ob))
    # A lamp's identity changes with its type, of which its object tells.
    reads = nodes.identities(ob.data) | {compat.identity(ob)}
    target.part(("light", key), stamp, reads,
                lambda: _export(target, ob, matrix, key, camera_visible))


def _export(target, ob, matrix, key, camera_visible):
    light = ob.data
    if compat.light_is_portal(light):
        return

    def warn(sentence):
        target.reports.unsupported(f'Light "{light.name}"', sentence)

    color = np.array(light.color)
    kelvin = compat.light_temperature(light)
    if kelvin is not None:
        color = color * blackbody(kelvin)
    power = color * light.energy * compat.light_scale(light, matrix) * _node_factor(light, warn)
    if (power < 0).any():
        warn("negative light is left out.")
        power = np.maximum(power, 0.0)
    target.put("light", key, name=ob.name,
               world_from_light=matrix, power=tuple(power.tolist()),
               factors=tuple(map(float, _reaches(ob))),
               cast_shadow=bool(compat.light_casts_shadow(light)),
               camera_visible=bool(camera_visible and compat.light_is_seen(light)), **_shape(light))
