import dataclasses
import itertools

import numpy as np
import pytest
from box_sites import box_cells, box_site, test_crane
from scipy.spatial.transform import Rotation

from bimvox.log.plan_json import plan_from_json, plan_to_json
from bimvox.log.track import crane_track
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.records.motion import PhaseName
from bimvox.remarks.remarks import remarks_of
from bimvox.remarks.table import RAISED_NEAR
from bimvox.site.component import StoredPose
from bimvox.site.site import Blocker, Rules

BEAM = ("beam", (1.0, 2.0, 1.0), (9.0, 2.5, 1.5))  # 8 m along x, for a yard that is 2 m wide in x
FEET = [("west", (1.0, 2.0, 0.0), (1.5, 2.5, 0.98)), ("east", (8.5, 2.0, 0.0), (9.0, 2.5, 0.98))]
NARROW = ((28.0, 2.0), (32.0, 28.0))


def site_of(*parts, **more):
    return box_site(parts or (BEAM,), structure=FEET, yard=NARROW, crane=test_crane(base=(13.0, 13.0, 0.0)), **more)


def planned(site):
    preparation = prepare(site)
    return preparation, plan_lifts(site, preparation)


def test_a_long_beam_lies_turned_in_a_narrow_yard_and_is_turned_back_above_it():
    site = site_of()
    preparation, plan = planned(site)
    lift = plan.lifts[0]
    assert lift.status is Status.PLANNED
    assert lift.place.turn == 1
    assert lift.place.shape.size_vox == (1, 16, 1)
    hook = np.add(lift.place.transit_start_vox, site.components[0].hook_offset_vox)[:2]
    assert site.yard[tuple(hook)]
    assert verify_plan(plan).verified
    motions = time_plan(plan, preparation)
    assert verify_motions(plan, motions).verified
    turned = [phase for phase in motions[0].phases if phase.name is PhaseName.TURN]
    assert [(phase.end_ns - phase.start_ns) / 1e9 for phase in turned] == [site.rules.turn_s]
    track = crane_track(site, lift, motions[0])
    assert track.tilt[0] == pytest.approx([0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)])
    assert track.tilt[-1] == pytest.approx([0, 0, 0, 1])
    # Turned counter-clockwise, the corner of the part's frame is at the yard cells' lowest y and highest x.
    low_m = site.frame.corner_of(lift.place.cell_vox)
    assert track.corner_m[0] == pytest.approx(low_m + np.array([site.frame.voxel_size_m, 0, 0]))


def test_it_rises_above_its_neighbours_before_it_is_turned():
    other = ("block", (4.0, 8.0, 0.0), (5.0, 9.0, 2.0))
    site = site_of(BEAM, other)
    _, plan = planned(site)
    lift = next(lift for lift in plan.lifts if lift.component == 0)
    assert lift.status is Status.PLANNED
    assert verify_plan(plan).verified
    if any(o.component == 1 and o.order > lift.order for o in plan.lifts):
        assert lift.place.rise_vox >= 4
    low = dataclasses.replace(lift.place, rise_vox=1)
    path = np.concatenate([np.array([low.transit_start_vox]), lift.path_vox[lift.path_vox[:, 2] > 4]])
    lower = dataclasses.replace(lift, place=low, path_vox=path.astype(np.int32))
    lifts = tuple(lower if o is lift else o for o in plan.lifts)
    assert not verify_plan(dataclasses.replace(plan, lifts=lifts)).verified


def test_what_blocks_the_turn_is_named():
    site = site_of()
    post = Blocker("post", "obstruction", box_cells(site.frame, (11.0, 0.0, 0.0), (12.0, 14.5, 9.0)))
    _, plan = planned(dataclasses.replace(site, blockers=(*site.blockers, post)))
    lift = plan.lifts[0]
    assert lift.status is Status.INFEASIBLE
    assert lift.reason == "it cannot be turned above its place in the yard"
    assert lift.blocked_by == ("post",)


@pytest.mark.parametrize("turn", [1, 2, 3])
def test_a_turn_that_the_site_file_gives_is_kept_and_written(turn):
    name, low, high = BEAM
    part = (name, low, (high[0] - 6.0, high[1], high[2]), {"stored_turn": turn})
    site = site_of(part)
    preparation, plan = planned(site)
    lift = plan.lifts[0]
    assert (lift.status, lift.place.turn) == (Status.PLANNED, turn)
    assert verify_plan(plan).verified
    motions = time_plan(plan, preparation)
    assert verify_motions(plan, motions).verified
    again, _ = plan_from_json(plan_to_json(plan), site, {0: lift.path_vox}, "log")
    place = again.lifts[0].place
    assert (place.turn, place.rise_vox, place.shift_vox) == (turn, lift.place.rise_vox, lift.place.shift_vox)
    assert place.transit_start_vox == tuple(lift.path_vox[0])


