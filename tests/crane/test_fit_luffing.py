from dataclasses import replace

import numpy as np
import pytest
from named_cranes import LUFFING_CRANES, default_luffing_crane

from bimvox.crane.fit import standing
from bimvox.crane.fit_luffing import built_heights, highest_hooks_m, pivoted, points_blocked


def test_a_height_map_is_the_highest_of_its_boxes():
    boxes = np.array([[[0.0, 0.0, 0.0], [2.0, 1.0, 3.0]], [[1.0, 0.0, 2.0], [3.0, 1.0, 5.2]]])
    built = built_heights(boxes, 0.5)
    assert built.origin_m == (0.0, 0.0)
    assert built.top.shape == (6, 2)
    assert built.top[:, 0].tolist() == [6, 6, 11, 11, 11, 11]


def test_a_luffing_tower_crane_is_as_high_as_it_must_be():
    low, high = (standing(LUFFING_CRANES[0], hook_m) for hook_m in (9.2, 30.0))
    assert low.luffing.tail_low_m == 9.5
    assert high.luffing.pivot_height_m - low.luffing.pivot_height_m == pytest.approx(20.5)
    assert low.highest_hook_m > low.luffing.pivot_height_m


def test_a_mobile_crane_is_as_high_as_it_is():
    crane = default_luffing_crane("mobile-60t")
    assert pivoted(crane, crane.luffing, 99.0) is crane
    assert not (highest_hooks_m(crane.luffing, np.linspace(0.0, 100.0, 50)) >= 60.0).any()


def test_a_building_blocks_the_boom_from_places_beyond_it():
    built = built_heights(np.array([[[0.0, 0.0, 0.0], [3.0, 8.0, 16.0]], [[0.0, 0.0, 0.0], [16.0, 8.0, 3.0]]]))
    points = np.array([[6.0, 2.0], [6.0, 6.0], [14.0, 4.0], [7.0, -10.0]])
    behind = replace(default_luffing_crane("mobile-60t"), base_m=(-6.0, 4.0, 0.0))
    assert points_blocked(behind, behind.luffing, points, built) > 0
    in_front = replace(behind, base_m=(20.0, -4.0, 0.0))
    assert points_blocked(in_front, in_front.luffing, points, built) == 0
