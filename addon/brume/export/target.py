# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an export writes to: a native scene that gets only what changed, and the reports."""

import hashlib

import numpy as np

from .. import compat
from ..native import KINDS, BrumeError
from .files import Files


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

    def extend(self, others):
        if others._entries:
            self._entries.update(others._entries)

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


class _Part:
    """What one step of an export came to, so that it need not be done again."""

    def __init__(self, stamp=None, reads=()):
        self.stamp = stamp
        self.reads = set(reads)   # identities of the datablocks that it depends on
        self.result = None
        self.reports = Reports()
        self.seen = set()         # (kind, key) of what it put
        self.inner = set()        # names of the parts inside
        self.lasting = True       # whether it is all that is to come

    def include(self, name, part):
        self.reads |= part.reads
        self.reports.extend(part.reports)
        self.seen |= part.seen
        self.inner |= part.inner
        self.inner.add(name)
        self.lasting &= part.lasting


class Target:
    """Fills one native scene over many exports. Between begin() and end() everything that is
    there is put; what is put unchanged is not sent again, what is not put is removed.

    An export is made of parts: functions that read datablocks and put what comes of them. What a
    part did stands until one of its datablocks changes."""

    def __init__(self, scene, background_loads=False):
        """background_loads: .vdb files are read by other threads. While one is, its volume stays
        as it was; `loading` tells of it, and `arrived` that another export would find more."""
        self.scene = scene
        self.files = Files(background_loads)
        self.sent_kinds = set()  # by the last export, or removed by it
        self._sent = {kind: {} for kind in KINDS}
        self._world = None
        self._grids = {}
        self._parts = {}  # of the last export, and those that are asked for in this one
        self._kept = {}
        self._part = _Part()  # the innermost one being made; outside of all, the whole export

    @property
    def reports(self):
        return self._part.reports

    @property
    def loading(self):
        return self.files.loading

    @property
    def arrived(self):
        return self.files.arrived

    def begin(self, changed=None):
        """changed: identities of datablocks whose parts are made anew; None: all are."""
        self._parts = {} if changed is None else {
            name: part for name, part in self._parts.items() if part.reads.isdisjoint(changed)}
        self._kept = {}
        self._part = _Part()
        self.sent_kinds = set()
        self.files.begin()

    def end(self):
        seen = {kind: set() for kind in (*KINDS, "grid")}
        for kind, key in self._part.seen:
            seen[kind].add(key)
        for kind, sent in self._sent.items():
            self.scene.keep(kind, seen[kind])
            kept = {k: v for k, v in sent.items() if k in seen[kind]}
            if len(kept) < len(sent):
                self.sent_kinds.add(kind)
            self._sent[kind] = kept
        self._grids = {k: v for k, v in self._grids.items() if k in seen["grid"]}
        self._parts = self._kept
        self.files.end()

    def part(self, name, stamp, reads, make):
        """What make() returns; taken from the last export, with all that was put and reported,
        if the stamp is the same and none of the datablocks changed that it reads: those whose
        identities are given, and those that the parts inside read."""
        outer, part = self._part, self._kept.get(name) or self._parts.get(name)
        if part is None or part.stamp != stamp:
            part = self._part = _Part(stamp, reads)
            try:
                part.result = make()
            except BrumeError:
                outer.reports.extend(part.reports)
                raise
            finally:
                self._part = outer
        if part.lasting:
            self._kept[name] = part
            for inner in part.inner:
                if inner in self._parts:
                    self._kept.setdefault(inner, self._parts[inner])
        outer.include(name, part)
        return part.result

    def reads(self, *datablocks):
        """The part being made depends on these."""
        self._part.reads.update(compat.identity(datablock) for datablock in datablocks)

    def unfinished(self, kind, key):
        """What the library has under the key stays for now; the part being made is made again in
        the next export."""
        self._part.lasting = False
        if key in self._sent[kind]:
            self._part.seen.add((kind, key))

    def keep(self, kind, key, mark):
        """Keeps what the library has under the key if it was put with this mark."""
        if self._sent[kind].get(key) != mark:
            return False
        self._part.seen.add((kind, key))
        return True

    def put(self, kind, key, mark=None, **values):
        """Sends one datablock unless the library has it; mark stands for the values, else they
        are hashed. False if the library refused it: that is reported under the datablock's name,
        and what the library had under the key is removed at end()."""
        mark = mark or fingerprint(*(values[name] for name in sorted(values)))
        if self.keep(kind, key, mark):
            return True
        self._sent[kind].pop(key, None)
        self.sent_kinds.add(kind)
        try:
            getattr(self.scene, f"set_{kind}")(key, **values)
        except BrumeError as error:
            self.reports.warn(error.id, f'"{values.get("name", kind)}": {error.sentence}')
            return False
        self._sent[kind][key] = mark
        self._part.seen.add((kind, key))
        return True

    def put_world(self, **values):
        mark = fingerprint(*(values[name] for name in sorted(values)))
        if self._world != mark:
            self.sent_kinds.add("world")
            self.scene.set_world(**values)
            self._world = mark

    def grid(self, key, make):
        """A grid of an earlier export under the same key, else make()'s."""
        if key not in self._grids:
            self._grids[key] = make()
        self._part.seen.add(("grid", key))
        return self._grids[key]
