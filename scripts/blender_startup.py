# SPDX-License-Identifier: GPL-3.0-or-later
"""Enables this checkout's add-on inside Blender, for this run only; see scripts/blender."""

import sys
from pathlib import Path

import addon_utils

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "addon"))


def _failed(error):
    raise error


addon_utils.enable("brume", default_set=False, persistent=True, handle_error=_failed)
