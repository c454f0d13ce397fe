"""The swing of a load in an emergency stop agrees with theory and with the proof, and its collisions are found."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sin

import numpy as np
import pytest
from box_sites import test_crane

from bimvox.motion.swept import LoadFrame
from bimvox.motion.swing import Pendulum, RiggedCrane, half_period_s, pendulum_length_m
from bimvox.proof.crane.pendulum import Hung, swung_parts
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.stop.brake_axes import AxisState, stop_from
from bimvox.stop.choose_stop import hangs_still_ns, swing_through

CRANE = test_crane(base=(0.0, 0.0, 0.0), jib=60.0, height=14.0)
HANGING = Pendulum(3.0)
RIGGED = RiggedCrane(CRANE, LoadFrame(0.0, 0.0, 0.0, 0.5), HANGING, 0.5)
HEIGHT_M = 6.0
PERIOD_S = 2.0 * half_period_s(pendulum_length_m(CRANE, HEIGHT_M, HANGING.below_hook_m))


def trajectory(time_s, radius_m):
    n = len(time_s)
    ns = np.round(np.asarray(time_s) * 1e9).astype(np.int64)
    return Trajectory(ns, np.zeros(n), np.asarray(radius_m, float), np.full(n, HEIGHT_M), np.empty(0, np.int64), 0.0)


def running(rate_m_s: float, for_s: float):
    """Return a trolley move that accelerates within one whole period, which leaves no swing, and continues."""
    time_s = np.arange(0.0, PERIOD_S + for_s, 0.05)
    speeding = np.minimum(time_s, PERIOD_S)
    radius = 8.0 + rate_m_s * (speeding**2 / (2.0 * PERIOD_S) + time_s - speeding)
    part = trajectory(time_s, radius)
    end_ns = int(part.time_ns[-1])
    motion = LiftMotion(0, 0, None, part, part, (Phase(PhaseName.TRAVERSE, 0, end_ns),), 0, end_ns)
    stop_ns = int((PERIOD_S + 0.5 * for_s) * 1e9)
    at = int(np.searchsorted(part.time_ns, stop_ns))
    state = AxisState(np.array([0.0, radius[at], HEIGHT_M]), np.array([0.0, rate_m_s, 0.0]), np.zeros(3))
    stop = stop_from(RIGGED, state, int(part.time_ns[at]))
    return motion, part, stop


@pytest.mark.parametrize("rate_m_s", [0.3, 0.6, 0.9])
def test_the_swing_that_a_stop_leaves_agrees_with_theory(rate_m_s):
    """By theory, the swing is the spectrum of a deceleration of v / a seconds that builds up in a / j seconds."""
    motion, part, stop = running(rate_m_s, 4.0)
    found = swing_through(motion, part, stop, HANGING)
    pulse = 2.0 * pi / PERIOD_S
    most, jerk = CRANE.trolley.acceleration, CRANE.trolley.jerk
    braking_s, ramp_s = rate_m_s / most, most / jerk
    if braking_s < ramp_s:  # the limit is not reached
        braking_s = ramp_s = (rate_m_s / jerk) ** 0.5
    left_m = rate_m_s / pulse * abs(sin(pulse * braking_s / 2) / (pulse * braking_s / 2))
    left_m *= abs(sin(pulse * ramp_s / 2) / (pulse * ramp_s / 2))
    after = found.time_ns > stop.end_ns
    assert found.swing.amplitude_m[after] == pytest.approx(left_m, rel=0.03, abs=0.004)
    assert np.hypot(*found.swing.offset_m[after].T).max() == pytest.approx(left_m, rel=0.03, abs=0.004)
    assert found.peak_m >= left_m * 0.97
    # The same by the proof's own integrator, from the written samples.
    driven = part.time_ns < stop.start_ns
    whole_ns = np.concatenate(
        [part.time_ns[driven], stop.trajectory.time_ns + stop.start_ns, [stop.end_ns + 20 * 10**9]]
    )
    radius = np.concatenate([part.radius_m[driven], stop.trajectory.radius_m, [stop.pose.radius_m]])
    whole = trajectory(np.append(whole_ns, whole_ns[-1] + 10**9) / 1e9, np.append(radius, radius[-1]))
    held = Phase(PhaseName.STOP, stop.start_ns, int(whole_ns[-1]))
    stopped = replace(motion, loaded=whole, phases=(held,), end_ns=int(whole.time_ns[-1]))
    first, second = swung_parts(CRANE, stopped, whole, Hung(HANGING.below_hook_m))
    beyond = first.time_s * 1e9 >= stop.start_ns
    assert np.hypot(*first.offset_m[beyond].T).max() == pytest.approx(found.peak_m, rel=0.02, abs=0.004)
    assert np.hypot(*second.offset_m.T).max() < 1e-9, "it was brought to rest while it was held"
    assert first.time_s[-1] * 1e9 <= stop.end_ns + 1.01e9 * PERIOD_S, "one period is enough"
    assert hangs_still_ns(stopped, whole, int(whole.time_ns[-1])) == held.end_ns


def test_a_load_that_swings_before_a_stop_continues_to_swing():
    """Not only braking counts: in the middle of a shaped move, the load is swinging already."""
    motion, part, _ = running(0.6, 4.0)
    at = int(np.searchsorted(part.time_ns, int(0.5 * PERIOD_S * 1e9)))
    rate = 0.6 * 0.5
    state = AxisState(np.array([0.0, part.radius_m[at], HEIGHT_M]), np.array([0.0, rate, 0.0]), np.zeros(3))
    stop = stop_from(RIGGED, state, int(part.time_ns[at]))
    swinging = swing_through(motion, part, stop, HANGING)
    still = swing_through(
        motion, trajectory(part.time_ns[at - 1 : at + 1] / 1e9, part.radius_m[at - 1 : at + 1]), stop, HANGING
    )
    begin = int(np.searchsorted(swinging.time_ns, stop.start_ns))
    assert np.hypot(*swinging.swing.offset_m[begin]) > 0.1
    assert abs(swinging.peak_m - still.peak_m) > 0.02
