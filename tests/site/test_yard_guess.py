"""Yards next to the building: as large as needed, on free ground."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from bimvox.site.yard_guess import YardNeed, access_beside, yard_beside, yards_next_to

BOX_M = np.array([[0.0, 0.0], [30.0, 12.0]])
NEED = YardNeed(width_m=4.0, depth_m=6.0, longest_m=7.0, area_m2=120.0)
SIDES = ((1, -1), (1, 1), (0, -1), (0, 1))


def test_the_usual_yards_lie_in_the_middle_of_each_side() -> None:
    assert [yard_beside(BOX_M, NEED, side, 0.0, 1.0) for side in SIDES] == yards_next_to(BOX_M, NEED)


@given(st.sampled_from(SIDES), st.floats(-1.0, 1.0), st.floats(0.5, 2.0))
def test_any_yard_is_large_enough_and_next_to_the_building(side: tuple[int, int], along: float, longer: float) -> None:
    yard = shapely.Polygon(yard_beside(BOX_M, NEED, side, along, longer))
    building = shapely.box(*BOX_M.ravel())
    width, depth = np.ptp(np.array(yard.exterior.coords), axis=0)
    assert (width >= NEED.width_m, depth >= NEED.depth_m, max(width, depth) >= NEED.longest_m) == (True, True, True)
    assert yard.area >= NEED.area_m2
    assert 1.0 - 1e-9 <= yard.distance(building) <= 2.0


CONSTRUCTION = ((0.0, 0.0), (30.0, 0.0), (30.0, 12.0), (0.0, 12.0))
YARD = ((0.0, -16.0), (20.0, -16.0), (20.0, -1.0), (0.0, -1.0))


def bounds(masts_m):
    return shapely.Polygon(access_beside([YARD], CONSTRUCTION, masts_m)).bounds


def test_trucks_stand_on_the_side_of_the_yard_that_is_nearest_to_the_crane() -> None:
    away = (0.0, -20.0, 20.0, -16.0)
    assert bounds([]) == away
    assert bounds([(33.0, -5.0, 0.0)]) == (20.0, -16.0, 24.0, -1.0)
    assert bounds([(-8.0, 4.0, 0.0)]) == (-4.0, -16.0, 0.0, -1.0)
    assert bounds([(10.0, -30.0, 0.0)]) == away
    assert bounds([(22.0, -5.0, 0.0)]) == away, "a mast stands where the nearest would be"