def test_a_turn_without_time_in_the_log_is_found():
    site = site_of()
    preparation, plan = planned(site)
    (motion,) = time_plan(plan, preparation)
    place = dataclasses.replace(plan.lifts[0].place, turn=3)
    assert not verify_plan(dataclasses.replace(plan, lifts=(dataclasses.replace(plan.lifts[0], place=place),))).verified
    phases = tuple(
        dataclasses.replace(p, name=PhaseName.RAISE if p.name is PhaseName.TURN else p.name) for p in motion.phases
    )
    assert not verify_motions(plan, (dataclasses.replace(motion, phases=phases),)).verified


PANEL = ("panel", (2.0, 2.0, 0.0), (2.5, 4.0, 6.0), {"erected": True})  # 6 m high, 2 m wide, half a metre thick
STRIP = ((24.0, 4.0), (38.0, 7.0))  # 1.5 m wide in y: it lies along x, its width can only be the panel's thickness


def panel_site(**more):
    name, low, high, options = PANEL
    return box_site(
        [(name, low, high, {**options, **more})],
        yard=STRIP,
        crane=test_crane(base=(13.0, 13.0, 0.0)),
        shape=(44, 30, 24),
    )


def test_a_part_is_erected_and_turned_in_one_lift():
    site = panel_site()
    preparation, plan = planned(site)
    (lift,) = plan.lifts
    assert (lift.status, lift.place.pose, lift.place.turn) == (Status.PLANNED, StoredPose.LYING_X, 1)
    assert lift.place.shape.size_vox == (12, 1, 4)
    assert verify_plan(plan).verified
    (motion,) = time_plan(plan, preparation)
    assert verify_motions(plan, (motion,)).verified
    assert {PhaseName.RAISE, PhaseName.TURN} <= {phase.name for phase in motion.phases}
    assert motion.raising.slew_rad[0] != motion.raising.slew_rad[-1]  # hooked at its head, tipped upright over its foot
    again, _ = plan_from_json(plan_to_json(plan), site, {0: lift.path_vox}, "log")
    assert again.lifts[0].place.transit_start_vox == lift.place.transit_start_vox


def test_its_box_is_shown_lying_being_upended_and_turning():
    """The frame of the track puts the panel's corners in its yard cells, then upright, then as in the building."""
    site = panel_site()
    preparation, plan = planned(site)
    (motion,) = time_plan(plan, preparation)
    track = crane_track(site, plan.lifts[0], motion)
    size_m = site.frame.voxel_size_m * np.array(site.components[0].shape.size_vox)
    corners = np.array(list(itertools.product(*zip(np.zeros(3), size_m, strict=True))))

    def box(n):
        there = Rotation.from_quat(track.tilt[n]).apply(corners) + track.corner_m[n]
        return there.min(axis=0), there.max(axis=0)

    place = plan.lifts[0].place
    low_m = site.frame.corner_of(place.cell_vox)
    np.testing.assert_allclose(box(0), [low_m, low_m + np.array([6.0, 0.5, 2.0])], atol=1e-6)
    raised = int(np.searchsorted(track.time_ns, motion.start_ns + int(motion.raising.time_ns[-1])))
    up_m = low_m + np.array([0, 0, place.rise_vox * site.frame.voxel_size_m])
    up_m[:2] -= 0.25  # its hook is half a cell aside, to another side as it lies: it turns onto whole cells from here
    np.testing.assert_allclose(box(raised), [up_m, up_m + np.array([2.0, 0.5, 6.0])], atol=0.02)
    steps_m = np.linalg.norm(np.diff(track.corner_m[: raised + 2], axis=0), axis=1)
    assert steps_m.max() < 0.8  # no jump along the track
    np.testing.assert_allclose(box(-1)[0], site.frame.corner_of(site.components[0].target_vox), atol=1e-6)


