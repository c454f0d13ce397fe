"""The safest emergency stop when something gets in the way of a load in the air.

Braking at once is tried first. If the load would hit something while it brakes, or within the swing that follows
(``bimvox.stop.swing``), other manoeuvres are tried, each checked along its whole length by the same rule: braking while
the load is hoisted, and continuing as planned to a place from which braking is free. If none is free, the result says
so, and the crane brakes at once, which leaves the least energy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from ruckig import InputParameter, Ruckig, RuckigError
from ruckig import Trajectory as RuckigTrajectory

from bimvox.crane.axis_limits import AxisLimits
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.rigged_crane import RiggedCrane
from bimvox.motion.swept import samples_are_free
from bimvox.records.motion import LiftMotion
from bimvox.records.trajectory import Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.stop.axis_state import AxisState, state_at
from bimvox.stop.brake_axes import EmergencyStop, stop_at, to_rest
from bimvox.stop.braking import AxisBraking
from bimvox.stop.swing import swing_through
from bimvox.units import NS_PER_S

STOPPED = "stopped"
HOISTED = "hoisted while braking"
CONTINUED = "continued to a place from which braking is free"
UNSAFE = "braked, although the load hits something meanwhile: no manoeuvre is free"
SWUNG = "braked, although the load swings into something: no manoeuvre is free"
_RISES_VOX = (2, 4, 8, 16)
_LATER_S = 0.5
"""Time between the places from which braking is tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Manoeuvre:
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
) -> Manoeuvre:
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
        return Manoeuvre(at_once.stop, STOPPED, True)
    at_ns, state = state_at(motion, time_ns)
    for rise_vox in _RISES_VOX:
        up = _hoisting(rigged, at_once.stop, state, at_ns, rise_vox * rigged.load.voxel_size_m)
        if up is not None and (tried := _tried(under, up)).swings_free:
            return Manoeuvre(tried.stop, HOISTED, True)
    end_ns, step_ns = motion.start_ns + int(part.time_ns[-1]), round(_LATER_S * NS_PER_S)
    for later_ns in range(time_ns + step_ns, end_ns, step_ns):
        if not motion_is_free(motion, part, time_ns, later_ns, space, rigged.load):
            break
        stop = stop_at(rigged, motion, later_ns)
        if stop.start_ns < end_ns and (tried := _tried(under, stop)).swings_free:
            return Manoeuvre(tried.stop, CONTINUED, True)
    return Manoeuvre(at_once.stop, SWUNG if at_once.hangs_free else UNSAFE, False)


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
