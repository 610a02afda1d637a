# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough the viewport's first pictures are, and what of a region is rendered."""

import numpy as np
import pytest
from brume import framing, native, pace

PIXELS = 640 * 360


def run(pixel_s, fixed_s=0.0, finest=1, target_s=0.1, pictures=12, refined=False):
    """The pixel sizes of pictures in a row on a machine of that speed."""
    keeper = pace.Pace()
    sizes = []
    for _ in range(pictures):
        size = keeper.choose(PIXELS, finest, target_s)
        sizes.append(size)
        finer = [size / 2] if refined else []  # what follows where there is a rest
        for shown in [size, *finer]:
            keeper.learn(PIXELS / shown ** 2, fixed_s + pixel_s * PIXELS / shown ** 2)
    return sizes


@pytest.mark.parametrize("pixel_s", [1e-9, 1e-7, 1e-6, 1e-5])
def test_pictures_come_in_time_and_stay_as_they_are(pixel_s):
    *_, before, last = run(pixel_s)
    assert before == last
    taken = pixel_s * PIXELS / last ** 2
    assert taken <= 1.25 * 0.1
    finer = [size for size in pace.sizes(1) if size < last]
    assert not finer or pixel_s * PIXELS / finer[-1] ** 2 > 0.8 * 0.1


def test_a_machine_too_slow_for_any_gets_the_coarsest():
    assert run(1e-2)[-1] == pace.PIXEL_SIZES[-1]


def test_a_fixed_cost_does_not_run_away():
    # 60 of 100 ms go to what no pixel size changes: pixels of 2 take 98 ms in all.
    sizes = run(pixel_s=0.038 * 4 / PIXELS, fixed_s=0.06, refined=True)
    assert set(sizes[-6:]) <= {2, 3}


def test_one_late_picture_changes_little():
    keeper = pace.Pace()
    for _ in range(10):
        size = keeper.choose(PIXELS, 1, 0.1)
        keeper.learn(PIXELS / size ** 2, 1.5e-6 * PIXELS / size ** 2)
    keeper.learn(PIXELS / size ** 2, 20.0)
    late = keeper.choose(PIXELS, 1, 0.1)
    assert size <= late <= 2 * size


def test_nothing_is_finer_than_blender_asks_for():
    assert min(run(1e-9, finest=4)) == 4


def settings():
    return native.Settings(medium_resolution=128, lattice_resolution=64, shadow_resolution=512,
                           light_samples=8, world_samples=128, iterations=8)


def drag(cost, kinds=("light",), changes=8):
    """The levels of changes in a row; cost(level): seconds, of the second and later ones."""
    quality, levels = pace.SceneQuality(), []
    quality.rest()
    for _ in range(changes):
        quality.change(kinds, 0.1)
        levels.append(quality.level)
        quality.learn(cost(quality.level))
    return quality, levels


def test_the_first_picture_of_a_scene_comes_early():
    quality = pace.SceneQuality()
    quality.change(native.KINDS, 0.1)
    assert quality.apply(settings()).lattice_resolution < 64
    assert quality.apply(settings()).medium_resolution < 128
    quality.rest()
    assert bytes(quality.apply(settings())) == bytes(settings())


def test_a_dear_change_gets_coarser_lattices_and_rest_restores_them():
    quality, levels = drag(lambda level: 0.4 / 5 ** level)
    assert levels == [0] + [1] * 7
    lowered = quality.apply(settings())
    assert (lowered.lattice_resolution, lowered.shadow_resolution) == (32, 256)
    assert lowered.medium_resolution == 128  # a lamp leaves the volumes alone
    quality.rest()
    assert bytes(quality.apply(settings())) == bytes(settings())


def test_a_cheap_change_keeps_the_resolutions():
    assert drag(lambda level: 0.05)[1] == [0] * 8


def test_no_coarser_than_helps():
    # Half of the cost is one that no level takes away.
    assert drag(lambda level: 0.3 + 0.3 / 5 ** level)[1][-3:] == [1] * 3


def test_full_resolution_comes_back_once_it_is_cheap():
    quality, _ = drag(lambda level: 0.4 / 5 ** level)
    quality.learn_full(0.05, with_medium=False)  # the scene got smaller
    quality.change(("light",), 0.1)
    assert quality.full


def test_changed_volumes_get_a_coarser_medium_that_other_changes_leave():
    quality, levels = drag(lambda level: 3.0 / 5 ** level, ("volume",))
    assert levels[-1] > 1
    assert quality.apply(settings()).medium_resolution < 128
    level = quality.medium_level
    quality.change({"light"}, 0.1)
    assert quality.medium_level == level


# -- framing


def test_a_border_is_cut_to_whole_pixels_of_the_region():
    assert framing.part_of((200, 100), None) == (0, 0, 200, 100)
    assert framing.part_of((200, 100), (0.25, 0.1, 0.5, 0.9)) == (50, 10, 50, 80)
    assert framing.part_of((200, 100), (-0.5, 0.5, 2.0, 3.0)) == (0, 50, 200, 50)
    assert framing.part_of((200, 100), (1.2, 0.0, 1.8, 1.0))[2] == 0


def test_clip_range_of_both_projections():
    near, far = 0.1, 50.0
    perspective = np.diag([1.0, 1.0, -(far + near) / (far - near), 0.0])
    perspective[2, 3], perspective[3, 2] = -2 * far * near / (far - near), -1.0
    assert framing.clip_range(perspective, far) == pytest.approx((near, far))
    assert framing.clip_range(perspective, 0.15) == pytest.approx((near, 0.15))
    perspective[2, 2] = -1.0  # what single precision makes of it where far is far enough
    assert framing.clip_range(perspective, 1e9) == pytest.approx((near, 1e9), rel=3e-3)
    orthographic = np.diag([1.0, 1.0, -2 / (far - near), 1.0])
    orthographic[2, 3] = -(far + near) / (far - near)
    assert framing.clip_range(orthographic, far) == pytest.approx((near, far))
