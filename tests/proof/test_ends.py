"""Clearances hold until the last moves, and a plan cannot call its transit last moves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import box_site

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Lift, LiftPlan
from bimvox.site.site import Rules

MARGIN_M = 1.0
PARTS = [("slab", (2.0, 2.0, 0.0), (5.5, 6.0, 0.5))]
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 15.0, 3.0))


def plan_with(margin_m: float) -> LiftPlan:
    site = box_site(PARTS, structure=[WALL], rules=Rules(rope=False, transit_clearance_m=margin_m))
    return plan_lifts(site, prepare(site))


@pytest.fixture(scope="module")
def plan() -> LiftPlan:
    return plan_with(MARGIN_M)


def told(plan: LiftPlan, lift: Lift) -> list[str]:
    """What the proof says of a plan with another lift."""
    return list(verify_plan(dataclasses.replace(plan, lifts=(lift,))).failures)


def dipped(lift: Lift) -> tuple[np.ndarray, int]:
    """A path that goes down by a cell and up again on its way, and the placement before; wherever that is possible."""
    path = lift.path_vox
    assert path is not None
    over = next(n for n in range(len(path)) if path[n, 0] == 15)  # above the wall
    dip = np.array([path[over] - [0, 0, 1], path[over]], np.int32)
    return np.concatenate([path[: over + 1], dip, path[over + 1 :]]).astype(np.int32), over


def test_a_path_that_keeps_its_distance_is_proven(plan: LiftPlan) -> None:
    assert told(plan, plan.lifts[0]) == []


def test_a_whole_path_is_not_last_moves(plan: LiftPlan) -> None:
    low = plan_with(0.0).lifts[0]
    assert low.path_vox is not None
    lift = dataclasses.replace(low, contact_moves=len(low.path_vox) - 1)
    assert told(plan, lift) == ["margin: slab: its last moves begin nearer than 1 m to ground"]


def test_last_moves_begin_where_nothing_above_the_place_is_near_any_more(plan: LiftPlan) -> None:
    path, over = dipped(plan.lifts[0])
    honest = dataclasses.replace(plan.lifts[0], path_vox=path, shortest_moves=None)
    (said,) = told(plan, honest)
    assert said.startswith(f"margin: slab: at placement {over + 1} it comes nearer than 1 m to wall")
    claimed = dataclasses.replace(honest, contact_moves=len(path) - 1 - over)
    assert told(plan, claimed) == [said]
