import dataclasses

import numpy as np
from box_sites import box_cells, box_mesh, box_site

from bimvox.bim.building import TriangleMesh
from bimvox.planning.assembly import prepare
from bimvox.planning.lift import Status
from bimvox.planning.planner import plan_lifts
from bimvox.planning.verify import verify_plan
from bimvox.site.site import Blocker

CASE = [  # a case on one side of whose bottom a part fits, under a lid that leaves half of it open
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
    """Free by cells near its place, but only the way over there leads out."""
    lid = ("lid", (3.0, 3.0, 3.02), (6.2, 6.0, 3.4))
    lift = only_lift([("insert", (3.6, 4.0, 0.42), (5.0, 5.0, 1.4))], [*CASE, lid])
    assert lift.status is Status.PLANNED
    assert lift.path_vox[:, 0].max() > 12  # it comes in through the open half


def joined(frame, name, *boxes):
    """One piece of structure made of several boxes."""
    meshes = [box_mesh(low, high) for low, high in boxes]
    vertices = np.concatenate([mesh.vertices_m for mesh in meshes])
    faces = np.concatenate([mesh.faces + 8 * n for n, mesh in enumerate(meshes)])
    cells = np.unique(np.concatenate([box_cells(frame, low, high) for low, high in boxes]), axis=0)
    return Blocker(name, "structure", cells, TriangleMesh(vertices, faces))


def test_a_pocket_that_cells_close_is_left_along_true_surfaces():
    """A pit, wide above the part, with a rim that leaves 25 mm: closed by cells, open by triangles."""
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
    assert plan.lifts[0].contact_moves >= 8  # from the rim down, through the free room below it


def test_a_closed_room_is_named_by_its_walls():
    lid = ("lid", (3.0, 3.0, 3.02), (9.0, 6.0, 3.4))
    lift = only_lift([("insert", (3.6, 4.0, 0.42), (5.0, 5.0, 1.4))], [*CASE, lid])
    assert lift.status is Status.INFEASIBLE
    assert "lid" in lift.blocked_by
