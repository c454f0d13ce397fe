"""An emergency stop: the crane brakes on all axes from any state, sampled as one motion.

Every axis brakes independently, as fast as its acceleration and jerk allow, so the hook leaves the proven line. The
caller checks where it comes to rest and what it sweeps. A real crane needs long: slewing at 0.8 rpm with 0.3 deg/s^2
built up within a second, about 41 degrees and 17 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane, radius_limits
from bimvox.crane.travel import point_to_point_s
from bimvox.errors import InputError
from bimvox.motion.swing import RiggedCrane
from bimvox.motion.timeline import sample_times
from bimvox.motion.trajectories import between, delayed, trajectory_of
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.units import NS_PER_S

_WINDOW = 5
"""Samples from which the state is taken: four give a cubic, the fifth checks it."""
_WAIT_NS = 2 * NS_PER_S
_SAME = 1e-9
_FROM_REST = 2
"""Samples after a rest from which the state is taken: one gives the jerk, the other checks it."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisState:
    """Position, rate and acceleration of the axes.

    Attributes:
        position: (3,) float64 slew (rad), radius (m), height (m).
        rate: (3,) float64 per second.
        acceleration: (3,) float64 per second squared.
    """

    position: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]


def state_at(motion: LiftMotion, time_ns: int) -> tuple[int, AxisState]:
    """Return the state of the axes at the first sample from a time on at which it is known exactly.

    Returns the time of that sample on the site's clock, and the state there. Raises InputError: if the lift is not
    under way then.
    """
    if not motion.start_ns <= time_ns <= motion.end_ns:
        raise InputError(
            f"lift {motion.number} is not under way at {time_ns / NS_PER_S:g} s",
            hint=f"it runs from {motion.start_ns / NS_PER_S:g} to {motion.end_ns / NS_PER_S:g} s",
        )
    for part in motion.trajectories:
        part_ns = part.time_ns + np.int64(motion.start_ns)
        if part_ns[0] < time_ns < part_ns[-1]:
            return _state_within(part_ns, part.axes, part.corner, time_ns)
    times, axes = motion.samples()
    still = axes[int(np.searchsorted(times, time_ns))]
    return time_ns, AxisState(still, np.zeros(3), np.zeros(3))


def _state_within(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], corner: NDArray[np.int64], wanted_ns: int
) -> tuple[int, AxisState]:
    """Return the first sample from ``wanted_ns`` on whose predecessors lie on a cubic; the best fit if none does."""
    last = len(time_ns) - 1
    first = min(max(int(np.searchsorted(time_ns, wanted_ns)), _FROM_REST), last)
    best: tuple[float, int, AxisState] | None = None
    for at in range(first, len(time_ns)):
        if best is not None and time_ns[at] > wanted_ns + _WAIT_NS:
            break
        state = _state_from_rest(time_ns, axes, corner, at)
        if state is not None:
            return int(time_ns[at]), state
        if at < min(_WINDOW - 1, last):
            continue
        off, state = _cubic_state(time_ns, axes, at)
        if best is None or off < best[0]:
            best = (off, int(time_ns[at]), state)
        if off <= _SAME:
            break
    assert best is not None
    return best[1], best[2]


def _state_from_rest(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], corner: NDArray[np.int64], at: int
) -> AxisState | None:
    """Return the state soon after a rest; None once an axis has left its first piece of constant jerk."""
    rest = max([0, *(int(n) for n in corner if n <= at)])
    if at - rest < _FROM_REST:
        return None
    since = ((time_ns[rest + 1 : at + 1] - time_ns[rest]) / NS_PER_S)[:, None]
    moved = axes[rest + 1 : at + 1] - axes[rest]
    per_cube = moved[-1] / since[-1] ** 3
    if np.abs(moved - per_cube * since**3).max() > _SAME:
        return None
    return AxisState(axes[at], 3.0 * per_cube * since[-1] ** 2, 6.0 * per_cube * since[-1])


