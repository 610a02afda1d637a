# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads single-part scanline EXR files: none, ZIPS or ZIP compression, half or float channels.

Independent of the library's own reader, so that the two check each other.
"""

import struct
import zlib

import numpy as np

MAGIC = 20000630
ROWS_PER_CHUNK = {0: 1, 2: 1, 3: 16}  # by compression: none, ZIPS, ZIP
SAMPLE_TYPES = {1: np.dtype("<f2"), 2: np.dtype("<f4")}


def _word(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _attributes(data):
    attributes, at = {}, 8
    while data[at]:
        name, at = _word(data, at)
        _, at = _word(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _channels(value):
    channels, at = [], 0
    while value[at]:
        name, at = _word(value, at)
        channels.append((name, SAMPLE_TYPES[struct.unpack_from("<i", value, at)[0]]))
        at += 16
    return channels


def _inflate(packed, size):
    if len(packed) == size:  # stored as it is where packing does not pay
        return packed
    delta = np.frombuffer(zlib.decompress(packed), np.uint8).astype(np.int64)
    delta[1:] -= 128
    halves = np.cumsum(delta).astype(np.uint8)
    out = np.empty_like(halves)
    out[0::2], out[1::2] = halves[:(size + 1) // 2], halves[(size + 1) // 2:]
    return out.tobytes()


def read(path):
    """Channel name -> array (height, width) of floats, top row first."""
    data = path.read_bytes()
    magic, version = struct.unpack_from("<ii", data)
    # 0x400, long names, is the one flag that changes nothing here
    assert magic == MAGIC and version & 0x1A00 == 0, f"{path}: no single-part scanline EXR"
    attributes, at = _attributes(data)
    channels = _channels(attributes["channels"])
    rows = ROWS_PER_CHUNK[attributes["compression"][0]]
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1

    picture = {name: np.empty((height, width), np.float32) for name, _ in channels}
    for offset in struct.unpack_from(f"<{-(-height // rows)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        first, count = y - top, min(rows, bottom - y + 1)
        line = sum(width * sample.itemsize for _, sample in channels)
        block, at = _inflate(data[offset + 8:offset + 8 + size], line * count), 0
        for row in range(first, first + count):
            for name, sample in channels:
                picture[name][row] = np.frombuffer(block, sample, width, at)
                at += width * sample.itemsize
    return picture
