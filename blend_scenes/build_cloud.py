# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds cloud.vdb with OpenVDB's Python module and cloud.blend, which reads it.

The cloud is a heap of balls whose surface three octaves of value noise push about; the density
rises from the displaced surface inwards. The file holds half floats, Blosc-compressed.
"""
import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

try:
    import pyopenvdb as vdb
except ImportError:  # its name from OpenVDB 11 on
    import openvdb as vdb

NAME = 'cloud'
DIMS = (112, 80, 72)
VOXEL = 0.05  # metres


def value_noise(points, frequency, rng):
    """Smooth noise in [-1, 1] at `points` (m): a random lattice, interpolated by quintic fade."""
    size = 32
    lattice = rng.uniform(-1.0, 1.0, (size, size, size)).astype(np.float32)
    scaled = points * frequency
    cell = np.floor(scaled).astype(int)
    t = (scaled - cell).astype(np.float32)
    t = t * t * t * (t * (t * 6 - 15) + 10)
    total = np.zeros(points.shape[:-1], np.float32)
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, t, 1 - t), axis=-1)
        total += weight * lattice[tuple(np.moveaxis((cell + corner) % size, -1, 0))]
    return total


def density():
    """Density in [0, 1] on DIMS voxels, the cloud's flat base near z = 0."""
    rng = np.random.default_rng(7)
    axes = [(np.arange(n) + 0.5 - n / 2) * VOXEL for n in DIMS]
    axes[2] += DIMS[2] / 2 * VOXEL
    points = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1)

    distance = np.full(DIMS, np.inf, np.float32)  # to a smooth union of balls, negative inside
    for _ in range(26):
        x = rng.normal(0.0, 0.85)
        height = 1.25 * np.exp(-(x / 1.0) ** 2)
        centre = np.array([x, rng.normal(0.0, 0.45), 0.55 + rng.uniform(0.0, 1.0) * height])
        radius = rng.uniform(0.32, 0.62) * (1.0 - 0.12 * abs(x))
        ball = np.linalg.norm(points - centre, axis=-1) - radius
        blend = np.clip(0.5 + 0.5 * (distance - ball) / 0.12, 0.0, 1.0)
        finite = np.where(np.isfinite(distance), distance, ball)
        distance = finite + (ball - finite) * blend - 0.12 * blend * (1 - blend)

    for frequency, height in ((1.7, 0.22), (3.9, 0.12), (8.6, 0.06)):
        distance += height * np.abs(value_noise(points, frequency, rng)) * 2 - height
    inside = np.clip(-distance / 0.14, 0.0, 1.0)
    base = np.clip((points[..., 2] - 0.22) / 0.22, 0.0, 1.0)
    inside *= base
    for axis in range(3):  # nothing touches the box
        edge = np.minimum(np.arange(DIMS[axis]), np.arange(DIMS[axis])[::-1]) / 3.0
        inside *= np.clip(edge, 0.0, 1.0).reshape([-1 if a == axis else 1 for a in range(3)])
    return (inside * inside * (3 - 2 * inside)).astype(np.float32)


def write(path):
    grid = vdb.FloatGrid()
    grid.name = 'density'
    grid.gridClass = vdb.GridClass.FOG_VOLUME
    grid.saveFloatAsHalf = True
    field = density()
    grid.copyFromArray(np.where(field > 1e-3, field, 0.0), tolerance=1e-6)
    grid.prune()
    origin = [(0.5 - n / 2) * VOXEL for n in DIMS]
    origin[2] = 0.5 * VOXEL
    grid.transform = vdb.createLinearTransform(
        [[VOXEL, 0, 0, 0], [0, VOXEL, 0, 0], [0, 0, VOXEL, 0], [*origin, 1]])
    vdb.write(path, grids=[grid])


scene = staging.begin(NAME)
write(os.path.join(staging.FOLDER, 'cloud.vdb'))

bpy.ops.object.volume_import(filepath=os.path.join(staging.FOLDER, 'cloud.vdb'),
                             relative_path=True, align='WORLD', location=(0.0, 0.0, 0.0))
cloud = bpy.context.object
cloud.name = cloud.data.name = 'Cloud'
cloud.data.filepath = '//cloud.vdb'
cloud.data.materials.append(staging.volume(
    'Cloud', 'ShaderNodeVolumePrincipled', Color=(0.99, 0.99, 0.99, 1.0), Density=4.0,
    Anisotropy=0.6))

staging.lamp('Sun', 'SUN', (-3.5, 2.6, 4.4), (0.0, 0.0, 1.0), 16.0, (1.0, 0.92, 0.80), angle=0.01)
staging.world((0.16, 0.30, 0.62), 1.0)
staging.camera((0.0, -9.0, 0.6), (0.0, 0.0, 1.35), lens=60.0)
staging.finish(NAME)
