"""The proof's own braking: within the limits, at rest at the end, as far as the planner's braking."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.tower_crane import AxisLimits
from bimvox.proof.crane.way import braked, braking_time_s
from bimvox.stop.brake_axes import brake

LIMITS = AxisLimits(rate=1.0, acceleration=0.3, jerk=0.5)

rates = st.floats(-1.0, 1.0)
accelerations = st.floats(-0.3, 0.3)


def test_from_full_rate_the_distance_is_that_of_the_trapezium():
    """Mean rate v / 2 over v / a + a / j seconds: the deceleration rises and fades symmetrically."""
    time_s = 1.0 / 0.3 + 0.3 / 0.5
    assert braking_time_s(1.0, 0.0, LIMITS) == pytest.approx(time_s)
    reached = braked(2.0, 1.0, 0.0, LIMITS, np.array([0.0, time_s, 2.0 * time_s]))
    assert reached == pytest.approx([2.0, 2.0 + 0.5 * time_s, 2.0 + 0.5 * time_s])


def test_an_axis_at_rest_stays_there():
    assert braking_time_s(0.0, 0.0, LIMITS) == pytest.approx(0.0)
    assert braked(7.0, 0.0, 0.0, LIMITS, np.arange(3.0)) == pytest.approx([7.0, 7.0, 7.0])


@given(rates, accelerations)
def test_every_stop_keeps_the_limits_and_ends_at_rest(rate, acceleration):
    end_s = braking_time_s(rate, acceleration, LIMITS)
    time_s = np.linspace(0.0, end_s + 1.0, 4001)
    position, step_s = braked(0.0, rate, acceleration, LIMITS, time_s), time_s[1]
    rates, bends = np.diff(position) / step_s, np.diff(position, 2) / step_s**2
    assert np.abs(position[time_s > end_s] - position[-1]).max() < 1e-9
    assert rates[0] == pytest.approx(rate, abs=0.31 * step_s)
    assert np.abs(bends).max() <= LIMITS.acceleration + 1e-6
    assert np.abs(np.diff(bends)).max() <= LIMITS.jerk * step_s + 1e-6


@given(rates, accelerations)
def test_the_stops_that_are_planned_end_in_the_same_place(rate, acceleration):
    planned = brake(3.0, rate, acceleration, LIMITS)
    time_s = np.linspace(0.0, planned.duration_s + 0.5, 50)
    assert braked(3.0, rate, acceleration, LIMITS, time_s) == pytest.approx(planned.at(time_s), abs=1e-6)
