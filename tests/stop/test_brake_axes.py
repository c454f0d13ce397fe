"""Emergency stops from any state: they keep the limits, end at rest, and can be resumed."""

import dataclasses
from math import degrees, pi

import numpy as np
import pytest
from box_sites import box_site, test_crane
from crane_rooms import FRAME, crane_room
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import HAMMERHEADS
from ruckig import ControlInterface, InputParameter, Ruckig
from ruckig import Trajectory as RuckigTrajectory

from bimvox.crane.tower_crane import AxisLimits, CranePose
from bimvox.errors import InputError, PlanningError
from bimvox.motion.drive import drive_path
from bimvox.motion.swept import samples_are_free
from bimvox.motion.swing import rigged_crane
from bimvox.motion.time_plan import time_plan
from bimvox.planning.assembly import replay
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.search import shortest_path
from bimvox.proof.crane.axes import check_limits
from bimvox.proof.motion import verify_motions
from bimvox.records.motion import PhaseName
from bimvox.records.proof import Check
from bimvox.stop.brake_axes import AxisState, brake, stop_at, stop_from
from bimvox.stop.resume import cut_short, interrupted, resume, resume_cells

number = st.floats(0.05, 5.0)

SLEWING = HAMMERHEADS[0].slewing


@settings(max_examples=200, deadline=None)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), number, number, number)
def test_an_axis_brakes_as_ruckig_does_and_never_exceeds_its_limits(rate, acceleration, top, most, jerk):
    limits = AxisLimits(top, most, jerk)
    braking = brake(3.0, rate * top, acceleration * most, limits)
    state = InputParameter(1)
    state.control_interface = ControlInterface.Velocity
    state.current_position, state.current_velocity = [3.0], [rate * top]
    state.current_acceleration, state.target_velocity, state.target_acceleration = [acceleration * most], [0.0], [0.0]
    state.max_acceleration, state.max_jerk = [most], [jerk]
    known = RuckigTrajectory(1)
    Ruckig(1).calculate(state, known)
    assert braking.duration_s == pytest.approx(known.duration, abs=1e-6)
    assert braking.end == pytest.approx(known.at_time(known.duration)[0][0], abs=1e-6)
    _, _, a, j = braking.state.T
    assert np.abs(a).max() <= most * (1 + 1e-9)
    assert np.abs(j).max() <= jerk * (1 + 1e-9)
    assert braking.at(np.array([braking.duration_s + 1.0]))[0] == braking.end


def test_slewing_at_full_rate_stops_in_the_documented_degrees_and_seconds():
    braking = brake(0.0, SLEWING.rate, 0.0, SLEWING)
    # v / a + a / j, and half of it at full rate.
    wanted_s = SLEWING.rate / SLEWING.acceleration + SLEWING.acceleration / SLEWING.jerk
    assert braking.duration_s == pytest.approx(wanted_s) == pytest.approx(17.0)
    assert degrees(braking.end) == pytest.approx(40.8)
    # Without the second in which the deceleration builds up: 38 degrees and 16 s.
    sudden = brake(0.0, 0.8 * 2 * pi / 60, 0.0, AxisLimits(1.0, SLEWING.acceleration, 1e6))
    assert (degrees(sudden.end), sudden.duration_s) == (
        pytest.approx(38.4, abs=0.01),
        pytest.approx(16.0, abs=0.01),
    )


def test_an_axis_at_rest_stays():
    braking = brake(2.0, 0.0, 0.0, SLEWING)
    assert (braking.duration_s, braking.end) == (0.0, 2.0)
    stop = stop_from(crane_room(3).rigged, AxisState(np.array([1.0, 9.0, 5.0]), np.zeros(3), np.zeros(3)), 0)
    assert stop.pose == CranePose(1.0, 9.0, 5.0)
    assert stop.duration_s == 0.0


@pytest.fixture(scope="module")
def lifts():
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    columns = [("first", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0)), ("second", (5.0, 3.0, 0.0), (5.5, 3.5, 3.0))]
    site = box_site(columns, crane=crane, shape=(40, 30, 24))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, preparation, time_plan(plan, preparation)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.62, 0.8, 0.95])
