# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios where something is not as it should be."""

import os
from pathlib import Path

import launch
from drive import scenario, shade, views


@scenario()
def no_library():
    """That is said in the view; nothing else happens."""
    shade('RENDERED')
    yield lambda: views() and views()[0].failed
    yield 0.5
    assert views()[0].picture is None


@scenario()
def freezes_once():
    """As where Blender's flaw strikes, the first time."""
    mark = Path(os.environ["BRUME_FROZE_BEFORE"])
    if not mark.exists():
        mark.touch()
        raise AttributeError(launch.READ_ONLY[0])
    yield 0.0
    return "went on"
