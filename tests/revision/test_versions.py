"""Versions of lifts: they hold after other lifts differ, if nothing new is in their footprint."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from box_sites import box_site, test_crane

import bimvox.revision.revise as module
from bimvox.cranes.schedule import time_lifts
from bimvox.library.search import check_search
from bimvox.library.site import rasterise
from bimvox.log.plan_log import PlanLog
from bimvox.log.segments import newest, segment_of
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.progress import SilentProgress
from bimvox.proof.footprint import motion_footprint
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.records.proof import Check
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, current_plan_of
from bimvox.revision.draft import Proof
from bimvox.revision.revise import revise
from bimvox.revision.versions import Once, Reading, Validity, obstructed_cells, version_of, with_version
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Obstruction, ObstructionSet
from bimvox.site.site import Site

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


def holds(name: str, now: set[str], then: set[str], obstructions: ObstructionSet = EMPTY) -> bool:
    """Return whether the path of a part holds if other parts are in place than when it was proven."""
    current, preparation = planned()
    site, lift = current.plan.site, current.plan.lifts[order_of(name)]
    version = version_of(site, lift, Reading(obstructed_cells(site), _bits(then)), None)
    validity = Validity({lift.order: (version,)}, with_obstructions(site, obstructions, rasterise), preparation)
    validity.now = replace(validity.now, done=_bits(now))
    return validity.path(lift) is version


def _bits(names: set[str]) -> int:
    return sum(1 << order_of(name) for name in names)


def test_a_path_holds_if_the_same_parts_are_in_place() -> None:
    assert holds("high", {"low", "next", "far"}, {"low", "next", "far"})


def test_a_path_holds_if_a_part_far_away_is_not_in_place_now_or_was_not_then() -> None:
    assert holds("high", {"low", "next"}, {"low", "next", "far"})
    assert holds("high", {"low", "next", "far"}, {"low", "next"})


def test_planned_again_if_the_state_of_a_neighbour_differs() -> None:
    assert not holds("high", {"far", "next"}, {"far", "next", "low"})
    assert not holds("low", {"far", "next"}, {"far"})


def beam_in_the_way_of(name: str) -> ObstructionSet:
    site, lift = planned()[0].plan.site, planned()[0].plan.lifts[order_of(name)]
    low_m = site.frame.corner_of(lift.path_vox[len(lift.path_vox) // 2])
    return ObstructionSet.of([Obstruction("beam", Box(tuple(low_m.tolist()), tuple((low_m + 0.5).tolist())))])


def test_planned_again_if_an_obstruction_is_in_the_footprint() -> None:
    assert not holds("far", {"low"}, {"low"}, beam_in_the_way_of("far"))
    assert holds("far", {"low"}, {"low"}, beam_in_the_way_of("low"))


def test_a_footprint_is_made_once_when_it_is_first_needed() -> None:
    made: list[int] = []
    once = Once(lambda: made.append(1) or len(made))
    assert made == []
    assert (once(), once(), made) == (1, 1, [1])


def test_the_footprints_of_a_plan_are_made_before_anything_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    current, _ = planned()
    made: list[str] = []
    monkeypatch.setattr("bimvox.revision.versions.path_footprint", lambda *_: made.append("path"))
    monkeypatch.setattr("bimvox.revision.versions.motion_footprint", lambda *_: made.append("motion"))
    current_plan_of(current.plan, current.chain)
    assert sorted(made) == ["motion"] * 4 + ["path"] * 4


def test_a_version_in_a_later_state_replaces_itself_and_the_third_earlier_one_goes() -> None:
    current, _ = planned()
    site, read = current.plan.site, Reading(obstructed_cells(current.plan.site))
    one, two, three, four = (version_of(site, lift, read, None) for lift in current.plan.lifts)
    later = replace(one, read=replace(read, done=3))
    assert with_version((one, two), later) == (later, two)
    assert with_version((one, two), three) == (three, one, two)
    assert with_version((one, two, three), four) == (four, one, two)


def test_a_second_round_keeps_the_motions_that_the_first_has_proven(monkeypatch) -> None:
    current, preparation = planned()
    site = with_obstructions(current.plan.site, beam_in_the_way_of("low"), rasterise)
    proven: list[set[int]] = []
    last = 2
    real = module.prove_new

    def refuses_once(plan, draft, known_shapes, *more):
        found = real(plan, draft, known_shapes, *more)
        proven.append(set(draft.unproven_motions))
        if len(proven) > 1:
            return found
        name = plan.site.components[plan.lifts[last].component].id
        left = {n: one for n, one in found.swept.items() if n != last}
        return Proof({name: "it is refused"}, found.paths, left)

    monkeypatch.setattr(module, "prove_new", refuses_once)
    (part,) = revise(current, RevisionRequest(site, preparation))
    assert len(proven) == 2
    assert len(proven[0]) > 1
    assert proven[0] & proven[1] == {last}, "a lift that the first round had proven was made again"
    plan, motions = part.current.plan, part.current.chain
    assert [lift.status for lift in plan.lifts].count(Status.INFEASIBLE) == 0, "the refused lift goes another way"
    assert verify_plan(plan).verified
    assert verify_motions(plan, motions).verified
    for order, motion in part.current.motions.items():
        footprint, again = part.current.swept_by(order), motion_footprint(plan.site, plan.lifts[order], motion)
        assert np.array_equal(footprint.approach.columns, again.approach.columns)
        assert np.array_equal(footprint.carrying.columns, again.carrying.columns)


FEWEST_PARTS = [(f"block {n}", (2.0, 2.0 + 3.0 * n, 0.0), (3.0, 3.0 + 3.0 * n, 1.0)) for n in range(4)]
FENCE = Box((6.0, 0.0, 0.0), (6.5, 20.0, 6.0))
FAR = Box((18.0, 18.0, 0.0), (19.0, 19.0, 0.5))


def site_with(*boxes: Box) -> Site:
    crane = test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = with_digests(box_site(FEWEST_PARTS, crane=crane, shape=(40, 40, 24)))
    return obstructed(site, *boxes)


def obstructed(site: Site, *boxes: Box) -> Site:
    named = [Obstruction(f"box {n}", box) for n, box in enumerate(boxes)]
    return with_obstructions(site, ObstructionSet.of(named), rasterise)


def planned_twice(site: Site) -> tuple[CurrentPlan, Preparation]:
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return current_plan_of(plan, time_lifts(plan, preparation)), preparation


def revised(current: CurrentPlan, preparation: Preparation, site: Site) -> CurrentPlan:
    for part in revise(current, RevisionRequest(site, preparation)):
        current = part.current
    return current


def searched(current: CurrentPlan) -> Check:
    return check_search(PlanLog(plan=current.plan, motions=current.chain), SilentProgress())


def test_what_became_shorter_is_no_longer_stated() -> None:
    current, preparation = planned_twice(site_with(FENCE))
    assert searched(current).samples == 4
    after = revised(current, preparation, obstructed(current.plan.site))
    paths = [lift.path_vox for lift in current.plan.lifts]
    assert all(lift.path_vox is path for lift, path in zip(after.plan.lifts, paths, strict=True))
    assert None in [lift.shortest_moves for lift in after.plan.lifts]
    assert searched(after).failures == []


def test_what_cannot_have_become_shorter_is_stated_still() -> None:
    current, preparation = planned_twice(site_with(FENCE, FAR))
    after = revised(current, preparation, obstructed(current.plan.site, FENCE))
    assert [lift.shortest_moves for lift in after.plan.lifts] == [lift.shortest_moves for lift in current.plan.lifts]
    assert searched(after).samples == 4


def test_the_path_that_comes_back_with_the_site_has_its_fewest_moves_back() -> None:
    current, preparation = planned_twice(site_with())
    fenced = revised(current, preparation, obstructed(current.plan.site, FENCE))
    again = revised(fenced, preparation, obstructed(current.plan.site))
    for now, then in zip(again.plan.lifts, current.plan.lifts, strict=True):
        if now.path_vox is then.path_vox:
            assert now.shortest_moves == then.shortest_moves
    assert searched(fenced).failures == searched(again).failures == []


@pytest.mark.parametrize("seed", range(3))
def test_after_any_changes_what_is_stated_is_true(seed: int) -> None:
    rng = np.random.default_rng(seed)
    current, preparation = planned_twice(site_with())
    for _ in range(8):
        boxes = []
        for _ in range(int(rng.integers(0, 4))):
            low = rng.uniform((0.0, 0.0, 0.0), (18.0, 18.0, 5.0))
            boxes.append(Box(tuple(low.tolist()), tuple((low + rng.uniform(0.3, 6.0, 3)).tolist())))
        current = revised(current, preparation, obstructed(current.plan.site, *boxes))
        assert searched(current).failures == []


def test_a_longer_path_is_uncertain_if_anything_is_in_the_way() -> None:
    current, preparation = planned_twice(site_with(FENCE))
    lift = current.plan.lifts[0]
    longer = replace(lift, path_vox=np.concatenate([lift.path_vox[:1], lift.path_vox[1::-1], lift.path_vox[1:]]))
    read = Reading(obstructed_cells(current.plan.site))
    same = Validity({}, current.plan.site, preparation)
    assert same.fewest_are_known(longer, read)
    fuller = Validity({}, obstructed(current.plan.site, FENCE, FAR), preparation)
    assert fuller.fewest_are_known(lift, read)
    assert not fuller.fewest_are_known(longer, read)


def test_a_segment_tells_which_fewest_moves_are_no_longer_known() -> None:
    current, preparation = planned_twice(site_with(FENCE))
    base = PlanLog(plan=current.plan, motions=current.chain)
    after = revised(current, preparation, obstructed(current.plan.site))
    whole = replace(base, plan=after.plan, motions=after.chain, revision=1)
    merged = newest(base, [segment_of(whole, after.motions, (), (), {})])
    assert [lift.shortest_moves for lift in merged.plan.lifts] == [lift.shortest_moves for lift in after.plan.lifts]
