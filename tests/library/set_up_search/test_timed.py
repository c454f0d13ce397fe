"""The closer estimate: ways with swing are no quicker than without, and only parts that are served count."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bimvox_pipeline.studio.opened import open_site
from box_sites import test_crane as crane_of
from lift_work import ways_of
from planned_frame import FILES, planned

from bimvox.crane.kinematics import pose_of, rigged
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import CranePose
from bimvox.crane.travel import point_to_point_s
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.timed import timed_moving_s
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.site.machine import cranes_of
from bimvox.site.set_ups import LiftWork
from bimvox.units import NS_PER_S

CRANE = crane_of(base=(0.0, 0.0, 0.0), jib=40.0, height=30.0)


def work_of(places: list[tuple[float, float]], yard: list[tuple[float, float]]) -> LiftWork:
    count = len(places)
    return LiftWork(
        places_m=np.array(places),
        tops_m=np.linspace(2.0, 12.0, count),
        heights_m=np.full(count, 1.0),
        masses_kg=np.full(count, 800.0),
        standing_s=np.full(count, 600.0),
        yard_m=np.array(yard),
        closed=np.zeros(count, np.bool_),
        rooms=np.full((count, 2), None),
    )


PLACES, YARD = [(0.0, 15.0), (12.0, 18.0), (-10.0, 9.0)], [(30.0, -10.0), (22.0, 3.0)]


def axes_of(x: float, y: float, z: float) -> CranePose:
    return CranePose(*(float(axis) for axis in pose_of(CRANE, np.array([x, y, z]))))


def test_swing_costs_time_and_no_way_is_quicker_than_point_to_point() -> None:
    work = work_of(PLACES, YARD[:1])
    all_served = np.ones(3, np.bool_)
    plain, shaped = (timed_moving_s(CRANE, ways_of(work, swings=swings), all_served) for swings in (False, True))
    assert shaped > plain
    least_s = 0.0
    over_m = np.maximum.accumulate(work.tops_m) + work.heights_m + CRANE.sling_m
    for n, (place, top) in enumerate(zip(PLACES, work.tops_m.tolist(), strict=True)):
        pick, target = axes_of(*YARD[0], 1.0 + CRANE.sling_m), axes_of(*place, top + CRANE.sling_m)
        least_s += point_to_point_s(rigged(CRANE, 800.0), pick, target, float(over_m[n]))
        if n + 1 < len(PLACES):
            least_s += point_to_point_s(rigged(CRANE, 0.0), target, pick, target.height_m)
    assert plain >= least_s


def test_a_lift_that_slews_further_takes_longer() -> None:
    served = np.ones(3, np.bool_)
    near, far = (timed_moving_s(CRANE, ways_of(work_of(PLACES, [at])), served) for at in ((14.0, 16.0), (0.0, -21.0)))
    assert far > near + 30.0


@pytest.mark.parametrize("swings", [False, True])
def test_parts_that_are_not_served_take_no_time(swings: bool) -> None:
    both, alone = (ways_of(work_of(PLACES[:count], YARD[:1]), swings=swings) for count in (2, 1))
    found = timed_moving_s(CRANE, both, np.array([True, False]))
    assert found == pytest.approx(timed_moving_s(CRANE, alone, np.array([True])))
    assert timed_moving_s(CRANE, both, np.zeros(2, np.bool_)) == 0.0


def test_many_parts_are_sampled_and_count_in_full() -> None:
    few, many = work_of(PLACES[:1] * 20, YARD[:1]), work_of(PLACES[:1] * 200, YARD[:1])
    each = [
        timed_moving_s(CRANE, ways_of(replace(one, tops_m=np.full(count, 2.0)), swings=False), np.ones(count, np.bool_))
        / count
        for one, count in ((few, 20), (many, 200))
    ]
    assert each[1] == pytest.approx(each[0], rel=0.05)


def one_carry_s(**more: Any) -> float:
    work = replace(work_of([(0.0, 20.0)], [(20.0, 0.0)]), tops_m=np.array([4.0]))
    return timed_moving_s(CRANE, ways_of(work, swings=False, **more), np.ones(1, np.bool_))


def test_a_load_that_keeps_a_clearance_goes_higher_and_across_later() -> None:
    assert one_carry_s(clearance_m=2.0) > one_carry_s() + 4.0
    assert one_carry_s(cell_m=0.5) > one_carry_s() + 1.0


def test_a_turned_load_is_raised_above_what_is_built_around_it_and_turned() -> None:
    far_m = allowed_radii_m(CRANE, 800.0)[1]
    work = work_of([(0.0, 12.0), (0.0, 20.0)], [(far_m - 3.0, -6.0), (far_m + 9.0, 6.0)])
    # The yard begins 4 m within reach; the part is 13 m long, away from the mast unless it lies turned.
    long = np.tile([[[-6.5, -0.5], [6.5, 0.5]]], (2, 1, 1))
    kept, turned = (
        ways_of(work, swings=False, around_m=long, cell_m=0.5, turn_s=30.0, turns=turns) for turns in (False, True)
    )
    served = np.ones(2, np.bool_)
    assert timed_moving_s(CRANE, turned, served) > timed_moving_s(CRANE, kept, served) + 50.0
    assert turned.raised_to_turn_m(1, np.array([far_m, 0.0])) == 0.5
    assert turned.raised_to_turn_m(1, np.array([0.0, 14.0])) == work.tops_m[0]


def test_a_load_is_raised_only_above_what_it_passes_and_what_is_there_by_then() -> None:
    tower, first = np.array([[[9.0, 9.0], [15.0, 15.0]]]), np.zeros(1, np.int64)
    aside = tower + 40.0
    above, beside, later = (
        one_carry_s(others_m=where, other_tops_m=np.array([14.0]), others_before=first + when)
        for where, when in ((tower, 0), (aside, 0), (tower, 1))
    )
    assert later == beside == one_carry_s() < above


def test_a_load_goes_straight_down_between_neighbours_as_high_as_they_are() -> None:
    # Both are carried over the same height; the second one's neighbour is the first.
    apart, close = (work_of([(0.0, 20.0 + gap_m), (0.0, 20.0)], [(20.0, 0.0)]) for gap_m in (9.0, 1.5))
    apart, close = (ways_of(replace(one, tops_m=np.array([9.0, 1.0])), 2.0, swings=False) for one in (apart, close))
    assert close.passed_m(1, close.work.places_m[1:]) == 9.0
    assert apart.passed_m(1, apart.work.places_m[1:]) == 0.0
    only = np.array([False, True])
    assert timed_moving_s(CRANE, close, only) > timed_moving_s(CRANE, apart, only) + 4.0


def test_a_long_load_does_not_pass_through_the_mast_nor_leave_the_site() -> None:
    straight_s = one_carry_s(size_m=6.0)
    long = np.array([[[-0.5, -18.0], [0.5, 18.0]]])
    assert one_carry_s(around_m=long, mast_m=2.0) > straight_s + 20.0
    narrow = np.array([[-9.0, -9.0], [16.0, 26.0]])
    assert one_carry_s(size_m=6.0, bounds_m=np.array([[-9.0, -9.0], [26.0, 26.0]])) == straight_s
    assert one_carry_s(size_m=6.0, bounds_m=narrow) > straight_s


def test_the_estimate_is_that_of_the_plan_but_for_a_few_percent() -> None:
    opened, made = open_site(planned() / FILES[0]), read_log(planned() / FILES[1])
    (crane,) = cranes_of(opened.config)
    search = Search(opened, SilentProgress())
    parts, estimate_s = search.of(crane)
    standing_s = float(search.work.standing_s.sum())
    moving_s = made.motions[-1].end_ns / NS_PER_S - standing_s
    assert parts == len(made.motions)
    assert estimate_s - standing_s == pytest.approx(moving_s, rel=0.1)
