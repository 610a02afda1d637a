# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an export writes to: a native scene that gets only what changed, and the reports."""

import hashlib

import numpy as np

from .. import compat
from ..native import KINDS, BrumeError


def key_of(*parts):
    """A 64-bit key, the same in every run, of the parts' text; never 0."""
    text = "\0".join(str(part) for part in parts)
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little") or 1


def key_of_datablock(datablock, *parts):
    return key_of(compat.identity(datablock), *parts)


class Reports:
    """Sentences for the user, each once, in the order in which they came up."""

    def __init__(self):
        self._entries = {}

    def warn(self, id, sentence):
        self._entries.setdefault((id, sentence))

    def unsupported(self, owner, what):
        """owner: 'Material "Fog"'; what: the thing that is not shown, and what stands for it."""
        self.warn("UNSUPPORTED", f"{owner}: {what}")

    def __iter__(self):
        return iter(self._entries)

    def ids(self):
        return [id for id, _ in self._entries]


def _feed(digest, value):
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode())
        if value.size:
            digest.update(np.ascontiguousarray(value))
    elif hasattr(value, "fingerprint"):
        digest.update(value.fingerprint())
    elif isinstance(value, (list, tuple)):
        digest.update(f"({len(value)}".encode())
        for item in value:
            _feed(digest, item)
    else:
        digest.update(f"{type(value).__name__}{value!r}".encode())


def fingerprint(*values):
    digest = hashlib.blake2b(digest_size=16)
    _feed(digest, values)
    return digest.digest()


class Target:
    """Fills one native scene over many exports. Between begin() and end() everything that is
    there is put; what is put unchanged is not sent again, what is not put is removed."""

    def __init__(self, scene):
        self.scene = scene
        self.reports = Reports()
        self._sent = {kind: {} for kind in KINDS}
        self._seen = {kind: set() for kind in KINDS}
        self._world = None
        self._grids = {}
        self._grids_seen = set()

    def begin(self):
        self.reports = Reports()
        self._seen = {kind: set() for kind in KINDS}
        self._grids_seen = set()

    def end(self):
        for kind, seen in self._seen.items():
            self.scene.keep(kind, seen)
            self._sent[kind] = {k: v for k, v in self._sent[kind].items() if k in seen}
        self._grids = {k: v for k, v in self._grids.items() if k in self._grids_seen}

    def seen(self, kind, key):
        """Whether the key was put or kept since begin()."""
        return key in self._seen[kind]

    def keep(self, kind, key, mark):
        """Keeps what the library has under the key if it was put with this mark."""
        if self._sent[kind].get(key) != mark:
            return False
        self._seen[kind].add(key)
        return True

    def put(self, kind, key, mark=None, **values):
        """Sends one datablock unless the library has it; mark stands for the values, else they
        are hashed. False if the library refused it: that is reported under the datablock's name,
        and what the library had under the key is removed at end()."""
        mark = mark or fingerprint(*(values[name] for name in sorted(values)))
        if self.keep(kind, key, mark):
            return True
        self._sent[kind].pop(key, None)
        try:
            getattr(self.scene, f"set_{kind}")(key, **values)
        except BrumeError as error:
            self.reports.warn(error.id, f'"{values.get("name", kind)}": {error.sentence}')
            return False
        self._sent[kind][key] = mark
        self._seen[kind].add(key)
        return True

    def put_world(self, **values):
        mark = fingerprint(*(values[name] for name in sorted(values)))
        if self._world != mark:
            self.scene.set_world(**values)
            self._world = mark

    def grid(self, key, make):
        """A grid of an earlier export under the same key, else make()'s."""
        if key not in self._grids:
            self._grids[key] = make()
        self._grids_seen.add(key)
        return self._grids[key]
