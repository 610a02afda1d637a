# SPDX-License-Identifier: GPL-3.0-or-later
"""The process's one device and its scenes.

Blender makes and drops RenderEngine objects as it likes, several times a render, so nothing
native hangs on them. The device is made when it is first needed and let go at exit.
"""

import atexit
import threading

from . import native
from .export.target import Target

_lock = threading.Lock()
_device = None
_stages = {}


class Stage:
    """One scene of the library and what was exported to it; hold the lock while using it."""

    def __init__(self, device):
        self.lock = threading.Lock()
        self.scene = native.Scene(device)
        self.target = Target(self.scene)

    def close(self):
        self.scene.close()


def device():
    """The device, made on the first call; BrumeError if there can be none."""
    global _device
    with _lock:
        if _device is None:
            _device = native.Device()
        return _device


def stage(name):
    """The scene kept under a name: "final", "preview", or a viewport's own."""
    owner = device()
    with _lock:
        if name not in _stages:
            _stages[name] = Stage(owner)
        return _stages[name]


def drop(name):
    """Frees a scene that is no longer needed."""
    with _lock:
        dropped = _stages.pop(name, None)
    if dropped is not None:
        with dropped.lock:
            dropped.close()


def close():
    """Frees all scenes, then the device."""
    global _device
    for name in list(_stages):
        drop(name)
    with _lock:
        if _device is not None:
            _device.close()
            _device = None


atexit.register(close)