@pytest.mark.parametrize(("pose", "turn"), [(StoredPose.LYING_X, 3), (StoredPose.LYING_Y, 2), (StoredPose.LYING_X, 2)])
def test_pose_and_turn_of_the_site_file_are_kept(pose, turn):
    site = dataclasses.replace(panel_site(stored_pose=pose, stored_turn=turn), yard=np.ones((44, 30), bool))
    preparation, plan = planned(site)
    (lift,) = plan.lifts
    assert (lift.status, lift.place.pose, lift.place.turn) == (Status.PLANNED, pose, turn)
    assert verify_plan(plan).verified
    assert verify_motions(plan, time_plan(plan, preparation)).verified


def test_a_post_where_it_is_erected_or_turned_is_found_by_the_verifier():
    site = panel_site()
    _, plan = planned(site)
    (lift,) = plan.lifts
    x, y, _ = lift.place.cell_vox
    lows = {"erected": (x + 2, y, 7), "turned": (x + 2, y - 2, 1 + lift.place.rise_vox)}
    for word, cell in lows.items():
        post = Blocker("post", "obstruction", np.array([cell], np.int32))
        spoiled = dataclasses.replace(plan, site=dataclasses.replace(site, blockers=(*site.blockers, post)))
        failures = " ".join(verify_plan(spoiled).failures)
        assert f"meets post while it is {word}" in failures


GATE = [
    ("left", (8.0, 0.0, 0.0), (8.5, 4.5, 8.5)),
    ("right", (8.0, 6.0, 0.0), (8.5, 15.0, 8.5)),
]


def test_a_long_beam_passes_lengthwise_through_a_narrow_place():
    """A wall as high as the site with a gap of 1.5 m; the beam of 6 m is stored turned, across its path."""
    beam = ("beam", (1.0, 5.0, 0.0), (7.0, 5.5, 0.5))
    site = box_site(
        [beam], structure=GATE, yard=((30.0, 2.0), (32.0, 28.0)), shape=(40, 30, 18), rules=Rules(rope=False)
    )
    _, plan = planned(site)
    (lift,) = plan.lifts
    assert (lift.status, lift.place.turn) == (Status.PLANNED, 1)
    assert verify_plan(plan).verified
    # The same beam along y does not pass through the gap.
    across = ("beam", (1.0, 3.0, 0.0), (1.5, 9.0, 0.5))
    _, plan = planned(box_site([across], structure=GATE, shape=(40, 30, 18), rules=Rules(rope=False)))
    assert plan.lifts[0].status is Status.INFEASIBLE
    assert set(plan.lifts[0].blocked_by) >= {"left", "right"}


COLUMNS = [(f"column {n}", (1.0 + 2.0 * n, 1.0, 0.0), (1.5 + 2.0 * n, 1.5, 4.0), {"erected": True}) for n in range(3)]


def columns_planned(yard, **rules):
    """Return the plan of three columns whose yard is next to a wall, and the parts that are upended too near."""
    wall = [("wall", (25.0, 0.0, 0.0), (25.5, 15.0, 3.0))]
    crane = test_crane(base=(12.0, -3.0, 0.0), jib=40.0, height=20.0)
    own = Rules(transit_clearance_m=2.0, upending_clearance_m=2.0, **rules)
    site = box_site(COLUMNS, crane=crane, shape=(60, 40, 36), yard=yard, structure=wall, rules=own)
    preparation, plan = planned(site)
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    remarks = remarks_of(plan, time_plan(plan, preparation))
    return plan, {one.component for one in remarks if one.kind == RAISED_NEAR.code}


def test_upended_columns_keep_the_clearance_of_loads_in_transit_if_the_yard_has_room():
    plan, near = columns_planned(((24.0, 8.0), (60.0, 40.0)))
    assert not near
    wall, size_vox = plan.site.blockers[1].cells, 4
    for lift in plan.lifts:
        low = np.array(lift.place.cell_vox)
        high = low + lift.place.raising_size_vox(plan.site.components[lift.component])
        later = (one for one in plan.lifts if one.order > lift.order and one.place.delivery == lift.place.delivery)
        for cells in (wall, *(one.place.shape.cells + np.array(one.place.cell_vox) for one in later)):
            assert (np.maximum(low - cells - 1, cells - high).max(axis=1) >= size_vox).all()
    _, near = columns_planned(((46.0, 8.0), (50.0, 40.0)), gives_way=("transit_clearance_m", "upending_clearance_m"))
    assert near


def test_a_turned_part_is_raised_clear_of_what_it_turns_above():
    free, near = (
        planned(site_of(rules=Rules(turning_clearance_m=clearance_m)))[1].lifts[0].place.rise_vox
        for clearance_m in (2.0, 0.0)
    )
    assert free >= near + 4
