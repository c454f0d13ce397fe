"""The level of a part, from the feet of columns and walls, whichever storey the file keeps a slab in."""

from __future__ import annotations

from box_sites import box_site

from bimvox.planning.order.levels import levels_of

POST = {"ifc_class": "IfcColumn"}
WALL = {"ifc_class": "IfcWall"}
SLAB = {"ifc_class": "IfcSlab"}


def levels(*parts: tuple) -> dict[str, int] | None:
    components = box_site(list(parts), shape=(40, 30, 40)).components
    found = levels_of(components)
    return None if found is None else {c.id: n for c, n in zip(components, found, strict=True)}


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


def test_feet_on_a_slope_do_not_become_one_level_for_ever() -> None:
    posts = [(f"{n}", (n, 1, 0.4 * n), (n + 0.5, 1.5, 0.4 * n + 3.0), POST) for n in range(9)]
    found = levels(*posts)
    assert found is not None
    assert list(found.values()) == [0, 0, 0, 0, 1, 1, 1, 1, 2]


def test_without_columns_and_walls_there_are_no_levels() -> None:
    assert levels(("beam", (0, 0, 0), (5, 0.4, 0.5)), ("slab", (0, 1, 0), (5, 2.2, 0.3), SLAB)) is None
