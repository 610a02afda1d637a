# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaves out what the Blender in use cannot do."""

import blenders
import launch


def pytest_collection_modifyitems(config, items):
    blenders.deselect(config, items, [launch.ROOT / "scripts" / "blender", "--factory-startup"])
