# SPDX-License-Identifier: GPL-3.0-or-later
"""Images to linear float pixels with straight alpha."""

import hashlib
from typing import NamedTuple

import bpy
import numpy as np

from ..compat import identity
from .target import key_of_datablock

_BYTES = np.arange(256) / 255.0
_SRGB = np.where(_BYTES <= 0.04045, _BYTES / 12.92, ((_BYTES + 0.055) / 1.055) ** 2.4).astype("f4")
_AS_IT_IS = {"Non-Color", "Raw", "Linear", "Linear Rec.709"}
CHANNELS = {"R": 0, "G": 1, "B": 2, "A": 3}


class Texture(NamedTuple):
    """An image as a node uses it."""
    image: bpy.types.Image
    extend: str = "REPEAT"
    nearest: bool = False


def _raw(image):
    """(height, width, channels) as Blender stores them, or None for a missing image."""
    width, height = image.size
    if width == 0 or height == 0 or len(image.pixels) == 0:
        return None
    raw = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(raw)
    return raw.reshape(height, width, -1)


def linear(image, raw, warn=lambda sentence: None):
    """Linear RGBA with straight alpha of an image's stored pixels. 8-bit images are stored in
    their own colour space, float images already linear but multiplied by alpha."""
    height, width, channels = raw.shape
    rgba = np.ones((height, width, 4), np.float32)
    if channels < 3:
        rgba[..., :3] = raw[..., :1]
    else:
        rgba[..., :channels] = raw[..., :4]
    if channels == 2:
        rgba[..., 3] = raw[..., 1]
    space = image.colorspace_settings.name
    if not image.is_float and space not in _AS_IT_IS:
        if space != "sRGB":
            warn(f"its colour space {space} is read as sRGB.")
        rgba[..., :3] = _SRGB[(np.clip(rgba[..., :3], 0, 1) * 255 + 0.5).astype(np.uint8)]
    if image.alpha_mode == 'NONE':
        rgba[..., 3] = 1
    elif image.is_float and image.alpha_mode != 'CHANNEL_PACKED':
        alpha = rgba[..., 3:]
        np.divide(rgba[..., :3], alpha, out=rgba[..., :3], where=(alpha > 0) & (alpha != 1))
    return rgba


def _channel(rgba, channel):
    """One channel, or luminance ("L"), in all of red, green and blue; "W": white with alpha."""
    out = np.ones_like(rgba)
    if channel == "L":
        out[..., :3] = (rgba[..., :3] @ np.array((0.2126, 0.7152, 0.0722), np.float32))[..., None]
    elif channel == "W":
        out[..., 3] = rgba[..., 3]
    else:
        out[..., :3] = rgba[..., CHANNELS[channel], None]
    return out


def export(target, texture, channel=None):
    """The key of a texture in the library's scene."""
    image, extend, nearest = texture
    key = key_of_datablock(image, extend, nearest, channel)
    return target.part(("image", key), None, {identity(image)},
                       lambda: _export(target, texture, channel, key))


def _export(target, texture, channel, key):
    image, extend, nearest = texture

    def warn(sentence):
        target.reports.unsupported(f'Image "{image.name}"', sentence)

    if image.source not in {'FILE', 'GENERATED'}:
        warn(f"an image of source {image.source} is shown with its present pixels.")
    raw = _raw(image)
    if raw is None:
        target.reports.warn("IMAGE_MISSING", f'Image "{image.name}" has no pixels '
                                             f'({image.filepath or "no file"}); shown magenta.')
        raw = np.array((1, 0, 1, 1), np.float32).reshape(1, 1, 4)
    # Hashing what is stored is far cheaper than decoding it.
    digest = hashlib.blake2b(raw, digest_size=16)
    digest.update(f"{raw.shape} {image.colorspace_settings.name} {image.alpha_mode}".encode())
    if target.keep("image", key, digest.digest()):
        return key
    pixels = linear(image, raw, warn)
    if channel:
        pixels = _channel(pixels, channel)
    target.put("image", key, digest.digest(), name=image.name, pixels=pixels, extend=extend,
               nearest=nearest)
    return key
