# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds arcade.blend: galleries of two storeys along both sides of a courtyard, in fog.

The sun stands over the eastern roof and shines through the western arches; the camera stands
behind them, in the lower gallery, whose light is nearly all scattered or reflected: what Sponza is
to others. y runs along the court, z = 0 is its paving, x = 0 the line of the western columns.
"""
import math
import os
import sys

import bpy
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import staging

NAME = 'arcade'
BAYS, BAY = 6, 2.6
LENGTH, COURT, DEPTH, WALL = BAYS * BAY, 7.0, 3.0, 0.4  # the galleries are DEPTH deep
LOWER = (0.0, 2.4, 3.75)    # a storey: its floor, where its arches spring, its ceiling
UPPER = (4.05, 5.95, 7.2)
THICK = 0.5                 # of the arcades' walls
TUCK = 0.1                  # how far one thing reaches into another, so that no faces coincide


def mesh(name, vertices, faces, materials, slots=None, smooth=False):
    """An object of a mesh; slots: a material's number for each face."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    for material in materials:
        data.materials.append(material)
    for polygon, slot in zip(data.polygons, slots or [0] * len(faces)):
        polygon.material_index = slot
        polygon.use_smooth = smooth
    if smooth:
        data.use_auto_smooth, data.auto_smooth_angle = True, math.radians(40)
    data.validate()
    thing = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(thing)
    return thing


def again(thing, name, location, turn=0.0):
    """The same mesh elsewhere."""
    copy = bpy.data.objects.new(name, thing.data)
    copy.location, copy.rotation_euler.z = location, turn
    bpy.context.collection.objects.link(copy)
    return copy


def pleated(bottom, top, thickness):
    """A closed wall along y: quads between two polylines of (y, z), front and back."""
    count = len(bottom)
    vertices = [(x, y, z) for x in (-thickness / 2, thickness / 2) for line in (bottom, top)
                for y, z in line]
    back_low, back_high, low, high = (range(k * count, (k + 1) * count) for k in range(4))
    faces = []
    for i in range(count - 1):
        j = i + 1
        faces += [(low[i], low[j], high[j], high[i]),
                  (back_low[i], back_high[i], back_high[j], back_low[j]),
                  (low[i], back_low[i], back_low[j], low[j]),
                  (high[i], high[j], back_high[j], back_high[i])]
    faces += [(low[0], high[0], back_high[0], back_low[0]),
              (low[-1], back_low[-1], back_high[-1], high[-1])]
    return vertices, faces


def arches(name, count, bay, radius, spring, top, thickness, material):
    """A wall with `count` round arches along y, from y = 0 on, above the springing line."""
    bottom = [(-TUCK, spring)]
    for i in range(count):
        middle = (i + 0.5) * bay
        for k in range(25):
            angle = math.pi * (1 - k / 24)
            bottom.append((middle + radius * math.cos(angle), spring + radius * math.sin(angle)))
    bottom.append((count * bay + TUCK, spring))
    return mesh(name, *pleated(bottom, [(y, top) for y, _ in bottom], thickness), [material])


def lathe(profile, segments=32):
    """Vertices and faces of (radius, height) turned about z, closed at both ends."""
    vertices = [(r * math.cos(a), r * math.sin(a), z) for r, z in profile
                for a in (2 * math.pi * k / segments for k in range(segments))]
    faces = [(i * segments + k, i * segments + (k + 1) % segments,
              (i + 1) * segments + (k + 1) % segments, (i + 1) * segments + k)
             for i in range(len(profile) - 1) for k in range(segments)]
    faces += [tuple(reversed(range(segments))),
              tuple(range((len(profile) - 1) * segments, len(profile) * segments))]
    return vertices, faces


def block(half, low, high):
    """Vertices and faces of an upright box about the z axis."""
    vertices = [(x, y, z) for z in (low, high) for x, y in (
        (-half, -half), (half, -half), (half, half), (-half, half))]
    return vertices, [(3, 2, 1, 0), (4, 5, 6, 7), *(
        (k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4) for k in range(4))]


