# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts/demo does once all is built, on a tenth of the picture's side."""

import struct
import subprocess
from pathlib import Path

import numpy as np
import openexr
import pytest

ROOT = Path(__file__).parents[2]

SMALL_AND_COUNTED = """
import bpy
bpy.context.scene.render.resolution_percentage = 10
bpy.app.handlers.render_complete.append(lambda *_: print('a render is complete'))
"""


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo")
    done = subprocess.run(
        [ROOT / "scripts" / "blender", "-b", ROOT / "blend_scenes" / "plume.blend",
         "--python-exit-code", "1", "--python-expr", SMALL_AND_COUNTED,
         "-P", ROOT / "scripts" / "render_demo.py", "--", out / "plume.png", out / "plume.exr"],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return out, done.stdout


def test_picture_and_layers_come_from_one_render(demo):
    out, printed = demo
    assert printed.count("a render is complete") == 1
    assert (out / "plume.png").exists() and (out / "plume.exr").exists()


def test_stage_times_and_peak_memory_are_printed(demo):
    line = next(line for line in demo[1].splitlines() if line.startswith("Brume |"))
    for word in ("export", "medium", "shadow", "transport", "march", "peak", "MiB"):
        assert word in line


def test_every_pass_is_a_layer(demo):
    header = subprocess.run(["exrheader", demo[0] / "plume.exr"], capture_output=True, text=True,
                            check=True).stdout
    for channel in ("Combined.A", "Depth.Z", "Normal.X", "VolumeDir.R", "Emit.G", "Env.B",
                    "Transmittance.R"):
        assert f"ViewLayer.{channel}," in header


def test_picture_shows_smoke(demo):
    layers = openexr.read(demo[0] / "plume.exr")
    width, height = struct.unpack(">II", (demo[0] / "plume.png").read_bytes()[16:24])
    assert layers["ViewLayer.Combined.R"].shape == (height, width)
    through = layers["ViewLayer.Transmittance.R"]
    smoke = through < 0.5
    assert 0.02 < smoke.mean() < 0.5
    assert np.all(layers["ViewLayer.VolumeDir.R"][smoke] > 0.0)
    # a step of depth below 6e-8 rounds to a transmittance of 1; over 128 of them 8e-6 may scatter
    assert layers["ViewLayer.VolumeDir.R"][through == 1.0].max() < 1e-4
