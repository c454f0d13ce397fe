from dataclasses import replace

import numpy as np
import pytest
from named_cranes import LUFFING_CRANES, MOBILE_CRANES, default_luffing_crane

from bimvox.crane.fit import Ground, fit_crane
from bimvox.crane.fit_luffing import built_heights, highest_hooks_m, pivoted, points_blocked
from bimvox.errors import InputError

BUILDING = np.array([[0.0, 0.0], [16.0, 0.0], [16.0, 8.0], [0.0, 8.0]])
YARD = np.array([[2.0, -14.0], [12.0, -14.0], [12.0, -6.0], [2.0, -6.0]])
POINTS = np.concatenate([BUILDING, YARD])


def test_a_height_map_is_the_highest_of_its_boxes():
    boxes = np.array([[[0.0, 0.0, 0.0], [2.0, 1.0, 3.0]], [[1.0, 0.0, 2.0], [3.0, 1.0, 5.2]]])
    built = built_heights(boxes, 0.5)
    assert built.origin_m == (0.0, 0.0)
    assert built.top.shape == (6, 2)
    assert built.top[:, 0].tolist() == [6, 6, 11, 11, 11, 11]


def test_a_luffing_tower_crane_is_as_high_as_it_must_be():
    low, high = (fit_crane(POINTS, 1000.0, Ground((BUILDING, YARD)), h, cranes=LUFFING_CRANES) for h in (9.2, 30))
    assert (low.name, high.name) == ("luffing-40", "luffing-40")
    assert low.luffing.tail_low_m == 9.5
    assert high.luffing.pivot_height_m - low.luffing.pivot_height_m == pytest.approx(20.5)
    assert low.highest_hook_m > low.luffing.pivot_height_m
    for crane in (low, high):
        radii = np.hypot(*(POINTS - np.array(crane.base_m[:2])).T)
        assert ((radii >= crane.luffing.radii_m[0]) & (radii <= crane.luffing.radii_m[1])).all()


def test_a_mobile_crane_must_get_its_hook_up_there():
    crane = fit_crane(POINTS, 1000.0, Ground((BUILDING, YARD)), 12.0, cranes=MOBILE_CRANES)
    radii = np.hypot(*(POINTS - np.array(crane.base_m[:2])).T)
    assert (highest_hooks_m(crane.luffing, radii) >= 12.0).all()
    assert pivoted(crane, crane.luffing, 99.0) is crane
    with pytest.raises(InputError, match="no crane serves every point"):
        fit_crane(POINTS, 1000.0, Ground((BUILDING, YARD)), 60.0, cranes=MOBILE_CRANES)


def test_a_mobile_crane_stands_where_its_boom_is_over_every_place():
    """A stair tower at one end of the building blocks the boom from places beyond it."""
    tower = [[0.0, 0.0, 0.0], [3.0, 8.0, 16.0]]
    low = [[0.0, 0.0, 0.0], [16.0, 8.0, 3.0]]
    built = built_heights(np.array([tower, low]))
    points = np.array([[6.0, 2.0], [6.0, 6.0], [14.0, 4.0], [7.0, -10.0]])
    behind = replace(default_luffing_crane("mobile-60t"), base_m=(-6.0, 4.0, 0.0))
    assert points_blocked(behind, behind.luffing, points, built) > 0
    crane = fit_crane(points, 1000.0, Ground((BUILDING,)), 12.0, cranes=MOBILE_CRANES, built=built)
    assert points_blocked(crane, crane.luffing, points, built) == 0
    assert crane.base_m[0] > 3.0
