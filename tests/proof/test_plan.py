"""The verifier on plans of the planner, and on plans with deliberate faults."""

import dataclasses

import numpy as np
import pytest
from box_sites import PORTAL, box_cells, box_mesh, box_site, test_crane

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.proof.site_rules import check_wind
from bimvox.records.lift import ModelledClash, Status
from bimvox.records.proof import Check
from bimvox.site.parts import sail_area_m2
from bimvox.site.site import Blocker, Rules


@pytest.fixture(scope="module")
def plan():
    site = box_site(PORTAL, crane=test_crane(base=(8.0, 8.0, 0.0)))
    return plan_lifts(site, prepare(site))


def spoiled(plan, name, **changes):
    lifts = [
        dataclasses.replace(lift, **changes) if plan.site.components[lift.component].id == name else lift
        for lift in plan.lifts
    ]
    return dataclasses.replace(plan, lifts=tuple(lifts))


def failed(plan):
    return {check.name for check in verify_plan(plan).checks if not check.passed}


def lift_of(plan, name):
    return next(lift for lift in plan.lifts if plan.site.components[lift.component].id == name)


def test_a_good_plan_is_proven_and_every_check_looked_at_something(plan):
    result = verify_plan(plan)
    assert result.verified, result.failures
    assert all(check.samples for check in result.checks)


def test_a_path_through_a_wall_is_caught(plan):
    path = lift_of(plan, "beam").path_vox
    middle = plan.site.frame.corner_of(path[len(path) // 2])
    wall = Blocker("wall", "obstruction", box_cells(plan.site.frame, middle, middle + 0.5))
    walled = dataclasses.replace(plan, site=dataclasses.replace(plan.site, blockers=(*plan.site.blockers, wall)))
    assert "cells" in failed(walled)
    assert any("wall" in f for f in verify_plan(walled).failures)


def test_two_lifts_swapped_are_caught(plan):
    beam, left = lift_of(plan, "beam"), lift_of(plan, "left")
    swapped = spoiled(spoiled(plan, "beam", order=left.order), "left", order=beam.order)
    assert failed(swapped) & {"support", "cells", "rope"}


def test_a_jump_is_caught(plan):
    path = lift_of(plan, "left").path_vox
    assert "unit_moves" in failed(spoiled(plan, "left", path_vox=np.delete(path, 3, axis=0)))


def test_a_diagonal_move_is_caught(plan):
    path = lift_of(plan, "left").path_vox.copy()
    turn = next(n for n in range(1, len(path) - 1) if np.abs(path[n + 1] - path[n - 1]).max() == 1)
    assert "unit_moves" in failed(spoiled(plan, "left", path_vox=np.delete(path, turn, axis=0)))


@pytest.mark.parametrize("shift", [(1, 0, 0), (0, 1, 0), (0, 0, -1)])
def test_a_shifted_path_is_caught(plan, shift):
    path = lift_of(plan, "slab").path_vox + np.array(shift, np.int32)
    assert failed(spoiled(plan, "slab", path_vox=path))


def test_a_target_shifted_by_one_cell_is_caught(plan):
    site = plan.site
    moved = dataclasses.replace(site.components[2], target_vox=tuple(np.add(site.components[2].target_vox, (1, 0, 0))))
    components = (*site.components[:2], moved, *site.components[3:])
    assert "unit_moves" in failed(dataclasses.replace(plan, site=dataclasses.replace(site, components=components)))


def test_a_part_stored_turned_otherwise_is_caught(plan):
    lift = lift_of(plan, "beam")
    place = dataclasses.replace(lift.place, shape=plan.site.components[2].shape)
    assert "yard" in failed(spoiled(plan, "beam", place=place))


def test_a_part_stored_outside_the_yard_is_caught(plan):
    lift = lift_of(plan, "beam")
    assert "yard" in failed(spoiled(plan, "beam", place=dataclasses.replace(lift.place, cell_vox=(0, 20, 1))))


def test_two_parts_stored_in_one_place_are_caught(plan):
    place = lift_of(plan, "left").place
    assert "yard" in failed(spoiled(plan, "right", place=place))


def test_leaving_the_site_is_caught(plan):
    lift = lift_of(plan, "slab")
    path = np.concatenate([lift.path_vox[:1], lift.path_vox[:1] + np.array([[0, -40, 0]], np.int32), lift.path_vox[1:]])
    assert "boundary" in failed(spoiled(plan, "slab", path_vox=path))


def test_a_missing_lift_is_caught(plan):
    assert "complete" in failed(dataclasses.replace(plan, lifts=plan.lifts[:-1]))


def test_resting_on_an_unplaced_part_is_caught(plan):
    broken = spoiled(plan, "left", status=Status.INFEASIBLE, path_vox=None, method=None, reason="made so")
    assert "support" in failed(broken)


def test_a_roof_over_the_rope_is_caught(plan):
    target = np.add(plan.site.components[2].target_vox, (0, 0, 10))
    corner = plan.site.frame.corner_of(target)
    roof = Blocker("roof", "obstruction", box_cells(plan.site.frame, corner - 0.6, corner + 0.6))
    roofed = dataclasses.replace(plan, site=dataclasses.replace(plan.site, blockers=(*plan.site.blockers, roof)))
    assert "rope" in failed(roofed)


def test_a_crane_too_weak_or_too_short_is_caught(plan):
    crane = plan.site.cranes[0]
    weak = dataclasses.replace(crane, chart=dataclasses.replace(crane.chart, capacity_kg=(900.0, 900.0, 900.0)))
    assert "reach" in failed(dataclasses.replace(plan, site=dataclasses.replace(plan.site, cranes=(weak,))))
    short = dataclasses.replace(crane, jib_length_m=5.0)
    assert "reach" in failed(dataclasses.replace(plan, site=dataclasses.replace(plan.site, cranes=(short,))))


def test_a_hook_over_a_prohibited_zone_is_caught(plan):
    path = lift_of(plan, "slab").path_vox
    zone = np.zeros(plan.site.shape[:2], bool)
    zone[tuple((path[len(path) // 2] + np.array(plan.site.components[0].hook_offset_vox))[:2])] = True
    assert "reach" in failed(dataclasses.replace(plan, site=dataclasses.replace(plan.site, prohibited=zone)))


def test_an_extract_is_proven_with_the_lifts_that_it_leaves_out_as_context(plan):
    slab = lift_of(plan, "slab")
    context = [dataclasses.replace(lift, path_vox=None) for lift in plan.lifts if lift is not slab]
    extract = dataclasses.replace(plan, lifts=(slab,))
    assert verify_plan(extract, context).verified
    assert "complete" in failed(extract)
    unplaced = [dataclasses.replace(lift, status=Status.INFEASIBLE, reason="made so") for lift in context]
    assert "support" in {check.name for check in verify_plan(extract, unplaced).checks if not check.passed}


def test_parts_pushed_into_each_other_are_caught_by_their_triangles():
    """The cells are the same in both cases; only the true surfaces distinguish 80 mm from a joint of 20 mm."""
    parts = [
        ("beam", (1.0, 1.4, 2.9), (5.0, 1.6, 3.3)),
        ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.88)),
        ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.88)),
    ]
    site = box_site(parts)
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    assert lift_of(plan, "beam").contact_moves
    longer = dataclasses.replace(site.components[1], mesh=box_mesh((1.0, 1.4, 0.0), (1.2, 1.6, 2.98)))
    components = (site.components[0], longer, site.components[2])
    pushed = dataclasses.replace(plan, site=dataclasses.replace(site, components=components))
    assert failed(pushed) == {"triangles", "support"} or failed(pushed) == {"triangles"}


def test_a_surface_outside_its_cells_is_caught(plan):
    site = plan.site
    longer = dataclasses.replace(site.components[2], mesh=box_mesh((1.0, 1.4, 0.0), (1.2, 1.6, 3.3)))
    components = (*site.components[:2], longer, site.components[3])
    wrong, known = dataclasses.replace(plan, site=dataclasses.replace(site, components=components)), set()
    for _ in range(2):
        checks = {check.name: check for check in verify_plan(wrong, known_shapes=known).checks}
        assert checks["shapes"].culprits == {longer.id}, "also when it is looked at again"
    assert known == {0, 1, 3}


def test_a_false_clash_is_caught():
    """Listing a pair as a modelled clash excuses it only if the model has that clash."""
    site = box_site([("a", (1.0, 1.0, 0.0), (2.1, 2.0, 1.0)), ("b", (2.095, 1.0, 0.0), (3.0, 2.0, 1.0))])
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    excused = dataclasses.replace(plan, clashes=(ModelledClash("a", "b", 0.1, (-0.1, 0.0, 0.0)),))
    assert "triangles" in failed(excused)


def test_parts_drawn_into_each_other_are_proven_as_deep_as_drawn():
    site = box_site([("beam", (1.0, 1.4, 2.9), (5.0, 1.6, 3.3)), ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.94))])
    plan = plan_lifts(site, prepare(site))
    assert [c.depth_m for c in plan.clashes] == [pytest.approx(0.04, abs=0.002)]
    assert verify_plan(plan).verified, verify_plan(plan).failures
    assert "triangles" in failed(dataclasses.replace(plan, clashes=()))


