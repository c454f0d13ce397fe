from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_mesh, box_site, test_crane

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError, SequenceError
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.relations import _one_way, precedence
from bimvox.planning.order.sequence import Sequencer, body_m, levels_of
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.site.component import OrderHints
from bimvox.site.means import Means

PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98)),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98)),
]


def order_of(site):
    contacts = Contacts(site)
    relations = precedence(site, contacts)
    return relations, Sequencer(site, relations, contacts).lowest_first()


def names(site, sequence):
    return [site.components[i].id for i in sequence.order]


def test_supports_stand_before_what_they_carry():
    site = box_site(PORTAL)
    relations, sequence = order_of(site)
    assert relations.supports[1] == (2, 3)  # across a joint of 20 mm
    assert relations.supports[0] == (1,)
    assert relations.grounded == (False, False, True, True)
    assert names(site, sequence) == ["left", "right", "beam", "slab"]
    assert not sequence.notes


def test_what_would_block_the_descent_comes_later():
    site = box_site(PORTAL)
    relations, _ = order_of(site)
    assert set(relations.descent[2]) == {0, 1}
    assert relations.descent[1] == (0,)
    assert relations.descent[0] == ()


def test_parts_side_by_side_do_not_order_each_other():
    relations, _ = order_of(box_site([("a", (1, 1, 0), (2, 2, 3)), ("b", (2, 1, 0), (3, 2, 1))]))
    assert relations.descent == ((), ())
    assert relations.supports == ((), ())


def test_the_planners_own_order_is_kept():
    site = box_site([("a", (1, 1, 0), (2, 2, 1)), ("b", (4, 1, 0), (5, 2, 1), {"before": ("a",)})])
    assert names(site, order_of(site)[1]) == ["b", "a"]


def test_a_constraint_on_an_unknown_component_is_an_error():
    site = box_site([("a", (1, 1, 0), (2, 2, 1), {"after": ("nobody",)})])
    with pytest.raises(InputError, match="nobody"):
        order_of(site)


def test_a_hung_panel_waits_for_what_it_touches_and_is_noted():
    site = box_site([("panel", (2.0, 1.0, 1.0), (2.2, 3.0, 2.0)), ("column", (1.0, 1.0, 0.0), (2.0, 2.0, 3.0))])
    _, sequence = order_of(site)
    assert names(site, sequence) == ["column", "panel"]
    assert sequence.notes == ("panel: nothing supports it within 0.05 m; it is set after a part that it touches",)


def test_circular_wishes_are_an_error_that_names_the_circle():
    site = box_site([("a", (1, 1, 0), (2, 2, 1), {"after": ("b",)}), ("b", (4, 1, 0), (5, 2, 1), {"after": ("a",)})])
    with pytest.raises(SequenceError, match=r"b before a .required by the site file., a before b") as caught:
        order_of(site)
    assert sorted(caught.value.cycle) == ["a", "b"]


def test_a_wish_against_support_is_an_error_that_names_both_reasons():
    site = box_site([("slab", (1, 1, 1), (3, 3, 1.2), {"before": ("leg",)}), ("leg", (1.5, 1.5, 0), (2, 2, 0.98))])
    with pytest.raises(
        SequenceError, match=r"slab before leg .required by the site file., leg before slab .which rests on"
    ):
        order_of(site)


def test_a_wish_against_a_straight_descent_is_kept_if_insertion_from_the_side_is_free():
    """A post under a cantilevered slab with other supports, requested after the slab: it is inserted from the side."""
    parts = [
        ("wall", (1.0, 1.0, 0.0), (1.5, 3.0, 2.0)),
        ("slab", (1.0, 1.0, 2.0), (3.0, 3.0, 2.2)),
        ("box", (2.0, 1.5, 0.0), (2.5, 2.0, 1.5), {"after": ("slab",)}),
    ]
    site = box_site(parts)
    relations, sequence = order_of(site)
    assert 1 in relations.descent[2]
    assert names(site, sequence) == ["wall", "slab", "box"]
    (note,) = sequence.notes
    assert "block each other in a cycle" in note and note.endswith("set from the side: box")


def test_a_wish_that_no_insertion_allows_is_an_error():
    """The same box between walls: after the slab is set, it has no path."""
    walls = [
        ("west", (0.5, 0.5, 0.0), (1.0, 3.5, 2.0)),
        ("east", (3.0, 0.5, 0.0), (3.5, 3.5, 2.0)),
        ("south", (1.0, 0.5, 0.0), (3.0, 1.0, 2.0)),
        ("north", (1.0, 3.0, 0.0), (3.0, 3.5, 2.0)),
    ]
    slab = ("slab", (0.5, 0.5, 2.0), (3.5, 3.5, 2.2))
    site = box_site([*walls, slab, ("box", (1.5, 1.5, 0.0), (2.5, 2.5, 1.5), {"after": ("slab",)})])
    with pytest.raises(SequenceError) as caught:
        order_of(site)
    assert set(caught.value.cycle) == {"slab", "box"}


