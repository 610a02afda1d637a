# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog sources: what an object, its points or its particles are as a sum of Gaussians."""

from typing import NamedTuple

import numpy as np

from ..compat import identity, positions
from ..native import IDENTITY, OP, BrumeError
from . import mesh
from .volume import program_for
from .volume_shader import FOG_GRIDS, plain_program

# The radius is where exp(-4) of the middle's density is left, 2 %: scale = 2 / radius.
_SCALE_AT_RADIUS = 2.0

_DEAD, _UNBORN, _ALIVE = 1, 2, 3  # alive_state of Blender's particles

# Data types of attributes: the name of the values, and how many there are.
_ATTRIBUTES = {'FLOAT': ("value", 1), 'INT': ("value", 1), 'INT8': ("value", 1),
               'BOOLEAN': ("value", 1), 'FLOAT_VECTOR': ("vector", 3),
               'FLOAT_COLOR': ("color", 4), 'BYTE_COLOR': ("color", 4)}


# Of these Blender makes a mesh beside them, unless they are bare lines.
LINES = {'CURVE', 'SURFACE', 'FONT'}


class _Points(NamedTuple):
    """Where the Gaussians are and what differs between them; None where nothing does."""
    positions: np.ndarray
    sizes: np.ndarray      # their natural radii
    along: np.ndarray = None   # the curves' x
    colors: np.ndarray = None


def numbers(ob, own, shown, bare):
    """Which of an evaluated object's sources an instance gives the fog of. own: whether its data
    is the object's, not what modifiers made beside it; shown: whether it is itself seen; bare:
    whether there is nothing beside it."""
    def applies(source):
        if source.source == 'POINTS':
            return shown and (ob.type in {'MESH', 'POINTCLOUD', 'EMPTY'}
                              or ob.type in LINES and bare)
        return own and (shown or source.source == 'PARTICLES')
    return [number for number, source in enumerate(ob.brume.fog_sources)
            if source.enabled and applies(source)]


def is_fog(ob, kind):
    """Whether an object has a source of this kind."""
    return any(source.enabled and source.source == kind for source in ob.brume.fog_sources)


# ------------------------------------------------------------------------------------------------
# Reading


