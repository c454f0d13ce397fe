"""A panel that is turned over between two hooks: statics, the room it takes, its motion."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from flipping_sites import AUXILIARY, crane_with, flipping_site
from scipy.spatial.transform import Rotation

from bimvox.crane.load_chart import LoadChart
from bimvox.log.plan_json import plan_from_json, plan_to_json
from bimvox.log.track import crane_track
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.records.motion import PhaseName
from bimvox.remarks.not_covered import not_covered_by
from bimvox.remarks.remarks import remarks_of
from bimvox.remarks.table import FLIP_LEANS
from bimvox.site.component import StoredPose
from bimvox.site.default_rules import FlipRules
from bimvox.site.flip_box import rise_to_flip_vox, upright_at_vox
from bimvox.site.lifting import hoisted_kg, hung_kg, permitted_for

LYING = [
    (StoredPose.LYING_X, 0),
    (StoredPose.LYING_X, 1),
    (StoredPose.LYING_X, 2),
    (StoredPose.LYING_X, 3),
    (StoredPose.LYING_Y, 0),
    (StoredPose.LYING_Y, 1),
]


def planned(site):
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def test_the_shares_are_those_of_two_vertical_ropes():
    """Level, the centre is 3 m and the auxiliary hook 4.5 m from the head; upright, all is on the main hook."""
    plan, _ = planned(flipping_site())
    flip = plan.lifts[0].flip
    assert flip.main_m == (2.25, 2.5, 6.0)
    assert flip.auxiliary_m[2] == 1.5
    assert flip.auxiliary_kg[0] == pytest.approx(7200.0 * 3.0 / 4.5)
    half = flip.angle_deg.index(45.0)
    # The half thickness of the side that is held brings the hooks together while it turns.
    assert flip.auxiliary_kg[half] == pytest.approx(7200.0 * 3.0 / (4.5 + 0.25))
    assert (flip.main_kg[-1], flip.auxiliary_kg[-1]) == (pytest.approx(7200.0), pytest.approx(0.0, abs=1e-6))
    assert np.add(flip.main_kg, flip.auxiliary_kg) == pytest.approx(7200.0)
    # 4.8 t, slings of 0.5 t and its block; 7.2 t with both slings and both blocks on the chart.
    assert flip.auxiliary_used == pytest.approx((4800.0 + 500.0 + 150.0) / 9000.0)
    assert flip.both_used == pytest.approx((7200.0 + 500.0 + 500.0 + 150.0) / 20_000.0)


@pytest.mark.parametrize(("pose", "turn"), LYING)
def test_it_is_proven_and_stays_in_its_room_and_clear_of_the_ground(pose, turn):
    site = flipping_site(stored_pose=pose, stored_turn=turn)
    plan, motions = planned(site)
    (lift,), (motion,) = plan.lifts, motions
    assert (lift.status, lift.place.pose, lift.place.turn) == (Status.PLANNED, pose, turn)
    assert verify_plan(plan).failures == ()
    assert verify_motions(plan, motions).failures == ()
    track, size_m = crane_track(site, lift, motion), site.frame.voxel_size_m
    corners = np.array(list(itertools.product(*zip(np.zeros(3), np.array((0.5, 1.0, 6.0)), strict=True))))
    low_m = site.frame.corner_of(lift.place.cell_vox)
    raised = int(np.searchsorted(track.time_ns, motion.start_ns + int(motion.raising.time_ns[-1])))
    height_m = np.interp(track.time_ns[:raised] - motion.start_ns, motion.raising.time_ns, motion.raising.height_m)
    # At its full height it may be moved to where it is turned to its heading.
    raised = int(np.argmax(height_m >= height_m.max() - 1e-6)) + 1
    swept = np.stack([Rotation.from_quat(track.tilt[n]).apply(corners) + track.corner_m[n] for n in range(raised)])
    room_m = size_m * np.array(lift.place.raising_size_vox(site.components[0]))
    assert (swept.min(axis=(0, 1)) >= low_m - 1e-6).all()
    assert (swept.max(axis=(0, 1)) <= low_m + room_m + 1e-6).all()
    begins_m = float(motion.raising.height_m[0]) + size_m * lift.place.rise_vox
    clear_m = swept[height_m[:raised] > begins_m + 1e-6][..., 2].min() - low_m[2]
    assert clear_m >= lift.flip.clear_m - 1e-6 > site.rules.two_hooks.clear_m
    assert np.linalg.norm(np.diff(track.corner_m[: raised + 2], axis=0), axis=1).max() < 0.3  # no jump along the track


def test_the_main_hook_goes_straight_up_and_the_crew_has_its_time():
    site = flipping_site()
    _, (motion,) = planned(site)
    assert np.ptp(motion.raising.radius_m) == np.ptp(motion.raising.slew_rad) == 0.0
    (raised,) = (phase for phase in motion.phases if phase.name is PhaseName.RAISE)
    rules = site.rules.two_hooks
    stands_s = (raised.end_ns - raised.start_ns) / 1e9 - motion.raising.duration_s
    assert stands_s == pytest.approx(10.0 + rules.unhook_s)
    assert motion.raising.duration_s > rules.turn_s


def test_a_crane_without_an_auxiliary_hook_is_named():
    plan, _ = planned(flipping_site(crane=crane_with(None)))
    assert plan.lifts[0].reason == (
        "it is turned over between two hooks, and test has no auxiliary one ([auxiliary] of its machine file)"
    )


def test_what_the_hooks_cannot_carry_is_named():
    weak = replace(AUXILIARY, chart=LoadChart((1000.0,), (7_000.0,)))
    (lift,) = planned(flipping_site(crane=crane_with(weak)))[0].lifts
    assert lift.status is Status.INFEASIBLE
    assert "between two hooks, 75 % of each capacity is permitted" in lift.reason
    (lift,) = planned(flipping_site(crane=crane_with(weak), start_vox=(24, 6, 1)))[0].lifts
    assert lift.reason == (
        "between two hooks it uses 78 % of the auxiliary hook of test at 10.9 m, and 75 % is permitted: "
        "7.2 t on the main hook at most, 4.8 t on the auxiliary one"
    )
    stated = replace(AUXILIARY, most_share=0.6)
    assert planned(flipping_site(crane=crane_with(stated)))[0].lifts[0].status is Status.INFEASIBLE


def test_a_hook_ahead_is_not_loaded_beyond_its_own_chart():
    """It hangs 1 m further out than the main hook, where its chart has ended."""
    near = replace(AUXILIARY, chart=LoadChart((11.5,), (9_000.0,)))
    place = {"start_vox": (24, 6, 1), "stored_pose": StoredPose.LYING_X, "stored_turn": 0}
    assert planned(flipping_site(**place))[0].lifts[0].status is Status.PLANNED
    assert planned(flipping_site(crane=crane_with(near), **place))[0].lifts[0].status is Status.INFEASIBLE


def test_it_is_written_and_read():
    site = flipping_site()
    plan, _ = planned(site)
    again, _ = plan_from_json(plan_to_json(plan), site, {0: plan.lifts[0].path_vox}, "log")
    assert again.lifts[0].flip == plan.lifts[0].flip
    assert again.lifts[0].place.transit_start_vox == plan.lifts[0].place.transit_start_vox


def test_upended_about_its_foot_it_states_nothing():
    plan, motions = planned(flipping_site(flip_rise_vox=0))
    assert plan.lifts[0].flip is None
    assert verify_plan(plan).verified and verify_motions(plan, motions).verified


def test_it_is_lifted_higher_if_it_is_thicker_or_the_rule_asks_for_more():
    (thin,), (thick,) = (flipping_site(thick_m=t).components for t in (0.5, 2.0))
    assert rise_to_flip_vox(thin, FlipRules(clear_m=0.0), 0.5) == 1
    assert rise_to_flip_vox(thick, FlipRules(clear_m=0.5), 0.5) == 2  # 0.5 + 0.41 x 1 m
    assert rise_to_flip_vox(thin, FlipRules(clear_m=1.0), 0.5) == 3
    squat = replace(thin, stored_pose=StoredPose.LYING_X, shape=flipping_site(thick_m=6.0).components[0].shape)
    assert rise_to_flip_vox(squat, FlipRules(), 0.5) == 0


def test_it_ends_below_its_head():
    (part,) = flipping_site().components
    assert upright_at_vox(part, StoredPose.LYING_X, 0) == (12, 0)
    assert upright_at_vox(part, StoredPose.AS_BUILT, 0) == (0, 0)


def test_the_plan_says_what_is_left_to_ask():
    plan, motions = planned(flipping_site())
    (line,) = (one for one in not_covered_by(plan) if one.code == "two_hooks")
    assert line.text.endswith("Here: every part that lies is turned over between two hooks, and its shares are proven.")
    said = [one.text for one in remarks_of(plan, motions) if one.text.startswith(FLIP_LEANS.sentence[:40])]
    assert len(said) == 1 and "degrees" in said[0]


def test_the_block_of_the_auxiliary_hook_counts_on_the_chart_and_not_on_the_rope():
    with_hook, without = (flipping_site(crane=crane_with(hook)) for hook in (AUXILIARY, None))
    (part,) = with_hook.components
    (one,), (other,) = with_hook.cranes, without.cranes
    assert hung_kg(one, part) - hung_kg(other, part) == AUXILIARY.hook_block_kg
    assert hoisted_kg(one, part) == hoisted_kg(other, part)
    assert permitted_for(with_hook, one, part) == permitted_for(without, other, part)


def test_the_line_about_one_hook_says_what_hangs_on_two():
    plan, _ = planned(flipping_site())
    (line,) = (one for one in not_covered_by(plan) if one.code == "tandem")
    assert line.text.endswith("Here: 1 hangs on both hooks of one crane while being turned over.")
