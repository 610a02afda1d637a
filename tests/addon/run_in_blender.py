# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of this folder by pytest inside Blender:

    scripts/blender -b --factory-startup --python-exit-code 1 \\
        -P tests/addon/run_in_blender.py -- [PYTEST ARGUMENTS]
"""

import os
import sys
from pathlib import Path

import pytest

arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
status = pytest.main([str(Path(__file__).parent), "-p", "no:cacheprovider", *arguments])
sys.stdout.flush()
sys.stderr.flush()
# Blender would go on and end with 0.
os._exit(int(status))