class _Reader:
    """Reads one source of an evaluated object; what is wrong with it goes to the reports."""

    def __init__(self, target, ob, source, scene):
        self.target, self.ob, self.source, self.scene = target, ob, source, scene

    def unsupported(self, sentence):
        self.target.reports.unsupported(f'Object "{self.ob.name}"', sentence)

    def read(self):
        """The Gaussians, (n, 8); None if there are none."""
        read = {'OBJECT': self.object, 'POINTS': self.points, 'PARTICLES': self.particles}
        points = read[self.source.source]()
        if points is None or not len(points.positions):
            return None
        return self.gaussians(points)

    def object(self):
        ob = self.ob
        if ob.type == 'EMPTY':
            return _Points(np.zeros((1, 3)), np.array([ob.empty_display_size]))
        if ob.type == 'META':
            elements = [e for e in ob.data.elements if not e.hide]
            if any(element.use_negative for element in elements):
                self.unsupported("its negative metaballs take no fog away.")
            if any(element.type != 'BALL' for element in elements):
                self.unsupported("its metaballs of other shapes are balls of fog, too.")
            kept = [element for element in elements if not element.use_negative]
            return _Points(np.array([tuple(e.co) for e in kept]).reshape(-1, 3),
                           np.array([e.radius for e in kept]))
        self.unsupported(f'it is fog by its points or particles; "{self.source.name}" takes the '
                         f"object itself, which is for empties and metaballs.")
        return None

    def points(self):
        if self.ob.type == 'EMPTY':
            self.unsupported(f'an empty has no points for the fog "{self.source.name}".')
            return None
        if self.ob.type == 'POINTCLOUD':
            return self.points_of(self.ob.data, self.ob.data.points)
        if self.ob.type in LINES:
            return self.line()
        with mesh.evaluated(self.ob) as data:
            return self.points_of(data, data.vertices)

    def line(self):
        """The points along a line without a mesh beside it."""
        try:
            data = self.ob.to_mesh()
            return data and self.points_of(data, data.vertices)
        finally:
            self.ob.to_mesh_clear()

    def points_of(self, data, points):
        count = len(points)
        if not count:
            return None
        radius = data.attributes.get("radius")
        sizes = _values(data, radius, count)
        if radius is not None and sizes is None:
            self.target.reports.warn(
                "ATTRIBUTE_UNKNOWN", f'Object "{self.ob.name}": attribute "radius" has no number '
                f'for each point or corner; the fog "{self.source.name}" takes 1 m.')
        color, along = self.source.color_attribute, self.source.factor_attribute
        return _Points(
            positions(data, points),
            np.ones(count) if sizes is None else sizes.mean(1),
            self.attribute(data, along, count, 1), self.attribute(data, color, count, 3))

    def attribute(self, data, name, count, channels):
        """The values of a named attribute or vertex group, one or three a point; None
        without a name and, reported, if they cannot be had."""
        if not name:
            return None
        attribute = data.attributes.get(name)
        values = _values(data, attribute, count)
        if values is None and attribute is None and name in self.ob.vertex_groups:
            values = _weights(data, self.ob.vertex_groups[name].index, count)
        if values is None:
            why = ("is not there" if attribute is None
                   else "has no number, vector or colour for each point or corner")
            self.target.reports.warn("ATTRIBUTE_UNKNOWN",
                                     f'Object "{self.ob.name}": attribute "{name}" {why}; the fog '
                                     f'"{self.source.name}" does without.')
            return None
        values = values[:, :3]  # without alpha
        if channels == 1:
            return values.mean(1)
        return np.broadcast_to(values, (count, 3))

    def particles(self):
        systems, name = self.ob.particle_systems, self.source.particle_system
        # Without a name the first that can be fog, else the first, which is then reported.
        system = systems.get(name) if name else min(
            systems, key=lambda system: system.settings.type == 'HAIR', default=None)
        if system is None:
            named = f' "{name}"' if name else ""
            self.target.reports.warn("PARTICLES_UNKNOWN",
                                     f'Object "{self.ob.name}" has no particle system{named} for '
                                     f'the fog "{self.source.name}".')
            return None
        settings = system.settings
        if settings.type == 'HAIR':
            self.unsupported(f'the hair of "{system.name}" gives no fog.')
            return None
        if settings.child_type != 'NONE':
            self.unsupported(f'the children of "{system.name}" give no fog.')

        def get(name, kind=np.float32):
            return mesh.values(system.particles, name, 1, kind).ravel()
        state = get("alive_state", np.int32)
        seen = get("is_exist", bool) & get("is_visible", bool) & (
            (state == _ALIVE) | ((state == _DEAD) & settings.use_dead)
            | ((state == _UNBORN) & settings.show_unborn))
        age = self.scene.frame_current_final - get("birth_time")
        lifetime = get("lifetime")
        along = np.divide(age, lifetime, out=np.zeros_like(age), where=lifetime > 0)
        location = mesh.values(system.particles, "location", 3, np.float32)
        return _Points(location[seen], get("size")[seen], along[seen])

    def gaussians(self, points):
        source, count = self.source, len(points.positions)
        with np.errstate(all="ignore"):
            radius = points.sizes * source.radius
            density = np.full(count, source.density)
            if points.along is not None and source.curves:
                along = np.nan_to_num(points.along)
                radius = radius * _curve(source.curves, "Radius", along)
                density = density * _curve(source.curves, "Strength", along)
            color = np.broadcast_to(source.color, (count, 3))
            if points.colors is not None:
                color = np.maximum(color * points.colors, 0)  # NaN stays
            scale = _SCALE_AT_RADIUS / radius
            found = np.column_stack((points.positions, scale, color, density)).astype(np.float32)
        unusable = ~np.isfinite(found[:, (0, 1, 2, 4, 5, 6)]).all(1) | ~np.isfinite(radius) | (
            radius < 0)
        if unusable.any():
            self.target.reports.warn(
                "POINTS_LEFT_OUT",
                f'Object "{self.ob.name}": {unusable.sum()} of its {count} points have no finite '
                f"position, size and colour, or a negative size, and are left out.")
        # A radius of 0 or almost so, or no strength, is how fog begins and ends.
        kept = ~unusable & np.isfinite(found).all(1) & (found[:, 3] > 0) & (found[:, 7] > 0)
        return found[kept] if kept.any() else None


