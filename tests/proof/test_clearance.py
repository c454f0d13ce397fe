from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_site, test_crane
from scipy.ndimage import maximum_filter

from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.clearance import WideMarks
from bimvox.proof.moment import NO_SOLID, Thing
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan

SHAPE = (12, 9, 11)


def counted(things, reach):
    """The counts by definition: every thing's cells in a larger grid, grown by a maximum filter, cut to the site."""
    counts, around = np.zeros(SHAPE, int), 9
    for one in things:
        dense = np.zeros(np.array(SHAPE) + 2 * around, np.bool_)
        dense[tuple((one.cells + around).T)] = True
        dense = maximum_filter(dense, size=tuple(2 * n + 1 for n in reach))
        counts += dense[around:-around, around:-around, around:-around]
    return counts


@pytest.mark.parametrize("reach", [(4, 4, 4), (1, 1, 0), (2, 0, 3), (0, 0, 0)])
def test_they_count_each_thing_once_within_reach_of_its_cells(reach):
    rng = np.random.default_rng(7)
    things = [
        Thing(str(n), np.unique(rng.integers(-3, 14, (rng.integers(0, 7), 3)), axis=0).astype(np.int32), NO_SOLID)
        for n in range(15)
    ]
    boxes = (((0, 0, 0), (11, 8, 0)), ((3, 2, 4), (5, 2, 9)), ((-2, 7, 8), (1, 9, 12)))
    things += [
        Thing(str(low), (np.argwhere(np.ones(np.subtract(high, low) + 1)) + low).astype(np.int32), NO_SOLID)
        for low, high in boxes
    ]
    marks = WideMarks(SHAPE, reach)
    for _ in range(6):
        present = tuple(one for one in things if rng.random() < 0.5)
        marks.move_to(present)
        assert np.array_equal(marks.counts, counted(present, reach))
        with marks.without(present[:3]):
            assert np.array_equal(marks.counts, counted(present[3:], reach))


def failed(found):
    return {check.name: list(check.failures) for check in found.checks if not check.passed}


def planned(site):
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def test_a_rope_that_alone_is_too_near_is_refused_and_named():
    """A block passes a tower that is higher than its hook; nothing is asked of the distance of the load."""
    block = ("block", (1.0, 3.0, 0.0), (2.0, 4.0, 1.0), {"start_vox": (30, 6, 1)})
    site = box_site(
        [block],
        structure=[("tower", (8.0, 3.0, 0.0), (9.0, 4.0, 9.0))],
        crane=test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0),
        shape=(40, 30, 24),
    )
    careful = replace(site, rules=replace(site.rules, rope_clearance_m=2.0))
    (near, near_motions), (far, far_motions) = planned(site), planned(careful)
    assert failed(verify_plan(far)) == failed(verify_motions(far, far_motions)) == {}

    forged = replace(near, site=careful)
    assert list(failed(verify_plan(forged))) == ["rope_margin"]
    (said,) = failed(verify_motions(far, near_motions))["motion_margin"]
    assert said.startswith("lift 1 (block): at ")
    assert said.endswith("in transit, its rope is nearer than 2 m to tower")