def joined(*parts):
    vertices, faces = [], []
    for some, indices in parts:
        faces += [tuple(i + len(vertices) for i in face) for face in indices]
        vertices += some
    return vertices, faces


def column(name, radius, height, material):
    """Plinth, round base, shaft that swells a little, capital and abacus, from z = 0 on."""
    foot, neck = 0.34, height - 0.42
    base = [(1.32, 0.12), (1.42, 0.16), (1.42, 0.21), (1.30, 0.25), (1.18, 0.27), (1.24, 0.30),
            (1.20, foot)]
    shaft = [(1.0 - 0.12 * t * t, foot + 0.03 + t * (neck - foot - 0.03))
             for t in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)]
    capital = [(1.00, neck + 0.01), (1.00, neck + 0.05), (0.90, neck + 0.07), (0.94, neck + 0.14),
               (1.08, neck + 0.22), (1.32, neck + 0.28), (1.36, neck + 0.31)]
    outline = [(radius * r, z) for r, z in base + shaft + capital]
    return mesh(name, *joined(block(1.5 * radius, -TUCK / 2, 0.13), lathe(outline),
                              block(1.45 * radius, neck + 0.30, height + 0.02)),
                [material], smooth=True)


def drape(name, width, low, high, phase, material):
    """Cloth in folds that deepen downwards, along y about 0."""
    across, down = 72, 12
    vertices, faces = [], []
    for side in (-0.02, 0.02):
        for i in range(down + 1):
            t = i / down
            for k in range(across + 1):
                s = k / across
                fold = (0.03 + 0.07 * t) * math.sin(2 * math.pi * 5 * s + phase + 0.5 * t)
                fold += 0.03 * t * math.sin(2 * math.pi * 2 * s + 2 * phase)
                hem = 0.05 * math.sin(2 * math.pi * s + phase) * t
                narrower = 1.0 - 0.08 * t
                vertices.append((side + fold, (s - 0.5) * width * narrower,
                                 high + (low - high) * t + hem))
    row, sheet = across + 1, (across + 1) * (down + 1)
    for i in range(down):
        for k in range(across):
            a = i * row + k
            faces += [(a, a + 1, a + row + 1, a + row),
                      (sheet + a, sheet + a + row, sheet + a + row + 1, sheet + a + 1)]
    border = [*range(across), *(across + i * row for i in range(down)),
              *(down * row + k for k in range(across, 0, -1)),
              *(i * row for i in range(down, 0, -1))]
    for a, b in zip(border, border[1:] + border[:1]):
        faces.append((a, a + sheet, b + sheet, b))
    return mesh(name, vertices, faces, [material], smooth=True)


def paving(name, low, high, tile, materials):
    """Tiles of two kinds in turn, on the ground between two corners of (x, y)."""
    (x0, y0), (x1, y1) = low, high
    nx, ny = round((x1 - x0) / tile), round((y1 - y0) / tile)
    vertices = [(x0 + (x1 - x0) * i / nx, y0 + (y1 - y0) * j / ny, 0.0)
                for j in range(ny + 1) for i in range(nx + 1)]
    cells = [(i, j) for j in range(ny) for i in range(nx)]
    faces = [(j * (nx + 1) + i, j * (nx + 1) + i + 1, (j + 1) * (nx + 1) + i + 1,
              (j + 1) * (nx + 1) + i) for i, j in cells]
    return mesh(name, vertices, faces, materials, [(i + j) % 2 for i, j in cells])


