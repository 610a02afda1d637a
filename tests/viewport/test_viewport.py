# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume in Blender's window, on a virtual display: real keys and mouse, and the screen's pixels.

Each theme (seen.py, views.py …) is played in one Blender, its scenarios one after another; what
they assert is in there. Two are played at a time: each waits for a third of its own. Slow scenarios
are played with BRUME_SLOW=1 alone.
"""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import launch
import pytest

THEMES = "living", "views", "seen", "edits", "playback", "colour", "methods", "latency"
COMPARES_TIMES = "latency"  # played by itself, when the others are through
SLOW = os.environ.get("BRUME_SLOW") == "1"
QUIT_AFTER_S = 0.0, 0.3, 1.0, 3.0


def names_of(theme):
    return [name for name, marks in launch.scenarios(theme).items() if SLOW or "slow" not in marks]


def marks_of(theme, name):
    return [pytest.mark.fluid] if "fluid" in launch.scenarios(theme)[name] else []


SCENARIOS = [pytest.param(theme, name, marks=marks_of(theme, name))
             for theme in THEMES for name in names_of(theme)]


@pytest.fixture(scope="session")
def played(request):
    """The runs of the themes that were asked for, by their names, each with those of its scenarios
    that were."""
    asked = {}
    for item in request.session.items:
        params = item.callspec.params if hasattr(item, "callspec") else {}
        if "theme" in params:
            asked.setdefault(params["theme"], set()).add(params.get("name"))

    def play(theme):
        return launch.play(theme, [name for name in names_of(theme) if name in asked[theme]])

    with ThreadPoolExecutor(2) as pool:
        runs = {theme: pool.submit(play, theme) for theme in THEMES
                if theme in asked and theme != COMPARES_TIMES}
        found = {theme: run.result() for theme, run in runs.items()}
    if COMPARES_TIMES in asked:
        found[COMPARES_TIMES] = play(COMPARES_TIMES)
    return found


@pytest.mark.parametrize("theme, name", SCENARIOS)
def test_scenario(played, theme, name):
    run = played[theme]
    assert name in run.results, f"Blender ended before, with {run.status}: {run.said[-4000:]}"
    result = run.results[name]
    print(f"{result['seconds']} s, {json.dumps(result['values'])}")
    assert result["error"] is None, result["error"]


@pytest.mark.parametrize("theme", THEMES)
def test_blender_ends_well(played, theme):
    run = played[theme]
    assert run.status == 0, run.said[-4000:]
    assert not run.wrong, run.said[-4000:]


@pytest.mark.parametrize("after", QUIT_AFTER_S if SLOW else QUIT_AFTER_S[1:3])
def test_quits_at_any_moment(after):
    run = launch.play("quitting", ["quit_at_work"], BRUME_QUIT_AFTER=str(after))
    assert run.results["quit_at_work"]["error"] is None
    assert run.status == 0, run.said[-4000:]
    assert not run.wrong, run.said[-4000:]


def test_a_missing_library_is_said(tmp_path):
    run = launch.play("broken", ["no_library"], BRUME_LIBRARY=str(tmp_path / "none.so"))
    assert run.results["no_library"]["error"] is None, run.results["no_library"]["error"]
    assert run.status == 0, run.said[-4000:]


def test_a_frozen_blender_is_given_up(tmp_path):
    run = launch.play("broken", ["freezes_once"], BRUME_FROZE_BEFORE=str(tmp_path / "before"))
    assert run.results["freezes_once"]["values"] == "went on"
    assert run.status == 0, run.said[-4000:]
