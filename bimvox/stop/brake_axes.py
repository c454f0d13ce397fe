"""An emergency stop: the crane brakes on all axes from any state, sampled as one motion.

Every axis brakes independently, as fast as its acceleration and jerk allow, so the hook leaves the proven line. The
caller checks where it comes to rest and what it sweeps. A real crane needs long: slewing at 0.8 rpm with 0.3 deg/s^2
built up within a second, about 41 degrees and 17 s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.bound import point_to_point_s
from bimvox.crane.luffing import radius_limits
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.motion.rigged_crane import RiggedCrane
from bimvox.motion.timing import sample_times
from bimvox.motion.trajectories import between, delayed, trajectory_of
from bimvox.records.motion import LiftMotion
from bimvox.records.trajectory import Trajectory
from bimvox.stop.axis_state import AxisState, state_at
from bimvox.stop.braking import AxisBraking, brake
from bimvox.units import NS_PER_S

Three = tuple[AxisBraking, AxisBraking, AxisBraking]
"""Slewing, radius (trolley or jib), hoist."""

STOP_EVENT = "stop"
"""Kind of the log event of a stop."""
_TRIES = 8
_NO_CORNERS = np.empty(0, np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class EmergencyStop:
    """All axes braking to rest.

    Attributes:
        crane: The crane.
        start_ns: When braking begins, on the site's clock.
        axes: Slewing, trolley, hoist.
        trajectory: Its samples, times from ``start_ns``.
        swing_m: Peak swing of its load during and after it; 0 if that is not checked.
    """

    crane: TowerCrane
    start_ns: int
    axes: Three
    trajectory: Trajectory
    swing_m: float = 0.0

    @property
    def end_ns(self) -> int:
        """When the last axis is at rest, on the site's clock."""
        return self.start_ns + int(self.trajectory.time_ns[-1])

    @property
    def duration_s(self) -> float:
        """Braking time of the slowest axis."""
        return max(axis.duration_s for axis in self.axes)

    @property
    def pose(self) -> CranePose:
        """The crane's pose at rest."""
        slew, trolley, hoist = self.axes
        return CranePose(slew.end, trolley.end, hoist.end)


def stop_at(rigged: RiggedCrane, motion: LiftMotion, time_ns: int) -> EmergencyStop:
    """Return the stop of the crane on a stop command during a lift.

    Samples hold no rates or accelerations, and an approximate state would break the limits. So braking begins at the
    first sample after the command at which the state is known exactly (the samples before it lie on one piece of
    constant jerk), within two seconds.

    Raises:
        InputError: If the lift is not under way then.
    """
    at_ns, state = state_at(motion, time_ns)
    return stop_from(rigged, state, at_ns)


def stop_from(rigged: RiggedCrane, state: AxisState, start_ns: int) -> EmergencyStop:
    """Return the stop of the crane from a state of its axes; braking begins at ``start_ns`` on the site's clock."""
    crane = rigged.crane
    position, rate, acceleration = state.position.tolist(), state.rate.tolist(), state.acceleration.tolist()
    slew = brake(position[0], rate[0], acceleration[0], crane.slewing)
    radius = brake_radius(crane, position[1], rate[1], acceleration[1])
    hoist = brake(position[2], rate[2], acceleration[2], crane.hoist)
    return to_rest(rigged, (slew, radius, hoist), start_ns)


def to_rest(rigged: RiggedCrane, axes: Three, start_ns: int) -> EmergencyStop:
    """Return the stop made of three axes that brake from ``start_ns`` on."""
    crane = rigged.crane
    motion = _ToRest(crane, axes)
    end_ns = max(1, int(np.ceil(max(axis.duration_s for axis in axes) * NS_PER_S)))
    time_ns = sample_times(motion, end_ns, _NO_CORNERS, rigged)
    samples = motion.axes_at(time_ns / NS_PER_S)
    first, last = (CranePose(*samples[i].tolist()) for i in (0, -1))
    bound_s = min(point_to_point_s(crane, first, last, -np.inf), end_ns / NS_PER_S)
    return EmergencyStop(crane, start_ns, axes, trajectory_of(time_ns, samples, _NO_CORNERS, bound_s))


def stop_under_way(crane: TowerCrane, motion: LiftMotion, time_ns: int) -> EmergencyStop | None:
    """Return the stop of a load that brakes, or is held after braking, at a time on the site's clock; None if none."""
    loaded = motion.loaded
    for start_ns, end_ns in motion.stops_ns:
        told_ns, resumes_ns = start_ns - motion.start_ns, end_ns - motion.start_ns
        if not start_ns <= time_ns < end_ns or told_ns < loaded.time_ns[0]:
            continue
        part = between(loaded, told_ns, resumes_ns - 1)
        slew, radius, height = part.axes[-1].tolist()
        at_rest = brake(slew, 0.0, 0.0, crane.slewing), brake(radius, 0.0, 0.0, crane.trolley)
        axes = (*at_rest, brake(height, 0.0, 0.0, crane.hoist))
        return EmergencyStop(crane, start_ns, axes, delayed(part, -told_ns))
    return None


def brake_radius(crane: TowerCrane, radius_m: float, rate: float, acceleration: float) -> AxisBraking:
    """Return the fastest braking of the axis that changes the radius.

    The limits of a luffing jib depend on the radius. It brakes within the limits that hold between its radius and the
    one at which it comes to rest; that range is widened until it suffices. Its hoist has its own share of the winch.
    """
    jib = crane.luffing
    if jib is None:
        return brake(radius_m, rate, acceleration, crane.trolley)
    low_m, high_m = jib.radii_m
    within = (radius_m, radius_m)
    for _ in range(_TRIES):
        found = brake(radius_m, rate, acceleration, radius_limits(jib, jib.winch, *within))
        reached = (min(radius_m, found.reach[0]), max(radius_m, found.reach[1]))
        if within[0] <= reached[0] and reached[1] <= within[1]:
            return found
        # A little more than needed: the next try is slower and goes further.
        more = 0.1 * (reached[1] - reached[0])
        within = (max(low_m, reached[0] - more), min(high_m, reached[1] + more))
    return brake(radius_m, rate, acceleration, crane.trolley)


@dataclass(frozen=True, slots=True, eq=False)
class _ToRest:
    """Three braking axes as a motion that can be sampled."""

    crane: TowerCrane
    axes: Three

    @property
    def top_speed_m_s(self) -> float:
        """Upper bound of the hook's speed: all axes at their fastest, at the largest radius."""
        slew, radius, hoist = self.axes
        reach_m = max(abs(position) for position in radius.reach)
        return float(np.linalg.norm([reach_m * slew.top_rate, radius.top_rate, hoist.top_rate]))

    def axes_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times."""
        return np.stack([axis.at(time_s) for axis in self.axes], axis=1)
