"""Two cranes that carry a part drive one course: hooks at a constant distance, within the limits of both."""

from dataclasses import replace

import numpy as np
import pytest
from tandem_sites import BEAM, crane_at, planned_together, tandem_site

from bimvox.crane.kinematics import hook_of, joint_limits, joints_of
from bimvox.errors import MotionError
from bimvox.motion.tandem import RATE_SHARE
from bimvox.motion.time_plan import each_by_itself
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.records.motion import PhaseName, by_each_crane


@pytest.fixture(scope="module")
def made():
    plan, (motion,) = planned_together(tandem_site(transit_clearance_m=1.0, departure_clearance_m=0.5))
    return plan, motion


def hooks_m(site, motion, which):
    ways = [getattr(one, which) for one in by_each_crane([motion])]
    cranes = [site.cranes[one.crane] for one in by_each_crane([motion])]
    return [hook_of(crane, *way.axes.T) for crane, way in zip(cranes, ways, strict=True)]


def test_both_hooks_make_the_same_moves(made):
    plan, motion = made
    for which in ("raising", "loaded"):
        assert (getattr(motion, which).time_ns == getattr(motion.second, which).time_ns).all()
        west, east = hooks_m(plan.site, motion, which)
        np.testing.assert_allclose(east - west, np.tile([6.0, 0.0, 0.0], (len(west), 1)), atol=1e-9)


def test_the_load_goes_straight_up_and_straight_down(made):
    _, motion = made
    names = [phase.name for phase in motion.phases]
    assert names == [
        PhaseName.HOOK_ON,
        PhaseName.RAISE,
        PhaseName.HOIST,
        PhaseName.TRAVERSE,
        PhaseName.LOWER,
        PhaseName.SET,
        PhaseName.RELEASE,
    ]
    assert [one.name for one in motion.second.phases if one.name is not PhaseName.WAIT] == names


def test_each_crane_uses_half_of_its_rates_at_most(made):
    plan, motion = made
    for one in by_each_crane([motion]):
        crane = plan.site.cranes[one.crane]
        joints = joints_of(crane, one.loaded.axes)
        rates = np.abs(np.diff(joints, axis=0)) / (np.diff(one.loaded.time_ns) / 1e9)[:, None]
        most = np.array([limit.rate for limit in joint_limits(crane)])
        assert (rates.max(axis=0) <= RATE_SHARE * most + 1e-9).all()


def test_the_slower_crane_sets_the_pace(made):
    plan, motion = made
    slower = tandem_site(
        west=replace(crane_at("west", 7.0), slewing=replace(crane_at("west", 7.0).slewing, rate=0.004)),
        transit_clearance_m=1.0,
        departure_clearance_m=0.5,
    )
    _, (other,) = planned_together(slower)
    assert other.loaded.duration_s > motion.loaded.duration_s + 5.0
    assert other.loaded.duration_s == other.second.loaded.duration_s
    assert plan.site.cranes[0].slewing.rate > 0.004


def test_a_path_that_jumps_is_refused(made):
    plan, _ = made
    site = tandem_site(parts=(BEAM,))
    preparation = prepare(site)
    lifts = plan_lifts(site, preparation).lifts
    shifted = lifts[0].path_vox.copy()
    shifted[1:, 0] += 1  # it jumps
    broken = replace(plan, site=site, lifts=(replace(lifts[0], path_vox=shifted),))
    with pytest.raises(MotionError, match="the path jumps"):
        each_by_itself(broken, preparation)
