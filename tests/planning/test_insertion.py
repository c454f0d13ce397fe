import dataclasses

import numpy as np
from box_sites import box_cells, box_mesh, box_site, test_crane

from bimvox.bim.building import TriangleMesh
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.site import Blocker

CASE = [  # a case with a lid over one half; a part fits on the bottom under the lid
    ("floor", (3.0, 3.0, 0.0), (9.0, 6.0, 0.4)),
    ("west", (3.0, 3.0, 0.42), (3.5, 6.0, 3.0)),
    ("east", (8.5, 3.0, 0.42), (9.0, 6.0, 3.0)),
    ("south", (3.5, 3.0, 0.42), (8.5, 3.5, 3.0)),
    ("north", (3.5, 5.5, 0.42), (8.5, 6.0, 3.0)),
]


def only_lift(parts, structure):
    site = box_site(parts, structure=structure)
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    return plan.lifts[0]


def test_a_room_with_a_hole_in_its_lid_is_left_through_the_hole():
    """A part that is free by cells near its place, but can only leave through the open half."""
    lid = ("lid", (3.0, 3.0, 3.02), (6.2, 6.0, 3.4))
    lift = only_lift([("insert", (3.6, 4.0, 0.42), (5.0, 5.0, 1.4))], [*CASE, lid])
    assert lift.status is Status.PLANNED
    assert lift.path_vox[:, 0].max() > 12  # it is inserted through the open half


def joined(frame, name, *boxes):
    """Return one piece of structure made of several boxes."""
    meshes = [box_mesh(low, high) for low, high in boxes]
    vertices = np.concatenate([mesh.vertices_m for mesh in meshes])
    faces = np.concatenate([mesh.faces + 8 * n for n, mesh in enumerate(meshes)])
    cells = np.unique(np.concatenate([box_cells(frame, low, high) for low, high in boxes]), axis=0)
    return Blocker(name, "structure", cells, TriangleMesh(vertices, faces))


def test_a_pocket_closed_by_cells_is_left_along_true_surfaces():
    """A pit, wide above the part, whose rim leaves 25 mm: blocked by cells, free by triangles."""
    site = box_site([("insert", (4.25, 4.25, 0.0), (5.75, 5.75, 0.9))])
    sides = {
        "west": [((3.0, 3.0, 0.0), (4.0, 7.0, 4.0)), ((4.0, 3.0, 3.0), (4.225, 7.0, 4.0))],
        "east": [((6.0, 3.0, 0.0), (7.0, 7.0, 4.0)), ((5.775, 3.0, 3.0), (6.0, 7.0, 4.0))],
        "south": [((4.0, 3.0, 0.0), (6.0, 4.0, 4.0)), ((4.0, 4.0, 3.0), (6.0, 4.225, 4.0))],
        "north": [((4.0, 6.0, 0.0), (6.0, 7.0, 4.0)), ((4.0, 5.775, 3.0), (6.0, 6.0, 4.0))],
    }
    pit = [joined(site.frame, name, *boxes) for name, boxes in sides.items()]
    site = dataclasses.replace(site, blockers=(*site.blockers, *pit))
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    assert plan.lifts[0].status is Status.PLANNED
    assert plan.lifts[0].contact_moves >= 8  # from the rim down, through the free space below it


def test_a_closed_room_is_named_by_its_walls():
    lid = ("lid", (3.0, 3.0, 3.02), (9.0, 6.0, 3.4))
    lift = only_lift([("insert", (3.6, 4.0, 0.42), (5.0, 5.0, 1.4))], [*CASE, lid])
    assert lift.status is Status.INFEASIBLE
    assert "lid" in lift.blocked_by


OPENING = 0.15  # clearance on every side of the part, metres
PART = ("insert", (4.1, 4.1, 0.0), (5.1, 5.1, 0.9))


def slab_with_an_opening(east=OPENING):
    """Return four pieces high above the part's place that do not touch it: blocked by cells of half a metre."""
    low, high = 4.1 - OPENING, 5.1 + OPENING
    return [
        ("west", (1.0, 1.0, 4.0), (low, 8.0, 4.5)),
        ("east", (5.1 + east, 1.0, 4.0), (8.0, 8.0, 4.5)),
        ("south", (low, 1.0, 4.0), (5.1 + east, low, 4.5)),
        ("north", (low, high, 4.0), (5.1 + east, 8.0, 4.5)),
        ("right", (8.0, 1.0, 0.0), (8.5, 8.0, 4.5)),  # no insertion from below the slab
        ("left", (0.5, 1.0, 0.0), (1.0, 8.0, 4.5)),
        ("front", (1.0, 0.5, 0.0), (8.0, 1.0, 4.5)),
        ("back", (1.0, 8.0, 0.0), (8.0, 8.5, 4.5)),
    ]


def test_a_part_passes_through_an_opening_that_cells_close():
    crane = test_crane(base=(13.0, 13.0, 0.0))
    site = box_site([PART], structure=slab_with_an_opening(), crane=crane)
    preparation = prepare(site)
    rim = {"west", "east", "south", "north"}
    assert rim.isdisjoint(preparation.contacts.solids[n].id for n in preparation.contacts.neighbours[0])
    plan = plan_lifts(site, preparation)
    (lift,) = plan.lifts
    assert lift.status is Status.PLANNED, lift.reason
    assert lift.contact_moves >= 9  # from above the slab down
    assert verify_plan(plan).verified
    motions = time_plan(plan, preparation)
    found = verify_motions(plan, motions)
    assert found.verified, found.failures
    # The same plan with an opening 30 mm too narrow: both proofs find it by true triangles.
    narrow = box_site([PART], structure=slab_with_an_opening(east=-0.03), crane=crane)
    spoiled = dataclasses.replace(plan, site=narrow)
    assert any("meets east, which it passes by" in failure for failure in verify_plan(spoiled).failures)
    assert any("meets east, which it passes by" in failure for failure in verify_motions(spoiled, motions).failures)
    # If the plan does not declare these as its last moves, cells decide.
    silent = dataclasses.replace(plan, lifts=(dataclasses.replace(lift, contact_moves=0),))
    assert any(failure.startswith("cells: ") for failure in verify_plan(silent).failures)


def test_an_opening_that_is_too_narrow_is_named_at_cells_and_by_shape():
    """The tolerance of 10 mm is kept to whatever the part does not touch at its place."""
    for east in (-0.03, 0.005):
        site = box_site([PART], structure=slab_with_an_opening(east=east))
        (lift,) = plan_lifts(site, prepare(site)).lifts
        assert lift.status is Status.INFEASIBLE
        assert "cells of 0.5 m and the true shapes around" in lift.reason
        assert "east" in lift.blocked_by


def test_parts_without_triangles_are_checked_by_cells():
    site = box_site([PART], structure=slab_with_an_opening())
    plan = plan_lifts(site, prepare(site))
    assert plan.lifts[0].status is Status.PLANNED
    rim = Blocker("rim", "obstruction", box_cells(site.frame, (5.25, 1.0, 4.0), (8.0, 8.0, 4.5)))
    other = dataclasses.replace(site, blockers=(*site.blockers, rim))
    (lift,) = plan_lifts(other, prepare(other)).lifts
    assert lift.status is Status.INFEASIBLE
    assert "rim" in lift.blocked_by
    assert not verify_plan(dataclasses.replace(plan, site=other)).verified
