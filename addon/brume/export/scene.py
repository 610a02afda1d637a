# SPDX-License-Identifier: GPL-3.0-or-later
"""One pass over the evaluated depsgraph: every visible object goes to its module.

The pass itself is made in every export: it is quick, and shows what comes, goes, moves and hides.
Meshes, materials and the like are read again only if they changed: target.part sees to that.
"""

import itertools
import re
from contextlib import contextmanager
from typing import NamedTuple

import bpy
import numpy as np

from .. import native, properties
from ..compat import identity
from ..native import BrumeError
from . import fluid, fog, light, material, mesh, nodes, volume, world
from .changes import GEOMETRY, SHADING
from .target import key_of, key_of_datablock

# Drawn by neither Brume nor Cycles, or presented to engines a second time, as a mesh.
_UNSEEN = {'EMPTY', 'ARMATURE', 'LATTICE', 'CAMERA', 'SPEAKER', 'LIGHT_PROBE', 'CURVE', 'SURFACE',
           'FONT', 'META'}


class _Material(NamedTuple):
    """A material slot: what its nodes make of the mesh."""
    material: object
    identity: str
    surface: bool
    volume: bool


class _Shape(NamedTuple):
    """What an object's data becomes: a mesh's key (None: no surface), and the arrays and the slot
    of a medium inside (None: none)."""
    mesh: int
    arrays: dict
    medium: int
    serial: int   # differs between all shapes


_serial = itertools.count()


class _Thing:
    """What all instances of one object with one shape have in common."""

    def __init__(self, *each, mesh=None, visibility=0):
        self.each = each      # are called with every instance, its object and matrix
        self.group = mesh, visibility
        self.indices = []     # of the instances


def _path(instance):
    """What tells the instances of one object apart."""
    if not instance.is_instance:
        return ()
    return (identity(instance.parent), *instance.persistent_id)


def _family(ob):
    """Metaballs whose names differ in the number at the end are one surface."""
    return re.sub(r"\.\d+$", "", ob.original.name)


def _matrices(instances):
    """Of all instances, hidden ones too, by rows."""
    values = np.empty(len(instances) * 16, np.float32)
    instances.foreach_get("matrix_world", values)
    return values.reshape(-1, 4, 4).swapaxes(1, 2)


