# SPDX-License-Identifier: GPL-3.0-or-later
"""brume-render from the outside: what it says, what it writes, how it ends."""

import signal
import struct
import subprocess
import time

import numpy as np
import openexr
import pytest

SMALL = ("--size", "48x32", "--samples", "2", "--medium-resolution", "32",
         "--lattice-resolution", "16", "--light-samples", "2", "--shadow-resolution", "64")
COLOR = ("R", "G", "B")


def combined(path):
    picture = openexr.read(path)
    return np.stack([picture[name] for name in "RGBA"], axis=-1)


def test_help_names_every_option(run):
    done = run("--help")
    assert done.returncode == 0 and done.stderr == ""
    for word in ("--density", "--sun", "--environment", "--eye", "--passes", "--list", "Ctrl-C"):
        assert word in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 100


def test_version(run):
    done = run("--version")
    assert done.returncode == 0 and done.stdout.startswith("brume-render ")


@pytest.mark.parametrize(("arguments", "sentence"), [
    ([], "a .vdb file is wanted"),
    (["a.vdb"], "--output is wanted"),
    (["-o", "a.exr", "a.vdb", "b.vdb"], "one .vdb file is wanted, not 2"),
    (["--what", "a.vdb"], "no option --what"),
    (["a.vdb", "-o"], "-o wants a value"),
    (["--samples", "many"], "--samples wants a whole number, not 'many'"),
    (["--samples", "0"], "--samples must be from 1"),
    (["--samples", "99999999999999999999"], "--samples must be from 1"),
    (["--density-scale", "nan"], "--density-scale wants a number, not 'nan'"),
    (["--density-scale", "inf"], "--density-scale wants a number, not 'inf'"),
    (["--density-scale", "-1"], "--density-scale must be from 0"),
    (["--density-scale", "1x"], "--density-scale wants a number, not '1x'"),
    (["--anisotropy", "1"], "--anisotropy must be from -0.99 to 0.99"),
    (["--albedo", "1,2"], "--albedo wants three numbers"),
    (["--depths", "exact"], "--depths wants propagated, marched, corrected or paper"),
    (["--blockers", "walls"], "--blockers wants links or fuzzy, not 'walls'"),
    (["--albedo", "0.5,0.5,1.5"], "--albedo must be from 0 to 1"),
    (["--eye", "1,2,nan"], "--eye wants three numbers"),
    (["--sun", "0,0,0"], "a direction that is not zero"),
    (["--power", "5"], "--power must follow the --point"),
    (["--point", "0,0,0", "--angle", "5"], "--angle must follow the --sun"),
    (["--size", "64"], "--size wants WIDTHxHEIGHT"),
    (["--size", "0x64"], "--size must be from 1x1"),
    (["--size", "64x64x64"], "--size wants WIDTHxHEIGHT"),
    (["--passes", "depth,shine"], "there is no pass 'shine'"),
    (["--passes", "alll"], "there is no pass 'alll'"),
    (["--passes", ""], "there is no pass ''"),
])
def test_bad_usage(run, arguments, sentence):
    done = run(*arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1


def test_list(run, smoke):
    done = run("--list", smoke)
    assert done.returncode == 0, done.stderr
    lines = {line.split()[0]: line for line in done.stdout.splitlines()}
    assert lines.keys() == {"density", "heat", "surface"}
    assert "float" in lines["density"] and "no medium" not in lines["density"]
    assert "no medium" in lines["surface"]


@pytest.mark.parametrize("arguments", [("--list",), ("-o", "a.exr")])
def test_missing_file(run, arguments):
    done = run(*arguments, "nowhere.vdb")
    assert done.returncode == 1
    assert "nowhere.vdb" in done.stderr and done.stderr.count("\n") == 1


def test_damaged_file(run, smoke, tmp_path):
    (tmp_path / "half.vdb").write_bytes(smoke.read_bytes()[:600])
    done = run("-o", "a.exr", "half.vdb")
    assert done.returncode == 1
    assert "half.vdb" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("grid", ["steam", "surface"])
def test_unknown_grid_and_level_set(run, smoke, grid):
    done = run("--density", grid, "-o", "a.exr", smoke)
    assert done.returncode == 1
    assert grid in done.stderr and done.stderr.count("\n") == 1


def test_missing_folder_is_found_before_the_work(run, smoke):
    done = run("-o", "nowhere/a.exr", smoke)
    assert done.returncode == 1 and "nowhere/a.exr" in done.stderr


def test_missing_environment(run, smoke):
    done = run("--environment", "sky.exr", "-o", "a.exr", smoke)
    assert done.returncode == 1 and "sky.exr" in done.stderr


def test_eye_at_the_target(run, smoke):
    done = run("--eye", "1,1,1", "--target", "1,1,1", "-o", "a.exr", smoke)
    assert done.returncode == 2 and "--target" in done.stderr


def test_default_picture_shows_the_smoke(run, smoke, tmp_path):
    done = run(*SMALL, "-o", "a.exr", smoke)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "" and done.stderr == ""
    picture = combined(tmp_path / "a.exr")
    assert picture.shape == (32, 48, 4) and np.isfinite(picture).all()
    # the ball stands in the middle and its surroundings are black
    assert picture[12:20, 20:28, :3].mean() > 0.05
    assert np.abs(picture[:3, :3, :3]).max() == 0.0


def test_same_command_same_pixels(run, smoke, tmp_path):
    for name in ("a.exr", "b.exr"):
        assert run(*SMALL, "-o", name, smoke).returncode == 0
    assert np.array_equal(combined(tmp_path / "a.exr"), combined(tmp_path / "b.exr"))


def test_half_march(run, smoke, tmp_path):
    for name, options in (("a.exr", ()), ("b.exr", ("--half-march",))):
        done = run(*SMALL, *options, "-o", name, smoke)
        assert done.returncode == 0, done.stderr
    whole, half = combined(tmp_path / "a.exr"), combined(tmp_path / "b.exr")
    assert not np.array_equal(whole, half)
    np.testing.assert_allclose(half[..., :3].mean(), whole[..., :3].mean(), rtol=0.05)


def test_more_light_more_radiance(run, smoke, tmp_path):
    for name, irradiance in (("a.exr", "16"), ("b.exr", "64")):
        assert run(*SMALL, "--sun", "0.2,1,-0.5", "--irradiance", irradiance, "-o", name,
                   smoke).returncode == 0
    one, four = combined(tmp_path / "a.exr"), combined(tmp_path / "b.exr")
    # linear in power; the tolerance is float's: of light that half floats hold without loss
    np.testing.assert_allclose(four[..., :3], 4.0 * one[..., :3], rtol=1e-4, atol=1e-6)


def test_passes(run, smoke, tmp_path):
    done = run(*SMALL, "--passes", "all", "--floor", "0.5", "--stats", "-o", "a.exr", smoke)
    assert done.returncode == 0, done.stderr
    picture = openexr.read(tmp_path / "a.exr")
    layers = {name.rpartition(".")[0] for name in picture}
    assert layers == {"", "Depth", "Normal", "VolumeDir", "Emit", "Env", "Transmittance",
                      "VolumeInd"}
    through = np.stack([picture[f"Transmittance.{name}"] for name in COLOR])
    assert through.min() >= 0.0 and through.max() <= 1.0 + 1e-6
    assert through[:, 16, 24].max() < 0.5  # 1.8 m of 4/m, no less than that at the middle
    assert picture["Depth.Z"][16:].max() < 100.0 < picture["Depth.Z"][0].min()  # floor and sky
    assert "total" in done.stdout and "MiB" in done.stdout


def test_one_pass_by_name(run, smoke, tmp_path):
    assert run(*SMALL, "--passes", "volumedir", "-o", "a.exr", smoke).returncode == 0
    layers = {name.rpartition(".")[0] for name in openexr.read(tmp_path / "a.exr")}
    assert layers == {"", "VolumeDir"}


def test_temperature_glows_without_any_lamp(run, smoke, tmp_path):
    done = run(*SMALL, "--temperature", "heat", "--density-scale", "0.1", "-o", "a.exr", smoke)
    assert done.returncode == 0, done.stderr
    core = combined(tmp_path / "a.exr")[14:18, 22:26, :3].mean(axis=(0, 1))
    assert core[0] > core[2] > 0.0  # 2000 K is red


def write_environment(path, color):
    """A uniform 4 x 2 EXR, float channels, uncompressed."""
    width, height = 4, 2
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in (b"B", b"G",
                                                                                     b"R")) + b"\0"
    attributes = (("channels", "chlist", channels), ("compression", "compression", b"\0"),
                  ("dataWindow", "box2i", window), ("displayWindow", "box2i", window),
                  ("lineOrder", "lineOrder", b"\0"),
                  ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
                  ("screenWindowCenter", "v2f", struct.pack("<2f", 0.0, 0.0)),
                  ("screenWindowWidth", "float", struct.pack("<f", 1.0)))
    head = struct.pack("<ii", openexr.MAGIC, 2)
    for name, kind, value in attributes:
        head += f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value
    head += b"\0"
    row = b"".join(np.full(width, value, "<f4").tobytes() for value in reversed(color))
    first = len(head) + 8 * height
    offsets = [first + y * (8 + len(row)) for y in range(height)]
    body = b"".join(struct.pack("<ii", y, len(row)) + row for y in range(height))
    path.write_bytes(head + struct.pack(f"<{height}Q", *offsets) + body)


