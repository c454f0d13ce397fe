"""The safest emergency stop when something gets in the way of a load in the air, and how the load swings after it.

Braking at once is tried first. If the load would hit something while it brakes, or within the swing that follows, other
manoeuvres are tried, each checked along its whole length by the same rule: braking while the load is hoisted, and
continuing as planned to a place from which braking is free. If none is free, the result says so, and the crane brakes
at once, which leaves the least energy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from ruckig import InputParameter, Ruckig, RuckigError
from ruckig import Trajectory as RuckigTrajectory

from bimvox.crane.tower_crane import AxisLimits
from bimvox.motion.swept import LoadFrame, samples_are_free, swaying_is_free
from bimvox.motion.swing import (
    PLANNED_RESIDUAL_M,
    STEP_S,
    Pendulum,
    RiggedCrane,
    Swing,
    half_periods_s,
    swing_of,
)
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.stop.brake_axes import AxisBraking, AxisState, EmergencyStop, state_at, stop_at, to_rest
from bimvox.units import NS_PER_S

# The swing of a load during and after an emergency stop.
#
# Braking is not shaped, so the load still swings when the crane is at rest. The pendulum is simulated from where the
# load last hung at rest: over the driven part, the braking, and one whole period with the crane at rest. The load may
# be anywhere within that swing, to either side. Tag lines bring it to rest before the crane resumes.

_MARGIN = 1.03
"""The proof integrates differently: the swing found here is enlarged by this factor."""


@dataclass(frozen=True, slots=True, eq=False)
class _StopSwing:
    """The swing of a load before, during and after a stop.

    Attributes:
        time_ns: (N,) int64 on the site's clock.
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        swing: At these times.
        begins_ns: When braking begins.
    """

    time_ns: NDArray[np.int64]
    axes: NDArray[np.float64]
    swing: Swing
    begins_ns: int

    @property
    def peak_m(self) -> float:
        """The peak swing from the beginning of the stop on."""
        return float(np.hypot(*self.swing.offset_m[self.time_ns >= self.begins_ns].T).max())

    def is_free(self, space: CollisionSpace, load: LoadFrame, from_ns: int) -> bool:
        """Return whether the load, within its swing to either side, hits nothing from a time on."""
        sway = _MARGIN * self.swing.beyond_m(PLANNED_RESIDUAL_M) / load.voxel_size_m
        looked_at = (np.abs(sway).max(axis=1) > 0.0) & (self.time_ns >= from_ns)
        return bool(swaying_is_free(space, load, self.axes, sway, looked_at, True) < 0)


def swing_through(motion: LiftMotion, part: Trajectory, stop: EmergencyStop, pendulum: Pendulum) -> _StopSwing:
    """Return the swing of a load before a stop, while the crane brakes, and for a period after."""
    from scipy.interpolate import PchipInterpolator  # takes long to import, and few plans need it

    driven_ns = part.time_ns + np.int64(motion.start_ns)
    driven = (driven_ns < stop.start_ns) & (driven_ns >= hangs_still_ns(motion, part, stop.start_ns))
    axes = np.concatenate([part.axes[driven], stop.trajectory.axes])
    time_s = (np.concatenate([driven_ns[driven], stop.trajectory.time_ns + stop.start_ns]) - stop.start_ns) / NS_PER_S
    pose = stop.pose
    slow_s, fast_s = half_periods_s(stop.crane, pendulum, pose.height_m, pose.radius_m)
    # The swing of a point repeats after one period; the two of a load below a block have met by then, or in another.
    ends_s = float(time_s[-1]) + (4.0 if fast_s else 2.0) * slow_s
    steps = int(np.ceil((ends_s - time_s[0]) / STEP_S)) + 1
    every_s = np.linspace(time_s[0], ends_s, steps + 1)
    at = PchipInterpolator(time_s, axes)(np.minimum(every_s, time_s[-1]))
    swing = swing_of(stop.crane, at, float(every_s[1] - every_s[0]), pendulum)
    return _StopSwing(np.round(every_s * NS_PER_S).astype(np.int64) + stop.start_ns, at, swing, stop.start_ns)


def hangs_still_ns(motion: LiftMotion, part: Trajectory, before_ns: int) -> int:
    """Return when the load of a lift last hung at rest before a time: at its pick, or at the end of a stop."""
    starts = int(part.time_ns[0]) + motion.start_ns
    return max([starts, *(end_ns for _, end_ns in motion.stops_ns if starts < end_ns <= before_ns)])


STOPPED = "stopped"
HOISTED = "hoisted while braking"
CONTINUED = "continued to a place from which braking is free"
UNSAFE = "braked, although the load hits something meanwhile: no manoeuvre is free"
SWUNG = "braked, although the load swings into something: no manoeuvre is free"
_RISES_VOX = (2, 4, 8, 16)
_LATER_S = 0.5
"""Time between the places from which braking is tried."""


@dataclass(frozen=True, slots=True, eq=False)
class _Manoeuvre:
    """A manoeuvre that brings a load to rest.

    Attributes:
        stop: The stop.
        kind: Its description.
        is_free: Whether the load hits nothing on it, including its swing.
    """

    stop: EmergencyStop
    kind: str
    is_free: bool


class _UnderWay(NamedTuple):
    """The lift under way at the stop command, and the collision rule then; see :func:`manoeuvre`."""

    rigged: RiggedCrane
    motion: LiftMotion
    part: Trajectory
    time_ns: int
    space: CollisionSpace


def manoeuvre(
    rigged: RiggedCrane, motion: LiftMotion, part: Trajectory, time_ns: int, space: CollisionSpace
) -> _Manoeuvre:
    """Return the first free manoeuvre to rest, or braking at once if none is free.

    Args:
        rigged: The crane with its load.
        motion: The lift under way.
        part: The trajectory of it that is being driven.
        time_ns: When the change was noticed, on the site's clock.
        space: The collision rule now.
    """
    under = _UnderWay(rigged, motion, part, time_ns, space)
    at_once = _tried(under, stop_at(rigged, motion, time_ns))
    if at_once.swings_free:
        return _Manoeuvre(at_once.stop, STOPPED, True)
    at_ns, state = state_at(motion, time_ns)
    for rise_vox in _RISES_VOX:
        up = _hoisting(rigged, at_once.stop, state, at_ns, rise_vox * rigged.load.voxel_size_m)
        if up is not None and (tried := _tried(under, up)).swings_free:
            return _Manoeuvre(tried.stop, HOISTED, True)
    end_ns, step_ns = motion.start_ns + int(part.time_ns[-1]), round(_LATER_S * NS_PER_S)
    for later_ns in range(time_ns + step_ns, end_ns, step_ns):
        if not motion_is_free(motion, part, time_ns, later_ns, space, rigged.load):
            break
        stop = stop_at(rigged, motion, later_ns)
        if stop.start_ns < end_ns and (tried := _tried(under, stop)).swings_free:
            return _Manoeuvre(tried.stop, CONTINUED, True)
    return _Manoeuvre(at_once.stop, SWUNG if at_once.hangs_free else UNSAFE, False)


def _hoisting(
    rigged: RiggedCrane, stop: EmergencyStop, state: AxisState, start_ns: int, rise_m: float
) -> EmergencyStop | None:
    """Return a stop with the load hoisted meanwhile by a height; None if the hook cannot go that high."""
    target = float(state.position[2]) + rise_m
    if target > rigged.crane.highest_hook_m:
        return None
    hoist = _to_rest_at(state, 2, target, rigged.crane.hoist)
    slew, radius, _ = stop.axes
    return None if hoist is None else to_rest(rigged, (slew, radius, hoist), start_ns)


def _to_rest_at(state: AxisState, axis: int, target: float, limits: AxisLimits) -> AxisBraking | None:
    """Return the quickest motion of one axis to rest at a target, by ruckig; None if ruckig finds none."""
    wanted, found = InputParameter(1), RuckigTrajectory(1)
    wanted.current_position = [float(state.position[axis])]
    wanted.current_velocity = [float(np.clip(state.rate[axis], -limits.rate, limits.rate))]
    wanted.current_acceleration = [float(np.clip(state.acceleration[axis], -limits.acceleration, limits.acceleration))]
    wanted.target_position, wanted.max_velocity = [target], [limits.rate]
    wanted.max_acceleration, wanted.max_jerk = [limits.acceleration], [limits.jerk]
    try:
        Ruckig(1).calculate(wanted, found)
    except RuckigError:
        return None
    pieces = found.profiles[0][0]
    starts: list[float] = []
    states: list[tuple[float, float, float, float]] = []
    at = 0.0
    profiles = [(part.t, part.p, part.v, part.a, part.j) for part in (pieces.brake, pieces) if len(part.t)]
    for lengths, positions, rates, accelerations, jerks in profiles:
        for n, length in enumerate(lengths):
            if length > 0.0:
                starts.append(at)
                states.append((positions[n], rates[n], accelerations[n], jerks[n]))
                at += length
    if not starts:
        return None
    return AxisBraking(np.array(starts), np.array(states), float(found.duration), target)


class _Tried(NamedTuple):
    """A stop that was checked.

    Attributes:
        stop: The stop, with the peak swing of its load.
        hangs_free: Whether the load, hanging straight, hits nothing until the crane is at rest.
        swings_free: Whether it hits nothing within its swing either, including after the stop.
    """

    stop: EmergencyStop
    hangs_free: bool
    swings_free: bool


def _tried(under: _UnderWay, stop: EmergencyStop) -> _Tried:
    """Check a stop from its command until its load comes to rest."""
    rigged, motion, part, time_ns, space = under
    load, reached = rigged.load, motion_is_free(motion, part, time_ns, stop.start_ns, space, rigged.load)
    hangs = reached and bool(samples_are_free(space, load, stop.trajectory.axes))
    if rigged.pendulum is None:
        return _Tried(stop, hangs, hangs)
    swinging = swing_through(motion, part, stop, rigged.pendulum)
    stop = replace(stop, swing_m=swinging.peak_m)
    return _Tried(stop, hangs, hangs and swinging.is_free(space, load, time_ns))


def motion_is_free(
    motion: LiftMotion, part: Trajectory, from_ns: int, until_ns: int, space: CollisionSpace, load: LoadFrame
) -> bool:
    """Return whether a load hits nothing on its planned motion between two times."""
    time_ns = part.time_ns + np.int64(motion.start_ns)
    first = max(int(np.searchsorted(time_ns, from_ns, side="right")) - 1, 0)
    last = int(np.searchsorted(time_ns, until_ns)) + 1
    axes = part.axes[first:last]
    return len(axes) < 2 or bool(samples_are_free(space, load, axes))
