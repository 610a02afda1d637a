# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume in Blender's window, on a virtual display: real keys and mouse, and the screen's pixels.

Each theme (seen.py, views.py …) is played in one Blender, its scenarios one after another; what
they assert is in there. Slow ones are played with BRUME_SLOW=1 alone.
"""

import functools
import json
import os

import launch
import pytest

THEMES = "seen", "views", "methods", "colour", "living", "playback", "edits", "latency"
SLOW = os.environ.get("BRUME_SLOW") == "1"
QUIT_AFTER_S = 0.0, 0.3, 1.0, 3.0


def names_of(theme):
    return [name for name, marks in launch.scenarios(theme).items() if SLOW or "slow" not in marks]


def marks_of(theme, name):
    return [pytest.mark.fluid] if "fluid" in launch.scenarios(theme)[name] else []


SCENARIOS = [pytest.param(theme, name, marks=marks_of(theme, name))
             for theme in THEMES for name in names_of(theme)]


@pytest.fixture
def played(request):
    """The run of a theme, with those of its scenarios that were asked for."""
    @functools.cache
    def run(theme):
        asked = [item.callspec.params.get("name") for item in request.session.items
                 if hasattr(item, "callspec") and item.callspec.params.get("theme") == theme]
        return launch.play(theme, [name for name in names_of(theme) if name in asked])
    return request.config.stash.setdefault(RUNS, run)


RUNS = pytest.StashKey()


@pytest.mark.parametrize("theme, name", SCENARIOS)
def test_scenario(played, theme, name):
    run = played(theme)
    assert name in run.results, f"Blender ended before, with {run.status}: {run.said[-4000:]}"
    result = run.results[name]
    print(f"{result['seconds']} s, {json.dumps(result['values'])}")
    assert result["error"] is None, result["error"]


@pytest.mark.parametrize("theme", THEMES)
def test_blender_ends_well(played, theme):
    run = played(theme)
    assert run.status == 0, run.said[-4000:]
    assert not run.wrong


@pytest.mark.parametrize("after", QUIT_AFTER_S if SLOW else QUIT_AFTER_S[1:3])
def test_quits_at_any_moment(after):
    run = launch.play("quitting", ["quit_at_work"], BRUME_QUIT_AFTER=str(after))
    assert run.results["quit_at_work"]["error"] is None
    assert run.status == 0, run.said[-4000:]
    assert not run.wrong


def test_a_missing_library_is_said(tmp_path):
    run = launch.play("broken", ["no_library"], BRUME_LIBRARY=str(tmp_path / "none.so"))
    assert run.results["no_library"]["error"] is None, run.results["no_library"]["error"]
    assert run.status == 0, run.said[-4000:]


def test_a_frozen_blender_is_given_up(tmp_path):
    run = launch.play("broken", ["freezes_once"], BRUME_FROZE_BEFORE=str(tmp_path / "before"))
    assert run.results["freezes_once"]["values"] == "went on"
    assert run.status == 0, run.said[-4000:]
