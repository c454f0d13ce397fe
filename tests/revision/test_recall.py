"""Earlier versions of lifts: recalled after other lifts differ, if nothing new is in their footprint."""

from __future__ import annotations

from functools import cache

import numpy as np
from box_sites import box_site, test_crane

import bimvox.revision.revise as module
from bimvox.cranes.schedule import time_lifts
from bimvox.library.site import rasterise
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.proof.footprint import motion_footprint, path_footprint
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.revision.current_plan import CurrentPlan, Footprints, RevisionRequest, current_plan_of
from bimvox.revision.draft import Proof
from bimvox.revision.recall import Recall, Version, obstructed_cells
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet

PARTS = [
    ("far", (12.0, 12.0, 0.0), (13.0, 13.0, 1.0)),
    ("low", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0)),
    ("next", (3.0, 2.0, 0.0), (4.0, 3.0, 1.0)),
    ("high", (2.0, 2.0, 1.0), (3.0, 3.0, 2.0)),
]


@cache
def planned() -> tuple[CurrentPlan, Preparation]:
    crane = test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = with_digests(box_site(PARTS, crane=crane, shape=(40, 40, 24)))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return current_plan_of(plan, time_lifts(plan, preparation)), preparation


def order_of(name: str) -> int:
    plan = planned()[0].plan
    return next(lift.order for lift in plan.lifts if plan.site.components[lift.component].id == name)


def recalled(name: str, now: set[str], then: set[str]) -> bool:
    """Return whether the path of a part is recalled if other parts are in place than when it was proven."""
    current, preparation = planned()
    site, lift = current.plan.site, current.plan.lifts[order_of(name)]
    version = Version(lift, path_footprint(site, lift), None, None, _bits(then), None, obstructed_cells(site))
    return Recall({lift.order: (version,)}, site, preparation).path(lift.order, _bits(now)) is version


def _bits(names: set[str]) -> int:
    return sum(1 << order_of(name) for name in names)


def test_recalled_if_the_same_parts_are_in_place() -> None:
    assert recalled("high", {"low", "next", "far"}, {"low", "next", "far"})


def test_recalled_if_a_part_far_away_is_not_in_place_now_or_was_not_then() -> None:
    assert recalled("high", {"low", "next"}, {"low", "next", "far"})
    assert recalled("high", {"low", "next", "far"}, {"low", "next"})


def test_planned_again_if_the_state_of_a_neighbour_differs() -> None:
    assert not recalled("high", {"far", "next"}, {"far", "next", "low"})
    assert not recalled("low", {"far", "next"}, {"far"})


def test_planned_again_if_a_part_in_place_is_in_the_footprint() -> None:
    current, preparation = planned()
    site, lift = current.plan.site, current.plan.lifts[order_of("far")]
    through = lift.path_vox[len(lift.path_vox) // 2]
    version = Version(lift, path_footprint(site, lift), None, None, 0, None, obstructed_cells(site))
    index = order_of("low")
    moved = site.components[current.plan.lifts[index].component].shape.cells + through
    recall = Recall({lift.order: (version,)}, site, preparation)
    assert recall.path(lift.order, 1 << index) is version
    occupied, _ = recall._since[next(iter(recall._since))]
    occupied.add(moved.astype(np.int32))
    assert recall.path(lift.order, 1 << index) is None


def test_a_second_round_keeps_the_motions_that_the_first_has_proven(monkeypatch) -> None:
    current, preparation = planned()
    lift = current.plan.lifts[order_of("low")]
    cell = lift.path_vox[len(lift.path_vox) // 2]
    low_m = current.plan.site.frame.corner_of(cell)
    beam = Obstruction("beam", Box(tuple(low_m.tolist()), tuple((low_m + 0.5).tolist())))
    site = with_obstructions(current.plan.site, ObstructionSet.of([beam]), rasterise)
    proven: list[set[int]] = []
    last = 2
    real = module.prove_new

    def refuses_once(plan, draft, known_shapes, *more):
        found = real(plan, draft, known_shapes, *more)
        proven.append(set(draft.unproven_motions))
        if len(proven) > 1:
            return found
        name = plan.site.components[plan.lifts[last].component].id
        left = {n: one for n, one in found.motion_footprints.items() if n != last}
        return Proof({name: "it is refused"}, found.path_footprints, Footprints({}, left))

    monkeypatch.setattr(module, "prove_new", refuses_once)
    (part,) = revise(current, RevisionRequest(site, preparation))
    assert len(proven) == 2
    assert len(proven[0]) > 1
    assert proven[0] & proven[1] == {last}, "a lift that the first round had proven was made again"
    plan, motions = part.current.plan, part.current.chain
    assert [lift.status for lift in plan.lifts].count(Status.INFEASIBLE) == 0, "the refused lift goes another way"
    assert verify_plan(plan).verified
    assert verify_motions(plan, motions).verified
    for order, footprint in part.current.motion_footprints.items():
        lift = plan.lifts[order]
        again = motion_footprint(plan.site, lift, part.current.motions[order])
        assert np.array_equal(footprint.approach.columns, again.approach.columns)
        assert np.array_equal(footprint.carrying.columns, again.carrying.columns)
