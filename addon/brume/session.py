# SPDX-License-Identifier: GPL-3.0-or-later
"""The process's one device and its scenes.

Blender makes and drops RenderEngine objects as it likes, several times a render, so nothing
native hangs on them. The device is made when it is first needed and let go at exit.
"""

import atexit
import threading
from typing import NamedTuple

from . import native
from .export import files
from .export.target import Target

_lock = threading.Lock()
_device = None
_stages = {}
_users = {}    # of a stage's name: how many hold it
_closing = []  # threads that free what was dropped


class RenderStats(NamedTuple):
    """What a final render took."""
    stats: native.Stats
    export_s: float
    whole_s: float


last_stats = None  # RenderStats of the newest final render


class Stage:
    """One scene of the library and what was exported to it; hold the lock while using it."""

    def __init__(self, device, **target_options):
        self.lock = threading.Lock()
        self.scene = native.Scene(device)
        self.target = Target(self.scene, **target_options)

    def close(self):
        with self.lock:
            self.target.files.close()
            self.scene.close()


def device():
    """The device, made on the first call; BrumeError if there can be none."""
    global _device
    with _lock:
        if _device is None:
            _device = native.Device()
        return _device


def ready():
    """Whether the device is there, so that device() answers at once."""
    return _device is not None


class Start(threading.Thread):
    """Makes the device without keeping anybody waiting: a graphics driver may take its time."""

    def __init__(self):
        super().__init__(name="brume start")
        self._error = None
        self.start()

    def run(self):
        try:
            device()
        except Exception as error:  # told by done()
            self._error = error

    def done(self):
        """Whether device() would answer at once; BrumeError if there can be no device."""
        if self.is_alive():
            return False
        if self._error is not None:
            raise self._error
        return True


def stage(name, make=Stage):
    """The scene kept under a name: "final", "preview", or one of the viewport's; make(device)
    makes it when it is first asked for."""
    owner = device()
    with _lock:
        if name not in _stages:
            _stages[name] = make(owner)
        return _stages[name]


def join(name):
    """Holds the stage of this name for one more user, who calls leave() in the end."""
    _users[name] = _users.get(name, 0) + 1


def leave(name):
    """Frees the stage once nobody is left who joined it."""
    _users[name] -= 1
    if not _users[name]:
        del _users[name]
        drop(name, wait=False)


def drop(name, wait=True):
    """Frees a scene that is no longer needed. The library first lets the step end that it is at, be
    it another scene's: wait=False leaves that to a thread."""
    with _lock:
        dropped = _stages.pop(name, None)
        if dropped is None:
            return
        if not wait:
            thread = threading.Thread(target=dropped.close, name="brume drop")
            thread.start()
            _closing[:] = [other for other in _closing if other.is_alive()] + [thread]
            return
    dropped.close()


def close():
    """Frees all scenes, then the device."""
    global _device
    files.shutdown()
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
    """The times of the stages that ran in native.Stats, in words: "medium 20, … ms"."""
    times = [(native.library().stage_name(index).decode(), stats.stages[index].wall_ms)
             for index in range(len(native.STAGES))]
    return ", ".join(f"{name} {ms:.0f}" for name, ms in times if ms >= 0.5) + " ms"


def iterations(stats):
    """How often native.Stats has light scattered anew, and what share of it the last time changed,
    where that is known: "7 iterations, the last 0.08 % | "; nothing where none ran."""
    if not stats.iterations:
        return ""
    last = f", the last {100 * stats.change:.2g} %" if stats.change > 0.0 else ""
    return f"{stats.iterations} iterations{last} | "


def told(stats):
    """native.Stats in words: the stages' times, the lattices' sizes, the memory."""
    medium, light = (" x ".join(str(side) for side in dims)
                     for dims in (stats.medium_dims, stats.transport_dims))
    return (f"{stage_times(stats)} | volumes {medium}, light {light} | {iterations(stats)}"
            f"{stats.total_bytes / 2 ** 20:.0f} MiB")


atexit.register(close)
