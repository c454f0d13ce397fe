"""Yards next to the building: as large as needed, on free ground."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from bimvox.site.yard_guess import YardNeed, access_away, accesses_beside, yard_beside, yards_next_to

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


def lanes(masts_m, more=()):
    taken = shapely.union_all([shapely.Polygon(YARD), shapely.Polygon(CONSTRUCTION), *more])
    return [shapely.Polygon(lane).bounds for lane in accesses_beside([YARD], CONSTRUCTION, taken, masts_m)]


def test_lorries_stand_along_the_yard_where_it_is_nearest_to_its_places_and_the_crane() -> None:
    away, left, right = (0.0, -20.0, 20.0, -16.0), (-4.0, -17.0, 0.0, -0.5), (20.0, -17.0, 24.0, -0.5)
    assert lanes([(10.0, -22.0, 0.0)])[:3] == [away, left, right]
    assert lanes([(33.0, -5.0, 0.0)])[0] == right
    assert lanes([(-8.0, 4.0, 0.0)])[0] == left


def test_lorries_stand_at_the_yard_although_another_side_of_the_building_is_nearer_to_the_crane() -> None:
    beyond = (15.0, 30.0, 0.0)
    yard_lanes = {(0.0, -20.0, 20.0, -16.0), (-4.0, -17.0, 0.0, -0.5), (20.0, -17.0, 24.0, -0.5)}
    assert set(lanes([beyond])[:3]) == yard_lanes
    wall = shapely.box(-6.0, -30.0, 26.0, -1.5)
    assert not yard_lanes & set(lanes([beyond], [wall])), "where none is free, it is another side"


def test_lorries_may_stand_on_the_side_of_the_building_where_the_crane_is() -> None:
    assert (0.0, 13.0, 30.0, 17.0) in [(x0 + 1.0, y0, x1 - 1.0, y1) for x0, y0, x1, y1 in lanes([(15.0, 22.0, 0.0)])]


def test_a_lane_is_clear_of_what_is_taken_and_takes_a_lorry() -> None:
    wall = shapely.box(20.0, -18.0, 22.0, -16.5)
    found = lanes([], [wall])
    assert not any(x0 == 20.0 for x0, *_ in found), "further from the wall it would be in the building"
    for x0, y0, x1, y1 in found:
        assert max(x1 - x0, y1 - y0) >= 16.5
        assert not shapely.box(x0, y0, x1, y1).intersection(wall).area
    assert len(lanes([], [shapely.box(-50.0, -50.0, 50.0, 50.0)])) == 0


def test_without_a_free_side_the_lane_is_away_from_the_building() -> None:
    assert shapely.Polygon(access_away([YARD], CONSTRUCTION)).bounds == (0.0, -20.0, 20.0, -16.0)
