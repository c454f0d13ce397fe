"""While a load is held on its hook, what rests on it is set by no means; it follows when the load is set."""

from __future__ import annotations

import pytest
from planned_sites import planned
from turning_sites import turning_site

from bimvox.library.prove import prepared
from bimvox.library.site import rasterise
from bimvox.progress import SilentProgress
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.lift import Status
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.site.site import HeadingRule

BEAM, SLAB = 2, 3  # their lifts


def proven(current: CurrentPlan) -> CurrentPlan:
    for verify in (verify_plan_over_time, verify_motions_over_time):
        proof = verify(current.plan, current.chain)
        assert proof.verified, proof.failures[:3]
    return current


@pytest.mark.parametrize("heading", HeadingRule)
def test_what_rests_on_a_held_load_waits_for_it(heading: HeadingRule) -> None:
    site = with_digests(turning_site(heading))
    plan, motions = planned(site)
    current, preparation = current_plan_of(plan, motions), prepared(site, SilentProgress())[1]
    low_m = site.components[plan.lifts[BEAM].component].mesh.bounds_m[0] + 0.01
    box = Obstruction("box", Box(tuple(low_m), tuple(low_m + 0.3)))
    motion = current.motions[BEAM]
    now_ns = motion.start_ns + int(motion.loaded.time_ns[0]) + 10**10

    blocked = with_obstructions(site, ObstructionSet.of([box]), rasterise)
    (part,) = revise(current, RevisionRequest(blocked, preparation, now_ns=now_ns))
    held = proven(part.current)
    beam, slab = (held.plan.lifts[order] for order in (BEAM, SLAB))
    assert beam.reason is not None
    assert beam.reason.startswith("it is held on the hook")
    assert (slab.is_set, slab.blocked_by) == (False, ("beam",))

    free = with_obstructions(blocked, ObstructionSet.of([]), rasterise)
    *_, last = revise(held, RevisionRequest(free, preparation, now_ns=now_ns + 600 * 10**9))
    after = proven(last.current)
    assert [lift.status for lift in after.plan.lifts] == [Status.PLANNED] * 4
