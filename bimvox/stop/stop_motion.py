"""An emergency stop: the crane brakes on all axes from any state, and may resume from there.

Every axis brakes independently, as fast as its acceleration and jerk allow, so the hook leaves the proven line. The
caller checks where it comes to rest and what it sweeps (:func:`stop_is_free`). A real crane needs long: slewing at
0.8 rpm with 0.3 deg/s^2 built up within a second, about 41 degrees and 17 s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.errors import InputError, PlanningError
from bimvox.motion.course import Course, Moves
from bimvox.motion.drive import drive_path
from bimvox.motion.load_frame import LoadFrame, axes_of_cells, cells_of_axes
from bimvox.motion.move import Move, axes_of
from bimvox.motion.shortcut import move_is_free
from bimvox.motion.swept import samples_are_free
from bimvox.motion.swing import Pendulum
from bimvox.motion.timeline import Timeline, in_sequence
from bimvox.motion.timing import NS_PER_S
from bimvox.records.motion import LiftMotion
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.stop.braking import brake
from bimvox.stop.halt import Stop, brake_radius, to_rest

STOP_EVENT = "stop"
"""Kind of the log event of a stop."""

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


def stop_motion(
    crane: TowerCrane, motion: LiftMotion, time_ns: int, *, sample_period_s: float, voxel_size_m: float
) -> Stop:
    """Return the stop of the crane on a stop command during a lift.

    Samples hold no rates or accelerations, and an approximate state would break the limits. So braking begins at the
    first sample after the command at which the state is known exactly (the samples before it lie on one piece of
    constant jerk), within two seconds.

    Args:
        crane: The crane.
        motion: The lift.
        time_ns: When the stop is commanded, on the site's clock.
        sample_period_s: Largest time between samples of the stop.
        voxel_size_m: Edge of a cell.

    Raises:
        InputError: If the lift is not under way then.
    """
    at_ns, state = state_at(motion, time_ns)
    return stop_from(crane, state, at_ns, sample_period_s=sample_period_s, voxel_size_m=voxel_size_m)


def stop_from(
    crane: TowerCrane, state: AxisState, start_ns: int = 0, *, sample_period_s: float, voxel_size_m: float
) -> Stop:
    """Return the stop of the crane from a state.

    Args:
        crane: The crane.
        state: Positions, rates and accelerations of the axes.
        start_ns: When braking begins, on the site's clock.
        sample_period_s: Largest time between samples.
        voxel_size_m: Edge of a cell.
    """
    position, rate, acceleration = state.position.tolist(), state.rate.tolist(), state.acceleration.tolist()
    slew = brake(position[0], rate[0], acceleration[0], crane.slewing)
    radius = brake_radius(crane, position[1], rate[1], acceleration[1])
    hoist = brake(position[2], rate[2], acceleration[2], crane.hoist)
    return to_rest(crane, (slew, radius, hoist), start_ns, sample_period_s=sample_period_s, voxel_size_m=voxel_size_m)


def state_at(motion: LiftMotion, time_ns: int) -> tuple[int, AxisState]:
    """Return the state of the axes at the first sample at or after a time at which it is known exactly.

    Args:
        motion: The lift.
        time_ns: On the site's clock.

    Returns:
        The time of that sample on the site's clock, and the state there.

    Raises:
        InputError: If the lift is not under way then.
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


def stop_is_free(space: CollisionSpace, load: LoadFrame, stop: Stop) -> bool:
    """Return whether a load that hangs straight hits nothing while the crane brakes; see also ``bimvox.stop.swing``."""
    return bool(samples_are_free(space, load, stop.trajectory.axes))


def go_on_cells(space: CollisionSpace, load: LoadFrame, pose: CranePose) -> list[tuple[int, int, int]]:
    """Return the whole placements around a pose that a load can reach in a straight line, the nearest first.

    A path from one of them can be driven from the pose (:func:`go_on`). Empty if the load is stuck.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        pose: Where the crane stands.
    """
    at = cells_of_axes(load, axes_of(pose))
    cells = sorted(_around(at), key=lambda cell: (round(float(np.linalg.norm(np.subtract(cell, at))), 9), cell))
    return [
        cell
        for cell in cells
        if placement_is_free(space, *cell) and move_is_free(space, load, move_to_cell(load, pose, cell))
    ]


def go_on(
    crane: TowerCrane,
    space: CollisionSpace,
    load: LoadFrame,
    pose: CranePose,
    path_vox: NDArray[np.int32],
    contact_moves: int,
    pendulum: Pendulum | None = None,
) -> tuple[Timeline, float]:
    """Return the motion of a load from rest at any pose to the end of a voxel path that begins next to it.

    Args:
        crane: The crane.
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        pose: Where the crane stands.
        path_vox: (N, 3) int32 reference cells, N >= 2, the first one of :func:`go_on_cells`.
        contact_moves: How many of the last placements were cleared by the narrow phase.
        pendulum: What hangs on the hook (``pendulum_of``); None if its swing is not checked.

    Returns:
        The motion, and the height that the hook has to reach.

    Raises:
        PlanningError: If the first cell cannot be reached, the path is not free, or takes the hook above the jib.
    """
    first = move_to_cell(load, pose, (int(path_vox[0, 0]), int(path_vox[0, 1]), int(path_vox[0, 2])))
    if not move_is_free(space, load, first):
        raise PlanningError(
            f"cell {path_vox[0].tolist()} cannot be reached from where the crane stands",
            hint="begin the path at one of the free cells around the load",
        )
    onward, needed_m = drive_path(crane, space, load, path_vox, contact_moves, first.end.slew_rad, pendulum)
    if not any(first.moving):
        return onward, needed_m
    begin = in_sequence(crane, [first], pendulum)
    later = tuple(start + begin.duration_s for start in onward.start_s)
    course = Course(Moves(crane, begin.moves + onward.moves), begin.profiles + onward.profiles)
    return Timeline(course, begin.start_s + later), max(needed_m, pose.height_m)


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
    gone = axes[rest + 1 : at + 1] - axes[rest]
    per_cube = gone[-1] / since[-1] ** 3
    if np.abs(gone - per_cube * since**3).max() > _SAME:
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


def _around(at: NDArray[np.float64]) -> Iterator[tuple[int, int, int]]:
    """Yield the up to eight whole placements around a continuous one."""
    low, high = np.floor(at + 1e-6).astype(int), np.ceil(at - 1e-6).astype(int)
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                yield (x, y, z)


def move_to_cell(load: LoadFrame, pose: CranePose, cell: tuple[int, int, int]) -> Move:
    """Return the straight move in the axes from a pose to a whole placement next to it."""
    slew, radius, height = axes_of_cells(load, np.array(cell)).tolist()
    turned = pose.slew_rad + float(np.remainder(slew - pose.slew_rad + np.pi, 2.0 * np.pi)) - np.pi
    return Move(pose, CranePose(turned, radius, height))
