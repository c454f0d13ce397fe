"""Lifts that another crane obstructs wherever its jib points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from box_sites import test_crane as crane_of
from lift_work import work_of
from two_cranes import two_crane_plan

from bimvox.crane.conflict import CraneTrack, first_conflict
from bimvox.crane.outline import outline_of
from bimvox.cranes.clock import always_obstructed, clear_ways, insist_on_room
from bimvox.cranes.lift import Carried, NoFreeTimeError, carrying_track
from bimvox.site.site import Site


def carried(**rules: float) -> tuple[Site, list[Carried]]:
    plan, motions = two_crane_plan()
    site = replace(plan.site, rules=replace(plan.site.rules, **rules))
    by_order = {motion.order: motion for motion in motions}
    lifts = [lift for lift in plan.lifts if lift.order in by_order]
    numbers = [site.components[lift.component].crane for lift in lifts]
    tracks = [
        carrying_track(site, site.cranes[number], lift, by_order[lift.order])
        for number, lift in zip(numbers, lifts, strict=True)
    ]
    return site, [
        Carried(lift, number, track, 0.0, 0.0) for lift, number, track in zip(lifts, numbers, tracks, strict=True)
    ]


def test_with_room_nothing_is_obstructed() -> None:
    site, lifts = carried()
    assert always_obstructed(site, lifts) == {}
    insist_on_room(site, lifts)


@pytest.mark.parametrize("separation_m", [5.0, 9.0, 12.0])
def test_what_is_reported_meets_the_other_crane_in_every_direction(separation_m: float) -> None:
    site, lifts = carried(crane_separation_m=separation_m)
    found = always_obstructed(site, lifts)
    for one in lifts:
        other = site.cranes[1 - one.crane]
        own = outline_of(site.cranes[one.crane])
        free = 0
        for slew_rad in np.linspace(0.0, 2.0 * np.pi, 721):
            at = np.array(
                [slew_rad, slew_rad, other.min_radius_m, other.min_radius_m, *[outline_of(other).rope_top_m] * 3, 0, 0]
            )
            still = CraneTrack(0, at[None], at, at)
            free += first_conflict((own, outline_of(other)), one.track, still, separation_m) is None
        assert free == 0 or site.components[one.lift.component].id not in found
    assert bool(found) == (separation_m > 5.0)


def test_all_of_them_are_named_at_once() -> None:
    site, lifts = carried(crane_separation_m=15.0)
    with pytest.raises(NoFreeTimeError) as caught:
        insist_on_room(site, lifts)
    reasons = caught.value.reasons
    assert len(reasons) > 1
    assert "west left: west has no free time slot for it alongside the other cranes" in reasons["west left"]
    assert "wherever the jib of east points" in reasons["west left"]
    assert "[[component]] start" in str(caught.value.hint)


def test_a_crane_without_lifts_is_not_looked_at() -> None:
    site, lifts = carried(crane_separation_m=15.0)
    assert always_obstructed(site, [one for one in lifts if one.crane == 0]) == {}


def test_a_way_past_a_higher_mast_is_not_clear_and_one_beside_it_is() -> None:
    low, high = (
        crane_of(base=(0.0, 0.0, 0.0), jib=40.0, height=30.0),
        crane_of(base=(30.0, 0.0, 0.0), jib=40.0, height=45.0),
    )
    work = work_of([(20.0, -20.0), (20.0, 20.0), (45.0, 5.0)], [1000.0] * 3, [(19.0, 15.0), (21.0, 15.0)])
    clear = clear_ways((low, high), work, 2.0)
    assert clear[:, 0].tolist() == [False, True, False], "the first turns past the mast, the third reaches beyond it"
    assert clear[:, 1].all(), "its jib passes above the other crane"
    # From where it lies in the yard, nearer to the own crane, the first part does not turn past the mast.
    rooms = np.array([[shapely.box(-20.0, -30.0, -15.0, -25.0).union(shapely.box(80.0, 10.0, 99.0, 15.0)), None]] * 3)
    beyond = clear_ways((low, high), replace(work, rooms=rooms), 2.0)
    assert beyond[:, 0].tolist() == [True, False, False]
    rooms = np.array([[shapely.Polygon(), shapely.box(19.0, 14.0, 21.0, 16.0)]] * 3)
    assert clear_ways((low, high), replace(work, rooms=rooms), 2.0)[:, 0].tolist() == clear[:, 0].tolist()
    far = crane_of(base=(90.0, 0.0, 0.0), jib=40.0, height=30.0)
    assert clear_ways((low, far), work, 2.0)[:2, 0].all()
