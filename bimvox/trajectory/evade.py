"""What the crane does when something comes into the way of a load in the air: the safest manoeuvre to rest.

Braking at once is tried first. Where the load would meet something while it brakes, other manoeuvres are tried, each
checked all along by the same rule: braking while the load is hoisted, and going on as planned until a place from which
braking is free. If none is free, that is said, and the crane brakes at once: the least energy.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from ruckig import InputParameter, Ruckig, RuckigError
from ruckig import Trajectory as RuckigTrajectory

from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.site.clearance import Clearance
from bimvox.site.site import Site
from bimvox.trajectory.braking import AxisBraking
from bimvox.trajectory.load_frame import LoadFrame
from bimvox.trajectory.motion import LiftMotion
from bimvox.trajectory.stop import AxisState, Stop, state_at, stop_is_free, stop_motion
from bimvox.trajectory.swept import samples_are_free
from bimvox.trajectory.timing import NS_PER_S, frozen, sample_times
from bimvox.trajectory.trajectory import Trajectory

STOPPED = "stopped"
HOISTED = "hoisted while braking"
WENT_ON = "went on to a place from which braking is free"
UNSAFE = "braked, though the load meets something on the way: no manoeuvre is free"
_RISES_VOX = (2, 4, 8, 16)
_LATER_S = 0.5
"""How far apart the places are from which braking is tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Manoeuvre:
    """How a load comes to rest.

    Attributes:
        stop: The way to rest.
        kind: What it is, in words.
        is_free: Whether the load meets nothing on it.
    """

    stop: Stop
    kind: str
    is_free: bool


def manoeuvre(
    site: Site,
    crane: TowerCrane,
    motion: LiftMotion,
    part: Trajectory,
    time_ns: int,
    clearance: Clearance,
    load: LoadFrame,
) -> Manoeuvre:
    """Return the first manoeuvre to rest that is free.

    Args:
        site: The site.
        crane: Its crane.
        motion: The lift under way.
        part: Its trajectory that is being driven.
        time_ns: When the change was noticed, on the site's clock.
        clearance: The collision rule now.
        load: How hook poses and reference cells correspond.
    """
    period_s, size_m = site.rules.sample_period_s, site.frame.voxel_size_m
    at_once = stop_motion(crane, motion, time_ns, sample_period_s=period_s, voxel_size_m=size_m)
    if _is_free(motion, part, time_ns, at_once, clearance, load):
        return Manoeuvre(at_once, STOPPED, True)
    at_ns, state = state_at(motion, time_ns)
    for rise_vox in _RISES_VOX:
        up = hoisting(crane, at_once, state, at_ns, rise_vox * size_m, period_s, size_m)
        if up is not None and _is_free(motion, part, time_ns, up, clearance, load):
            return Manoeuvre(up, HOISTED, True)
    for later_ns in _later(motion, part, time_ns):
        if not way_is_free(motion, part, time_ns, later_ns, clearance, load):
            break
        stop = stop_motion(crane, motion, later_ns, sample_period_s=period_s, voxel_size_m=size_m)
        inside = stop.start_ns < motion.start_ns + int(part.time_ns[-1])
        if inside and _is_free(motion, part, time_ns, stop, clearance, load):
            return Manoeuvre(stop, WENT_ON, True)
    return Manoeuvre(at_once, UNSAFE, False)


def hoisting(
    crane: TowerCrane,
    stop: Stop,
    state: AxisState,
    start_ns: int,
    rise_m: float,
    sample_period_s: float,
    voxel_size_m: float,
) -> Stop | None:
    """Return the stop with the load hoisted meanwhile; None where the hook cannot go that high.

    Args:
        crane: The crane.
        stop: Slewing and trolley brake as in this one.
        state: Of the axes at its start.
        start_ns: When it starts, on the site's clock.
        rise_m: How far above where it is the hook comes to rest.
        sample_period_s: Largest time between samples.
        voxel_size_m: Edge of a cell.
    """
    target = float(state.position[2]) + rise_m
    if target > crane.highest_hook_m:
        return None
    hoist = _to_rest_at(state, 2, target, crane.hoist)
    if hoist is None:
        return None
    slew, trolley, _ = stop.axes
    motion = _Axes(crane, (slew, trolley, hoist))
    end_ns = int(np.ceil(max(axis.duration_s for axis in motion.axes) * NS_PER_S))
    time_ns = sample_times(motion, end_ns, np.empty(0, np.int64), sample_period_s, voxel_size_m)
    axes = motion.axes_at(time_ns / NS_PER_S)
    trajectory = replace(
        stop.trajectory,
        time_ns=frozen(time_ns),
        slew_rad=frozen(axes[:, 0].copy()),
        radius_m=frozen(axes[:, 1].copy()),
        height_m=frozen(axes[:, 2].copy()),
        bound_s=end_ns / NS_PER_S,
    )
    return Stop(crane, start_ns, motion.axes, trajectory)


@dataclass(frozen=True, slots=True, eq=False)
class _Axes:
    """Three axes on their way to rest, as what can be sampled."""

    crane: TowerCrane
    axes: tuple[AxisBraking, AxisBraking, AxisBraking]

    @property
    def top_speed_m_s(self) -> float:
        """No axis is faster than it may be."""
        crane = self.crane
        return float(np.linalg.norm([crane.jib_length_m * crane.slewing.rate, crane.trolley.rate, crane.hoist.rate]))

    def axes_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times."""
        return np.stack([axis.at(time_s) for axis in self.axes], axis=1)


def _to_rest_at(state: AxisState, axis: int, target: float, limits: AxisLimits) -> AxisBraking | None:
    """The quickest way of one axis to rest at a place, by ruckig, state to state."""
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
    """Later times while it is driven."""
    end_ns = motion.start_ns + int(part.time_ns[-1])
    step_ns = round(_LATER_S * NS_PER_S)
    yield from range(time_ns + step_ns, end_ns, step_ns)


def _is_free(
    motion: LiftMotion, part: Trajectory, time_ns: int, stop: Stop, clearance: Clearance, load: LoadFrame
) -> bool:
    """Whether the load meets nothing from a time to the stop's beginning, and while it stops."""
    return way_is_free(motion, part, time_ns, stop.start_ns, clearance, load) and stop_is_free(clearance, load, stop)


def way_is_free(
    motion: LiftMotion, part: Trajectory, from_ns: int, until_ns: int, clearance: Clearance, load: LoadFrame
) -> bool:
    """Return whether a load meets nothing on its planned way between two times."""
    time_ns = part.time_ns + np.int64(motion.start_ns)
    first = max(int(np.searchsorted(time_ns, from_ns, side="right")) - 1, 0)
    last = int(np.searchsorted(time_ns, until_ns)) + 1
    axes = np.stack([part.slew_rad, part.radius_m, part.height_m], axis=1)[first:last]
    return len(axes) < 2 or bool(samples_are_free(clearance, load, axes))
