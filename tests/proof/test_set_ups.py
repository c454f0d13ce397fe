"""The proof of a crane that moves, and forged plans in which it is in two places, or moves in no time."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from box_sites import box_mesh
from moving_sites import planned_row

from bimvox.library.plan_value import Plan
from bimvox.library.verify import prove_plan
from bimvox.log.plan_log import PlanLog
from bimvox.progress import SilentProgress
from bimvox.proof.set_ups import meets_stand, verify_set_ups
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.steps import Move, Steps

Forged = tuple[LiftPlan, tuple[LiftMotion, ...], Steps]


@pytest.fixture(scope="module")
def good() -> Plan:
    return planned_row()


def steps_of(plan: Plan) -> Steps:
    return plan.record.steps


def test_a_plan_with_set_ups_is_proven(good: Plan) -> None:
    check = verify_set_ups(good.record.plan, good.motions, steps_of(good))
    assert check.passed and check.samples > 20, check.failures
    verdict = prove_plan(good.record, SilentProgress())
    assert verdict.verified and "set_ups" in {one.name for one in verdict.checks}


def test_the_crane_moves_once_and_takes_its_time(good: Plan) -> None:
    steps = steps_of(good)
    (move,) = steps.moves
    moving = good.site.moving
    assert moving is not None
    assert (move.order, move.come_from, move.goes_to) == (3, 0, 1)
    assert (move.drives_ns - move.begins_ns) / 1e9 == moving.derig_s
    assert (move.arrives_ns - move.drives_ns) / 1e9 == pytest.approx(36.0, abs=1e-6)
    assert (move.ends_ns - move.arrives_ns) / 1e9 == moving.rig_s
    first = good.motions[3]
    assert first.approach is None and first.start_ns == good.motions[2].end_ns
    assert steps.starting_ns(first.start_ns) == move.ends_ns


def by(move: Move, **changes: int) -> Callable[[Steps], Steps]:
    return lambda steps: replace(steps, moves=(replace(move, **changes),))


def executed_by(plan: Plan, n: int, crane: int) -> Forged:
    motions = tuple(replace(m, crane=crane) if k == n else m for k, m in enumerate(plan.motions))
    return plan.record.plan, motions, steps_of(plan)


def early(plan: Plan) -> Forged:
    """Return a plan in which the second set-up begins before the first one is left."""
    moved = plan.motions[3]
    by_ns = 60_000_000_000
    return (
        plan.record.plan,
        (*plan.motions[:3], replace(moved, start_ns=moved.start_ns - by_ns, end_ns=moved.end_ns - by_ns)),
        replace(steps_of(plan), moves=()),
    )


def there_and_back(plan: Plan) -> Forged:
    """Return a plan in which one lift of the first set-up comes after those of the second one, without a move."""
    *first, last = plan.motions[:3]
    late = replace(last, start_ns=plan.motions[-1].end_ns, end_ns=plan.motions[-1].end_ns + last.end_ns - last.start_ns)
    return plan.record.plan, (*first, *plan.motions[3:], late), steps_of(plan)


def without_moves(plan: Plan) -> Forged:
    return plan.record.plan, plan.motions, replace(steps_of(plan), moves=())


def without_pause(plan: Plan) -> Forged:
    return plan.record.plan, plan.motions, replace(steps_of(plan), pauses=())


def short_drive(plan: Plan) -> Forged:
    (move,) = steps_of(plan).moves
    forged = replace(move, arrives_ns=move.arrives_ns - 10_000_000_000)
    return plan.record.plan, plan.motions, replace(steps_of(plan), moves=(forged,))


def short_rig(plan: Plan) -> Forged:
    (move,) = steps_of(plan).moves
    forged = replace(move, ends_ns=move.ends_ns - 60_000_000_000)
    return plan.record.plan, plan.motions, replace(steps_of(plan), moves=(forged,))


def another_place(plan: Plan) -> Forged:
    """Return a plan whose second place is 1 m from where its lifts were made."""
    site = plan.site
    x, y, z = site.cranes[1].base_m
    cranes = (site.cranes[0], replace(site.cranes[1], base_m=(x + 1.0, y, z)))
    return replace(plan.record.plan, site=replace(site, cranes=cranes)), plan.motions, steps_of(plan)


def on_a_part(plan: Plan) -> Forged:
    """Return a plan in which a part of the first set-up stands where the crane stands then."""
    site = plan.site
    part = site.components[plan.record.plan.lifts[0].component]
    x, y, _ = site.cranes[0].base_m
    moved = replace(part, mesh=box_mesh((x, y, 0.0), (x + 1.0, y + 0.2, 2.0)))
    parts = tuple(moved if one is part else one for one in site.components)
    return replace(plan.record.plan, site=replace(site, components=parts)), plan.motions, steps_of(plan)


@pytest.mark.parametrize(
    ("forge", "says"),
    [
        (lambda plan: executed_by(plan, 1, 1), "it is executed in set-up 'east', its part is lifted in 'west'"),
        (lambda plan: executed_by(plan, 1, 1), "its hook ends"),
        (early, "the crane would be in set-up 'west' and in 'east' at once"),
        (there_and_back, "against their order"),
        (there_and_back, "the crane changes its set-up before lifts [4, 3]"),
        (without_moves, "the crane changes its set-up before lifts [4], but the moves are before []"),
        (without_pause, "after that lift begins"),
        (short_drive, "to drive 30.0 m, the site file asks for"),
        (short_rig, "to rig, the site file asks for 2700.0 s"),
        (another_place, "its hook ends 1.00 m from its place"),
        (on_a_part, "it is where the crane stands in set-up 'west'"),
    ],
)
def test_a_forged_plan_is_refused_by_name(good: Plan, forge: Callable[[Plan], Forged], says: str) -> None:
    check = verify_set_ups(*forge(good))
    assert not check.passed
    assert any(says in failure for failure in check.failures), check.failures


def test_a_forged_log_is_refused_by_the_whole_proof(good: Plan) -> None:
    plan, motions, _ = executed_by(good, 1, 1)
    forged = PlanLog(plan, motions, attachments=good.record.attachments, metadata=good.record.metadata)
    verdict = prove_plan(forged, SilentProgress())
    failed = {check.name for check in verdict.checks if not check.passed}
    assert {"timeline", "set_ups"} <= failed


def test_a_crane_that_stays_has_no_moves(good: Plan) -> None:
    plan = replace(good.record.plan, site=replace(good.site, moving=None))
    check = verify_set_ups(plan, good.motions, steps_of(good))
    assert "moves of a crane that stays" in check.failures[0]


@pytest.mark.parametrize(
    ("low_m", "high_m", "meets"),
    [
        ((-1.0, -1.0, 0.0), (1.0, 1.0, 0.3), True),
        ((-1.0, -1.0, -0.3), (1.0, 1.0, 0.0), False),  # it stands on it
        ((3.6, -1.0, 0.0), (5.0, 1.0, 3.0), False),  # beside the square of 3.5 m
        ((3.4, -1.0, 0.0), (5.0, 1.0, 3.0), True),
        ((-20.0, -20.0, 0.5), (20.0, 20.0, 0.6), True),  # a plate through all of it
        ((-1.0, -1.0, 4.0), (1.0, 1.0, 5.0), False),  # above the pivot
    ],
)
def test_a_body_meets_the_carrier_or_not(good: Plan, low_m: tuple, high_m: tuple, meets: bool) -> None:
    crane = replace(good.site.cranes[0], base_m=(0.0, 0.0, 0.0))
    assert meets_stand(crane, box_mesh(low_m, high_m)) == meets


def test_outriggers_turn_with_the_carrier(good: Plan) -> None:
    crane = replace(good.site.cranes[0], base_m=(0.0, 0.0, 0.0))
    assert crane.carrier is not None
    corner = box_mesh((4.4, -0.1, 0.0), (4.6, 0.1, 1.0))
    assert not meets_stand(crane, corner)
    turned = replace(crane, carrier=replace(crane.carrier, heading_rad=0.75))
    assert meets_stand(turned, corner)