def test_a_part_that_holds_on_to_nothing_yet_is_caught():
    """A panel next to a column, set before it: nothing carries it, so only what holds it matters."""
    site = box_site([("panel", (2.0, 1.0, 1.0), (2.2, 3.0, 2.0)), ("column", (1.0, 1.0, 0.0), (2.0, 2.0, 3.0))])
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    column, panel = plan.lifts
    swapped = (dataclasses.replace(panel, order=0), dataclasses.replace(column, order=1))
    proof = verify_plan(dataclasses.replace(plan, lifts=swapped))
    assert any("panel: has no hold until column is set" in failure for failure in proof.failures)
    assert "panel" in proof.culprits


def test_what_floats_in_the_finished_building_is_accepted():
    site = box_site([("cloud", (2.0, 1.0, 4.0), (3.0, 3.0, 5.0)), ("beside", (3.0, 1.0, 4.0), (4.0, 3.0, 5.0))])
    assert verify_plan(plan_lifts(site, prepare(site))).verified


@pytest.mark.parametrize("at_m", [1.0, 4.0, 7.3, 13.35])
def test_the_outline_of_a_part_is_its_sail_area_wherever_it_stands(at_m):
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = box_site([("cube", (at_m, 4.0, 0.0), (at_m + 1.0, 5.0, 1.0))], crane=crane, rules=Rules(wind_speed_m_s=5.0))
    (cube,) = site.components
    check = Check("wind")
    check_wind(check, site, crane, dataclasses.replace(cube, sail_area_m2=sail_area_m2(cube.mesh)))
    assert check.passed, check.failures
    check_wind(check, site, crane, dataclasses.replace(cube, sail_area_m2=0.999 * sail_area_m2(cube.mesh)))
    assert "shows the wind 1.414 m2, not 1.413 m2" in check.failures[0]