def gallery(side, stone, plaster, tiles, columns):
    """One side of the court, in its own frame: the court is at x > 0, the back wall at x = -DEPTH.
    Returns its objects, to be turned."""
    before = set(bpy.context.collection.objects)
    slab = staging.slab
    y0, y1 = -TUCK, LENGTH + TUCK
    slab(f'{side} back', (-DEPTH - WALL, y0, -TUCK), (-DEPTH, y1, UPPER[2] + TUCK), plaster)
    slab(f'{side} floor', (-DEPTH - TUCK, y0, LOWER[2]), (0.36, y1, UPPER[0]), stone)
    slab(f'{side} cornice', (0.0, y0, LOWER[2] + 0.14), (0.46, y1, UPPER[0] - 0.04), stone)
    slab(f'{side} ceiling', (-DEPTH - TUCK, y0, UPPER[2]), (0.40, y1, UPPER[2] + 0.25), stone)
    slab(f'{side} parapet', (0.02, y0, UPPER[0] - TUCK), (0.16, y1, UPPER[0] + 0.62), stone)
    slab(f'{side} coping', (-0.04, y0, UPPER[0] + 0.60), (0.22, y1, UPPER[0] + 0.70), stone)
    x, eave, ridge = (-DEPTH - WALL - 0.05, 0.70), UPPER[2] + 0.24, UPPER[2] + 0.85
    roof = [(x[1], eave), (x[1], eave + 0.08), (x[0], ridge), (x[0], eave)]
    mesh(f'{side} roof', [(a, y, z) for y in (y0, y1) for a, z in roof],
         [(0, 1, 2, 3), (7, 6, 5, 4), *((k + 4, (k + 1) % 4 + 4, (k + 1) % 4, k)
                                        for k in range(4))], [tiles])
    for storey, (floor, spring, ceiling), pattern in (('lower', LOWER, columns[0]),
                                                      ('upper', UPPER, columns[1])):
        arches(f'{side} {storey} arcade', BAYS, BAY, 0.93, spring, ceiling + TUCK, THICK, stone)
        across = arches(f'{side} {storey} rib', 1, DEPTH - THICK / 2 - 0.12, 1.10, spring,
                        ceiling + TUCK, 0.32, plaster)
        across.data.transform(Matrix.Translation((-THICK / 2, 0, 0)) @
                              Matrix.Rotation(math.pi / 2, 4, 'Z'))
        for i in range(1, BAYS):
            again(pattern, f'{side} {storey} column {i}', (0.0, i * BAY, floor))
            again(across, f'{side} {storey} rib {i}', (0.0, i * BAY, 0.0))
            slab(f'{side} {storey} pilaster {i}', (-DEPTH - TUCK, i * BAY - 0.22, floor - TUCK),
                 (-DEPTH + 0.12, i * BAY + 0.22, spring - 0.12), plaster)
            slab(f'{side} {storey} impost {i}', (-DEPTH - TUCK, i * BAY - 0.27, spring - 0.13),
                 (-DEPTH + 0.18, i * BAY + 0.27, spring + 0.02), stone)
        for end, y in (('near', 0.0), ('far', LENGTH)):  # half piers at the end walls
            slab(f'{side} {storey} pier {end}', (-0.27, y - 0.36, floor - TUCK),
                 (0.27, y + 0.36, spring + 0.01), stone)
        bpy.data.objects.remove(across)
    return set(bpy.context.collection.objects) - before


staging.begin(NAME)
stone = staging.matt('Stone', (0.64, 0.57, 0.48))
plaster = staging.matt('Plaster', (0.70, 0.62, 0.52))
pale = staging.matt('Pale tiles', (0.58, 0.50, 0.41))
dark = staging.matt('Dark tiles', (0.30, 0.22, 0.17))
roofs = staging.matt('Roof tiles', (0.45, 0.20, 0.12))
wood = staging.matt('Wood', (0.16, 0.09, 0.05))
clay = staging.matt('Clay', (0.50, 0.23, 0.13))
red = staging.matt('Red cloth', (0.60, 0.03, 0.03))
green = staging.matt('Green cloth', (0.04, 0.36, 0.08))
blue = staging.matt('Blue cloth', (0.03, 0.10, 0.55))

west, east = -DEPTH, COURT + DEPTH
paving('Paving', (west - TUCK, -TUCK), (east + TUCK, LENGTH + TUCK), 0.65, [pale, dark])
staging.slab('Ground', (west - WALL, -WALL, -0.4), (east + WALL, LENGTH + WALL, -0.002), pale)
columns = (column('Lower column', 0.235, LOWER[1], stone),
           column('Upper column', 0.19, UPPER[1] - UPPER[0], stone))
