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
import conftest
import references
from cases import CASES, ROOT

OUT = os.path.join(ROOT, 'out', 'pictures')


@functools.cache
def brume(name):
    return references.render(conftest.BLENDER, 'BRUME', CASES[name])


@pytest.fixture
def reference(request):
    case = CASES[request.getfixturevalue('name')]
    if request.config.getoption('--refresh'):
        references.refresh(case)
    return references.load(case)


@pytest.mark.parametrize('name', [
    pytest.param(name, marks=pytest.mark.fluid if case.scene == 'plume' else ())
    for name, case in CASES.items()])
def test_against_cycles(name, reference):
    case = CASES[name]
    expected, apart = reference
    # Two seeds differ by twice the error of their mean, in this measure: it must not decide.
    assert apart / 2 < case.tolerance / 4, f'the reference is too noisy: {apart:.4f}'
    picture, expected_picture = (passes['Combined'][..., :3] for passes in (brume(name), expected))
    os.makedirs(OUT, exist_ok=True)
    compare.side_by_side(os.path.join(OUT, name + '.png'), picture, expected_picture)
    total, channels = compare.difference(picture, expected_picture)
    conftest.differences.append((name, total, case.tolerance))
    print(f'{name}: {total:.4f} of {case.tolerance} '
          f'(red, green, blue: {", ".join(f"{c:.4f}" for c in channels)})')
    failed = []
    for group, index, tolerance in case.groups:
        mask = expected['IndexOB'] == index
        apart, _ = compare.difference(picture * mask, expected_picture * mask)
        print(f'    {group}: {apart:.4f} of {tolerance}')
        if apart >= tolerance:
            failed.append(group)
    assert total < case.tolerance
    assert not failed
    if expected['Combined'].shape[-1] == 4:
        covers = (passes['Combined'][..., 3:] for passes in (brume(name), expected))
        apart, _ = compare.difference(*covers)
        assert apart < 0.01, f'alpha is off by {apart:.4f}'


@pytest.mark.parametrize('name', ['surfaces-passes'])
def test_passes_against_cycles(name, reference):
    """Depth and normal are those of the same point of the same triangle; a hundredth of the pixels
    may have an edge so near that the two see other sides of it."""
    ours, (theirs, _) = brume(name), reference
    number = theirs['IndexOB'][..., 0]
    opaque, sky = (number == 1) | (number == 2), number == 0
    depth = np.abs(ours['Depth'] / theirs['Depth'] - 1)[..., 0]
    assert (depth[opaque] > 1e-5).mean() < 0.01
    assert (ours['Depth'][sky] == theirs['Depth'][sky]).all()
    normal = np.abs(ours['Normal'] - theirs['Normal']).max(axis=-1)
    assert (normal[opaque] > 2e-3).mean() < 0.02
    for light in ('Emit', 'Env'):
        assert compare.difference(ours[light], theirs[light])[0] < 0.005


@pytest.mark.fluid
def test_same_file_gives_same_pixels():
    again = references.render(conftest.BLENDER, 'BRUME', CASES['plume'])
    assert np.array_equal(brume('plume')['Combined'], again['Combined'])


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
