"""Picks in the yard: where the plan puts parts, as far as an estimate can know."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from bimvox_pipeline.studio.opened import open_site
from box_sites import test_crane as crane_of
from lift_work import picks_in
from planned_frame import FILES, planned
from rough_search import read_model

from bimvox.crane.kinematics import pose_of
from bimvox.crane.travel import Travel
from bimvox.library.set_up_search.placed import Picks, PlacedSite, around_m, rooms_of, taken_m2
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import OtherYard
from bimvox.planning.best_place import SAME_S
from bimvox.planning.order.faster_order import travel_of
from bimvox.planning.yard import allocate_yard
from bimvox.progress import SilentProgress
from bimvox.records.lift import Lift
from bimvox.site.catalogue import machines_called
from bimvox.site.component import StoredPose
from bimvox.site.config.site_config import ModelConfig
from bimvox.site.guess import guess_site
from bimvox.site.machine import cranes_of
from bimvox.site.site import Site
from bimvox.site.trial import yard_points

SAMPLES = Path(__file__).parents[3] / "sample_models"
SQUARE = (((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)),)
POINTS_M = np.array([(x + 0.5, y + 0.5) for y in range(10) for x in range(10)])
AROUND_M = np.array([[[-2.0, -1.0], [2.0, 1.0]]])


def picked(picks: Picks, site: Site, able: np.ndarray, *, turned: bool = False) -> np.ndarray:
    """Return where a part is picked that goes from one end of a yard to the other."""
    crane = site.cranes[0]
    before, place = (pose_of(crane, np.array([[x, 30.0, 0.0]])) for x in (20.0, 25.0))
    hook = pose_of(crane, np.pad(POINTS_M, ((0, 0), (0, 1))))
    at = picks.of(0, able, Travel(crane, 60.0), (before, hook, place), turned=turned)
    assert able[at]
    return POINTS_M[at]


def test_a_part_lies_within_the_yard_where_the_crane_can_pick_it(site: Site) -> None:
    everywhere = np.ones(100, np.bool_)
    x, y = picked(picks_in(SQUARE, POINTS_M, AROUND_M, np.zeros(1)), site, everywhere)
    assert 1.5 <= x <= 8.5
    assert 0.5 <= y <= 9.5
    # A part as long as the yard has one row of places; a longer one lies anywhere.
    long = 2.5 * AROUND_M
    x, _ = picked(picks_in(SQUARE, POINTS_M, long, np.zeros(1)), site, everywhere)
    assert abs(x - 5.0) <= 0.5
    picked(picks_in(SQUARE, POINTS_M, 9.0 * AROUND_M, np.zeros(1)), site, everywhere)
    # Where it fits, the crane may not carry it.
    only_east = POINTS_M[:, 0] > 9.0
    assert picked(picks_in(SQUARE, POINTS_M, AROUND_M, np.zeros(1)), site, only_east)[0] == 9.5


def test_a_part_lies_turned_only_where_the_crane_can_pick_it_so_alone() -> None:
    crane = crane_of(base=(-10.0, 5.0, 0.0), jib=40.0, height=30.0)
    may, kept = (picks_in(SQUARE, POINTS_M, AROUND_M, np.zeros(1), turns=turns) for turns in (True, False))
    # Its hook is at least 2 m from the west side as it is built, 1 m if it lies turned.
    assert [may.is_turned(0, crane, far_m) for far_m in (10.9, 11.1, 11.9, 12.1)] == [False, True, True, False]
    assert not kept.is_turned(0, crane, 11.5)


def test_the_room_of_a_part_is_the_yard_less_its_ends_as_it_lies_there(site: Site) -> None:
    part = next(one for one in site.components if np.ptp(one.shape.size_vox[:2]) and not one.erected)
    size_m, cells = site.frame.voxel_size_m, np.array(part.shape.size_vox[:2])
    yard_m = 40.0
    yard = (((0.0, 0.0), (yard_m, 0.0), (yard_m, yard_m), (0.0, yard_m)),)
    parts = [replace(part, stored_turn=turn) for turn in (None, 0, 1)]
    along = [replace(part, stored_pose=pose) for pose in (StoredPose.LYING_X, StoredPose.LYING_Y)]
    rooms = rooms_of(yard, [*parts, part, replace(part, erected=True), *along], size_m)

    def sides_m(room) -> tuple[float, float]:
        low_x, low_y, high_x, high_y = room.bounds
        return round(yard_m - (high_x - low_x), 6), round(yard_m - (high_y - low_y), 6)

    built_m, across_m = tuple((cells * size_m).round(6)), tuple((cells[::-1] * size_m).round(6))
    assert [[sides_m(room) for room in some] for some in rooms[:3]] == [
        [built_m, across_m], [built_m, built_m], [across_m, across_m]
    ]  # fmt: skip
    assert rooms[3, 0] is rooms[0, 0]
    # A part that is upended lies along x or along y.
    assert shapely.equals(rooms[4, 0], rooms[5, 0].union(rooms[6, 0]))
    assert sides_m(rooms[5, 0])[0] >= part.shape.size_vox[2] * size_m
    assert rooms_of((((0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)),), parts[:1], size_m)[0, 0].is_empty


def test_a_turned_part_is_picked_where_it_lies_turned(site: Site) -> None:
    everywhere = np.ones(100, np.bool_)
    picks = picks_in(SQUARE, POINTS_M, 2.5 * AROUND_M, np.zeros(1), turns=True)
    as_built, turned = (picked(picks, site, everywhere, turned=turned) for turned in (False, True))
    assert abs(as_built[0] - 5.0) <= 0.5
    assert abs(turned[1] - 5.0) <= 0.5


def test_earlier_parts_of_a_delivery_take_the_best_places(site: Site) -> None:
    everywhere = np.ones(100, np.bool_)
    first, later, next_delivery = (
        picked(picks_in(SQUARE, POINTS_M, AROUND_M, np.array([taken])), site, everywhere)
        for taken in (0.0, 60.0, 100.0)
    )
    assert (next_delivery == first).all()
    assert (later != first).any()


def test_a_part_is_picked_about_as_quickly_as_where_the_plan_puts_it(site: Site, lifts: tuple[Lift, ...]) -> None:
    parts = [site.components[lift.component] for lift in lifts]
    crane, size_m = site.cranes[0], site.frame.voxel_size_m
    places = allocate_yard(site, tuple(part.index for part in parts), travel_of(site, crane))
    travel, origin_m = travel_of(site, crane), np.array(site.frame.origin_m)

    def over(cells) -> tuple:
        return travel.axes_of(origin_m + size_m * (np.asarray(cells, float).reshape(-1, 3) + np.array([0.5, 0.5, 0.0])))

    points_m = _yard_points()
    picks = picks_in(_config().areas.yard, points_m, around_m(parts, size_m), taken_m2(site, parts))
    off_s = []
    for n, part in enumerate(parts[1:], start=1):
        place, height_m = places[part.index], part.shape.size_vox[2] * size_m
        before, target = (over(np.add(one.target_vox, one.hook_line_vox)) for one in (parts[n - 1], part))
        hook = travel.axes_of(np.pad(points_m, ((0, 0), (0, 1)), constant_values=height_m))
        at = picks.of(n, np.ones(len(points_m), np.bool_), travel, (before, hook, target))
        there = np.add(place.transit_start_vox, part.hook_line_vox)
        own, plans = (
            float((travel.between_s(before, axes) + travel.between_s(axes, target))[0])
            for axes in (tuple(axis[at : at + 1] for axis in hook), over(there))
        )
        off_s.append(abs(own - plans))
    # The yard also keeps upended parts apart and fills lorries, which the estimate does not know.
    assert np.median(off_s) <= 5.0 * SAME_S


def _config():
    return open_site(planned() / FILES[0]).config


def _yard_points() -> np.ndarray:
    return yard_points(_config())


def test_a_search_serves_no_part_that_lies_in_the_yard_only_beyond_the_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    building = read_model(SAMPLES / "frame.ifc")
    placed = PlacedSite(guess_site(building, ModelConfig(path=Path("frame.ifc")), name="site"), building)
    yard, machines = OtherYard(0, placed.config.areas.yard[0], 24_000.0), machines_called("hammerhead-45")

    def served() -> tuple[list[int], str]:
        search = Search(placed, SilentProgress())
        found, moved = next(search.tried(machines)), search.with_yard(machines[0], yard, 4)
        return [found.served, moved.served, search.of(cranes_of(placed.config)[0])[0]], found.why

    every, _ = served()

    def far_away(*given) -> np.ndarray:
        rooms = rooms_of(*given)
        rooms[0] = shapely.Point(1e3, 1e3)
        return rooms

    monkeypatch.setattr("bimvox.library.set_up_search.search.rooms_of", far_away)
    fewer, why = served()
    assert fewer == [count - 1 for count in every]
    assert "m needed where it lies within the yard; " in why
