# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume's pictures against Cycles', rendered by Blender through scripts/blender.

Run outside Blender: python3 -m pytest tests/pictures. Each case leaves a PNG in out/pictures/:
Brume | Cycles | four times the difference around grey.
"""
import functools
import os
import sys

import numpy as np
import pytest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import compare
import references
from cases import CASES, ROOT

BLENDER = [os.path.join(ROOT, 'scripts', 'blender'), '--factory-startup']
OUT = os.path.join(ROOT, 'out', 'pictures')


@functools.cache
def brume(name):
    return references.render(BLENDER, 'BRUME', CASES[name])


@pytest.fixture
def reference(request):
    case = CASES[request.getfixturevalue('name')]
    if request.config.getoption('--refresh'):
        references.refresh(case)
    return references.load(case)


@pytest.mark.parametrize('name', CASES)
def test_against_cycles(name, reference):
    case = CASES[name]
    expected, apart = reference
    # Two seeds differ by twice the error of their mean, in this measure: it must not decide.
    assert apart / 2 < case.tolerance / 4, f'the reference is too noisy: {apart:.4f}'
    picture = brume(name)
    os.makedirs(OUT, exist_ok=True)
    compare.side_by_side(os.path.join(OUT, name + '.png'), picture, expected)
    total, channels = compare.difference(picture, expected)
    print(f'{name}: {total:.4f} of {case.tolerance} '
          f'(red, green, blue: {", ".join(f"{c:.4f}" for c in channels)})')
    assert total < case.tolerance


def test_same_file_gives_same_pixels():
    again = references.render(BLENDER, 'BRUME', CASES['plume'])
    assert np.array_equal(brume('plume'), again)


def test_measure_sees_what_it_should():
    """The measure itself: nothing, a known change, and a change that block means hide."""
    rng = np.random.default_rng(1)
    picture = rng.uniform(0.5, 1.5, (128, 128, 3))
    assert compare.difference(picture, picture)[0] == 0.0
    assert compare.difference(picture * 1.03, picture)[0] == pytest.approx(0.03)
    shifted = picture.copy()
    shifted[..., 1] *= 0.9
    assert compare.difference(shifted, picture)[1] == pytest.approx([0.0, 0.1, 0.0])
    checker = (np.indices((128, 128)).sum(axis=0) % 2 - 0.5)[..., None] * 0.2
    assert compare.difference(picture + checker, picture)[0] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(ValueError, match='NaN'):
        compare.difference(np.where(picture > 1.49, np.nan, picture), picture)