def _cubic_state(time_ns: NDArray[np.int64], axes: NDArray[np.float64], at: int) -> tuple[float, AxisState]:
    """Return the deviation from a cubic of the samples up to ``at``, and the state by the cubic of the last four."""
    if at == len(time_ns) - 1:
        return 0.0, AxisState(axes[at], np.zeros(3), np.zeros(3))  # a trajectory ends at rest
    window = slice(max(0, at - _WINDOW + 1), at + 1)
    since = (time_ns[window] - time_ns[at]) / NS_PER_S
    values = axes[window] - axes[at]
    powers = since[-4:, None] ** np.arange(min(4, len(since)))
    # Column scaling: samples may be a millisecond or half a second apart.
    scale = max(float(-since[-4:][0]), 1e-9) ** np.arange(powers.shape[1])
    coefficients = np.linalg.lstsq(powers / scale, values[-4:], rcond=None)[0] / scale[:, None]
    coefficients = np.concatenate([coefficients, np.zeros((4 - len(coefficients), 3))])
    off = np.abs((since[0] ** np.arange(4)) @ coefficients - values[0]).max() if len(since) == _WINDOW else np.inf
    return float(off), AxisState(axes[at], coefficients[1], 2.0 * coefficients[2])


# Braking one axis: from any rate and acceleration to rest, as fast as its acceleration and jerk allow.
#
# The velocity half of the double-S profile (Biagiotti & Melchiorri, "Trajectory Planning for Automatic Machines and
# Robots", 2008, 3.4): jerk to the braking acceleration, hold it, jerk back to zero. The end position follows from that;
# a stop has no target.


@dataclass(frozen=True, slots=True, eq=False)
class AxisBraking:
    """One axis coming to rest, as pieces of constant jerk.

    Attributes:
        start_s: (P,) float64 start of each piece, from 0.
        state: (P, 4) float64 position, rate, acceleration and jerk at the start of each piece.
        duration_s: Time at which it is at rest.
        end: Its position at rest.
    """

    start_s: NDArray[np.float64]
    state: NDArray[np.float64]
    duration_s: float
    end: float

    @property
    def top_rate(self) -> float:
        """The highest absolute rate while braking."""
        _, v, a, j = self.state.T
        lengths = np.diff(np.append(self.start_s, self.duration_s))
        # Within a piece the rate has its extreme where the acceleration is zero.
        at = np.clip(np.divide(-a, j, out=np.zeros_like(a), where=j != 0.0), 0.0, lengths)
        rates = [v, v + at * (a + at * j / 2.0), v + lengths * (a + lengths * j / 2.0)]
        return float(np.abs(rates).max())

    @property
    def reach(self) -> tuple[float, float]:
        """The smallest and the largest position while braking: at ends of pieces, or where the axis reverses."""
        found = [self.end]
        lengths = np.diff(np.append(self.start_s, self.duration_s))
        for (p, v, a, j), length in zip(self.state.tolist(), lengths.tolist(), strict=True):
            found.append(p)
            turns = np.roots([j / 2.0, a, v]) if (j, a) != (0.0, 0.0) else np.empty(0)
            within = turns.real[(np.abs(turns.imag) < 1e-12) & (turns.real > 0.0) & (turns.real < length)]
            found += (p + within * (v + within * (a / 2.0 + within * j / 6.0))).tolist()
        return float(min(found)), float(max(found))

    def at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the position at times ((N,)): held at the start before 0 and at the end after the axis rests."""
        piece = np.clip(np.searchsorted(self.start_s, time_s, side="right") - 1, 0, None)
        t = np.maximum(time_s - self.start_s[piece], 0.0)
        p, v, a, j = self.state[piece].T
        return np.where(time_s >= self.duration_s, self.end, p + t * (v + t * (a / 2.0 + t * j / 6.0)))


def brake(position: float, rate: float, acceleration: float, limits: AxisLimits) -> AxisBraking:
    """Return the fastest braking of an axis; its initial acceleration is clipped to the limit."""
    lengths, jerks, acceleration = _pieces(rate, acceleration, limits.acceleration, limits.jerk)
    pieces = zip(lengths, jerks, strict=True)
    starts, states, at = [], [], 0.0
    p, v, a = position, rate, acceleration
    for length, j in pieces:
        if length <= 0.0:
            continue
        starts.append(at)
        states.append((p, v, a, j))
        p += length * (v + length * (a / 2.0 + length * j / 6.0))
        v += length * (a + length * j / 2.0)
        a += length * j
        at += length
    if not states:
        starts, states = [0.0], [(position, 0.0, 0.0, 0.0)]
    return AxisBraking(np.array(starts), np.array(states), at, p)


def braking_distances(
    rate: NDArray[np.float64], acceleration: NDArray[np.float64], limits: AxisLimits
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far an axis moves back and ahead while it brakes, for many states.

    Args:
        rate: (N,) its rate, unit/s.
        acceleration: (N,) its acceleration, unit/s^2.
        limits: The axis's limits.

    Returns:
        (N,) the lowest (0 or less) and (N,) the highest (0 or more) position while braking, relative to the start.
    """
    return _distances(rate, acceleration, limits.acceleration, limits.jerk)