class _Export:
    def __init__(self, depsgraph, target, space):
        self.depsgraph, self.target, self.space = depsgraph, target, space
        self.override = depsgraph.view_layer_eval.material_override
        self.view_layer = depsgraph.view_layer
        self.things = {}     # by object and data
        self.slots = {}      # by material: _Material
        self.drawn = set()   # those on a mesh
        self.shared = {}     # by mesh: its evaluated one
        self.numbers = {}    # how many shapes came up of one object and mesh
        self.meshed = set()  # curves that may be fog and have a mesh beside them
        self.families = None  # of metaballs that are fog, once they are asked for

    def run(self):
        instances = self.depsgraph.object_instances
        matrices = _matrices(instances)
        if bpy.data.curves and any(ob.type in fog.LINES and fog.is_fog(ob, 'POINTS')
                                   for ob in bpy.data.objects):
            self.meshed = {instance.object.original for instance in instances
                           if instance.object.type == 'MESH'
                           and instance.object.original.type in fog.LINES}
        for index, instance in enumerate(instances):
            shown = instance.show_self
            if not shown and not instance.show_particles:
                continue
            ob = instance.object
            # Only the evaluated object knows of local views; an instance has its instancer's.
            if self.space and not ob.visible_in_viewport_get(self.space):
                continue
            key = ob.original, ob.data, shown
            thing = self.things.get(key)
            if thing is None:
                thing = self.things[key] = self.thing(instance, ob, shown)
            thing.indices.append(index)
            for each in thing.each:
                with self.reporting(ob):
                    each(instance, ob, matrices[index])
        self.put_instances(matrices)

    @contextmanager
    def reporting(self, ob):
        """What fails of an object does not cost the rest."""
        try:
            yield
        except BrumeError as error:
            self.target.reports.warn(error.id, f'Object "{ob.name}": {error.sentence}')

    def put_instances(self, matrices):
        groups = {}
        for thing in self.things.values():
            groups.setdefault(thing.group, []).extend(thing.indices)
        for (key, visibility), indices in groups.items():
            if key is not None and visibility:
                block = matrices[indices]
                self.target.put("instances", key_of(key, visibility), block.tobytes(), mesh=key,
                                world_from_object=block, visibility=visibility)

    def thing(self, instance, ob, shown):
        thing = _Thing()
        if shown:
            with self.reporting(ob):
                thing = self.itself(instance, ob)
        numbers = fog.numbers(ob, self.is_own(ob), shown, ob.original not in self.meshed)
        if numbers:
            def each(instance, ob, matrix):
                self.fog(instance, ob, matrix, numbers)
            thing.each += (each,)
        return thing

    def itself(self, instance, ob):
        if ob.type == 'LIGHT':
            return _Thing(self.light)
        if ob.type == 'VOLUME':
            return _Thing(self.volume)
        if ob.type == 'MESH':
            return self.surface(instance, ob)
        seen_as_fog = ob.type == 'POINTCLOUD' and fog.is_fog(ob, 'POINTS')
        if ob.type not in _UNSEEN and not seen_as_fog:
            self.target.reports.unsupported(f'Object "{ob.name}"',
                                            f"objects of type {ob.type} are not shown.")
        return _Thing()

    def light(self, instance, ob, matrix):
        light.export(self.target, ob, matrix, _path(instance), ob.visible_camera)

    def volume(self, instance, ob, matrix):
        if ob.data is None:  # evaluated to nothing
            return
        self.medium_visibility(ob)
        volume.export_volume_object(
            self.target, ob, matrix, key_of_datablock(ob, "volume", *_path(instance)),
            self.makers(instance, ob), self.override)

    def fog(self, instance, ob, matrix, numbers):
        for number in numbers:
            key = key_of_datablock(ob, "fog", number, *_path(instance))
            with self.reporting(ob):
                fog.export(self.target, self.depsgraph, ob, number, matrix, instance.is_instance,
                           key, self.makers(instance, ob), self.override)

    def is_own(self, ob):
        """Whether the data is the object's, not what modifiers or curves made beside it."""
        return ob.original.evaluated_get(self.depsgraph).data == ob.data

    def makers(self, instance, ob):
        """Identities of what an object's data is made of."""
        found = {identity(ob)}
        if ob.data:
            found.add(identity(ob.data))
        if instance.is_instance:
            found.add(identity(instance.parent))
        return found

    # -- surfaces

    def surface(self, instance, ob):
        if ob.original.type == 'META' and _family(ob) in self.fog_families():
            return _Thing()
        own = self.is_own(ob)
        slots = [self.slot(m) for m in self.materials(ob, own)]
        shape, reads = self.shape(instance, ob, own, slots)
        if shape.mesh is not None:
            self.surface_visibility(ob)
            for slot in slots:
                if slot not in self.drawn:
                    self.drawn.add(slot)
                    material.export(self.target, slot.material)
        thing = _Thing(mesh=shape.mesh, visibility=self.visibility(ob))
        if shape.medium is not None:
            medium = slots[shape.medium]

            def each(instance, ob, matrix):
                self.medium(instance, ob, matrix, shape, medium, reads)
            thing.each = (each,)
        return thing

    def fog_families(self):
        """Names of the families of metaballs that are fog instead of a surface."""
        if self.families is None:
            seen = [ob for ob in self.depsgraph.objects if ob.type == 'META' and not (
                self.space and not ob.visible_in_viewport_get(self.space))]
            self.families = {_family(ob) for ob in seen if fog.is_fog(ob, 'OBJECT')}
            for ob in seen:
                if _family(ob) in self.families and not fog.is_fog(ob, 'OBJECT'):
                    self.target.reports.unsupported(
                        f'Object "{ob.name}"', "its metaballs are shown neither as a surface nor "
                                               "as fog, since others of their family are fog.")
        return self.families

    def medium(self, instance, ob, matrix, shape, medium, reads):
        self.medium_visibility(ob)
        key = key_of_datablock(ob, "medium", *_path(instance))
        stamp = (ob.name, matrix.tobytes(), medium.identity, shape.serial,
                 tuple(map(tuple, ob.bound_box)))
        domain = fluid.gas_domain(ob)

        def make():
            if domain is not None:
                fluid.export(self.target, ob, domain, medium.material, matrix, key)
            else:
                volume.export_mesh_volume(self.target, ob, shape.arrays, medium.material, matrix,
                                          key)
        self.target.part(("medium", key), stamp, reads, make)

    def surface_visibility(self, ob):
        """Names what a surface cannot be kept from."""
        if ob.is_shadow_catcher:
            self.target.reports.unsupported(f'Object "{ob.name}"', "a shadow catcher is shown as "
                                                                   "an ordinary surface.")
        if not (ob.visible_diffuse and ob.visible_volume_scatter):
            self.target.reports.unsupported(
                f'Object "{ob.name}"', "what it reflects lights all others: Ray Visibility to "
                                       "Diffuse and Volume Scatter is that of lamps alone.")

    def medium_visibility(self, ob):
        """Names what a volume cannot be kept from: all of them are one medium."""
        original = ob.original
        kept = {"Camera": ob.visible_camera, "Diffuse": ob.visible_diffuse,
                "Volume Scatter": ob.visible_volume_scatter, "Shadow": ob.visible_shadow,
                "Holdout": not (ob.is_holdout or
                                original.holdout_get(view_layer=self.view_layer)),
                "Indirect Only": not original.indirect_only_get(view_layer=self.view_layer)}
        named = [name for name, usual in kept.items() if not usual]
        if named:
            self.target.reports.unsupported(
                f'Object "{ob.name}"', f"its volume is seen, lit and casts shadows as all others: "
                                       f"{', '.join(named)} under Visibility means nothing to it.")

    def visibility(self, ob):
        original = ob.original
        bits = native.VISIBLE_SHADOW if ob.visible_shadow else 0
        if ob.visible_camera and not original.indirect_only_get(view_layer=self.view_layer):
            bits |= native.VISIBLE_CAMERA
        if ob.is_holdout or original.holdout_get(view_layer=self.view_layer):
            bits |= native.VISIBLE_HOLDOUT
        return bits

    def materials(self, ob, own):
        """The material of each slot; never empty. What modifiers or curves made has its own."""
        found = ([slot.material for slot in ob.material_slots] if own
                 else list(ob.data.materials)) or [None]
        return [self.override] * len(found) if self.override else found

    def slot(self, found):
        if found not in self.slots:
            name = found and identity(found)
            surface, medium = (True, False) if found is None else self.target.part(
                ("slot", name), None, nodes.identities(found),
                lambda: (material.has_surface(found), material.volume_tree(found) is not None))
            self.slots[found] = _Material(found, name, surface, medium)
        return self.slots[found]

    def shape(self, instance, ob, own, slots):
        """What the object's data becomes, and the identities of what that is made of."""
        # In edit mode the evaluated mesh does not know its original.
        data = ob.original.data if own and ob.original.type == 'MESH' else ob.data
        name = identity(data)
        reads, kinds = {name}, tuple(slot[1:] for slot in slots)
        if own and not ob.modifiers and self.shared.setdefault(name, ob.data) == ob.data:
            # Objects without modifiers share their evaluated mesh.
            label, part = data.name, ("mesh", name, kinds)
        else:
            owner = identity(ob)
            number = self.numbers[owner, name] = self.numbers.get((owner, name), 0) + 1
            label, part = ob.name, ("mesh", name, owner, number)
            reads.add(owner)
            if instance.is_instance and not own:
                reads.add(identity(instance.parent))
        stamp = label, ob.data.as_pointer(), kinds
        return self.target.part(part, stamp, reads,
                                lambda: self.make_shape(ob, slots, key_of(*part), label)), reads

    def make_shape(self, ob, slots, key, name):
        """Puts an object's mesh and finds its medium."""
        medium, *others = [i for i, slot in enumerate(slots) if slot.volume] or [None]
        for other in sorted({slots[i].material.name for i in others
                             if slots[i].material != slots[medium].material}):
            self.target.reports.unsupported(
                f'"{name}"', f'the volume of material "{other}" is not shown, since an object has '
                             f'one, and that is of "{slots[medium].material.name}".')
        for system in ob.particle_systems:
            if system.settings.type == 'HAIR' and system.settings.render_type == 'PATH':
                self.target.reports.unsupported(
                    f'"{name}"', f'the hair of "{system.name}" is not shown.')
        nothing = _Shape(None, None, None, next(_serial))
        if medium is None and fluid.gas_domain(ob) and all(slot.material is None for slot in slots):
            return nothing  # a domain without a material is no grey box
        arrays = mesh.read_of(ob)
        if arrays is None:
            return nothing
        # A slot number beyond the slots means the last one, as in Blender.
        arrays["triangle_slots"] = np.minimum(arrays["triangle_slots"], len(slots) - 1)
        drawn = mesh.only_slots(arrays, [i for i, slot in enumerate(slots) if slot.surface])
        keys = tuple(material.key_of_material(slot.material) for slot in slots)
        put = drawn and self.target.put("mesh", key, name=name, materials=keys, **drawn)
        inside = None if medium is None else {n: arrays[n] for n in ("positions", "triangles")}
        return _Shape(key if put else None, inside, medium, next(_serial))


def _is_read_again(name, flags):
    """Whether a change of a datablock means that what was made of it must be made anew."""
    if name.startswith("Object:"):
        # All but its data is looked at in every export.
        return bool(flags & GEOMETRY)
    # Since 4.2 a change of a material counts as one of the meshes' shading.
    return not (name.startswith("Mesh:") and flags == SHADING)


def export(depsgraph, target, changed=None, space=None):
    """Fills the target with the depsgraph's scene; what could not be shown is in its reports.
    changed: what changes.Changes gave since the last export from there, so that only that is read
    again; None: all is. space: a 3D view whose hidden objects are left out."""
    if changed is not None:
        changed = {name for name, flags in changed.items() if _is_read_again(name, flags)}
    target.begin(changed)
    scene = depsgraph.scene_eval
    world.export(target, scene.world, properties.world_reach(scene.brume))
    _Export(depsgraph, target, space).run()
    target.end()