def hinted(name, x, rank, **more):
    return (name, (x, 1, 0), (x + 1, 2, 1), {"hints": OrderHints(**{rank: more["at"]}, task=more.get("task"))})


@pytest.mark.parametrize("rank", ["zone", "task_rank", "storey_rank"])
def test_zones_tasks_and_storeys_order_what_geometry_leaves_free(rank):
    site = box_site([hinted("c", 1, rank, at=2), hinted("a", 3, rank, at=0), hinted("b", 5, rank, at=1)])
    assert names(site, order_of(site)[1]) == ["a", "b", "c"]


def test_what_is_wanted_first_comes_with_its_needs_before_all_zones():
    parts = [
        ("other", (5, 1, 0), (6, 2, 1), {"hints": OrderHints(zone=0, zone_name="north")}),
        ("slab", (1, 1, 1), (3, 3, 1.2), {"hints": OrderHints(first=True)}),
        ("leg", (1.5, 1.5, 0), (2, 2, 0.98)),
    ]
    site = box_site(parts)
    assert names(site, order_of(site)[1]) == ["leg", "slab", "other"]


def test_a_schedule_that_contradicts_geometry_gives_way_and_both_are_named():
    parts = [
        ("slab", (1, 1, 1), (3, 3, 1.2), {"hints": OrderHints(task="set slabs", task_rank=0)}),
        ("leg", (1.5, 1.5, 0), (2, 2, 0.98), {"hints": OrderHints(task="set columns", task_rank=1)}),
    ]
    site = box_site(parts)
    _, sequence = order_of(site)
    assert names(site, sequence) == ["leg", "slab"]
    told = "leg (task 'set columns') is set before task 'set slabs', against the schedule"
    assert sequence.notes == (f"{told}: slab needs it",)


def test_a_hung_part_waits_for_what_the_file_says_it_is_connected_to():
    parts = [
        ("panel", (2.0, 1.0, 1.0), (2.2, 3.0, 2.0), {"hints": OrderHints(connected=("post",))}),
        ("column", (1.0, 1.0, 0.0), (2.0, 2.0, 3.0)),
        ("post", (3.0, 3.2, 0.0), (3.2, 3.4, 3.0)),
    ]
    site = box_site(parts)
    _, sequence = order_of(site)
    assert names(site, sequence) == ["column", "post", "panel"]
    assert "is connected to" in sequence.notes[0]


def test_structure_below_counts_as_support():
    site = box_site([("wall", (1, 1, 0.5), (4, 1.2, 3.0))], structure=[("footing", (1, 1, 0), (4, 2, 0.48))])
    relations, sequence = order_of(site)
    assert relations.grounded == (True,)
    assert not sequence.notes


def test_parts_that_rest_on_each_other_do_not_wait_for_each_other():
    """Two parts with hooks, each hook above the other part's hook."""
    site = box_site([("a", (1, 1, 0), (2, 2, 1)), ("b", (4, 1, 0), (5, 2, 1))])
    level = np.array([[(0, 0, 0), (1, 1, 1)]] * 4, float)
    assert _one_way([(1,), (0,)], level, 0.01) == ((), ())
    assert _one_way([(1,), (2,), (1, 3), ()], level, 0.01) == ((1,), (), (3,), ())
    assert order_of(site)[1].order == (0, 1)


@pytest.mark.parametrize("means", [Means.CRANE, Means.BY_HAND])
def test_a_plate_drawn_flush_into_a_footing_lies_on_it(means):
    more = {} if means is Means.CRANE else {"means": means, "means_reason": "so"}
    plate, footing = ("plate", (1.6, 1.6, 0.79), (2.0, 2.0, 0.8), more), ("footing", (1.0, 1.0, 0.0), (3.0, 3.0, 0.8))
    site = box_site([plate, footing])
    relations, sequence = order_of(site)
    assert relations.supports == ((1,), ())
    assert sequence.order == (1, 0)
    assert verify_plan(plan_lifts(site, prepare(site))).verified