@kernel
def _pieces(
    rate: float, acceleration: float, most: float, jerk: float
) -> tuple[tuple[float, float, float], tuple[float, float, float], float]:
    """Return lengths (s) and jerks of the three pieces of braking, and the initial acceleration."""
    acceleration = min(max(acceleration, -most), most)
    # The rate that is left once the acceleration is reduced to zero decides in which direction to brake.
    left = rate + acceleration * abs(acceleration) / (2.0 * jerk)
    sign = -copysign(1.0, left)
    now, needed = sign * acceleration, -sign * rate
    peak = min(most, sqrt(max(0.0, jerk * needed + now * now / 2.0)))
    peak = max(peak, now)
    held = max(0.0, (needed - (2.0 * peak * peak - now * now) / (2.0 * jerk)) / peak) if peak > 0.0 else 0.0
    return ((peak - now) / jerk, held, peak / jerk), (sign * jerk, 0.0, -sign * jerk), acceleration


@kernel
def _distances(
    rate: NDArray[np.float64], acceleration: NDArray[np.float64], most: float, jerk: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the extremes; they are at ends of pieces, or where the rate is zero within one."""
    low, high = np.zeros(rate.shape[0]), np.zeros(rate.shape[0])
    for n in range(rate.shape[0]):
        lengths, jerks, a = _pieces(rate[n], acceleration[n], most, jerk)
        p, v = 0.0, rate[n]
        for piece in range(3):
            length, j = lengths[piece], jerks[piece]
            if length <= 0.0:
                continue
            turns = a * a - 2.0 * j * v
            if turns >= 0.0:
                for side in (-1.0, 1.0):
                    at = -1.0
                    if j != 0.0:
                        at = (-a + side * sqrt(turns)) / j
                    elif a != 0.0:
                        at = -v / a
                    if 0.0 < at < length:
                        there = p + at * (v + at * (a / 2.0 + at * j / 6.0))
                        low[n], high[n] = min(low[n], there), max(high[n], there)
            p += length * (v + length * (a / 2.0 + length * j / 6.0))
            v += length * (a + length * j / 2.0)
            a += length * j
            low[n], high[n] = min(low[n], p), max(high[n], p)
    return low, high


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

    Raises InputError: if the lift is not under way then.
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
        result = brake(radius_m, rate, acceleration, radius_limits(jib, jib.winch, *within))
        reached = (min(radius_m, result.reach[0]), max(radius_m, result.reach[1]))
        if within[0] <= reached[0] and reached[1] <= within[1]:
            return result
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
