"""Whatever is added outside the footprint of a lift, its proof holds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from box_sites import box_site, test_crane
from scipy.ndimage import maximum_filter

from bimvox.cranes.schedule import time_lifts
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.footprint import MotionFootprint, motion_footprint, path_footprint
from bimvox.proof.hook import jib_cell
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.site.build import with_digests
from bimvox.site.site import Blocker, Rules

PARTS = [
    ("far", (12.0, 12.0, 0.0), (13.0, 13.0, 2.0), {"erected": True}),
    ("low", (2.0, 2.0, 0.0), (3.0, 4.0, 1.0), {"stored_turn": 1}),
    ("next", (3.0, 2.0, 0.0), (4.0, 4.0, 1.0)),
    ("high", (2.0, 2.0, 1.0), (3.0, 3.0, 2.0)),
]


@cache
def planned():
    crane = test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0)
    near_rest = {f"{what}_clearance_m": 1.0 for what in ("departure", "approach", "upending", "turning")}
    rules = Rules(transit_clearance_m=1.0, rope_clearance_m=1.0, **near_rest)
    site = with_digests(box_site(PARTS, crane=crane, shape=(40, 40, 24), rules=rules))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_lifts(plan, preparation)


def cells_of(footprint, shape):
    if isinstance(footprint, MotionFootprint):
        return cells_of(footprint.approach, shape) | cells_of(footprint.carrying, shape)
    dense = np.zeros(shape, np.bool_)
    heights = np.unpackbits(footprint.heights.view(np.uint8), axis=1, bitorder="little")[:, : shape[2]]
    dense.reshape(-1, shape[2])[footprint.columns] = heights
    return dense


def is_proven(number, added):
    """Return whether a lift and its motion are proven if the cells that are added ((X, Y, Z) bool) are obstructed."""
    plan, motions = planned()
    blocker = Blocker("added", "obstruction", np.argwhere(added).astype(np.int32))
    site = replace(plan.site, blockers=(*plan.site.blockers, blocker))
    one = replace(plan, site=site, lifts=(plan.lifts[number],))
    context = tuple(lift for lift in plan.lifts if lift.order != number)
    return verify_plan(one, context).verified, verify_motions(one, [motions[number]], context).verified


@pytest.mark.parametrize("number", range(len(PARTS)))
def test_everything_around_a_footprint_may_be_obstructed(number):
    plan, motions = planned()
    lift, shape = plan.lifts[number], plan.site.shape
    path = cells_of(path_footprint(plan.site, lift), shape)
    moved = cells_of(motion_footprint(plan.site, lift, motions[number]), shape)
    for footprint, which in ((path, 0), (moved, 1)):
        around = maximum_filter(footprint, size=3) & ~footprint
        around[:, :, jib_cell(plan.site, plan.site.cranes[0]) :] = False
        assert around.sum() > 100
        assert is_proven(number, around)[which]
