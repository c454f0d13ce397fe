"""What comes before what by geometry alone: the zones ask for the reverse."""

from __future__ import annotations

from dataclasses import replace

import pytest
from box_sites import box_mesh, box_site, test_crane

from bimvox.bim.building import TriangleMesh
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.relations import precedence
from bimvox.planning.order.sequence import ErectionSequence, Sequencer
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.component import OrderHints
from bimvox.site.means import Means
from bimvox.site.site import Site

CAST, BUILT = ({"means": means, "means_reason": "so"} for means in (Means.IN_SITU, Means.BUILT))


def zone(number: int) -> dict:
    return {"hints": OrderHints(zone=number, zone_name=f"zone {number}")}


def sequence_of(site: Site) -> tuple[list[str], ErectionSequence]:
    contacts = Contacts(site)
    sequence = Sequencer(site, precedence(site, contacts), contacts).lowest_first()
    return [site.components[i].id for i in sequence.order], sequence


@pytest.mark.parametrize("more", [{}, BUILT], ids=["panels", "masonry"])
def test_a_stair_comes_before_walls_that_its_way_down_only_just_passes(more: dict) -> None:
    """The walls above stand flush on two sides of a shaft, but nowhere near the flight at its foot."""
    flight = ("flight", (2.0, 2.0, 0.0), (5.0, 3.0, 1.0), {"ifc_class": "IfcStairFlight", **zone(1)})
    south = ("south", (1.0, 1.5, 2.0), (6.0, 2.0, 5.0), more | zone(0))
    east = ("east", (5.0, 2.0, 2.0), (5.5, 4.0, 5.0), more | zone(0))
    under = [("pier", (1.0, 1.5, 0.0), (1.5, 2.0, 1.98), zone(0)), ("post", (5.0, 3.5, 0.0), (5.5, 4.0, 1.98), zone(0))]
    site = box_site([south, east, flight, *under], crane=test_crane(base=(9.0, 9.0, 0.0)))
    order, _ = sequence_of(site)
    assert order.index("flight") < min(order.index("south"), order.index("east"))
    plan = plan_lifts(site, prepare(site))
    assert {lift.status for lift in plan.lifts} <= {Status.PLANNED, Status.BUILT}
    assert verify_plan(plan).verified


def test_a_stair_stands_in_a_shaft_of_flush_walls_before_the_slab_closes_it() -> None:
    walls = [
        ("west", (1.5, 1.5, 0.0), (2.0, 3.5, 2.98), BUILT | zone(0)),
        ("east", (5.0, 1.5, 0.0), (5.5, 3.5, 2.98), BUILT | zone(0)),
        ("south", (2.0, 1.5, 0.0), (5.0, 2.0, 2.98), BUILT | zone(0)),
    ]
    slab = ("slab", (1.5, 1.5, 3.0), (5.5, 3.5, 3.3), {"ifc_class": "IfcSlab", **CAST, **zone(0)})
    flight = ("flight", (2.0, 2.0, 0.0), (5.0, 3.0, 2.5), {"ifc_class": "IfcStair", **zone(1)})
    site = box_site([slab, *walls, flight], crane=test_crane(base=(9.0, 9.0, 0.0)))
    order, _ = sequence_of(site)
    assert order.index("flight") < order.index("slab") == 4
    plan = plan_lifts(site, prepare(site))
    assert [lift.status for lift in plan.lifts].count(Status.PLANNED) == 1
    assert verify_plan(plan).verified


def test_what_is_built_in_its_place_needs_no_way_in() -> None:
    """The box of a test nearby, between walls under a slab that the site file asks for first: no crane could set it."""
    walls = [
        ("west", (0.5, 0.5, 0.0), (1.0, 3.5, 2.0)),
        ("east", (3.0, 0.5, 0.0), (3.5, 3.5, 2.0)),
        ("south", (1.0, 0.5, 0.0), (3.0, 1.0, 2.0)),
        ("north", (1.0, 3.0, 0.0), (3.0, 3.5, 2.0)),
    ]
    slab = ("slab", (0.5, 0.5, 2.0), (3.5, 3.5, 2.2))
    order, sequence = sequence_of(
        box_site([*walls, slab, ("box", (1.5, 1.5, 0.0), (2.5, 2.5, 1.5), {"after": ("slab",), **BUILT})])
    )
    assert order[-2:] == ["slab", "box"]
    assert not sequence.notes


