"""Which lifts a change affects through parts that are no longer set, or are set again."""

from __future__ import annotations

from functools import cache

from box_sites import box_site, test_crane

from bimvox.library.site import rasterise
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status, same_path
from bimvox.revision.current_plan import CurrentPlan, RevisionPart, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Obstruction, ObstructionSet
from bimvox.site.site import Rules

WALL = ("wall", (1.0, 2.0, 0.0), (1.5, 6.0, 3.0), {"start_vox": (24, 4, 1)})
BLOCK = ("block", (5.0, 3.5, 0.0), (6.0, 4.5, 1.0), {"start_vox": (30, 7, 1), "after": ("wall",)})
AT_THE_WALL = ObstructionSet.of([Obstruction("truck", Box((1.1, 3.1, 0.1), (1.4, 3.4, 1.0)))])


@cache
def current(*, by_other_means: bool) -> tuple[CurrentPlan, Preparation]:
    """Return the plan of a wall, and of a block that is carried low over where the wall was stored."""
    crane = test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0)
    rules = Rules(by_other_means=by_other_means)
    site = with_digests(box_site([WALL, BLOCK], crane=crane, shape=(40, 30, 24), rules=rules))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return current_plan_of(plan, time_plan(plan, preparation)), preparation


def revised(was: CurrentPlan, preparation: Preparation, obstructions: ObstructionSet) -> RevisionPart:
    site = with_obstructions(was.plan.site, obstructions, rasterise)
    *_, last = revise(was, RevisionRequest(site, preparation))
    assert verify_plan(last.current.plan).verified
    assert verify_motions(last.current.plan, last.current.chain).verified
    return last


def test_a_lift_through_the_place_of_a_part_that_lies_in_the_yard_again_is_planned_again() -> None:
    was, preparation = current(by_other_means=False)
    blocked = revised(was, preparation, AT_THE_WALL)
    wall, block = blocked.current.plan.lifts
    assert (wall.status, wall.blocked_by) == (Status.INFEASIBLE, ("truck",))
    assert block.status is Status.PLANNED
    assert blocked.replanned == (1,)

    wall_again, block_again = revised(blocked.current, preparation, EMPTY).current.plan.lifts
    assert same_path(wall_again, was.plan.lifts[0])
    assert same_path(block_again, block)


def test_a_part_that_is_set_by_other_means_is_not_in_the_yard_and_changes_no_later_lift() -> None:
    was, preparation = current(by_other_means=True)
    blocked = revised(was, preparation, AT_THE_WALL)
    wall, block = blocked.current.plan.lifts
    assert wall.by_other_means
    assert blocked.replanned == ()
    assert same_path(was.plan.lifts[1], block)
