"""The obstructions of the past in a plan that is carried out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import test_crane
from planned_sites import planned, portal_site

from bimvox.planning.order_search import prepare
from bimvox.proof.over_time import verify_plan_over_time
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, change_between
from bimvox.revision.draft import history_after
from bimvox.site.site import Blocker

S = 10**9
CRATE = Blocker("crate", "obstruction", np.array([[35, 25, 1]], np.int32))


@pytest.fixture(scope="module")
def portal() -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    return planned(portal_site(test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=11.0)))


def changed_at(current: CurrentPlan, now_ns: int) -> LiftPlan:
    """The plan after a crate has come somewhere aside."""
    site = current.plan.site
    other = dataclasses.replace(site, blockers=(*site.blockers, CRATE))
    request = RevisionRequest(other, prepare(site), now_ns=now_ns)
    return dataclasses.replace(
        current.plan, site=other, history=history_after(current, request, change_between(site, other))
    )


def without_the_last(
    portal: tuple[LiftPlan, tuple[LiftMotion, ...]],
) -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    plan, motions = portal
    last = dataclasses.replace(
        plan.lifts[-1],
        status=Status.INFEASIBLE,
        method=None,
        path_vox=None,
        shortest_moves=None,
        contact_moves=0,
        reason="it is blocked at its place",
    )
    return dataclasses.replace(plan, lifts=(*plan.lifts[:-1], last)), motions[:-1]


def test_after_the_last_motion_nothing_changes_any_more_if_a_lift_is_infeasible(portal):
    plan, motions = without_the_last(portal)
    current = CurrentPlan(plan, {motion.order: motion for motion in motions})
    ends_ns = motions[-1].end_ns
    for now_ns, until_ns in ((ends_ns - S, ends_ns - S), (ends_ns + 3600 * S, ends_ns)):
        after = changed_at(current, now_ns)
        assert [epoch.until_ns for epoch in after.history] == [until_ns]
        proof = verify_plan_over_time(after, motions)
        assert proof.verified, proof.failures
    twice = changed_at(dataclasses.replace(current, plan=after), ends_ns + 7200 * S)
    assert [epoch.until_ns for epoch in twice.history] == [ends_ns]


def test_while_lifts_are_pending_a_change_counts_from_now(portal):
    plan, motions = portal
    current = CurrentPlan(plan, {motions[0].order: motions[0]}, pending=frozenset({1, 2, 3}))
    now_ns = motions[0].end_ns + S
    assert [epoch.until_ns for epoch in changed_at(current, now_ns).history] == [now_ns]
