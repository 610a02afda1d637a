# SPDX-License-Identifier: GPL-3.0-or-later
"""The .vdb files of a target: what was read from them, and reading them in worker threads.

Only library calls run in the threads, and ctypes lets Python go on meanwhile.
"""

import os
import threading
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor

from ..compat import VOXELS_AT_CORNERS
from ..native import Grid, vdb_list

# Of grids that no volume shows at present, so that a sequence that loops is read once.
KEPT_BYTES = 256 << 20
_WORKERS = 2

_pool = None


def _workers():
    global _pool
    if _pool is None:
        _pool = ThreadPoolExecutor(_WORKERS, "brume load")
    return _pool


def shutdown():
    """Leaves no thread behind but what is being read; else Python's end would wait for all that is
    to be read."""
    global _pool
    if _pool is not None:
        _pool.shutdown(wait=False, cancel_futures=True)
        _pool = None


def grid_infos(path):
    """What the library tells of each grid in a file, by name."""
    return {info.name.decode(errors="replace"): info for info in vdb_list(path)}


def load_grid(path, name):
    """A grid of a file, where the engines of this Blender show it."""
    return Grid.load_vdb(path, name, at_corner=VOXELS_AT_CORNERS)


class File:
    """A .vdb file as it was at one time: its list of grids, and those that were read."""

    def __init__(self, path, stamp):
        self.path, self.stamp = path, stamp
        self.infos = None
        self.error = None
        self.grids = {}

    def read(self, names):
        """Lists the grids, and reads those of these names that there are; raises BrumeError."""
        if self.infos is None:
            self.infos = grid_infos(self.path)
        for name in names:
            if name in self.infos and name not in self.grids:
                self.grids[name] = load_grid(self.path, name)

    def has(self, names):
        return self.infos is not None and all(
            name in self.grids for name in names if name in self.infos)

    @property
    def bytes(self):
        total = 0
        for grid in list(self.grids.values()):
            info = grid.describe()
            x, y, z = info.dims
            total += 4 * info.channels * x * y * z
        return total


class Files:
    """Without `background` a file is read when it is asked for. With it a worker thread does that,
    and meanwhile the newest file that came for the same volume stands in."""

    def __init__(self, background=False):
        self.background = background
        self.arrived = False  # whether anything was read since the last export began
        self._lock = threading.Lock()
        self._files = OrderedDict()  # by path and time of change, the last used last
        self._loads = {}      # of what a thread reads or will read: its future
        self._wanted = set()  # what this export asked for
        self._volumes = set()  # and for which volumes
        self._asked = {}      # of a volume: the files it waits for, the last asked for last
        self._shown = {}      # of a volume: the newest file that came
        self._names = {}      # of a volume: the grids that it uses

    @property
    def loading(self):
        return bool(self._loads)

    def begin(self):
        self.arrived = False
        self._wanted = set()
        self._volumes = set()

    def end(self):
        """Drops what is no longer wanted: loads that have not begun, and the oldest grids."""
        with self._lock:
            for key in [key for key, load in self._loads.items()
                        if key not in self._wanted and load.cancel()]:
                del self._loads[key]
        for table in (self._asked, self._shown, self._names):
            for volume in table.keys() - self._volumes:
                del table[volume]
        used = {id(file) for file in self._shown.values()}
        spare = [(key, file) for key, file in self._files.items()
                 if key not in self._wanted and key not in self._loads and id(file) not in used]
        left = KEPT_BYTES if self.background else 0
        for key, file in reversed(spare):
            left -= file.bytes
            if left < 0:
                del self._files[key]

    def open(self, volume, path):
        """The file of a volume (any key), listed; None if there is none yet. Raises BrumeError
        if the file cannot be read."""
        self._volumes.add(volume)
        file = self._file(path)
        if not self.background:
            file.read(())
            return file
        self._take(volume)
        names = self._names.get(volume, ())
        if self._ready(file, names):
            self._shown[volume] = file
            self._asked.pop(volume, None)
        else:
            self._load(volume, file, names)
        return self._shown.get(volume)

    def grids(self, volume, file, names):
        """The grids of these names; None if they are not there yet."""
        self._names[volume] = names
        if not self.background:
            file.read(names)
        elif not self._ready(file, names):
            self._load(volume, file, names)
            return None
        return [file.grids[name] for name in names]

    def _file(self, path):
        try:
            time = os.stat(path).st_mtime_ns
        except OSError:
            time = None  # the library says what is wrong with the path
        file = self._files.setdefault((path, time), File(path, (path, time)))
        self._files.move_to_end(file.stamp)
        self._wanted.add(file.stamp)
        return file

    def _ready(self, file, names):
        with self._lock:
            if file.stamp in self._loads:
                return False
        if file.error is not None:
            raise file.error
        return file.has(names)

    def _take(self, volume):
        """Shows the newest of the files that came since, be it no longer wanted."""
        asked = self._asked.get(volume, ())
        with self._lock:
            waiting = [file for file in asked if file.stamp in self._loads]
        came = [file for file in asked if file not in waiting and file.infos and not file.error]
        if came:
            self._shown[volume] = came[-1]
            # What was asked for before is late.
            waiting = [file for file in waiting if asked.index(file) > asked.index(came[-1])]
        self._asked[volume] = waiting

    def _load(self, volume, file, names):
        waiting = self._asked.setdefault(volume, [])
        if file not in waiting:
            waiting.append(file)
        with self._lock:
            # A file that is being read may lack a name: it is asked for again when it came.
            if file.stamp not in self._loads:
                self._loads[file.stamp] = _workers().submit(self._read, file, names)

    def _read(self, file, names):
        try:
            file.read(names)
        except Exception as error:
            file.error = error  # raised again where the file is asked for
        finally:
            with self._lock:
                self._loads.pop(file.stamp, None)
                self.arrived = True

    def close(self):
        """Drops what is not being read yet."""
        with self._lock:
            for load in self._loads.values():
                load.cancel()
