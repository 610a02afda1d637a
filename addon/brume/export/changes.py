# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender says has changed since a viewport's last export, by datablock.

Blender tells a view of changes only when it draws; its handlers tell at once, of every evaluation.
They are silent about images: painting announces an image without naming it, and most of an image's
settings nothing at all. So the state of all images is looked at when somebody asks.
"""

import time
import weakref

import bpy
from bpy.app.handlers import persistent

from .. import compat

GEOMETRY, TRANSFORM, SHADING = 1, 2, 4

# Of a view's time, what looking at images may take: a thousand of them take some milliseconds.
_LOOK_SHARE = 0.05

_listeners = weakref.WeakSet()


class Changes:
    """Collects the changes of one scene and view layer for as long as it is kept."""

    def __init__(self, scene, view_layer):
        self._of = compat.identity(scene), view_layer.name
        self._changed = None  # None: everything
        self._images = {}     # their states at the last look
        self._look_again = 0.0  # not before
        _listeners.add(self)

    @property
    def pending(self):
        """Whether an export would find anything new."""
        if self._changed is None:
            return True
        if time.perf_counter() > self._look_again:
            self._look_at_images()
        return bool(self._changed)

    def take(self):
        """What changed, and forgets it: identity of a datablock -> GEOMETRY | TRANSFORM | SHADING
        as far as Blender says; None: everything may have."""
        self._look_at_images()
        changed, self._changed = self._changed, {}
        return changed

    def everything(self):
        self._changed = None

    def add(self, datablocks):
        if self._changed is not None:
            for name, flags in datablocks.items():
                self._changed[name] = self._changed.get(name, 0) | flags

    def concerns(self, depsgraph):
        return self._of == (compat.identity(depsgraph.scene), depsgraph.view_layer.name)

    def _look_at_images(self):
        began = time.perf_counter()
        before, self._images = self._images, _image_states()
        now = time.perf_counter()
        self._look_again = now + (now - began) / _LOOK_SHARE
        self.add({name: 0 for name in before.keys() | self._images.keys()
                  if _is_other(before.get(name), self._images.get(name))})


def _image_states():
    """Of each image what can be changed on it by name, and whether it is loaded. Asking for its
    size would load it."""
    return {compat.identity(image): (
        (image.as_pointer(), image.filepath, image.source, image.alpha_mode, image.is_dirty,
         image.colorspace_settings.name, image.generated_type, image.generated_width,
         image.generated_height, tuple(image.generated_color)), image.has_data)
        for image in bpy.data.images if image.source != 'VIEWER'}  # renders' results


def _is_other(before, now):
    """Whether an image's state tells of a change. Its pixels come when an export asks for them, but
    go when it is read anew from its file."""
    if before is None or now is None:
        return True
    return before[0] != now[0] or before[1] > now[1]


def _owners():
    """Of the node trees that are part of a material, world or lamp: these have all one name."""
    return {owner.node_tree: owner for owners in (bpy.data.materials, bpy.data.worlds,
                                                  bpy.data.lights)
            for owner in owners if owner.node_tree}


def _updates(depsgraph):
    found, owners = {}, None
    for update in depsgraph.updates:
        datablock = update.id.original
        if datablock.is_embedded_data and isinstance(datablock, bpy.types.NodeTree):
            owners = owners or _owners()
            datablock = owners.get(datablock, datablock)
        flags = (update.is_updated_geometry * GEOMETRY | update.is_updated_transform * TRANSFORM
                 | update.is_updated_shading * SHADING)
        name = compat.identity(datablock)
        found[name] = found.get(name, 0) | flags
    if depsgraph.id_type_updated('IMAGE'):
        # Of painting no more is known; what was painted on is not saved yet.
        for image in bpy.data.images:
            if image.is_dirty:
                found.setdefault(compat.identity(image), 0)
    return found


@persistent
def _evaluated(scene, depsgraph=None):
    if not _listeners or depsgraph is None or depsgraph.mode != 'VIEWPORT':
        return
    concerned = [changes for changes in _listeners if changes.concerns(depsgraph)]
    if concerned:
        found = _updates(depsgraph)
        for changes in concerned:
            changes.add(found)


@persistent
def _replaced(*_):
    """Undo, redo and loading replace datablocks by others of the same name."""
    for changes in _listeners:
        changes.everything()


_HANDLERS = {"depsgraph_update_post": _evaluated, "frame_change_post": _evaluated,
             "undo_post": _replaced, "redo_post": _replaced, "load_post": _replaced}


def register():
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS.items():
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:  # scripts clear such lists
            handlers.remove(handler)
