# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes that are read by worker threads while the viewport goes on."""

import threading
import time

import bpy
import numpy as np
import pytest
from brume.export import files
from brume.export import scene as scene_export
from brume.export.target import Target
from brume.native import Grid
from conftest import Recorder, write_vdb
from test_scene import smoke, volume_object


class Viewport:
    def __init__(self):
        self.recorder = Recorder()
        self.target = Target(self.recorder, background_loads=True)

    def export(self, changed=None):
        scene_export.export(bpy.context.evaluated_depsgraph_get(), self.target, changed)
        return self.recorder.of("volume")

    def width(self):
        """Of the density that the library has now, None without one."""
        blocks = self.recorder.of("volume")
        return blocks[0]["grids"][0].describe().dims[0] if blocks else None

    def settle(self):
        """Exports until all is there, as a view does while it draws."""
        deadline = time.monotonic() + 20
        while self.target.loading or self.target.arrived:
            assert time.monotonic() < deadline
            if self.target.arrived:
                self.export({})
            time.sleep(0.001)
        return self.width()


class Gate:
    """Holds every load until it is opened; counts them."""

    def __init__(self, monkeypatch):
        self.loads, self.opened = [], threading.Event()
        load = Grid.load_vdb

        def wait(path, name, **options):
            assert threading.current_thread() is not threading.main_thread()
            self.loads.append(int(path[-5]))
            assert self.opened.wait(20)
            return load(path, name, **options)
        monkeypatch.setattr(Grid, "load_vdb", wait)


@pytest.fixture
def sequence(scene, tmp_path):
    """A sequence of 8 frames; that of frame n is n voxels wide."""
    for frame in range(1, 9):
        write_vdb(tmp_path / f"s_{frame}.vdb", density=np.ones((frame, 2, 2), np.float32))
    ob = volume_object(str(tmp_path / "s_1.vdb"), smoke())
    ob.data.is_sequence, ob.data.frame_duration = True, 8
    scene.frame_set(1)
    return ob


@pytest.fixture
def viewport(scene):
    return Viewport()


def test_an_export_does_not_wait(sequence, viewport, monkeypatch):
    gate = Gate(monkeypatch)
    assert viewport.export() == []
    deadline = time.monotonic() + 20
    while not gate.loads:  # the grids are listed before one is loaded
        assert time.monotonic() < deadline
        assert viewport.export({}) == []
    assert viewport.target.loading
    gate.opened.set()
    assert viewport.settle() == 1
    assert not viewport.target.loading
    assert not list(viewport.target.reports)


def test_the_last_state_stays_meanwhile(scene, sequence, viewport, monkeypatch):
    viewport.export()
    assert viewport.settle() == 1
    gate = Gate(monkeypatch)
    scene.frame_set(2)
    viewport.export()
    assert viewport.width() == 1
    assert viewport.target.loading
    gate.opened.set()
    assert viewport.settle() == 2


def test_frames_are_dropped_rather_than_queued(scene, sequence, viewport, monkeypatch):
    viewport.export()
    viewport.settle()
    gate = Gate(monkeypatch)
    for frame in range(2, 9):
        scene.frame_set(frame)
        viewport.export()
        deadline = time.monotonic() + 20
        while len(gate.loads) < min(frame - 1, files._WORKERS):
            assert time.monotonic() < deadline
            time.sleep(0.001)
    gate.opened.set()
    assert viewport.settle() == 8
    # Those that had begun, and the one that is wanted in the end.
    assert gate.loads == [2, 3, 8]


def test_what_comes_late_is_shown_until_the_next(scene, sequence, viewport, monkeypatch):
    """Else a sequence that takes longer to read than to play would stand still."""
    viewport.export()
    viewport.settle()
    gate = Gate(monkeypatch)
    scene.frame_set(2)
    viewport.export()
    gate.opened.set()
    deadline = time.monotonic() + 20
    while not viewport.target.arrived:
        assert time.monotonic() < deadline
        time.sleep(0.001)
    gate.opened.clear()
    scene.frame_set(3)
    viewport.export()
    assert viewport.width() == 2
    gate.opened.set()
    assert viewport.settle() == 3


def test_a_loop_is_read_once(scene, sequence, viewport, monkeypatch):
    gate = Gate(monkeypatch)
    gate.opened.set()
    for _ in range(2):
        for frame in range(1, 9):
            scene.frame_set(frame)
            viewport.export()
            assert viewport.settle() == frame
    assert sorted(gate.loads) == list(range(1, 9))


def test_kept_grids_have_a_bound(scene, sequence, viewport, monkeypatch):
    monkeypatch.setattr(files, "KEPT_BYTES", 4 * 2 * 2 * (7 + 6 + 5))
    gate = Gate(monkeypatch)
    gate.opened.set()
    for frame in (1, 2, 3, 4, 5, 6, 7, 8, 5, 1):
        scene.frame_set(frame)
        viewport.export()
        assert viewport.settle() == frame
    assert gate.loads == [1, 2, 3, 4, 5, 6, 7, 8, 1]


def test_a_failed_load_is_reported_once_it_failed(scene, sequence, viewport, tmp_path):
    viewport.export()
    viewport.settle()
    sequence.data.filepath = str(tmp_path / "none_1.vdb")
    bpy.context.view_layer.update()
    viewport.export()
    viewport.settle()
    assert viewport.target.reports.ids() == ["FILE_MISSING"]
    assert viewport.width() is None
    write_vdb(tmp_path / "none_1.vdb", density=np.ones((5, 2, 2), np.float32))
    viewport.export({})
    assert viewport.settle() == 5
    assert not list(viewport.target.reports)


def test_a_file_that_is_written_anew_is_read_anew(scene, sequence, viewport, tmp_path):
    viewport.export()
    viewport.settle()
    write_vdb(tmp_path / "s_1.vdb", density=np.ones((6, 2, 2), np.float32))
    viewport.export({})
    assert viewport.settle() == 6


def test_a_hidden_volume_is_forgotten(scene, sequence, viewport, monkeypatch):
    gate = Gate(monkeypatch)
    viewport.export()
    sequence.hide_viewport = True
    bpy.context.view_layer.update()
    gate.opened.set()
    viewport.export()
    assert viewport.settle() is None
    assert viewport.export({}) == []
