"""The safest emergency stop when something gets in the way of a load in the air.

Braking at once is tried first. If the load would hit something while it brakes, or within the swing that follows
(``bimvox.stop.swing``), other manoeuvres are tried, each checked along its whole length by the same rule: braking while
the load is hoisted, and going on as planned to a place from which braking is free. If none is free, the result says so,
and the crane brakes at once, which leaves the least energy.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from ruckig import InputParameter, Ruckig, RuckigError
from ruckig import Trajectory as RuckigTrajectory

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.swept import samples_are_free
from bimvox.motion.swing import Pendulum
from bimvox.motion.timing import NS_PER_S
from bimvox.records.motion import LiftMotion
from bimvox.records.trajectory import Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.site.site import Site
from bimvox.stop.axis_state import AxisState, state_at
from bimvox.stop.braking import AxisBraking
from bimvox.stop.emergency_stop import EmergencyStop, stop_at, to_rest
from bimvox.stop.swing import swing_through

STOPPED = "stopped"
HOISTED = "hoisted while braking"
WENT_ON = "went on to a place from which braking is free"
UNSAFE = "braked, though the load meets something on the way: no manoeuvre is free"
SWUNG = "braked, though the load swings into something: no manoeuvre is free"
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

    motion: LiftMotion
    part: Trajectory
    time_ns: int
    space: CollisionSpace
    load: LoadFrame
    pendulum: Pendulum | None


def manoeuvre(
    site: Site,
    crane: TowerCrane,
    motion: LiftMotion,
    part: Trajectory,
    time_ns: int,
    space: CollisionSpace,
    load: LoadFrame,
    pendulum: Pendulum | None = None,
) -> Manoeuvre:
    """Return the first free manoeuvre to rest, or braking at once if none is free.

    Args:
        site: The site.
        crane: Its crane.
        motion: The lift under way.
        part: Its trajectory that is being driven.
        time_ns: When the change was noticed, on the site's clock.
        space: The collision rule now.
        load: How hook poses and reference cells correspond.
        pendulum: What hangs on the hook (``pendulum_of``); None if its swing is not checked.
    """
    under = _UnderWay(motion, part, time_ns, space, load, pendulum)
    period_s, size_m = site.rules.sample_period_s, site.frame.voxel_size_m
    at_once = _tried(under, stop_at(crane, motion, time_ns, sample_period_s=period_s, voxel_size_m=size_m))
    if at_once.swings_free:
        return Manoeuvre(at_once.stop, STOPPED, True)
    at_ns, state = state_at(motion, time_ns)
    for rise_vox in _RISES_VOX:
        up = hoisting(crane, at_once.stop, state, at_ns, rise_vox * size_m, period_s, size_m)
        if up is not None and (tried := _tried(under, up)).swings_free:
            return Manoeuvre(tried.stop, HOISTED, True)
    for later_ns in _later(motion, part, time_ns):
        if not way_is_free(motion, part, time_ns, later_ns, space, load):
            break
        stop = stop_at(crane, motion, later_ns, sample_period_s=period_s, voxel_size_m=size_m)
        inside = stop.start_ns < motion.start_ns + int(part.time_ns[-1])
        if inside and (tried := _tried(under, stop)).swings_free:
            return Manoeuvre(tried.stop, WENT_ON, True)
    return Manoeuvre(at_once.stop, SWUNG if at_once.hangs_free else UNSAFE, False)


def hoisting(
    crane: TowerCrane,
    stop: EmergencyStop,
    state: AxisState,
    start_ns: int,
    rise_m: float,
    sample_period_s: float,
    voxel_size_m: float,
) -> EmergencyStop | None:
    """Return the stop with the load hoisted meanwhile; None if the hook cannot go that high.

    Args:
        crane: The crane.
        stop: Slewing and trolley brake as in this one.
        state: The state of the axes at its start.
        start_ns: When it starts, on the site's clock.
        rise_m: Height above the current one at which the hook comes to rest.
        sample_period_s: Largest time between samples.
        voxel_size_m: Edge of a cell.
    """
    target = float(state.position[2]) + rise_m
    if target > crane.highest_hook_m:
        return None
    hoist = _to_rest_at(state, 2, target, crane.hoist)
    if hoist is None:
        return None
    slew, radius, _ = stop.axes
    return to_rest(crane, (slew, radius, hoist), start_ns, sample_period_s=sample_period_s, voxel_size_m=voxel_size_m)


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


def _later(motion: LiftMotion, part: Trajectory, time_ns: int) -> Iterator[int]:
    """Yield later times while the trajectory is driven."""
    end_ns = motion.start_ns + int(part.time_ns[-1])
    step_ns = round(_LATER_S * NS_PER_S)
    yield from range(time_ns + step_ns, end_ns, step_ns)


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
    motion, part, time_ns, space, load, pendulum = under
    hangs = way_is_free(motion, part, time_ns, stop.start_ns, space, load) and bool(
        samples_are_free(space, load, stop.trajectory.axes)
    )
    if pendulum is None:
        return _Tried(stop, hangs, hangs)
    swinging = swing_through(motion, part, stop, pendulum)
    stop = replace(stop, swing_m=swinging.peak_m)
    return _Tried(stop, hangs, hangs and swinging.is_free(space, load, time_ns))


def way_is_free(
    motion: LiftMotion, part: Trajectory, from_ns: int, until_ns: int, space: CollisionSpace, load: LoadFrame
) -> bool:
    """Return whether a load hits nothing on its planned motion between two times."""
    time_ns = part.time_ns + np.int64(motion.start_ns)
    first = max(int(np.searchsorted(time_ns, from_ns, side="right")) - 1, 0)
    last = int(np.searchsorted(time_ns, until_ns)) + 1
    axes = part.axes[first:last]
    return len(axes) < 2 or bool(samples_are_free(space, load, axes))
