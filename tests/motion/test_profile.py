import socket
from pathlib import Path

import numpy as np
import pytest
from ruckig import InputParameter, Result, Ruckig, Synchronization
from ruckig import Trajectory as RuckigTrajectory

import bimvox.motion
from bimvox.crane.tower_crane import AxisLimits
from bimvox.crane.travel import rest_to_rest_s
from bimvox.errors import PlanningError
from bimvox.motion.profile import profile_of, smoothed


@pytest.mark.parametrize(
    "limits", [AxisLimits(0.02, 0.004, 0.003), AxisLimits(2.0, 0.01, 5.0), AxisLimits(5.0, 9.0, 0.4)]
)
def test_a_profile_is_the_integral_of_its_jerk(limits):
    profile = profile_of(limits)
    assert profile.duration_s == pytest.approx(rest_to_rest_s(1.0, limits), rel=1e-6)
    time = np.linspace(-1.0, profile.duration_s + 1.0, 5000)
    share = profile.share_at(time)
    assert share[0] == 0.0
    assert share[-1] == 1.0
    assert (np.diff(share) >= 0.0).all()
    assert np.diff(share).max() / (time[1] - time[0]) == pytest.approx(profile.top_rate, rel=1e-3)


@pytest.mark.parametrize("ramp_s", [0.4, 1.5, 6.0])
@pytest.mark.parametrize(
    "limits", [AxisLimits(0.02, 0.004, 0.003), AxisLimits(2.0, 0.01, 5.0), AxisLimits(5.0, 9.0, 0.4)]
)
def test_a_smoothed_profile_speeds_up_in_ramps_of_the_time_wanted_within_its_limits(limits, ramp_s):
    soft = smoothed(limits, ramp_s)
    assert soft.rate == limits.rate
    assert soft.acceleration <= limits.acceleration
    assert soft.jerk <= limits.jerk * (1.0 + 1e-12)
    starts, jerks = profile_of(soft).pieces[:, 0], profile_of(soft).pieces[:, 4]
    lengths = np.diff(np.append(starts, profile_of(soft).duration_s))
    ramps = lengths[jerks != 0.0] / ramp_s  # two that follow each other are one piece
    assert ramps == pytest.approx([1, 1, 1, 1] if len(ramps) == 4 else [1, 2, 1], rel=1e-6)


def test_a_profile_whose_pieces_vanish_is_found_too():
    # Hoisting 0.6 m at 0.3 m/s^2 and 0.3 m/s^3 just reaches the acceleration. Ruckig alone refuses some of these.
    for way in (0.6, 0.6 * (1 + 1e-15), 0.2 * 3):
        for rate in (43 / 60, 0.7, 0.3, 1.0):
            limits = AxisLimits(rate / way, 0.3 / way, 0.3 / way)
            assert profile_of(limits).duration_s == pytest.approx(rest_to_rest_s(1.0, limits), rel=1e-4)


def test_invalid_limits_are_refused():
    with pytest.raises(PlanningError, match="must all be positive"):
        profile_of(AxisLimits(1.0, -1.0, 1.0))


def test_waypoints_are_never_given_to_ruckig(monkeypatch):
    # Ruckig would send them to a network service.
    folder = Path(bimvox.motion.__file__).parent
    assert not [path.name for path in folder.rglob("*.py") if "intermediate_positions" in path.read_text()]

    def no_network(*_):
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket, "socket", no_network)
    assert profile_of(AxisLimits(1.0, 1.0, 1.0)).duration_s > 0.0


def test_the_limits_are_projected_onto_the_line_first():
    # Ruckig's phase synchronisation falls back silently: this motion of three axes is not straight.
    state, found = InputParameter(3), RuckigTrajectory(3)
    state.current_position, state.target_position = [0.0] * 3, [1.0, 20.0, 1.0]
    state.max_velocity, state.max_acceleration = [0.0838, 0.63, 0.72], [0.005236, 0.25, 0.3]
    state.max_jerk, state.synchronization = [0.005236, 0.25, 0.3], Synchronization.Phase
    assert Ruckig(3).calculate(state, found) == Result.Working
    shares = np.array([found.at_time(t)[0] for t in np.linspace(0.0, found.duration, 50)]) / [1.0, 20.0, 1.0]
    assert np.abs(shares - shares[:, :1]).max() > 0.05