@pytest.mark.parametrize("top_m", [3.05, 3.1, 3.2, 3.3])
@pytest.mark.parametrize("into_m", [0.05, 0.1, 0.25])
def test_a_slab_drawn_into_the_walls_under_it_comes_after_them(top_m: float, into_m: float) -> None:
    """Whatever is shorter, the way out of the clash to the side or up."""
    walls = [
        ("west", (1.0, 1.0, 0.0), (1.3, 5.0, top_m), zone(1)),
        ("east", (5.0, 1.0, 0.0), (5.3, 5.0, top_m), zone(1)),
    ]
    slab = ("slab", (1.3 - into_m, 1.0, 3.0), (5.0 + into_m, 5.0, 3.2), zone(0))
    order, _ = sequence_of(box_site([slab, *walls]))
    assert order == ["west", "east", "slab"]


@pytest.mark.parametrize(
    ("low_m", "high_m", "more"),
    [
        ((1.0, 1.0, 3.0), (4.0, 4.0, 3.06), CAST),  # a plank in the full depth of the floor
        ((1.0, 1.0, 3.0), (1.3, 4.0, 3.4), CAST),  # a beam in it
        ((2.0, 2.0, 2.95), (2.2, 5.0, 3.05), BUILT),
    ],
)
def test_what_is_cast_or_built_around_a_part_comes_after_it(low_m: tuple, high_m: tuple, more: dict) -> None:
    around = ("around", (0.5, 0.5, 3.0), (5.5, 5.5, 3.3), {"ifc_class": "IfcSlab", **more})
    piers = [(f"pier-{n}", (x, 0.5, 0.0), (x + 0.5, 5.5, low_m[2])) for n, x in enumerate((0.5, 4.5))]
    site = box_site([around, *piers, ("part", low_m, high_m)], crane=test_crane(base=(9.0, 9.0, 0.0)))
    order, _ = sequence_of(site)
    assert order.index("part") < order.index("around")
    plan = plan_lifts(site, prepare(site))
    assert [lift.status for lift in plan.lifts].count(Status.PLANNED) == 3
    assert verify_plan(plan).verified


SLAB = {"ifc_class": "IfcSlab"}
PLANKS = [(f"plank {n}", (1.0, 1.0 + 1.5 * n, 3.0), (5.0, 2.0 + 1.5 * n, 3.2), SLAB) for n in range(2)]
PIERS = [(f"pier {n}", (x, 1.0, 0.0), (x + 0.5, 3.5, 3.0)) for n, x in enumerate((1.0, 4.5))]


@pytest.mark.parametrize(
    ("low_m", "high_m", "more"),
    [
        ((1.0, 2.0, 3.0), (5.0, 2.5, 3.2), SLAB),  # the joint between them
        ((1.0, 2.0, 2.98), (5.0, 2.5, 3.2), SLAB),  # a little deeper, as pours are drawn
        ((1.0, 2.02, 3.05), (5.0, 2.48, 3.3), SLAB),  # with a gap, and an upstand
        ((0.5, 0.5, 3.0), (1.0, 4.0, 3.2), {"ifc_class": "IfcBeam"}),  # a tie beam along their ends
        ((1.0, 1.0, 3.2), (5.0, 3.5, 3.26), SLAB),  # the topping on them
    ],
)
def test_what_is_cast_beside_or_over_planks_comes_after_them(low_m: tuple, high_m: tuple, more: dict) -> None:
    site = box_site([("cast", low_m, high_m, more | CAST | zone(0)), *PIERS, *PLANKS])
    order, sequence = sequence_of(site)
    assert order[-1] == "cast"
    assert not sequence.unheld


