# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume's pictures against Cycles', rendered by Blender through scripts/blender.

Run outside Blender: python3 -m pytest tests/pictures. Each case leaves a PNG in out/pictures/:
Brume | Cycles | four times the difference around grey. With --preset FINAL its name ends in -FINAL.
"""
import os
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import compare
import conftest
import references
from cases import CASES, ROOT

OUT = os.path.join(ROOT, 'out', 'pictures')
SAME = 'plume'  # rendered twice


@pytest.fixture(scope='session')
def brume(request):
    """Brume's pictures of the cases that were asked for, by their names: a function that waits for
    one. Two are rendered at a time, since half of a Blender's time but one thread has work."""
    preset = request.config.getoption('--preset')
    asked = [item.callspec.params['name'] if hasattr(item, 'callspec') else SAME
             for item in request.session.items if 'brume' in item.fixturenames]

    def render(name):
        return references.render(conftest.BLENDER, 'BRUME', CASES[name], '--preset', preset,
                                 timeout=7200 if preset == 'FINAL' else 900)

    with ThreadPoolExecutor(2) as pool:
        pictures = {name: pool.submit(render, name) for name in dict.fromkeys(asked)}
        yield lambda name: pictures[name].result()
        pool.shutdown(cancel_futures=True)


@pytest.fixture
def reference(request):
    case = CASES[request.getfixturevalue('name')]
    if request.config.getoption('--refresh'):
        references.refresh(case)
    return references.load(case)


@pytest.mark.parametrize('name', [
    pytest.param(name, marks=pytest.mark.fluid if case.scene == 'plume' else ())
    for name, case in CASES.items()])
def test_against_cycles(name, reference, brume, request):
    case = CASES[name]
    preset = request.config.getoption('--preset')
    expected, apart, where = reference
    # Two seeds differ by twice the error of their mean, in this measure: it must not decide.
    assert apart / 2 < case.tolerance / 4, f'the reference is too noisy: {apart:.4f}'
    found = brume(name)
    picture, expected_picture = (passes['Combined'][..., :3] for passes in (found, expected))
    os.makedirs(OUT, exist_ok=True)
    suffix = '' if preset == 'PREVIEW' else '-' + preset
    compare.side_by_side(os.path.join(OUT, name + suffix + '.png'), picture, expected_picture)
    total, channels = compare.difference(picture, expected_picture, where=where)
    conftest.differences.append((name, total, case.tolerance))
    print(f'{name}: {total:.4f} of {case.tolerance} '
          f'(red, green, blue: {", ".join(f"{c:.4f}" for c in channels)}; '
          f'two seeds of Cycles {apart:.4f})')
    if where is not None:
        print(f'    on {where.mean():.0%} of the blocks; on all: '
              f'{compare.difference(picture, expected_picture)[0]:.4f}')
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
        covers = (passes['Combined'][..., 3:] for passes in (found, expected))
        apart, _ = compare.difference(*covers)
        assert apart < 0.01, f'alpha is off by {apart:.4f}'


@pytest.mark.parametrize('name', ['surfaces-passes'])
def test_passes_against_cycles(name, reference, brume):
    """Depth and normal are those of the same point of the same triangle; a hundredth of the pixels
    may have an edge so near that the two see other sides of it."""
    ours, (theirs, *_) = brume(name), reference
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
def test_same_file_gives_same_pixels(brume, request):
    again = references.render(conftest.BLENDER, 'BRUME', CASES[SAME], '--preset',
                              request.config.getoption('--preset'))
    assert np.array_equal(brume(SAME)['Combined'], again['Combined'])


def test_measure_sees_what_it_should():
    """The measure itself: nothing, a known change, and a change that block means hide."""
    rng = np.random.default_rng(1)
    picture = rng.uniform(0.5, 1.5, (128, 128, 3))
    assert compare.difference(picture, picture)[0] == 0.0
    assert compare.difference(picture * 1.03, picture)[0] == pytest.approx(0.03)
    left = np.zeros((32, 32), bool)
    left[:, :16] = True
    brighter = picture * np.where(np.arange(128) < 64, 1.05, 1.5)[:, None]
    assert compare.difference(brighter, picture, where=left)[0] == pytest.approx(0.05)
    shifted = picture.copy()
    shifted[..., 1] *= 0.9
    assert compare.difference(shifted, picture)[1] == pytest.approx([0.0, 0.1, 0.0])
    checker = (np.indices((128, 128)).sum(axis=0) % 2 - 0.5)[..., None] * 0.2
    assert compare.difference(picture + checker, picture)[0] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(ValueError, match='NaN'):
        compare.difference(np.where(picture > 1.49, np.nan, picture), picture)


def test_changed_blocks():
    """A change of 1 % does not count, one of 3 % does; in the dark the mean is the yardstick."""
    plain = np.ones((128, 128, 3))
    plain[:64] = 0.0
    picture = plain.copy()
    picture[64:96] *= 1.01
    picture[96:] *= 1.03
    picture[:32] += 0.005
    picture[32:64] += 0.02
    found = compare.changed(picture, plain)
    assert found.all(axis=1).tolist() == [False] * 8 + [True] * 8 + [False] * 8 + [True] * 8
    assert not found[:8].any() and not found[16:24].any()
