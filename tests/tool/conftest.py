# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of brume-render share: the program and a smoke file made by OpenVDB itself."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from blenders import vdb

ROOT = Path(__file__).parents[2]
BUILD = Path(os.environ.get("BRUME_BUILD", ROOT / "build")).resolve()


@pytest.fixture(scope="session")
def program():
    path = BUILD / "bin" / "brume-render"
    assert path.exists(), f"{path} is not built"
    return path


@pytest.fixture
def run(program, tmp_path):
    """Runs brume-render in an empty folder; returns the completed process."""

    def run(*arguments):
        return subprocess.run([program, *map(str, arguments)], cwd=tmp_path, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True, timeout=300,
                              check=False)

    return run


@pytest.fixture(scope="session")
def smoke(tmp_path_factory):
    """A ball of density with a hot core, and a level set, which is no medium. 2 m wide."""
    side = 16
    axis = (np.arange(side) + 0.5) / side * 2.0 - 1.0
    radius = np.linalg.norm(np.meshgrid(axis, axis, axis, indexing="ij"), axis=0)
    grids = []
    for name, values in (("density", (radius < 0.9) * 4.0), ("heat", (radius < 0.4) * 2.0)):
        grid = vdb.FloatGrid()
        grid.name = name
        grid.copyFromArray(values.astype(np.float32))
        grid.transform = vdb.createLinearTransform(voxelSize=2.0 / side)
        grids.append(grid)
    surface = vdb.createLevelSetSphere(radius=1.0, voxelSize=0.2)
    surface.name = "surface"
    path = tmp_path_factory.mktemp("smoke") / "ball.vdb"
    vdb.write(str(path), grids=[*grids, surface])
    return path
