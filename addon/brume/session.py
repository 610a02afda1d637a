# SPDX-License-Identifier: GPL-3.0-or-later
"""The process's one device and its scenes.

Blender makes and drops RenderEngine objects as it likes, several times a render, so nothing
native hangs on them. The device is made when it is first needed and let go at exit.
"""

import atexit
import threading
from typing import NamedTuple

from . import native
from .export.target import Target

_lock = threading.Lock()
_device = None
_stages = {}
_closing = []  # threads that free what was dropped


class RenderStats(NamedTuple):
    """What a final render took."""
    stats: native.Stats
    export_s: float
    whole_s: float


last_stats = None  # RenderStats of the newest final render


class Stage:
    """One scene of the library and what was exported to it; hold the lock while using it."""

    def __init__(self, device):
        self.lock = threading.Lock()
        self.scene = native.Scene(device)
        self.target = Target(self.scene)

    def close(self):
        with self.lock:
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


def drop(name, wait=True):
    """Frees a scene that is no longer needed. The library first lets all jobs end that were begun
    before, a long render's too: wait=False leaves that to a thread."""
    with _lock:
        dropped = _stages.pop(name, None)
        if dropped is None:
            return
        if not wait:
            thread = threading.Thread(target=dropped.close, name="brume drop")
            _closing[:] = [other for other in _closing if other.is_alive()] + [thread]
            thread.start()
            return
    dropped.close()


def close():
    """Frees all scenes, then the device."""
    global _device
    for name in list(_stages):
        drop(name)
    for thread in _closing:
        thread.join()
    _closing.clear()
    with _lock:
        if _device is not None:
            _device.close()
            _device = None


def stage_times(stats):
    """The stages' times of native.Stats in words: "upload 1, medium 20, … ms"."""
    times = (f"{native.library().stage_name(index).decode()} {stats.stages[index].wall_ms:.0f}"
             for index in range(len(native.STAGES)))
    return f"{', '.join(times)} ms"


atexit.register(close)
