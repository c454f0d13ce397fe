"""The fewest moves of a kept lift: stated as long as they are known, and never wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.cranes.schedule import time_lifts
from bimvox.library.search import check_search
from bimvox.library.site import rasterise
from bimvox.log.plan_log import PlanLog
from bimvox.log.segments import newest, segment_of
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.progress import SilentProgress
from bimvox.records.proof import Check
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, current_plan_of
from bimvox.revision.recall import FewestMoves
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.site.site import Site

PARTS = [(f"block {n}", (2.0, 2.0 + 3.0 * n, 0.0), (3.0, 3.0 + 3.0 * n, 1.0)) for n in range(4)]
FENCE = Box((6.0, 0.0, 0.0), (6.5, 20.0, 6.0))
FAR = Box((18.0, 18.0, 0.0), (19.0, 19.0, 0.5))


def site_with(*boxes: Box) -> Site:
    crane = test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = with_digests(box_site(PARTS, crane=crane, shape=(40, 40, 24)))
    return obstructed(site, *boxes)


def obstructed(site: Site, *boxes: Box) -> Site:
    named = [Obstruction(f"box {n}", box) for n, box in enumerate(boxes)]
    return with_obstructions(site, ObstructionSet.of(named), rasterise)


def planned(site: Site) -> tuple[CurrentPlan, Preparation]:
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
    current, preparation = planned(site_with(FENCE))
    assert searched(current).samples == 4
    after = revised(current, preparation, obstructed(current.plan.site))
    paths = [lift.path_vox for lift in current.plan.lifts]
    assert all(lift.path_vox is path for lift, path in zip(after.plan.lifts, paths, strict=True))
    assert None in [lift.shortest_moves for lift in after.plan.lifts]
    assert searched(after).failures == []


def test_what_cannot_have_become_shorter_is_stated_still() -> None:
    current, preparation = planned(site_with(FENCE, FAR))
    after = revised(current, preparation, obstructed(current.plan.site, FENCE))
    assert [lift.shortest_moves for lift in after.plan.lifts] == [lift.shortest_moves for lift in current.plan.lifts]
    assert searched(after).samples == 4


def test_the_path_that_comes_back_with_the_site_has_its_fewest_moves_back() -> None:
    current, preparation = planned(site_with())
    fenced = revised(current, preparation, obstructed(current.plan.site, FENCE))
    again = revised(fenced, preparation, obstructed(current.plan.site))
    for now, then in zip(again.plan.lifts, current.plan.lifts, strict=True):
        if now.path_vox is then.path_vox:
            assert now.shortest_moves == then.shortest_moves
    assert searched(fenced).failures == searched(again).failures == []


@pytest.mark.parametrize("seed", range(3))
def test_after_any_changes_what_is_stated_is_true(seed: int) -> None:
    rng = np.random.default_rng(seed)
    current, preparation = planned(site_with())
    for _ in range(8):
        boxes = []
        for _ in range(int(rng.integers(0, 4))):
            low = rng.uniform((0.0, 0.0, 0.0), (18.0, 18.0, 5.0))
            boxes.append(Box(tuple(low.tolist()), tuple((low + rng.uniform(0.3, 6.0, 3)).tolist())))
        current = revised(current, preparation, obstructed(current.plan.site, *boxes))
        assert searched(current).failures == []


def test_a_longer_path_is_uncertain_if_anything_is_in_the_way() -> None:
    current, _ = planned(site_with(FENCE))
    fewest, lift = FewestMoves(current.plan.site), current.plan.lifts[0]
    longer = replace(lift, path_vox=np.concatenate([lift.path_vox[:1], lift.path_vox[1::-1], lift.path_vox[1:]]))
    assert fewest.are_known(longer)
    fewest.occupied(np.zeros((1, 3), np.int32))
    assert fewest.are_known(lift)
    assert not fewest.are_known(longer)


def test_a_segment_tells_which_fewest_moves_are_no_longer_known() -> None:
    current, preparation = planned(site_with(FENCE))
    base = PlanLog(plan=current.plan, motions=current.chain)
    after = revised(current, preparation, obstructed(current.plan.site))
    whole = replace(base, plan=after.plan, motions=after.chain, revision=1)
    merged = newest(base, [segment_of(whole, after.motions, (), (), {})])
    assert [lift.shortest_moves for lift in merged.plan.lifts] == [lift.shortest_moves for lift in after.plan.lifts]
