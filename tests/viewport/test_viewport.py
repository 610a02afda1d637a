# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume in Blender's window, on a virtual display: real key presses, and the screen's pixels."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCREEN = 900, 640


def run(scenario, folder, scene="cube", **environment):
    """Plays a scenario of drive.py in a Blender of its own; gives what it saw."""
    result = folder / f"{scenario}.npz"
    width, height = (str(side) for side in SCREEN)
    done = subprocess.run(
        ["xvfb-run", "-a", "-s", f"-ac -screen 0 {width}x{height}x24",
         ROOT / "scripts" / "blender", "--factory-startup", "-p", "0", "0", width, height,
         ROOT / "blend_scenes" / f"{scene}.blend", "-P", Path(__file__).parent / "drive.py",
         "--", scenario, result],
        capture_output=True, text=True, timeout=400,
        env=os.environ | {"TMPDIR": str(folder)} | environment)
    said = done.stdout[-4000:] + done.stderr[-4000:]
    assert result.exists(), said
    seen = dict(np.load(result))
    assert "error" not in seen, f"{seen['error']}\n{said}"
    assert done.returncode == 0, said
    return seen, said


def test_f12_renders_and_escape_stops_it(tmp_path):
    seen, _ = run("final", tmp_path)
    picture = seen["picture"]
    # Fog in the sun, on a grey floor.
    assert picture.min() > 0.02
    assert picture[1, 3].mean() > 1.3 * picture[0, 0].mean()
    # Half a second and one stage: a band of the march's rows.
    assert seen["cancel_s"] < 1.5


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    return run("seen", tmp_path_factory.mktemp("seen"))[0]


@pytest.mark.parametrize("kind", ["CAMERA", "PERSP", "ORTHO"])
def test_the_view_shows_what_f12_renders(seen, kind):
    shown, rendered = seen[f"{kind}_shown"], seen[f"{kind}_rendered"]
    assert rendered.std() > 0.02  # there is something to see
    # Noise of a few samples, 8 bits, and blocks cut at whole pixels.
    assert np.abs(shown - rendered).sum() < 0.03 * rendered.sum()


def test_views_come_and_go_at_work(tmp_path):
    seen, _ = run("survive", tmp_path)
    # Redrawing the window on a busy machine takes some tenths; waiting for the render, for ever.
    assert seen["away_s"] < 2.0
    assert seen["after_close"] == 1


def test_a_missing_library_is_said(tmp_path):
    seen, said = run("broken", tmp_path, BRUME_LIBRARY=str(tmp_path / "none.so"))
    assert seen["pictures"] == 0
