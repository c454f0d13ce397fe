"""The level of a part, from the feet of columns and walls, whichever storey the file keeps a slab in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_mesh, box_site

from bimvox.bim.building import TriangleMesh
from bimvox.planning.order.levels import levels_of

POST = {"ifc_class": "IfcColumn"}
WALL = {"ifc_class": "IfcWall"}
SLAB = {"ifc_class": "IfcSlab"}


def levels(*parts: tuple) -> dict[str, int]:
    components = box_site(list(parts), shape=(40, 30, 40)).components
    return {c.id: n for c, n in zip(components, levels_of(components, [()] * len(components)), strict=True)}


def test_a_floor_is_of_the_level_of_the_columns_that_carry_it() -> None:
    assert levels(
        ("base", (0, 0, 0), (6, 4, 0.2), SLAB),
        ("post", (1, 1, 0.2), (1.5, 1.5, 3.0), POST),
        ("wall", (3, 1, 0.25), (5, 1.2, 3.0), WALL),
        ("beam", (1, 1, 3.0), (5, 1.5, 3.4)),
        ("floor", (0, 0, 3.4), (6, 4, 3.6), SLAB),
        ("upper post", (1, 1, 3.6), (1.5, 1.5, 6.4), POST),
        ("panel past the edge", (6, 1, 3.3), (6.2, 4, 6.4), WALL),
        ("roof", (0, 0, 6.4), (6, 4, 6.6), SLAB),
        ("parapet", (0, 0, 6.6), (6, 0.2, 7.4), WALL),
    ) == {
        "base": -1,
        "post": 0,
        "wall": 0,
        "beam": 0,
        "floor": 0,
        "upper post": 1,
        "panel past the edge": 1,
        "roof": 1,
        "parapet": 2,
    }


def test_a_flight_of_stairs_is_of_the_level_that_it_starts_from() -> None:
    found = levels(
        ("post", (1, 1, 0), (1.5, 1.5, 3.0), POST),
        ("lower flight", (3, 1, 0), (6, 2, 1.6), {"ifc_class": "IfcStairFlight"}),
        ("upper flight", (3, 2, 1.6), (6, 3, 3.2), {"ifc_class": "IfcStairFlight"}),
        ("upper post", (1, 1, 3.2), (1.5, 1.5, 6.2), POST),
    )
    assert found == {"post": 0, "lower flight": 0, "upper flight": 0, "upper post": 1}


def test_what_rests_on_walls_is_of_no_lower_level_than_they() -> None:
    """By its top alone, the mezzanine would be of the level below."""
    parts = [
        ("post", (1, 1, 0), (1.5, 1.5, 2.5), POST),
        ("low wall", (3, 1, 2.6), (5, 1.2, 3.0), WALL),
        ("beam", (3, 1, 3.0), (5, 1.2, 3.2)),
        ("mezzanine", (3, 1, 3.2), (5, 3, 3.3), SLAB),
        ("wall", (7, 1, 3.0), (9, 1.2, 5.8), WALL),
    ]
    components = box_site(parts, shape=(40, 30, 40)).components
    assert levels_of(components, [()] * 5) == [0, 1, 0, 0, 1]
    assert levels_of(components, [(), (), (1,), (2,), ()]) == [0, 1, 1, 1, 1]


def test_feet_on_a_slope_do_not_become_one_level_for_ever() -> None:
    posts = [(f"{n}", (n, 1, 0.4 * n), (n + 0.5, 1.5, 0.4 * n + 3.0), POST) for n in range(9)]
    found = levels(*posts)
    assert list(found.values()) == [0, 0, 0, 0, 1, 1, 1, 1, 2]


def test_without_columns_and_walls_the_feet_of_all_parts_make_the_levels() -> None:
    found = levels(
        ("slab", (0, 1, 3.0), (5, 2.2, 3.2), SLAB),
        ("beam", (0, 0, 2.6), (5, 0.4, 3.0)),
        ("flight", (0, 3, 0), (3, 4, 3.2), {"ifc_class": "IfcStairFlight"}),
        ("upper slab", (0, 1, 6.0), (5, 2.2, 6.2), SLAB),
    )
    assert found == {"slab": 1, "beam": 1, "flight": 0, "upper slab": 2}


POSTS = [("post", (1, 1, 0), (1.5, 1.5, 2.8), POST), ("upper post", (1, 1, 3.0), (1.5, 1.5, 5.8), POST)]
SMALL = {
    "railing of a stair": ("IfcStair", [((3, 1, 0), (6, 2, 3.0)), ((5.9, 1, 3.0), (6, 2, 4.0))]),
    "upstand of a slab": ("IfcSlab", [((0, 0, 2.8), (6, 4, 3.0)), ((0, 0, 3.0), (0.1, 4, 4.0))]),
    "lug of a beam": ("IfcBeam", [((1, 1, 2.4), (5, 1.5, 2.8)), ((1, 1, 2.8), (1.1, 1.1, 3.9))]),
}


@pytest.mark.parametrize("boxes", SMALL.values(), ids=SMALL)
def test_what_is_small_at_its_top_does_not_move_a_part_to_the_next_level(boxes: tuple) -> None:
    assert with_part(*boxes) == {"post": 0, "part": 0, "upper post": 1}


@pytest.mark.parametrize("ifc_class", ["IfcColumn", "IfcWall"])
def test_what_is_small_at_its_foot_does_not_move_it_to_the_level_below(ifc_class: str) -> None:
    boxes = [((3, 1, 3.0), (5, 1.2, 5.8)), ((3.5, 1.05, 1.9), (3.6, 1.15, 3.0))]
    assert with_part(ifc_class, boxes) == {"post": 0, "part": 1, "upper post": 1}


def test_a_wall_stands_on_its_legs_however_thin_they_are() -> None:
    boxes = [((3, 1, 2.6), (9, 1.2, 2.9)), ((3, 1, 0), (3.05, 1.2, 2.6)), ((8.95, 1, 0), (9, 1.2, 2.6))]
    assert with_part("IfcWall", boxes) == {"post": 0, "part": 0, "upper post": 1}


def test_half_of_a_part_is_not_small() -> None:
    boxes = [((3, 1, 0), (6, 2, 3.0)), ((3, 1, 3.0), (6, 1.5, 5.8))]
    assert with_part("IfcStair", boxes) == {"post": 0, "part": 1, "upper post": 1}


def with_part(ifc_class: str, boxes: list) -> dict[str, int]:
    """Return the levels of two posts and of a part of several boxes."""
    (low, high), lower, upper = zip(*boxes, strict=True), POSTS[0], POSTS[1]
    part = ("part", np.min(low, axis=0), np.max(high, axis=0), {"ifc_class": ifc_class})
    components = list(box_site([lower, part, upper], shape=(40, 30, 40)).components)
    components[1] = replace(components[1], mesh=TriangleMesh.joined([box_mesh(*box) for box in boxes]))
    return {c.id: n for c, n in zip(components, levels_of(components, [()] * len(components)), strict=True)}
