from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import box_site
from box_sites import test_crane as crane_at
from named_cranes import MOBILE_CRANES

from bimvox.site.crane_distances import base_of
from bimvox.site.crane_room import PLACE_M, REACH_M, Room, place_beside, room_for_jib, way_in

TOWER = crane_at(base=(30.0, 30.0, 0.0), jib=30.0, height=20.0)
RING = [
    ("south", (10.0, 10.0, 0.0), (50.0, 12.0, 6.0)),
    ("north", (10.0, 48.0, 0.0), (50.0, 50.0, 6.0)),
    ("west", (10.0, 12.0, 0.0), (12.0, 48.0, 6.0)),
    ("east", (48.0, 12.0, 0.0), (50.0, 48.0, 6.0)),
]


def site(parts=(), *, crane=TOWER, side=60.0, access=None, **more):
    made = box_site(parts, shape=(int(side * 2), int(side * 2), 20), yard=((0, 0), (4, 4)), crane=crane, **more)
    if access is None:
        return made
    (x0, y0), (x1, y1) = access
    columns = np.zeros(made.shape[:2], np.bool_)
    columns[int(2 * x0) : int(2 * x1), int(2 * y0) : int(2 * y1)] = True
    return dataclasses.replace(made, access=columns)


def in_a_bowl(own, slope):
    """Return a site whose ground rises from 18 m around its middle on, by up to 3 m."""
    x, y = np.indices(own.shape[:2]) / 2.0
    ground_m = np.minimum(np.maximum(np.hypot(x - 30.0, y - 30.0) - 18.0, 0.0) * slope, 3.0)
    tops = np.ceil(ground_m / 0.5).astype(int)
    cells = np.argwhere(np.arange(own.shape[2]) <= tops[:, :, None]).astype(np.int32)
    ground = dataclasses.replace(own.blockers[0], cells=cells)
    return dataclasses.replace(own, natural_ground_m=ground_m, blockers=(ground, *own.blockers[1:]))


def beside(own, *, finished=True):
    return place_beside(own, TOWER, base_of(TOWER).edge_m, finished=finished)


def test_on_an_open_site_the_place_is_next_to_the_foundation() -> None:
    place = beside(site())
    assert place.room is Room.FREE
    assert place.at_m is not None
    apart_m = np.abs(np.array(place.at_m) - 30.0).max()
    assert apart_m == pytest.approx((base_of(TOWER).edge_m + PLACE_M) / 2.0, abs=1.0)
    assert not place.from_access


def test_a_court_is_left_before_the_building_stands_but_not_afterwards() -> None:
    own = site(RING)
    assert beside(own, finished=False).room is Room.FREE
    assert beside(own).room is Room.NONE


def test_a_gate_in_the_court_is_wide_and_high_enough_or_not() -> None:
    for gate_m, high_m, room in (
        (5.0, 0.0, Room.FREE),
        (3.0, 0.0, Room.NONE),
        (5.0, 5.0, Room.FREE),
        (5.0, 4.0, Room.NONE),
    ):
        east = [
            ("low", (48.0, 12.0, 0.0), (50.0, 25.0, 6.0)),
            ("high", (48.0, 25.0 + gate_m, 0.0), (50.0, 48.0, 6.0)),
        ]
        lintel = [("lintel", (48.0, 25.0, high_m), (50.0, 25.0 + gate_m, 6.0))] if high_m else []
        assert beside(site([*RING[:3], *east, *lintel])).room is room, (gate_m, high_m)


def test_too_little_room_next_to_the_mast_is_none_and_beyond_the_site_unknown() -> None:
    around = [("south", (0.0, 0.0, 0.0), (60.0, 26.5, 6.0)), ("north", (0.0, 33.5, 0.0), (60.0, 60.0, 6.0))]
    assert beside(site(around)).room is Room.NONE
    small = site(crane=dataclasses.replace(TOWER, base_m=(4.0, 4.0, 0.0)), side=8.0)
    place = place_beside(small, small.cranes[0], base_of(TOWER).edge_m, finished=True)
    assert place.room is Room.UNKNOWN
    assert place.at_m is not None
    assert np.hypot(*(np.array(place.at_m) - 4.0)) <= REACH_M + 0.5


def test_with_an_access_the_way_begins_there() -> None:
    wall = [("wall", (0.0, 50.0, 0.0), (60.0, 52.0, 6.0))]
    assert beside(site(access=((0.0, 20.0), (5.0, 40.0)))).from_access
    cut_off = beside(site(wall, access=((0.0, 53.0), (60.0, 59.0))))
    assert cut_off.room is Room.UNKNOWN  # only from elsewhere


def test_a_mobile_crane_comes_to_its_place_and_leaves_it() -> None:
    crane = dataclasses.replace(MOBILE_CRANES[0], base_m=(30.0, 30.0, 0.0))
    own = site(RING, crane=crane)
    assert way_in(own, crane, finished=False).room is Room.FREE
    assert way_in(own, crane, finished=True).room is Room.NONE
    assert way_in(site(crane=crane), crane, finished=True).room is Room.FREE


def test_a_steep_slope_is_no_way() -> None:
    crane = dataclasses.replace(MOBILE_CRANES[0], base_m=(30.0, 30.0, 0.0))
    for slope, room in ((0.4, Room.NONE), (0.08, Room.FREE)):
        assert way_in(in_a_bowl(site(crane=crane), slope), crane, finished=False).room is room


def test_a_jib_lies_on_the_ground_in_one_piece_or_does_not() -> None:
    edge_m = base_of(TOWER).edge_m
    assert room_for_jib(site(), TOWER, edge_m, finished=True) is Room.FREE
    own = site(RING)  # a court of 36 m, and a jib of 30
    assert room_for_jib(own, TOWER, edge_m, finished=True) is Room.FREE
    longer = dataclasses.replace(TOWER, jib_length_m=65.0)  # than the site
    assert room_for_jib(own, longer, edge_m, finished=True) is Room.UNKNOWN
    walls = [(f"wall {n}", (0.0, 4.0 * n, 0.0), (60.0, 4.0 * n + 2.0, 6.0)) for n in range(15)]
    walls += [(f"fin {n}", (4.0 * n, 0.0, 0.0), (4.0 * n + 2.0, 60.0, 6.0)) for n in range(15)]
    assert room_for_jib(site(walls), TOWER, edge_m, finished=True) is not Room.FREE
