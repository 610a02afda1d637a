# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a picture is from a reference: block means, one number, and a side-by-side PNG.

Pictures are float arrays (height, width, channels), linear, first row at the bottom.
"""
import struct
import zlib

import numpy as np

BLOCKS = 32  # a side: at 128x128 pixels a block is 4x4 of them


def block_means(picture, blocks=BLOCKS):
    """Means over a grid of blocks x blocks equal tiles; sides must divide evenly."""
    height, width, channels = picture.shape
    if height % blocks or width % blocks:
        raise ValueError(f'{width}x{height} pixels do not divide into {blocks}x{blocks} blocks')
    tiles = picture.astype(np.float64).reshape(
        blocks, height // blocks, blocks, width // blocks, channels)
    return tiles.mean(axis=(1, 3))


def difference(picture, reference, blocks=BLOCKS, where=None):
    """(all channels, [each channel]): sum |picture - reference| / sum reference of block means,
    over the blocks that `where` picks (blocks x blocks, boolean), or all."""
    if picture.shape != reference.shape:
        raise ValueError(f'shapes {picture.shape} and {reference.shape} differ')
    if not np.isfinite(picture).all():
        raise ValueError('the picture has NaN or infinite pixels')
    a, b = block_means(picture, blocks), block_means(reference, blocks)
    if where is not None:
        a, b = a * where[..., None], b * where[..., None]
    apart, whole = np.abs(a - b).sum(axis=(0, 1)), b.sum(axis=(0, 1))
    if not whole.sum() > 0.0:
        raise ValueError('the reference is black')
    return apart.sum() / whole.sum(), (apart / np.maximum(whole, 1e-30)).tolist()


def changed(picture, plain, share=0.02, blocks=BLOCKS):
    """The blocks where `picture` differs from `plain` by more than `share` of `plain`'s value there
    or, where that is darker than the mean, of the mean: a black sky has no share to exceed."""
    a, b = (block_means(image, blocks).sum(axis=-1) for image in (picture, plain))
    return np.abs(a - b) > share * np.maximum(b, b.mean())


def side_by_side(path, picture, reference, gain=4.0):
    """Writes picture | reference | signed difference (times gain, around grey) as an 8-bit PNG."""
    exposure = 0.8 / max(np.percentile(reference, 98), 1e-6)
    shown = [srgb(image * exposure) for image in (picture, reference)]
    shown.append(np.clip(0.5 + gain * exposure * (picture - reference), 0.0, 1.0))
    write_png(path, np.concatenate(shown, axis=1))


def srgb(linear):
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def write_png(path, rgb):
    """rgb: (height, width, 3) in [0, 1], already encoded for display."""
    rows = np.flipud((rgb * 255 + 0.5).astype(np.uint8))
    height, width, _ = rows.shape
    raw = np.concatenate([np.zeros((height, 1), np.uint8), rows.reshape(height, -1)], axis=1)

    def chunk(kind, data):
        body = kind + data
        return struct.pack('>I', len(data)) + body + struct.pack('>I', zlib.crc32(body))

    with open(path, 'wb') as file:
        file.write(b'\x89PNG\r\n\x1a\n'
                   + chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 2, 0, 0, 0))
                   + chunk(b'IDAT', zlib.compress(raw.tobytes(), 6)) + chunk(b'IEND', b''))
