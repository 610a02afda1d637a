# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input in whole renders: it is reported with an id, and the rest of the picture stands.

Not here: a .vdb that was cut off before Blender opened it. Blender 3.4 aborts on that by itself
while it evaluates the scene, before any engine is asked (an exception of OpenVDB that nobody
catches, in a TBB task).
"""

import os
import shutil
import subprocess

import bpy
import numpy as np
import pytest
from blenders import vdb
from brume import engine
from conftest import add, blender, lit, material, write_vdb

BALL = np.ones((8, 8, 8), np.float32)


@pytest.fixture
def entries(monkeypatch):
    """(id, sentence) of the engine's warnings."""
    found = []
    monkeypatch.setattr(engine.BrumeEngine, "_warn", lambda self, entries: found.extend(entries))
    return found


def volume(path, attribute="density"):
    """A Volume object that reads a file, beside the fog."""
    data = bpy.data.volumes.new("Cloud")
    data.filepath = str(path)
    smoke, nodes = material("Smoke")
    nodes.volume(nodes.node("VolumePrincipled", Density_Attribute=attribute))
    data.materials.append(smoke)
    return add("Cloud", data, location=(1.2, 0, -0.4))


def missing(path):
    pass


def garbage(path):
    path.write_bytes(bytes(range(256)) * 40)


def empty_file(path):
    path.touch()


def head_alone(path):
    write_vdb(path, density=BALL)
    path.write_bytes(path.read_bytes()[:60])


def folder(path):
    path.mkdir()


def unreadable(path):
    write_vdb(path, density=BALL)
    path.chmod(0)


def empty_grid(path):
    write_vdb(path, density=0 * BALL)


def one_value(value):
    def write(path):
        grid = vdb.FloatGrid()
        grid.copyFromArray(BALL)
        grid.name = "density"
        grid.getAccessor().setValueOn((3, 4, 5), value)
        vdb.write(str(path), grids=[grid])
    return write


def level_set(path):
    ball = vdb.createLevelSetSphere(radius=1.0, voxelSize=0.1)
    ball.name = "density"
    vdb.write(str(path), grids=[ball])


FILES = [
    (missing, "FILE_MISSING"), (garbage, "FILE_FORMAT"), (empty_file, "FILE_FORMAT"),
    (head_alone, "FILE_FORMAT"), (folder, "FILE_MISSING"), (empty_grid, "GRID_EMPTY"),
    (one_value(float('nan')), "GRID_VALUES"), (one_value(float('inf')), "GRID_VALUES"),
    (level_set, "GRID_TYPE"),
]
if os.geteuid() != 0:  # root may read everything
    FILES.append((unreadable, "FILE_MISSING"))


@pytest.mark.parametrize("write, id", FILES, ids=lambda value: getattr(value, "__name__", None))
def test_files(scene, render, entries, tmp_path, write, id):
    lit(scene)
    whole = render()
    path = tmp_path / "smoke.vdb"
    write(path)
    volume(path)
    assert np.array_equal(render("b"), whole)
    (found, sentence), = entries
    assert found == id, sentence
    assert "Cloud" in sentence
    assert "smoke.vdb" in sentence


def test_a_file_cut_off_while_blender_is_open(scene, render, entries, tmp_path):
    lit(scene)
    whole = render()
    path = tmp_path / "smoke.vdb"
    write_vdb(path, density=BALL)
    ob = volume(path)
    assert not np.array_equal(render("b"), whole)
    path.write_bytes(path.read_bytes()[:-200])
    assert np.array_equal(render("c"), whole)
    (found, sentence), = entries
    assert found == "FILE_FORMAT", sentence
    assert ob.name in sentence
    assert "smoke.vdb" in sentence


def test_unknown_grid(scene, render, entries, tmp_path):
    lit(scene)
    whole = render()
    volume(write_vdb(tmp_path / "smoke.vdb", density=BALL), "dust")
    assert np.array_equal(render("b"), whole)
    assert {found for found, _ in entries} == {"GRID_UNKNOWN"}
    assert any("Cloud" in sentence and '"dust"' in sentence for _, sentence in entries)


@pytest.mark.parametrize("scale", [(1, 1, 0), (0, 0, 0)])
def test_zero_scale(scene, render, entries, tmp_path, scale):
    lit(scene)
    whole = render()
    volume(write_vdb(tmp_path / "smoke.vdb", density=BALL)).scale = scale
    assert np.array_equal(render("b"), whole)
    (found, sentence), = entries
    assert found == "TRANSFORM", sentence
    assert "Cloud" in sentence


def test_two_voxels_a_million_apart(scene, render, entries, tmp_path):
    """Boxes of 0.6 m here, so that the fog keeps its cells; scattered light's get coarser."""
    lit(scene)
    scene.brume.method = 'OPV'
    grid = vdb.FloatGrid()
    grid.name = "density"
    grid.transform = vdb.createLinearTransform(1e-3)
    for at in (0, 10 ** 6):
        grid.fill((at, at, at), (at, at, at), 1.0)
    path = tmp_path / "smoke.vdb"
    vdb.write(str(path), grids=[grid])
    whole = render()
    volume(path).scale = (6e-4,) * 3
    pixels = render("b")
    # The lattice now holds another box, so the fog's edges fall on other cells.
    assert np.abs(pixels - whole).mean() < 0.03 * whole.mean()
    (found, sentence), = entries
    assert found == "GRID_WIDE", sentence
    assert "Cloud" in sentence
    assert "1000001" in sentence
    assert "smoke.vdb" in sentence


# -- other processes


def rendered(saved, tmp_path, **environment):
    """What Blender said about a render that must fail without a crash or a file."""
    done = blender(saved, "-E", "BRUME", "-o", tmp_path / "out_####", "-f", "1", **environment)
    assert done.returncode in {0, 1}, "Blender crashed"
    assert not list(tmp_path.glob("out_*"))
    return done.stdout + done.stderr


def test_no_gl(saved, tmp_path):
    said = rendered(saved, tmp_path, MESA_GL_VERSION_OVERRIDE="3.3")
    assert "(NO_GL)" in said
    assert "4.5" in said


def test_no_egl(saved, tmp_path):
    assert "(NO_EGL)" in rendered(saved, tmp_path, __EGL_VENDOR_LIBRARY_DIRS=str(tmp_path))


def test_no_library(saved, tmp_path):
    said = rendered(saved, tmp_path, BRUME_LIBRARY=str(tmp_path / "none.so"))
    assert "(LIBRARY_MISSING)" in said
    assert "none.so" in said


def test_a_text_for_a_library(saved, tmp_path):
    (tmp_path / "text.so").write_text("no library")
    said = rendered(saved, tmp_path, BRUME_LIBRARY=str(tmp_path / "text.so"))
    assert "(LIBRARY_MISSING)" in said
    assert "text.so" in said


@pytest.mark.parametrize("abi", ["999", None])
def test_library_of_another_abi(saved, tmp_path, abi):
    source = tmp_path / "other.c"
    source.write_text(f"unsigned brume_abi(void) {{ return {abi}; }}\n"
                      "unsigned long brume_struct_size(const char *n) { return n != 0; }\n"
                      if abi else "int nothing;\n")
    subprocess.run([shutil.which("cc"), "-shared", "-fPIC", "-o", tmp_path / "other.so", source],
                   check=True)
    said = rendered(saved, tmp_path, BRUME_LIBRARY=str(tmp_path / "other.so"))
    assert "(LIBRARY_ABI)" in said
    assert "other.so" in said
