"""No plan, no estimate and no moved point goes below the bound, and it comes close to what a crane cannot avoid."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from box_sites import test_crane as crane_of
from hypothesis import given, settings
from hypothesis import strategies as st
from lift_work import picks_in, ways_of, work_of
from rough_search import read_model

import bimvox
from bimvox.crane.kinematics import pose_of, rigged
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import CranePose
from bimvox.crane.travel import point_to_point_s
from bimvox.library.set_up_search.least_moving import Loose, Lowered, least_moving_s, least_of_all_s, lowered
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import OtherYard
from bimvox.library.set_up_search.timed import timed_moving_s
from bimvox.library.site import built_site
from bimvox.progress import SilentProgress
from bimvox.records.lift import Lift
from bimvox.site.catalogue import machines_called
from bimvox.site.collision import margin_vox
from bimvox.site.component import Component, shape_of
from bimvox.site.config.site_config import ComponentConfig, ModelConfig
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.guess import guess_site
from bimvox.site.machine import cranes_of, machine_config
from bimvox.site.set_ups import set_ups
from bimvox.site.site import HeadingRule, Site

SAMPLES = Path(__file__).parents[3] / "sample_models"
CRANE = crane_of(base=(0.0, 0.0, 0.0), jib=40.0, height=30.0)
YARD = (((4.0, 10.0), (14.0, 10.0), (14.0, 16.0), (4.0, 16.0)),)

points = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
some_parts = st.lists(st.tuples(points, st.floats(100.0, 900.0)), min_size=1, max_size=5)


@given(some_parts, st.lists(points, min_size=1, max_size=4), st.lists(points, min_size=1, max_size=3))
def test_no_estimate_of_parts_that_are_all_served_is_below_the_bound(parts, yard, bases):
    work = work_of(*zip(*parts, strict=True), yard)
    found, least_s = set_ups(CRANE, np.array(bases), work, 20.0), least_moving_s(CRANE, np.array(bases), work)
    for row in np.flatnonzero(found.served.all(axis=1)):
        assert least_s[row] <= found.crane_s[row] - 600.0 * len(parts) + 1.0


@settings(max_examples=20)
@given(some_parts, st.lists(points, min_size=1, max_size=4))
def test_no_motion_with_swing_is_below_the_bound_with_swing_nor_that_below_the_one_without(parts, yard):
    work, base = work_of(*zip(*parts, strict=True), yard), np.zeros((1, 2))
    if set_ups(CRANE, base, work, 20.0).served.all():
        plain_s, least_s = (least_moving_s(CRANE, base, work, Loose(swings=on))[0] for on in (False, True))
        assert plain_s <= least_s
        assert least_s <= timed_moving_s(CRANE, ways_of(work), np.ones(len(parts), np.bool_)) + 1e-6


def test_one_lift_takes_no_less_than_its_raise_and_the_way_across():
    work = work_of([(0.0, 15.0)], [500.0], [(30.0, -10.0)])
    pick, place = (
        CranePose(*(float(axis) for axis in pose_of(CRANE, np.array([x, y, 5.0]))))
        for x, y in ((30.0, -10.0), (0.0, 15.0))
    )
    across_s = point_to_point_s(rigged(CRANE, 500.0), pick, place, 5.0)
    (least_s,) = least_moving_s(CRANE, np.zeros((1, 2)), work)
    (raised_s,) = least_moving_s(CRANE, np.zeros((1, 2)), work, Loose(raised_m=0.5))
    (shaped_s,) = least_moving_s(CRANE, np.zeros((1, 2)), work, Loose(swings=True))
    assert least_s == pytest.approx(across_s, rel=0.02)
    assert least_s + 1.0 < raised_s
    assert least_s + 0.8 < shaped_s < least_s + 5.0


def test_a_load_goes_straight_up_to_its_clearance_and_straight_down_from_there():
    work = work_of([(0.0, 15.0), (2.0, 15.0)], [500.0, 900.0], [(30.0, -10.0)])
    base, down_m = np.zeros((1, 2)), np.array([2.0, 2.0])
    no_pairs, pair = np.zeros((0, 2), np.int64), np.array([[0, 1]])

    def least_s(loose: Loose) -> float:
        return float(least_moving_s(CRANE, base, work, loose)[0])

    plain_s, up_s, down_s = (
        least_s(one) for one in (Loose(), Loose(clearance_m=2.0), Loose(lowered=Lowered(down_m, down_m, no_pairs)))
    )
    fastest_s = 2.0 * 2.0 / CRANE.hoist.rate
    assert up_s == pytest.approx(down_s)
    assert plain_s + fastest_s < up_s < plain_s + fastest_s + 4.0
    assert least_s(Loose(clearance_m=2.0, raised_m=0.5, lies_m=1.5)) == pytest.approx(
        least_s(Loose(raised_m=0.5, lies_m=1.5))
    )
    # The later one of two is lowered further: that which takes least, as nobody knows which it is.
    first_s, second_s, later_s = (
        least_s(Loose(lowered=Lowered(down_m, down_m + more_m, pair)))
        for more_m in (np.array([3.0, 9.0]), np.array([9.0, 3.0]), np.array([3.0, 3.0]))
    )
    both_s = least_s(Loose(lowered=Lowered(down_m + 3.0, down_m, no_pairs)))
    assert later_s == pytest.approx(down_s + 3.0 / CRANE.hoist.rate)
    assert later_s <= min(first_s, second_s) < both_s


def test_the_bound_is_lower_with_slack_and_higher_where_a_heavy_part_may_not_be_picked_nearby():
    base = np.zeros((1, 2))
    work = work_of([(0.0, 15.0), (4.0, 20.0), (-9.0, 30.0)], [500.0, 700.0, 600.0], [(6.0, 14.0), (8.0, 0.0)])
    exact, loose = (least_moving_s(CRANE, base, work, one)[0] for one in (Loose(), Loose(1.0, 1.0, 1.5)))
    assert 0.0 < loose < exact
    near, aside = (0.0, 25.0), (-10.0, -3.0)
    heavy_kg = next(kg for kg in range(500, 100_000, 100) if allowed_radii_m(CRANE, float(kg))[1] < 24.0)
    light, heavy = (work_of([(0.0, 10.0)], [kg], [near, aside]) for kg in (500.0, float(heavy_kg)))
    assert set_ups(CRANE, base, heavy, 20.0).served.all()
    assert least_moving_s(CRANE, base, heavy)[0] > least_moving_s(CRANE, base, light)[0] + 5.0
    # What the crane does not carry takes no time.
    beyond = work_of([(0.0, 10.0)], [1e6], [near, aside])
    assert least_moving_s(CRANE, base, beyond)[0] == 0.0


def test_a_long_part_comes_from_deeper_in_the_yard_or_is_turned() -> None:
    # The place is south of the yard; a part of 5 m along y lies with its hook 2.5 m within, or turned at its edge.
    work, stands = work_of([(9.0, -2.0)], [500.0], [(9.0, 13.0)]), [(CRANE, np.array([[9.0, -15.0]]))]
    around_m = np.array([[[-0.5, -2.5], [0.5, 2.5]]])
    picks = picks_in(YARD, work.yard_m, around_m, np.zeros(1), turns=True)
    anywhere_s, turning_s, kept_s = (
        least_of_all_s(stands, work, YARD, Loose(turn_s=turn_s), fits)
        for turn_s, fits in ((0.0, None), (0.5, picks.fits), (1e3, picks.fits))
    )
    assert anywhere_s + 0.3 < turning_s < kept_s
    deeper = (((4.0, 12.5), (14.0, 12.5), (14.0, 13.5), (4.0, 13.5)),)
    assert kept_s == pytest.approx(least_of_all_s(stands, work, deeper, Loose()), abs=0.5)
    # What is larger than the yard may lie anywhere.
    huge = picks_in(YARD, work.yard_m, 9.0 * around_m, np.zeros(1), turns=True)
    assert least_of_all_s(stands, work, YARD, Loose(), huge.fits) == pytest.approx(anywhere_s)


@given(some_parts, st.integers(0, 3))
def test_points_moved_by_less_than_the_slack_never_move_less_than_the_bound(parts, seed):
    rng = np.random.default_rng(seed)
    work, base = work_of(*zip(*parts, strict=True), [(6.0, 14.0), (30.0, -20.0)]), np.array([[1.0, 2.0]])
    least_s = least_moving_s(CRANE, base, work, Loose(places_m=1.0))[0]
    angles = rng.uniform(0.0, 2.0 * np.pi, len(parts))
    moved = work.places_m + 0.99 * np.column_stack([np.cos(angles), np.sin(angles)])
    moved_work = dataclasses.replace(work, places_m=moved)
    if set_ups(CRANE, base, moved_work, 20.0).served.all():
        assert least_s <= least_moving_s(CRANE, base, moved_work)[0] + 0.5 * len(parts)


@given(some_parts, st.lists(points, min_size=1, max_size=6), st.integers(0, 5))
def test_the_least_of_all_places_is_below_that_of_every_place_with_any_points_of_the_yard(parts, bases, seed):
    rng = np.random.default_rng(seed)
    (x0, y0), (x1, y1) = np.min(YARD[0], axis=0), np.max(YARD[0], axis=0)
    yard = np.column_stack([rng.uniform(x0, x1, 5), rng.uniform(y0, y1, 5)])
    work, stands_m = work_of(*zip(*parts, strict=True), yard), np.array(bases)
    least_s = least_of_all_s([(CRANE, stands_m)], work, YARD, Loose(swings=True))
    each_s = least_moving_s(CRANE, stands_m, work, Loose(swings=True))
    served = set_ups(CRANE, stands_m, work, 20.0).served.all(axis=1)
    table_s = 1.0 * len(parts)  # travel times are looked up in tables whose steps depend on the longest of all ways
    assert (least_s <= each_s[served] + table_s).all()
    assert least_of_all_s([], work, YARD, Loose()) == 0.0


@pytest.mark.parametrize(("name", "aside_m"), [("frame.ifc", 0.0), ("frame.ifc", 6.0), ("hall.ifc", 0.0)])
def test_no_plan_moves_less_than_the_bound_of_its_own_place(name: str, aside_m: float) -> None:
    building = read_model(SAMPLES / name)
    config = guess_site(building, ModelConfig(path=Path(name), voxel_size_m=0.5), name="site")
    (crane,) = cranes_of(config)
    x, y, z = crane.base_m
    crane = dataclasses.replace(crane, base_m=(x + aside_m, y - aside_m, z))
    config = config.model_copy(update={"crane": machine_config(crane)})
    made = bimvox.plan(built_site(config, building, {}, SilentProgress()), jobs=1)
    search = Search(PlacedSite(config, building), SilentProgress())
    own = next(one for one in search.tried([machine_of_crane(crane)]) if one.crane is not None)
    here = {"bases_m": np.array([crane.base_m[:2]]), "all_served": np.array([own.served])}
    moving_s = made.figures.crane_s - float(search.work.standing_s.sum())
    assert 0.45 * moving_s < search.least_moving_s([dataclasses.replace(own, crane=crane, **here)]) <= moving_s


def test_the_bound_counts_each_yard_with_the_machine_that_is_tried_there() -> None:
    building = read_model(SAMPLES / "frame.ifc")
    config = guess_site(building, ModelConfig(path=Path("frame.ifc")), name="site")
    search, machines = Search(PlacedSite(config, building), SilentProgress()), machines_called("hammerhead-45")
    given = list(search.tried(machines))
    (yard,) = config.areas.yard
    away_m = np.sign(np.mean(yard, axis=0) - np.mean(config.areas.construction, axis=0)) * 8.0
    far, same = (
        search.with_yard(machines[0], OtherYard(n, tuple(map(tuple, np.add(yard, aside_m))), 24_000.0), 4)
        for n, aside_m in enumerate((away_m, 0.0))
    )
    assert far.served == same.served == given[0].served
    given_s, far_s, same_s = (search.least_moving_s(some) for some in (given, [far], [same]))
    assert 0.0 < given_s < far_s
    assert search.least_moving_s([far, *given]) == given_s
    assert search.least_moving_s([far, same]) == same_s >= given_s
    assert search.least_moving_s([dataclasses.replace(far, second=far)]) == 0.0


def test_nothing_is_proved_where_a_part_may_start_outside_of_the_yard() -> None:
    building = read_model(SAMPLES / "frame.ifc")
    config = guess_site(building, ModelConfig(path=Path("frame.ifc")), name="site")
    search = Search(PlacedSite(config, building), SilentProgress())
    lattice = list(search.tried(machines_called("hammerhead-45")))
    assert search.least_moving_s(lattice) > 0.0
    part = ComponentConfig(global_id=building.elements[0].global_id, start=(0.0, -10.0))
    search.config = config.model_copy(update={"component": (part,)})
    assert search.least_moving_s(lattice) == 0.0


def straight_down_vox(lift: Lift) -> int:
    """Return the unit moves straight down at the end of a path."""
    assert lift.path_vox is not None
    moves = np.diff(lift.path_vox, axis=0)
    others = np.flatnonzero((moves != (0, 0, -1)).any(axis=1))
    return len(moves) - (int(others[-1]) + 1 if len(others) else 0)


def box(part: Component, index: int, low: tuple[int, int, int], size: tuple[int, int, int]) -> Component:
    """Return a part with the shape of a box at a place, as wide in every cell as said."""
    shape, _ = shape_of(np.argwhere(np.ones(size, np.bool_)))
    return replace(part, index=index, id=f"box {index}", shape=shape, target_vox=low)


def test_no_lift_of_a_plan_is_lowered_less_and_of_each_pair_one_as_far_as_beside_the_other(
    site: Site, lifts: tuple[Lift, ...]
) -> None:
    parts, size_m = [site.components[lift.component] for lift in lifts], site.frame.voxel_size_m
    found = lowered(site, parts)
    down_m = np.array([straight_down_vox(lift) for lift in lifts]) * size_m
    assert (found.always_m > 0.0).all()
    assert (down_m >= found.always_m - 1e-9).all()
    assert len(found.pairs)
    assert len(np.unique(found.pairs)) == found.pairs.size
    assert ((down_m >= found.beside_m - 1e-9)[found.pairs].any(axis=1)).all()


def test_a_part_comes_down_from_the_clearance_above_the_ground_or_a_part_and_the_later_of_two_from_above_the_other(
    site: Site,
) -> None:
    margin, size_m, part = margin_vox(site), site.frame.voxel_size_m, site.components[0]
    assert margin > 1
    # On the ground, on that, high above, and next to the first, half as high; the last one is far from all.
    boxes = [
        box(part, 0, (5, 5, 1), (2, 2, 8)),
        box(part, 1, (5, 5, 9), (2, 2, 1)),
        box(part, 2, (5, 5, 11 + margin), (2, 2, 1)),
        box(part, 3, (6 + margin, 5, 1), (2, 2, 4)),
        box(part, 4, (12 + 2 * margin, 5, 2), (2, 2, 2)),
    ]
    cells = 14 + 2 * margin
    wide = replace(
        site, components=tuple(boxes), blockers=(), labels=np.zeros((cells, 10, 14 + margin), site.labels.dtype)
    )
    found = lowered(wide, boxes)
    assert (found.always_m / size_m).round().tolist() == [margin, margin, 0, margin, margin - 1]
    assert found.pairs.tolist() == [[0, 3]]
    assert (found.beside_m / size_m).round().tolist() == [margin + 4, margin, 0, margin + 8, margin - 1]
    turning = replace(wide, rules=replace(site.rules, heading=HeadingRule.WITH_JIB))
    nothing = lowered(turning, boxes)
    assert not nothing.always_m.any()
    assert not nothing.pairs.size
