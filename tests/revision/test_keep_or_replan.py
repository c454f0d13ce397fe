"""The reason of a lift that stays infeasible is the current one, and a verdict that stays is not made again."""

from __future__ import annotations

from box_sites import box_site, test_crane

from bimvox.library.obstructions import rasterise
from bimvox.motion.time_plan import time_plan
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import prepare
from bimvox.records.lift import Status
from bimvox.revision.current_plan import CurrentPlan, current_plan_of
from bimvox.revision.request import RevisionRequest
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.site.site import Rules

PORTAL = [
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98)),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98)),
]
LEFT = Obstruction("at left", Box((1.05, 1.45, 1.0), (1.15, 1.55, 1.2)))
RIGHT = Obstruction("at right", Box((4.85, 1.45, 1.0), (4.95, 1.55, 1.2)))
FAR = Obstruction("far away", Box((8.0, 12.0, 0.1), (8.4, 12.4, 0.4)))


def test_a_part_without_support_is_blocked_by_the_one_that_is_missing_now() -> None:
    crane = test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0)
    site = with_digests(box_site(PORTAL, crane=crane, shape=(40, 30, 24), rules=Rules(by_other_means=False)))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    current = current_plan_of(plan, time_plan(plan, preparation))

    def revised(*obstructions: Obstruction) -> tuple[CurrentPlan, tuple[int, ...]]:
        now = with_obstructions(site, ObstructionSet.of(obstructions), rasterise)
        parts = list(revise(current, RevisionRequest(now, preparation)))
        return parts[-1].current, tuple(order for part in parts for order in part.made)

    beam = next(lift.order for lift in plan.lifts if site.components[lift.component].id == "beam")
    for obstructions, missing in [((LEFT,), "left"), ((LEFT, FAR), "left"), ((RIGHT,), "right")]:
        was = current.plan.lifts[beam]
        current, made = revised(*obstructions)
        lift = current.plan.lifts[beam]
        assert (lift.status, lift.blocked_by) == (Status.INFEASIBLE, (missing,))
        assert (beam in made) == (FAR not in obstructions)
        assert (lift is was) == (FAR in obstructions)