@pytest.mark.parametrize(
    ("low_m", "high_m", "more"),
    [
        ((1.0, 2.0, 2.5), (5.0, 2.5, 3.2), {"ifc_class": "IfcBeam"}),  # a beam that may carry them
        ((1.0, 2.0, 0.0), (5.0, 2.5, 3.2), {"ifc_class": "IfcWall"}),
        ((1.0, 2.2, 3.0), (5.0, 2.3, 3.2), SLAB),  # too far away for a joint
    ],
)
def test_what_is_cast_deeper_or_apart_does_not_wait_for_planks(low_m: tuple, high_m: tuple, more: dict) -> None:
    site = box_site([("cast", low_m, high_m, more | CAST | zone(0)), *PIERS, *PLANKS])
    assert not any(0 in later for later in precedence(site, Contacts(site)).yields)


def test_a_plank_that_rests_on_what_is_cast_beside_it_comes_after_it() -> None:
    """On the ledge of a beam that is no deeper than the joint under the plank."""
    ledge, upstand = ((0.5, 1.0, 2.96), (1.2, 2.0, 3.0)), ((0.5, 1.0, 2.96), (1.0, 2.0, 3.2))
    beam = ("beam", (0.5, 1.0, 2.96), (1.2, 2.0, 3.2), {"ifc_class": "IfcBeam"} | CAST)
    site = box_site([*PLANKS[:1], *PIERS, beam])
    shaped = replace(site.components[3], mesh=TriangleMesh.joined([box_mesh(*box) for box in (ledge, upstand)]))
    site = replace(site, components=(*site.components[:3], shaped))
    order, _ = sequence_of(site)
    assert order.index("beam") < order.index("plank 0")


def test_a_panel_that_stands_in_a_slab_cast_below_it_comes_after_the_slab() -> None:
    slab = ("slab", (0.5, 0.5, 3.0), (5.5, 5.5, 3.3), {"ifc_class": "IfcSlab", **CAST})
    site = box_site([("panel", (1.0, 1.0, 3.2), (4.0, 1.2, 5.0)), ("pier", (0.5, 0.5, 0.0), (5.5, 5.5, 3.0)), slab])
    assert sequence_of(site)[0] == ["pier", "slab", "panel"]


def test_a_panel_drawn_into_the_edge_of_a_slab_does_not_carry_it() -> None:
    """Its foot is a little lower than the slab."""
    post = ("post", (1.0, 1.0, 0.0), (1.3, 1.3, 2.98), zone(0))
    slab = ("slab", (1.0, 1.0, 3.0), (5.0, 5.0, 3.2), zone(0))
    panel = ("panel", (4.95, 1.0, 2.8), (5.2, 5.0, 6.0), zone(1))
    order, _ = sequence_of(box_site([panel, slab, post]))
    assert order == ["post", "slab", "panel"]


def test_of_interlocked_parts_the_one_that_blocks_the_most_others_is_set_last() -> None:
    """A bracket holds a slab from above and from below; posts that do not reach the slab stand on the bracket."""
    boxes = [((0.5, 0.5, 0.0), (6.5, 6.5, 0.2)), ((0.5, 0.5, 0.2), (1.0, 6.5, 3.6)), ((1.0, 0.5, 3.4), (2.0, 6.5, 3.6))]
    parts = [
        ("bracket", (0.5, 0.5, 0.0), (6.5, 6.5, 3.6)),
        *((f"post {n}", (x, y, 0.2), (x + 0.4, y + 0.4, 2.7))
          for n, (x, y) in enumerate([(3.0, 2.0), (3.0, 4.0), (4.0, 2.0), (4.0, 4.0)])),
        ("slab", (1.0, 0.5, 3.0), (6.5, 6.5, 3.2)),
        ("parapet", (6.0, 0.5, 3.2), (6.5, 6.5, 4.0)),
    ]  # fmt: skip
    site = box_site(parts, voxel_size_m=0.1, shape=(200, 100, 80), yard=((80, 0), (200, 100)))
    bracket = replace(site.components[0], mesh=TriangleMesh.joined([box_mesh(*box) for box in boxes]))
    order, sequence = sequence_of(replace(site, components=(bracket, *site.components[1:])))
    assert order[0] == "bracket"
    assert order[-2:] == ["slab", "parapet"]
    assert "interlocked" in sequence.notes[-1]
