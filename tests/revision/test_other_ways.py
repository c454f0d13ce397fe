"""A lift that its proof refuses in a revision goes another way before it is refused, as in a first plan."""

from __future__ import annotations

from typing import Any

import pytest
from planned_sites import planned
from turning_sites import turning_site

from bimvox.library.prove import prepared
from bimvox.library.site import rasterise
from bimvox.progress import SilentProgress
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Lift, Status
from bimvox.records.proof import Check, Verification
from bimvox.revision import draft
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet

BEAM = 2  # its lift


@pytest.fixture(scope="module")
def current() -> tuple[CurrentPlan, Any]:
    site = with_digests(turning_site())
    plan, motions = planned(site)
    assert plan.lifts[BEAM].with_jib
    return current_plan_of(plan, motions), prepared(site, SilentProgress())[1]


def revised(current: tuple[CurrentPlan, Any]) -> CurrentPlan:
    """Return the plan with a box in the way of the beam."""
    site, path_vox = current[0].plan.site, current[0].plan.lifts[BEAM].path_vox
    low_m = site.frame.corner_of(path_vox[len(path_vox) // 2]) + 0.01
    box = Obstruction("box", Box(tuple(low_m), tuple(low_m + 0.48)))
    site = with_obstructions(site, ObstructionSet.of([box]), rasterise)
    return list(revise(current[0], RevisionRequest(site, current[1])))[-1].current


def refusing(monkeypatch: pytest.MonkeyPatch, name: str, says: Any) -> list[Lift]:
    """Have a proof of a part refuse the beam's lift if ``says`` does; return all its lifts that were shown to it."""
    shown: list[Lift] = []
    real = getattr(draft, name)

    def verify(plan: Any, *given: Any, **known: Any) -> Verification:
        check = Check("triangles")
        for lift in plan.lifts:
            if lift.order == BEAM:
                check.about = plan.site.components[lift.component].id
                shown.append(lift)
                check.look(not says(lift), f"{check.about}: it meets something")
        return Verification((*real(plan, *given, **known).checks, check))

    monkeypatch.setattr(draft, name, verify)
    return shown


def proven(after: CurrentPlan) -> bool:
    return verify_plan(after.plan).verified and verify_motions(after.plan, after.chain).verified


@pytest.mark.parametrize("proof", ["verify_plan_over_time", "verify_motions_over_time"])
def test_a_load_refused_while_it_turns_with_the_jib_keeps_its_heading(current, monkeypatch, proof):
    shown = refusing(monkeypatch, proof, lambda lift: lift.with_jib)
    after = revised(current)
    lift = after.plan.lifts[BEAM]
    assert [one.with_jib for one in shown] == [True, False]
    assert (lift.status, lift.with_jib) == (Status.PLANNED, False)
    assert after.plan.lifts[BEAM + 1].with_jib, "the other loads still turn"
    assert proven(after)


def test_a_load_refused_at_any_heading_too_becomes_infeasible_with_the_first_reason(current, monkeypatch):
    shown = refusing(monkeypatch, "verify_plan_over_time", lambda lift: True)
    after = revised(current)
    lift = after.plan.lifts[BEAM]
    assert lift.status is Status.INFEASIBLE
    assert lift.reason.startswith("its lift could not be proven: triangles: ")
    last_moves = {tuple(map(tuple, one.last_moves_vox.tolist())) for one in shown[1:]}
    assert len(last_moves) == len(shown) - 1 > 1, "each way was another one"
    assert proven(after)
