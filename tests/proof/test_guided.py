"""Loads that turn with the jib are free at every heading, and a crew turns them to their final one in time."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import box_cells
from planned_sites import failures, planned
from turning_sites import BESIDE_THE_PORTAL, turning_site

from bimvox.proof.guided import cells_at_any_heading
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.site.collision import turning_shape
from bimvox.site.site import Blocker, HeadingRule

BEAM = 2  # its lift


@pytest.fixture(scope="module", params=[0.0, 2.0])
def turned(request: pytest.FixtureRequest) -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    return planned(turning_site(transit_clearance_m=request.param))


def with_motion(motions: tuple[LiftMotion, ...], order: int, **changes) -> tuple[LiftMotion, ...]:
    return tuple(dataclasses.replace(m, **changes) if m.order == order else m for m in motions)


def with_lift(plan: LiftPlan, order: int, **changes) -> LiftPlan:
    lifts = tuple(dataclasses.replace(lift, **changes) if lift.order == order else lift for lift in plan.lifts)
    return dataclasses.replace(plan, lifts=lifts)


def said(plan: LiftPlan, motions: tuple[LiftMotion, ...]) -> str:
    failed = [*verify_plan(plan).failures, *verify_motions(plan, motions).failures]
    return "\n".join(failed)


def test_every_load_turns_and_is_proven(turned):
    plan, motions = turned
    assert [lift.with_jib for lift in plan.lifts] == [True] * 4
    assert said(plan, motions) == ""


def test_each_lift_saves_the_tag_lines_and_takes_the_turn(turned):
    plan, motions = turned
    _, kept = planned(turning_site(HeadingRule.KEPT, transit_clearance_m=plan.site.rules.transit_clearance_m))
    for motion, before in zip(motions, kept, strict=True):
        crew = {
            name: sum(p.end_ns - p.start_ns for p in motion.phases if p.name is name) / 1e9
            - sum(p.end_ns - p.start_ns for p in before.phases if p.name is name) / 1e9
            for name in (PhaseName.HOOK_ON, PhaseName.RELEASE, PhaseName.TURN)
        }
        turned_rad = abs(motion.loaded.slew_rad[-1] - motion.loaded.slew_rad[0])
        assert crew[PhaseName.HOOK_ON] == crew[PhaseName.RELEASE] == -30.0
        assert crew[PhaseName.TURN] == pytest.approx(turned_rad / (np.pi / 2) * 30.0, abs=1e-6)
    assert motions[-1].end_ns < kept[-1].end_ns - 100e9


def test_a_beam_without_room_keeps_its_heading_by_tag_line():
    plan, motions = planned(turning_site(obstructions=BESIDE_THE_PORTAL))
    names = {plan.site.components[lift.component].id: lift for lift in plan.lifts}
    assert not names["beam"].with_jib
    assert names["left"].with_jib
    assert said(plan, motions) == ""
    hooked = next(p for p in motions[names["beam"].order].phases if p.name is PhaseName.HOOK_ON)
    assert hooked.end_ns - hooked.start_ns == 150e9


def test_the_planner_and_the_proof_count_the_same_cells():
    for component in turning_site().components:
        own = {tuple(cell) for cell in cells_at_any_heading(component).tolist()}
        assert {tuple(cell) for cell in component.shape.cells.tolist()} <= own
        low = turning_shape(component).boxes[:, :3].min(axis=0)
        dense = np.zeros(turning_shape(component).boxes[:, 3:].max(axis=0) - low, np.int64)
        for x0, y0, z0, x1, y1, z1 in (turning_shape(component).boxes - np.tile(low, 2)).tolist():
            dense[x0:x1, y0:y1, z0:z1] += 1
        assert dense.max() == 1
        covered = {tuple(cell) for cell in (np.argwhere(dense) + low).tolist()}
        assert own <= covered
        assert own == {tuple(cell) for cell in turning_shape(component).cells.tolist()}


def test_every_corner_of_a_turned_part_is_in_the_cells():
    for component in turning_site().components:
        size_m, low = 0.5, np.array(component.target_vox)
        corners = component.mesh.vertices_m / size_m - low + (0.0, 0.0, 1.0)
        axis = np.array(component.hook_line_vox[:2]) + 0.5
        own = {tuple(cell) for cell in cells_at_any_heading(component).tolist()}
        for angle in np.linspace(0.0, 2.0 * np.pi, 97):
            cos, sin = np.cos(angle), np.sin(angle)
            x, y = (corners[:, :2] - axis).T
            at = np.column_stack([cos * x - sin * y, sin * x + cos * y]) + axis
            height = np.clip(corners[:, 2], 0.0, component.shape.size_vox[2] - 1e-6)
            inside = np.floor(np.column_stack([at, height])).astype(int)
            assert {tuple(cell) for cell in inside.tolist()} <= own


# Forged.


def test_the_rules_must_ask_for_it(turned):
    plan, motions = turned
    rules = dataclasses.replace(plan.site.rules, heading=HeadingRule.KEPT)
    assert "unit_moves" in failures(plan, motions, rules=rules)


def test_a_load_of_which_tag_lines_keep_the_heading_is_not_turned(turned):
    plan, motions = turned
    assert "its load is turned on its way, but tag lines keep its heading" in said(
        with_lift(plan, BEAM, with_jib=False), motions
    )


def test_a_load_that_kept_its_heading_did_not_turn_with_the_jib(turned):
    plan, _ = turned
    kept, motions = planned(turning_site(HeadingRule.KEPT, transit_clearance_m=plan.site.rules.transit_clearance_m))
    kept = dataclasses.replace(kept, site=plan.site)
    assert "its load arrives" in said(with_lift(kept, BEAM, with_jib=True), motions)


def test_the_turn_takes_its_time(turned):
    plan, motions = turned
    phases = [
        dataclasses.replace(phase, end_ns=phase.end_ns - 10**9) if phase.name is PhaseName.TURN else phase
        for phase in motions[BEAM].phases
    ]
    assert "degrees in 1" in said(plan, with_motion(motions, BEAM, phases=tuple(phases)))


def test_the_hook_is_still_while_the_load_is_turned(turned):
    plan, motions = turned
    start_ns, end_ns = motions[BEAM].turned_ns
    loaded = motions[BEAM].loaded
    at = np.flatnonzero(loaded.time_ns + motions[BEAM].start_ns == end_ns)
    assert len(at) == 1
    assert start_ns in loaded.time_ns + motions[BEAM].start_ns
    slew = loaded.slew_rad.copy()
    slew[at] += 1e-3
    other = dataclasses.replace(loaded, slew_rad=slew)
    assert "its hook moves while its load is turned" in said(plan, with_motion(motions, BEAM, loaded=other))


def test_it_is_turned_above_its_place(turned):
    plan, motions = turned
    lift = plan.lifts[BEAM]
    assert "where its last moves begin" in said(with_lift(plan, BEAM, contact_moves=lift.contact_moves + 1), motions)


def test_it_is_turned_once(turned):
    plan, motions = turned
    phases = list(motions[BEAM].phases)
    n = next(i for i, phase in enumerate(phases) if phase.name is PhaseName.TURN)
    middle_ns = (phases[n].start_ns + phases[n].end_ns) // 2
    first = Phase(PhaseName.TURN, phases[n].start_ns, middle_ns)
    phases[n : n + 1] = [first, Phase(PhaseName.TURN, middle_ns, phases[n].end_ns)]
    assert "is turned to its final heading 2 times" in said(plan, with_motion(motions, BEAM, phases=tuple(phases)))


def test_no_obstruction_may_be_where_only_the_turned_beam_comes(turned):
    plan, motions = turned
    _, low, high = BESIDE_THE_PORTAL[0]
    cells = box_cells(plan.site.frame, low, high)
    top = cells[:, 2] <= plan.lifts[BEAM].last_moves_vox[0, 2]
    tower = Blocker("tower", "obstruction", cells[top])
    found = failures(plan, motions, blockers=(*plan.site.blockers, tower))
    assert {"cells", "motion_cells"} <= found


def test_a_longer_last_move_does_not_excuse_the_turning(turned):
    """Up to the turn the load is at any heading, also within the box of its last moves."""
    plan, motions = turned
    lift, loaded = plan.lifts[BEAM], motions[BEAM].loaded
    assert isinstance(loaded, Trajectory)
    _, low, high = BESIDE_THE_PORTAL[0]
    cells = box_cells(plan.site.frame, low, high)
    at = cells[cells[:, 2] == lift.last_moves_vox[0, 2]]
    found = failures(plan, motions, blockers=(*plan.site.blockers, Blocker("there", "obstruction", at)))
    assert "motion_cells" in found