def test_a_lift_stopped_anywhere_keeps_the_limits_holds_and_resumes_as_one_proven_motion(lifts, share):
    plan, preparation, motions = lifts
    site, motion = plan.site, motions[0]
    rigged = rigged_crane(site, site.cranes[0], site.components[motion.component])
    first, last = motion.loaded.time_ns[[0, -1]]
    told_ns = motion.start_ns + int(first + share * (last - first))
    stop = stop_at(rigged, motion, told_ns)
    assert told_ns <= stop.start_ns <= told_ns + 1_500_000_000
    lift, (_, space) = plan.lifts[0], next(iter(replay(site, preparation, plan)))
    assert samples_are_free(space, rigged.load, stop.trajectory.axes)
    goal = tuple(int(n) for n in lift.path_vox[-1])
    path = shortest_path(space, resume_cells(space, rigged.load, stop.pose)[0], goal).path_vox
    onward, needed_m = resume(rigged, space, stop.pose, path, 0)
    resume_ns = stop.end_ns + 20_000_000_000
    whole = interrupted(motion, stop, resume_ns, onward, needed_m, rigged)
    assert [p.name for p in whole.phases].count(PhaseName.STOP) == 1
    delay_ns = whole.end_ns - motion.end_ns
    shifted = dataclasses.replace(
        motions[1],
        start_ns=motions[1].start_ns + delay_ns,
        end_ns=motions[1].end_ns + delay_ns,
        phases=tuple(
            dataclasses.replace(p, start_ns=p.start_ns + delay_ns, end_ns=p.end_ns + delay_ns)
            for p in motions[1].phases
        ),
    )
    turned = whole.loaded.slew_rad[-1] - motion.loaded.slew_rad[-1]
    assert abs(turned) < 1e-9
    result = verify_motions(plan, [whole, shifted])
    assert result.verified, result.failures


@pytest.mark.parametrize("which", [0, 1])
def test_a_stop_ordered_soon_after_the_load_starts_to_move_keeps_the_limits(lifts, which):
    plan, _, motions = lifts
    site, motion = plan.site, motions[which]
    rigged = rigged_crane(site, site.cranes[0], site.components[motion.component])
    check, begins_ns = Check("axis_limits"), motion.start_ns + int(motion.loaded.time_ns[0])
    for told_ns in range(begins_ns + 10**7, begins_ns + 4 * 10**9, 10**8):
        stop = stop_at(rigged, motion, told_ns)
        assert told_ns <= stop.start_ns <= told_ns + 2_500_000_000
        check_limits(check, f"{told_ns}", site.cranes[0], cut_short(motion, stop), 0.0)
    assert check.passed, check.failures[:3]


def test_a_stop_begins_where_the_axes_are_and_is_sampled_until_the_last_one_rests():
    room = crane_room(3)
    timeline, _ = drive_path(room.rigged, room.space, room.path, 0, 0.0)
    at_s, step_s = timeline.duration_s / 2, 1e-3
    before, now, after = timeline.axes_at(np.array([at_s - step_s, at_s, at_s + step_s]))
    state = AxisState(now, (after - before) / (2.0 * step_s), (after - 2.0 * now + before) / step_s**2)
    stop = stop_from(room.rigged, state, 5)
    assert stop.start_ns == 5
    t = stop.trajectory
    assert (t.slew_rad[0], t.radius_m[0], t.height_m[0]) == pytest.approx(tuple(now))
    assert stop.duration_s == max(axis.duration_s for axis in stop.axes) <= timeline.duration_s / 2 + 1.0
    assert t.time_ns[-1] / 1e9 == pytest.approx(stop.duration_s, abs=1e-6)


def test_a_stop_outside_the_lift_and_an_unreachable_cell_are_refused(lifts):
    plan, _, motions = lifts
    component = plan.site.components[motions[0].component]
    rigged = rigged_crane(plan.site, plan.site.cranes[0], component)
    with pytest.raises(InputError, match="not under way"):
        stop_at(rigged, motions[0], motions[0].end_ns + 1)
    still = stop_at(rigged, motions[0], motions[0].start_ns)
    assert still.duration_s == 0.0
    room = crane_room(3)
    with pytest.raises(PlanningError, match="cannot be reached"):
        resume(room.rigged, room.space, CranePose(0.0, 5.0, 0.6), room.path, 0)
    assert FRAME.voxel_size_m == 0.5