def _values(data, attribute, count):
    """(count, channels) of an attribute for points or, averaged around them, corners; None if it
    is of another kind."""
    if attribute is None or attribute.data_type not in _ATTRIBUTES:
        return None
    found = mesh.values(attribute.data, *_ATTRIBUTES[attribute.data_type], np.float32)
    if attribute.domain == 'POINT':
        return found
    if attribute.domain != 'CORNER':
        return None
    vertices = mesh.values(data.loops, "vertex_index", 1, np.int32).ravel()
    corners = np.bincount(vertices, minlength=count)
    sums = np.stack([np.bincount(vertices, channel, count) for channel in found.T], 1)
    # Loose vertices have no corner that could make them dark.
    return np.divide(sums, corners[:, None], out=np.ones_like(sums), where=corners[:, None] > 0)


def _weights(data, group, count):
    """Of a vertex group, which only Python's own loop can read."""
    found = np.zeros((count, 1))
    for index, vertex in enumerate(data.vertices):
        for element in vertex.groups:
            if element.group == group:
                found[index] = element.weight
    return found


def _curve(tree, name, along):
    """What a curve of a fog source's node group multiplies by, for each x in 0..1."""
    node = tree.nodes.get(name)
    if node is None or node.bl_idname != 'ShaderNodeFloatCurve' or node.mute:
        return 1.0
    mapping, x = node.mapping, np.linspace(0, 1, 256)
    mapping.initialize()
    curve = mapping.curves[0]
    return np.interp(along, x, [mapping.evaluate(curve, value) for value in x])


# ------------------------------------------------------------------------------------------------
# Putting


def _program(target, ob, source, material):
    """The medium's program; None, and reported, if the material makes none of the Gaussians."""
    if material is None:
        return plain_program(source.anisotropy)
    owner = f'Object "{ob.name}": the fog "{source.name}"'
    program = program_for(target, material, FOG_GRIDS, FOG_GRIDS)
    if program is None:
        target.reports.unsupported(f'Object "{ob.name}"', f'the material "{material.name}" of its '
                                   f'fog "{source.name}" has no volume shader.')
        return None
    for name in program.unknown:
        target.reports.warn("GRID_UNKNOWN", f'{owner} has no "{name}"; it reads as 0.')
    for name in program.unused:
        target.reports.warn("GRID_UNKNOWN",
                            f'{owner} has no "{name}"; Principled Volume does without.')
    if not any(op == OP["GRID"] for op, *_ in program.instructions):
        target.reports.warn("GRID_UNKNOWN",
                            f'{owner} is left out: its material "{material.name}" reads neither '
                            f'"density" nor "color".')
        return None
    return program


def _stamp(ob, source, material, scene):
    """All settings: Blender does not tell of each that something about the object is new."""
    return (ob.empty_display_size, source.name, source.source, source.particle_system,
            source.radius, source.density, tuple(source.color), source.color_attribute,
            source.factor_attribute, source.anisotropy, material and identity(material),
            source.curves and identity(source.curves),
            scene.frame_current_final if source.source == 'PARTICLES' else None)


def _world_from_points(depsgraph, ob, source, matrix, is_instance):
    if source.source != 'PARTICLES':
        return matrix
    # Particles are where they are in the world, with their emitter. Instances of it move them.
    if not is_instance:
        return IDENTITY
    emitter = np.array(ob.original.evaluated_get(depsgraph).matrix_world)
    try:
        return matrix @ np.linalg.inv(emitter)
    except np.linalg.LinAlgError as error:
        raise BrumeError("TRANSFORM", "its transform is singular.") from error


def export(target, depsgraph, ob, number, matrix, is_instance, key, reads, override=None):
    """Puts the fog that one instance of an object gives by a source; reads: identities of what
    made it. Raises BrumeError."""
    source, scene = ob.brume.fog_sources[number], depsgraph.scene_eval
    material = override or source.material
    world = np.asarray(_world_from_points(depsgraph, ob, source, matrix, is_instance), np.float32)
    data = ob.data.as_pointer() if ob.data else 0
    stamp = ob.name, data, *_stamp(ob, source, material, scene)
    reads = reads | ({identity(source.curves)} if source.curves else set())

    def make():
        program = _program(target, ob, source, material)
        if program is None:
            return
        # All instances of the object share these.
        gaussians = target.part(("gaussians", identity(ob), number, data), stamp, reads,
                                _Reader(target, ob, source, scene).read)
        if gaussians is not None:
            target.put("volume", key, name=ob.name, program=program, gaussians=gaussians,
                       world_from_object=world)
    target.part(("fog", key), (*stamp, world.tobytes()), reads, make)