def test_environment_is_seen_and_multiplied(run, smoke, tmp_path):
    write_environment(tmp_path / "sky.exr", (0.25, 0.5, 1.0))
    done = run(*SMALL, "--environment", "sky.exr", "--background", "2", "-o", "a.exr", smoke)
    assert done.returncode == 0, done.stderr
    picture = combined(tmp_path / "a.exr")
    np.testing.assert_allclose(picture[0, 0, :3], (0.5, 1.0, 2.0), rtol=1e-3)


def test_orthographic_from_above(run, smoke, tmp_path):
    """Along the default up direction, where the picture's upright is undefined."""
    done = run(*SMALL, "--orthographic", "4", "--target", "1,1,1", "--eye", "1,1,9", "-o",
               "a.exr", smoke)
    assert done.returncode == 0, done.stderr
    picture = combined(tmp_path / "a.exr")
    lit = picture[..., :3].sum(axis=-1) > 0.0
    # 1.8 m of 4 m over 32 rows: 14.4 rows, within the filter's width
    assert 12 <= lit.any(axis=1).sum() <= 19


def test_interrupt_ends_with_130_and_no_file(program, smoke, tmp_path):
    process = subprocess.Popen([program, "--samples", "4096", "--size", "640x360", "-o", "a.exr",
                                smoke], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    time.sleep(3.0)
    assert process.poll() is None, process.stderr.read()
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "cancelled" in message
    assert not (tmp_path / "a.exr").exists()