def test_a_part_drawn_into_the_edge_of_its_support_is_set_after_it():
    """By as much as the tolerance, so that eroded bodies do not meet; the zones would set the post first."""
    north, south = ({"hints": OrderHints(zone=n, zone_name=name)} for n, name in enumerate(("north", "south")))
    parts = [
        ("footing", (1.0, 1.0, 0.0), (3.0, 3.0, 0.8), south),
        ("post", (2.99, 1.5, 0.79), (3.39, 1.9, 2.8), north),
        ("column", (3.39, 1.5, 0.0), (4.0, 1.9, 2.8), north),
    ]
    site = box_site(parts)
    relations, sequence = order_of(site)
    assert relations.supports == ((), (0,), ())
    assert names(site, sequence) == ["footing", "column", "post"]
    assert sequence.notes == ("footing is set with north, not with south: post needs it",)
    assert verify_plan(plan_lifts(site, prepare(site))).verified


def test_thin_parts_drawn_into_each_other_are_planned_and_proven():
    """Each rests on the other: no order is right."""
    own = {"means": Means.BY_HAND, "means_reason": "so"}
    sheets = [("one", (1.0, 1.0, 0.5), (3.0, 1.4, 0.506), own), ("other", (1.4, 1.0, 0.502), (3.4, 1.4, 0.508), own)]
    site = box_site(sheets, structure=[("wall", (1.0, 1.0, 0.0), (3.4, 1.4, 0.49))])
    assert verify_plan(plan_lifts(site, prepare(site))).verified


def test_what_would_block_the_rope_comes_later():
    """A cap above the middle of a ring is clear of the ring's way down, but not of its rope."""
    ring = ("frame", (1.0, 1.0, 0.0), (3.0, 3.0, 0.5))
    site = box_site([ring, ("cap", (1.8, 1.8, 3.0), (2.6, 2.6, 3.2))], crane=test_crane(base=(8.0, 8.0, 0.0)))
    assert order_of(site)[0].descent[0] == (1,)


def test_what_would_block_the_rope_beside_a_narrow_part_comes_later():
    """The hook line is in the wall beside the beam."""
    aside = {"hook_aside_vox": (0.0, 0.0)}  # as if its centre of mass were in the middle of that column of cells
    beam, wall = ("beam", (1.3, 1.0, 0.0), (1.45, 4.0, 0.5), aside), ("wall", (1.1, 1.0, 0.0), (1.29, 4.0, 3.0))
    site = box_site([wall, beam], crane=test_crane(base=(8.0, 8.0, 0.0)))
    relations, sequence = order_of(site)
    assert relations.descent[1] == (0,)
    assert names(site, sequence) == ["beam", "wall"]


def boxes(*pairs: tuple) -> TriangleMesh:
    return TriangleMesh.joined([box_mesh(*pair) for pair in pairs])


def test_a_solid_is_all_body() -> None:
    assert body_m(box_mesh((0, 0, 1.0), (2, 3, 4.0))) == (1.0, 4.0)


def test_railings_and_bolts_are_not() -> None:
    mesh = boxes(((0, 0, 1.0), (2, 3, 4.0)), ((0, 0, 4.0), (0.1, 3, 5.0)), ((1, 1, 0.5), (1.05, 1.05, 1.0)))
    assert body_m(mesh) == pytest.approx((1.0, 4.0), abs=0.08)


def test_a_slope_loses_its_tip_only() -> None:
    """A roof plane of 0.3 m that rises by 3 m: its ends are wedges."""
    mesh = box_mesh((0, 0, 0), (6, 4, 0.3))
    corners = mesh.vertices_m + np.outer(mesh.vertices_m[:, 0] / 2.0, [0.0, 0.0, 1.0])
    assert body_m(TriangleMesh(corners, mesh.faces)) == pytest.approx((0.0, 3.3), abs=0.15)


def test_of_an_inverted_mesh_it_is_the_same() -> None:
    mesh = boxes(((0, 0, 1.0), (2, 3, 4.0)), ((0, 0, 4.0), (0.1, 3, 5.0)))
    assert body_m(TriangleMesh(mesh.vertices_m, mesh.faces[:, ::-1])) == body_m(mesh)


def test_a_mesh_that_is_open_above_is_all_body() -> None:
    mesh = boxes(((0, 0, 1.0), (2, 3, 4.0)), ((0, 0, 4.0), (0.1, 3, 5.0)))
    open_m = mesh.triangles_m[..., 2].mean(axis=1) != 4.0  # without the faces at 4 m
    assert body_m(TriangleMesh(mesh.vertices_m, mesh.faces[open_m])) == (1.0, 5.0)


def test_a_flat_sheet_has_its_heights() -> None:
    corners = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]], float)
    assert body_m(TriangleMesh(corners, np.array([[0, 1, 2]], np.int32))) == (1.0, 1.0)


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
