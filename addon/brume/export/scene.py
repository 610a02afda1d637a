# SPDX-License-Identifier: GPL-3.0-or-later
"""One pass over the evaluated depsgraph: every visible object goes to its module."""

from typing import NamedTuple

import numpy as np

from .. import native, properties
from ..compat import identity
from ..native import BrumeError
from . import fluid, light, material, mesh, volume, world
from .target import key_of, key_of_datablock

# Drawn by neither Brume nor Cycles, or presented to engines a second time, as a mesh.
_UNSEEN = {'EMPTY', 'ARMATURE', 'LATTICE', 'CAMERA', 'SPEAKER', 'LIGHT_PROBE', 'CURVE', 'SURFACE',
           'FONT', 'META'}


class _Shape(NamedTuple):
    """What an object's data becomes: a mesh's key (None: no surface), and the arrays and the
    material of a medium inside (None: none)."""
    mesh: int
    arrays: dict
    medium: object


_NOTHING = _Shape(None, None, None)


def _path(instance):
    """What tells the instances of one object apart."""
    if not instance.is_instance:
        return ()
    return (identity(instance.parent), *instance.persistent_id)


class _Export:
    def __init__(self, depsgraph, target):
        self.depsgraph, self.target = depsgraph, target
        self.override = depsgraph.view_layer_eval.material_override
        self.view_layer = depsgraph.view_layer
        self.shapes = {}    # by data and object, and by data and materials
        self.names = {}     # how many meshes of one name came up
        self.programs = {}  # compiled volume shaders
        self.groups = {}    # (mesh, visibility) -> matrices

    def warn(self, ob, sentence):
        self.target.reports.unsupported(f'Object "{ob.name}"', sentence)

    def run(self):
        for instance in self.depsgraph.object_instances:
            if not instance.show_self:
                continue
            ob = instance.object
            try:
                self.instance(instance, ob)
            except BrumeError as error:
                self.target.reports.warn(error.id, f'Object "{ob.name}": {error.sentence}')
        for (key, visibility), matrices in self.groups.items():
            self.target.put("instances", key_of(key, visibility), mesh=key,
                            world_from_object=np.array(matrices, np.float32),
                            visibility=visibility)

    def instance(self, instance, ob):
        if ob.type == 'LIGHT':
            light.export(self.target, ob, np.array(instance.matrix_world), _path(instance),
                         ob.visible_camera)
        elif ob.type == 'VOLUME':
            volume.export_volume_object(
                self.target, self.programs, ob, np.array(instance.matrix_world),
                key_of_datablock(ob, "volume", *_path(instance)), self.override)
        elif ob.type == 'MESH':
            self.surface(instance, ob)
        elif ob.type not in _UNSEEN:
            self.warn(ob, f"objects of type {ob.type} are not shown.")

    # -- surfaces

    def surface(self, instance, ob):
        known = (ob.data.as_pointer(), ob.original.as_pointer())
        shape = self.shapes.get(known)
        if shape is None:
            self.name_hair(ob)
            shape = self.shapes[known] = self.shape(ob)
        if shape.mesh is not None:
            visibility = self.visibility(ob)
            if visibility:
                matrices = self.groups.setdefault((shape.mesh, visibility), [])
                matrices.append(instance.matrix_world.copy())
        if shape.medium is not None:
            self.medium(instance, ob, shape, key_of_datablock(ob, "medium", *_path(instance)))

    def medium(self, instance, ob, shape, key):
        matrix = np.array(instance.matrix_world)
        domain = fluid.gas_domain(ob)
        if domain is not None:
            fluid.export(self.target, self.programs, ob, domain, shape.medium, matrix, key)
        else:
            volume.export_mesh_volume(self.target, self.programs, ob, shape.arrays, shape.medium,
                                      matrix, key)

    def visibility(self, ob):
        original = ob.original
        bits = native.VISIBLE_SHADOW if ob.visible_shadow else 0
        if ob.visible_camera and not original.indirect_only_get(view_layer=self.view_layer):
            bits |= native.VISIBLE_CAMERA
        if ob.is_holdout or original.holdout_get(view_layer=self.view_layer):
            bits |= native.VISIBLE_HOLDOUT
        return bits

    def materials(self, ob):
        """The material of each slot; never empty. What modifiers or curves made has its own."""
        own = ob.original.evaluated_get(self.depsgraph).data == ob.data
        found = ([slot.material for slot in ob.material_slots] if own
                 else list(ob.data.materials)) or [None]
        return [self.override] * len(found) if self.override else found

    def shape(self, ob):
        """Puts an object's mesh and finds its medium."""
        slots = self.materials(ob)
        medium, *others = [m for m in slots if material.volume_tree(m)] or [None]
        for name in sorted({other.name for other in others if other != medium}):
            self.warn(ob, f'the volume of material "{name}" is not shown, since an object has one, '
                          f'and that is of "{medium.name}".')
        domain = fluid.gas_domain(ob) is not None
        # Objects without modifiers share their evaluated mesh.
        shared = (ob.data.as_pointer(), tuple(m.as_pointer() if m else 0 for m in slots))
        if not domain and shared in self.shapes:
            return self.shapes[shared]
        seen = [i for i, m in enumerate(slots) if material.has_surface(m)]
        if domain and medium is None and not any(slots):
            return _NOTHING  # a domain without a material is no grey box
        arrays = mesh.read(ob.data)
        if arrays is None:
            return _NOTHING
        # A slot number beyond the slots means the last one, as in Blender.
        arrays["triangle_slots"] = np.minimum(arrays["triangle_slots"], len(slots) - 1)
        drawn = mesh.only_slots(arrays, seen)
        key = self.put_mesh(ob, drawn, slots) if drawn else None
        shape = self.shapes[shared] = _Shape(key, arrays if medium else None, medium)
        return shape

    def put_mesh(self, ob, arrays, slots):
        keys = tuple(material.export(self.target, m) for m in slots)
        number = self.names[ob.data.name_full] = self.names.get(ob.data.name_full, 0) + 1
        key = key_of_datablock(ob.data, "mesh", number)
        put = self.target.put("mesh", key, name=ob.name, materials=keys, **arrays)
        return key if put else None

    def name_hair(self, ob):
        for system in ob.particle_systems:
            settings = system.settings
            if settings.type == 'HAIR' and settings.render_type == 'PATH':
                self.warn(ob, f'the hair of "{system.name}" is not shown.')


def export(depsgraph, target):
    """Fills the target with the depsgraph's scene; what could not be shown is in its reports."""
    target.begin()
    scene = depsgraph.scene_eval
    world.export(target, scene.world, properties.world_reach(scene.brume))
    _Export(depsgraph, target).run()
    target.end()
