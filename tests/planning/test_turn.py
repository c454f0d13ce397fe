import dataclasses

import numpy as np
import pytest
from box_sites import box_cells, box_site, test_crane

from bimvox.log.plan_json import plan_from_json, plan_to_json
from bimvox.log.track import crane_track
from bimvox.planning.assembly import prepare, replay
from bimvox.planning.lift import Status
from bimvox.planning.planner import plan_lifts
from bimvox.planning.verify import verify_plan
from bimvox.site.site import Blocker
from bimvox.trajectory.motion import PhaseName
from bimvox.trajectory.time_plan import time_plan
from bimvox.trajectory.verify import verify_motions

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
    motions = time_plan(plan, replay(site, preparation, plan))
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
    motions = time_plan(plan, replay(site, preparation, plan))
    assert verify_motions(plan, motions).verified
    again, _ = plan_from_json(plan_to_json(plan), site, {0: lift.path_vox}, "log")
    place = again.lifts[0].place
    assert (place.turn, place.rise_vox, place.shift_vox) == (turn, lift.place.rise_vox, lift.place.shift_vox)
    assert place.transit_start_vox == tuple(lift.path_vox[0])


def test_a_turn_that_the_log_does_not_time_is_found():
    site = site_of()
    preparation, plan = planned(site)
    (motion,) = time_plan(plan, replay(site, preparation, plan))
    place = dataclasses.replace(plan.lifts[0].place, turn=3)
    assert not verify_plan(dataclasses.replace(plan, lifts=(dataclasses.replace(plan.lifts[0], place=place),))).verified
    phases = tuple(
        dataclasses.replace(p, name=PhaseName.RAISE if p.name is PhaseName.TURN else p.name) for p in motion.phases
    )
    assert not verify_motions(plan, (dataclasses.replace(motion, phases=phases),)).verified