gallery('West', stone, plaster, roofs, columns)
half_turn = Matrix.Translation((COURT, LENGTH, 0.0)) @ Matrix.Rotation(math.pi, 4, 'Z')
for thing in gallery('East', stone, plaster, roofs, columns):
    thing.matrix_world = half_turn @ thing.matrix_basis
for thing in columns:
    bpy.data.objects.remove(thing)

top = UPPER[2] + 0.9
for end, y0, y1 in (('Near', -WALL, 0.0), ('Far', LENGTH, LENGTH + WALL)):
    staging.slab(f'{end} wall', (west - WALL - 0.1, y0, -0.3), (east + WALL + 0.1, y1, top),
                 plaster)
    staging.slab(f'{end} ledge', (0.3, y0 - 0.04, LOWER[2] + 0.14),
                 (COURT - 0.3, y1 + 0.04, UPPER[0] - 0.04), stone)

# A door at the gallery's end, in a frame of stone.
staging.slab('Door frame', (-2.25, LENGTH - 0.10, -TUCK), (-0.85, LENGTH + TUCK, 2.35), stone)
staging.slab('Door', (-2.07, LENGTH - 0.13, -TUCK), (-1.03, LENGTH + TUCK, 2.15), wood)

urn = mesh('Urn', *lathe([(0.16, 0.0), (0.20, 0.02), (0.17, 0.06), (0.24, 0.16), (0.34, 0.34),
                          (0.36, 0.50), (0.30, 0.68), (0.19, 0.80), (0.17, 0.86), (0.23, 0.92),
                          (0.21, 0.93), (0.15, 0.86)]), [clay], smooth=True)
urn.location = (-2.45, 2.5 * BAY, 0.001)
again(urn, 'Urn 2', (1.2, 4.5 * BAY, 0.001), 1.0)

cloths = ((red, 0.3), (green, 1.7), (blue, 3.1))
for number, (x, bay, cloth, low) in enumerate((
        (0.62, 1, 2, 3.5), (0.62, 2, 0, 3.7), (0.62, 4, 1, 3.6),
        (COURT - 0.62, 1, 1, 3.6), (COURT - 0.62, 2, 0, 3.3), (COURT - 0.62, 3, 2, 3.55),
        (COURT - 0.62, 4, 1, 3.4)), start=1):
    material, phase = cloths[cloth]
    y, high, wall = (bay + 0.5) * BAY, UPPER[1] + 0.1, 0.0 if x < COURT / 2 else COURT
    drape(f'Drape {number}', 1.7, low, high, phase + number, material).location = (x, y, 0.0)
    staging.slab(f'Rod {number}', (x - 0.03, y - 0.98, high - 0.02),
                 (x + 0.03, y + 0.98, high + 0.04), wood)
    for hook in (y - 0.95, y + 0.95):  # into the arcade's wall beside the arch
        staging.slab(f'Hook {number}', (min(x, wall), hook - 0.02, high - 0.01),
                     (max(x, wall), hook + 0.02, high + 0.03), wood)

fog = staging.slab('Fog', (west - WALL / 2, -WALL / 2, -0.2),
                   (east + WALL / 2, LENGTH + WALL / 2, UPPER[2] + 0.12), staging.volume(
    'Fog', 'ShaderNodeVolumeScatter', Color=(0.94, 0.94, 0.94, 1.0), Density=0.05, Anisotropy=0.0))
fog.display_type = 'BOUNDS'

slope = 1.1  # of the sun's rays, across the court: over the eastern eaves, under western arches
staging.lamp('Sun', 'SUN', (9.0, 3.0 + 3.0, 2.0 + 9.0 * slope), (0.0, 3.0, 2.0), 22.0,
             (1.0, 0.82, 0.60), angle=0.009)
staging.world((0.26, 0.48, 1.0), 0.8)
staging.camera((-2.0, 0.9, 1.4), (0.25, 7.0, 2.1), lens=18.0)
scene = bpy.context.scene
scene.view_settings.look = 'Medium High Contrast'
scene.view_settings.exposure = -0.3
if hasattr(scene, 'brume'):
    scene.brume.method = 'LPV'
staging.finish(NAME, samples=128, bounces=16, volume_bounces=16)
