"""The closer estimate: ways with swing are no quicker than without, and only parts that are served count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_sites import test_crane as crane_of

from bimvox.crane.bound import point_to_point_s
from bimvox.crane.kinematics import pose_of
from bimvox.crane.rigging import rigged
from bimvox.crane.tower_crane import CranePose
from bimvox.library.set_up_search.timed import timed_moving_s
from bimvox.site.set_ups import LiftWork

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
    )


PLACES, YARD = [(0.0, 15.0), (12.0, 18.0), (-10.0, 9.0)], [(30.0, -10.0), (22.0, 3.0)]


def axes_of(x: float, y: float, z: float) -> CranePose:
    return CranePose(*(float(axis) for axis in pose_of(CRANE, np.array([x, y, z]))))


def test_swing_costs_time_and_no_way_is_quicker_than_point_to_point() -> None:
    work = work_of(PLACES, YARD[:1])
    all_served = np.ones(3, np.bool_)
    plain, shaped = (timed_moving_s(CRANE, work, all_served, swings=swings) for swings in (False, True))
    assert shaped > plain
    least_s = 0.0
    over_m = np.maximum.accumulate(work.tops_m) + work.heights_m + CRANE.sling_m
    for n, (place, top) in enumerate(zip(PLACES, work.tops_m.tolist(), strict=True)):
        pick, target = axes_of(*YARD[0], 1.0 + CRANE.sling_m), axes_of(*place, top + CRANE.sling_m)
        least_s += point_to_point_s(rigged(CRANE, 800.0), pick, target, float(over_m[n]))
        least_s += point_to_point_s(rigged(CRANE, 0.0), target, pick, target.height_m)
    assert plain >= 0.98 * least_s  # the first lift has no way back before it


def test_a_lift_that_slews_further_takes_longer() -> None:
    served = np.ones(3, np.bool_)
    near, far = (
        timed_moving_s(CRANE, work_of(PLACES, [at]), served, swings=True) for at in ((14.0, 16.0), (0.0, -21.0))
    )
    assert far > near + 30.0


@pytest.mark.parametrize("swings", [False, True])
def test_parts_that_are_not_served_take_no_time(swings: bool) -> None:
    both, alone = work_of(PLACES[:2], YARD[:1]), work_of(PLACES[:1], YARD[:1])
    found = timed_moving_s(CRANE, both, np.array([True, False]), swings=swings)
    assert found == pytest.approx(timed_moving_s(CRANE, alone, np.array([True]), swings=swings))
    assert timed_moving_s(CRANE, both, np.zeros(2, np.bool_), swings=swings) == 0.0


def test_many_parts_are_sampled_and_count_in_full() -> None:
    few = work_of(PLACES[:1], YARD[:1])
    many = work_of(PLACES[:1] * 200, YARD[:1])
    many = replace(many, tops_m=np.full(200, 2.0))
    each = [
        timed_moving_s(CRANE, one, np.ones(count, np.bool_), swings=False) / count
        for one, count in ((few, 1), (many, 200))
    ]
    assert each[1] == pytest.approx(each[0], rel=0.02)
