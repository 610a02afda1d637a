# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip of scripts/package: what is in it, and that a Blender which has nothing else renders."""

import os
import subprocess
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUILD = Path(os.environ.get("BRUME_BUILD", ROOT / "build")).resolve()

INSTALL = """
import bpy
bpy.ops.preferences.addon_install(filepath={package!r})
bpy.ops.preferences.addon_enable(module='brume')
"""

RENDER = """
import bpy, brume.native
print('add-on at', brume.__file__)
print('library at', brume.native.library_path())
scene = bpy.context.scene
scene.render.engine = 'BRUME'
scene.render.resolution_x, scene.render.resolution_y = 48, 32
scene.render.resolution_percentage = 100
scene.render.filepath = {picture!r}
bpy.ops.render.render(write_still=True)
"""


@pytest.fixture(scope="session")
def package(tmp_path_factory):
    out = tmp_path_factory.mktemp("package")
    done = subprocess.run([ROOT / "scripts" / "package", "--build", BUILD, "--out", out],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return Path(done.stdout.strip())


def test_contents(package):
    names = zipfile.ZipFile(package).namelist()
    assert {name.split("/")[0] for name in names} == {"brume"}  # one top folder, as Blender asks
    for name in ("__init__.py", "blender_manifest.toml", "lib/libbrume.so", "LICENSE"):
        assert f"brume/{name}" in names
    assert any(name.endswith(".comp.glsl") for name in names)
    assert not any("__pycache__" in name or name.endswith(".pyc") for name in names)


def test_same_input_same_zip(package, tmp_path):
    subprocess.run([ROOT / "scripts" / "package", "--build", BUILD, "--out", tmp_path],
                   capture_output=True, check=True)
    assert (tmp_path / package.name).read_bytes() == package.read_bytes()


@pytest.fixture
def blender(tmp_path):
    """Runs Python in a Blender with empty user folders; BRUME_ variables are kept from it."""
    environment = {name: value for name, value in os.environ.items()
                   if not name.startswith("BRUME_")}
    environment["BLENDER_USER_SCRIPTS"] = str(tmp_path / "scripts")
    environment["BLENDER_USER_CONFIG"] = str(tmp_path / "config")

    def blender(*scripts):
        words = [word for script in scripts for word in ("--python-expr", script)]
        return subprocess.run([os.environ.get("BLENDER", "blender"), "-b", "--factory-startup",
                               "--python-exit-code", "1", *words], env=environment,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=300, check=False)

    return blender


def test_installed_add_on_renders(package, blender, tmp_path):
    """Away from the checkout: add-on, library and shaders come out of the zip."""
    picture = tmp_path / "still.png"
    install = INSTALL.format(package=str(package))
    render = RENDER.format(picture=str(picture))
    installed = tmp_path / "scripts" / "addons" / "brume"

    done = blender(install, render)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"add-on at {installed}" in done.stdout
    assert f"library at {installed}" in done.stdout
    assert picture.stat().st_size > 0

    # spoil an installed shader: if it is the one in use, the next render fails and names it
    shader = installed / "lib" / "shaders" / "shade.comp.glsl"
    shader.write_text(shader.read_text() + "spoilt\n")
    enable = "import bpy; bpy.ops.preferences.addon_enable(module='brume')"
    done = blender(enable, render)
    assert done.returncode == 1
    assert "shade.comp.glsl" in done.stdout + done.stderr
