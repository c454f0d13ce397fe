import fcl
import numpy as np
import pytest
from box_sites import box_mesh, box_site

from bimvox.bim.building import TriangleMesh
from bimvox.proof.bodies import triangles as triangle_check
from bimvox.proof.bodies.triangles import TriangleCheck, boxes_along
from bimvox.records.lift import Guide, LiftPlan, ModelledClash
from bimvox.records.proof import Check

PARTS = [
    ("below", (1.0, 1.0, 0.0), (2.0, 3.0, 1.0)),
    ("above", (1.0, 1.0, 1.0), (2.0, 3.0, 2.0)),
    ("aside", (1.95, 1.0, 0.0), (3.0, 3.0, 2.0)),
]


@pytest.fixture(scope="module")
def plan():
    clashes = tuple(ModelledClash(name, "aside", 0.05, (-0.05, 0.0, 0.0)) for name in ("below", "above"))
    return LiftPlan(box_site(PARTS), (), clashes)


def ways(rng):
    """Paths to its place and across it, in every direction."""
    for _ in range(40):
        from_m, to_m = rng.normal(0.0, 0.6, 3) * rng.integers(0, 2, 3), rng.normal(0.0, 0.2, 3) * rng.integers(0, 2, 3)
        yield np.array([from_m, to_m, (0.0, 0.0, 0.0)])


def found(plan, moving, other):
    check, triangles = Check("triangles"), TriangleCheck(plan)
    for way in ways(np.random.default_rng(0)):
        triangles.check_way(check, plan.site.components[moving], way, other)
        triangles.check_apart(check, plan.site.components[moving], way, other)
    return check


@pytest.mark.parametrize(("moving", "other"), [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)])
def test_boxes_that_are_apart_agree_with_the_collision_library(plan, monkeypatch, moving, other):
    quick = found(plan, moving, other)
    assert 0 < quick.failed < quick.samples
    monkeypatch.setattr(triangle_check, "_ROUNDING_M", 1e9)
    assert found(plan, moving, other) == quick


def test_what_carries_a_part_does_not_depend_on_which_triangles_are_left_out(monkeypatch):
    """Columns of several heights, walls, a gap, a part drawn into its support: as with all triangles of all parts."""
    boxes = [("slab", (1.0, 1.0, 1.0), (4.0, 4.0, 1.3)), ("deep", (1.0, 1.0, 0.0), (1.4, 1.4, 1.02))]
    boxes += [("touching", (2.0, 2.0, 0.0), (2.4, 2.4, 1.0)), ("low", (3.0, 3.0, 0.0), (3.4, 3.4, 0.96))]
    boxes += [("aside", (4.0, 1.0, 0.0), (4.4, 4.0, 1.0)), ("over", (2.0, 2.0, 1.3), (2.4, 2.4, 2.0))]
    boxes += [("lower", (2.0, 1.0, 0.0), (2.4, 1.4, 0.5))]
    site = box_site(boxes)
    plan = LiftPlan(site, ())

    def carried():
        triangles = TriangleCheck(plan)
        return {one.id: [site.components[n].id for n in triangles.carried_by(one)] for one in site.components}

    quick = carried()
    assert quick["slab"] == ["touching", "low"]
    assert quick["over"] == ["slab"]
    stray = TriangleMesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -9.0]]), np.array([[0, 1, 2]], np.int32))
    everywhere = triangle_check._object_between(stray, -1.0, 1.0)  # FCL ends the process if it gets no triangles
    assert fcl.collide(triangle_check._object_between(stray, -np.inf, -5.0), everywhere)
    monkeypatch.setattr(triangle_check, "_ROUNDING_M", 1e9)
    assert carried() == quick


def test_a_part_may_be_on_the_far_side_of_what_it_is_drawn_into(plan):
    """Its way out of one clash would lead into the other, which the check of the way out does not test there."""
    check = Check("triangles")
    beyond = np.array([[3.0, 0.0, 0.0], [2.03, 0.0, 0.0]])
    TriangleCheck(plan).check_way(check, plan.site.components[0], beyond, 2)
    assert check.passed


def test_a_rope_may_touch_the_top_of_the_part_that_it_hangs_from():
    site = box_site([("beam", (1.0, 1.0, 0.0), (4.0, 1.4, 1.0)), ("wall", (1.0, 0.8, 0.0), (4.0, 1.0, 3.0))])
    beam = site.components[0]
    triangles = TriangleCheck(LiftPlan(site, ()))
    top_m = float(beam.mesh.bounds_m[1, 2])
    foot_m = site.frame.origin_m[2] + site.frame.voxel_size_m * (beam.target_vox[2] + beam.hook_offset_vox[2])
    flush = np.array([0.0, 0.0, top_m - foot_m])
    assert triangles.rope_is_clear(beam, flush, 0)
    assert not triangles.rope_is_clear(beam, flush - (0.0, 0.0, 0.001), 0)


def test_the_box_of_a_pose_holds_the_part_in_it_and_is_no_larger_than_it_must_be():
    mesh = box_mesh((1.0, 2.0, 3.0), (6.0, 3.0, 3.2))
    guide = Guide(0.4, (3.5, 2.5, 3.1), ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    poses = np.random.default_rng(1).uniform((0.0, -0.3, -0.2), (2.0, 0.3, 0.2), (50, 3))
    for (low, high), pose in zip(boxes_along(guide, mesh, poses), poses.tolist(), strict=True):
        moved = guide.moved(mesh.vertices_m, tuple(pose))
        assert np.allclose(low, moved.min(axis=0))
        assert np.allclose(high, moved.max(axis=0))
