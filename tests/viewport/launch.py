# SPDX-License-Identifier: GPL-3.0-or-later
"""Starts Blender in a window on a virtual display and has it play scenarios."""

import ast
import json
import os
import re
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WINDOW = 640, 480  # Blender makes none smaller
TIMEOUT_S = 900
# What Blender says of all that Python writes, and of operators, once its own flaw has struck
# (docs/blenders.md, bench/readonly.py), the status that play.py then ends it with, and how often
# that may happen.
READ_ONLY = ("Writing to ID classes in this context is not allowed",
             "can't modify blend data in this state (drawing/rendering)")
FROZEN = 77
FREEZES = 3
# What Blender or the library says when something went wrong.
WRONG = re.compile(r"Traceback|\bError\b|ERROR|[Aa]ssert|GL error|GL_INVALID|Segmentation|Aborted"
                   r"|memory leak|Not freed")


class Played(NamedTuple):
    status: int     # None: it had to be ended
    said: str       # both of Blender's streams, and where it crashed if it did
    results: dict   # by the scenario's name: its values, error and seconds; none if not got to

    @property
    def wrong(self):
        """The lines that should not be there."""
        return [line for line in self.said.splitlines() if WRONG.search(line)]


def scenarios(theme):
    """The names of a theme's scenarios, and the marks of their functions by name."""
    found = {}
    for node in ast.parse((HERE / f"{theme}.py").read_text(encoding="utf-8")).body:
        for mark in getattr(node, "decorator_list", []):
            if isinstance(mark, ast.Call) and mark.func.id == "scenario":
                options = {word.arg: ast.literal_eval(word.value) for word in mark.keywords}
                found[node.name] = {name for name, value in options.items() if value is True}
    return found


def is_read_only(said):
    return any(words in said for words in READ_ONLY)


def play(theme, names, **environment):
    """Plays scenarios of a theme in one Blender; in another from where it stood, if it froze."""
    results, said = {}, ""
    for _ in range(1 + FREEZES):
        run = play_once(theme, [name for name in names if name not in results], environment)
        results |= run.results
        said += run.said
        if run.status != FROZEN:
            break
    return Played(run.status, said, results)


def play_once(theme, names, environment):
    """Plays scenarios of a theme in one Blender. One that takes too long is ended, with None for
    its status; play.py has it say before where it stood."""
    width, height = (str(side) for side in WINDOW)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        results, said = folder / "results.jsonl", folder / "said.txt"
        # xvfb-run mixes both streams into one; what Blender leaves at its end goes into the folder.
        with open(said, "wb") as file, subprocess.Popen(
                ["xvfb-run", "-a", "-s", f"-ac -screen 0 {width}x{height}x24",
                 ROOT / "scripts" / "blender", "--factory-startup", "-p", "0", "0", width, height,
                 "-P", HERE / "play.py", "--", theme, results, *names],
                stdout=file, stderr=subprocess.STDOUT, start_new_session=True,
                env=os.environ | {"TMPDIR": name} | environment) as process:
            try:
                status = process.wait(TIMEOUT_S)
            except subprocess.TimeoutExpired:
                status = None
            finally:
                if process.returncode is None:
                    os.killpg(process.pid, signal.SIGKILL)  # the display and Blender too
        told = "".join(path.read_text(errors="replace")
                       for path in [said, *folder.glob("*.crash.txt")])
        lines = results.read_text(encoding="utf-8").splitlines() if results.exists() else []
        found = {entry["name"]: entry for entry in map(json.loads, lines)}
    return Played(status, told, found)
