"""Trajectories made from samples, shifted, turned, joined and cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.records.trajectory import Trajectory


def trajectory_of(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], corner: NDArray[np.int64], bound_s: float
) -> Trajectory:
    """Return the trajectory of (N,) times and (N, 3) slew, radius and height, its arrays read-only."""
    slew_rad, radius_m, height_m = (_fixed(axis.copy()) for axis in axes.T)
    return Trajectory(_fixed(time_ns), slew_rad, radius_m, height_m, _fixed(corner.astype(np.int64)), bound_s)


def delayed(part: Trajectory, by_ns: int, *, since_ns: int | None = None) -> Trajectory:
    """Return a trajectory delayed by nanoseconds, if ``since_ns`` is given only from that time on."""
    by = np.int64(by_ns) if since_ns is None else np.where(part.time_ns >= since_ns, np.int64(by_ns), np.int64(0))
    return replace(part, time_ns=_fixed(part.time_ns + by))


def turned(part: Trajectory, turns: int) -> Trajectory:
    """Return a trajectory with whole turns added to its slewing angles."""
    return replace(part, slew_rad=_fixed(part.slew_rad + 2.0 * np.pi * turns)) if turns else part


def turned_to(part: Trajectory, slew_rad: float | None) -> Trajectory:
    """Return a trajectory with whole turns added, so that it begins nearest to a slewing angle."""
    return part if slew_rad is None else turned(part, round((slew_rad - float(part.slew_rad[0])) / (2.0 * np.pi)))


def one_after_another(parts: Sequence[Trajectory]) -> Trajectory:
    """Return trajectories that follow each other on one clock joined into one; between them the hook is at rest."""
    if len(parts) == 1:
        return parts[0]
    before = np.cumsum([0, *(len(part.time_ns) for part in parts)])
    corners = [part.corner + at for part, at in zip(parts, before, strict=False)]
    ends = np.array([[at - 1, at] for at in before[1:-1]], np.int64).ravel()
    return trajectory_of(
        np.concatenate([part.time_ns for part in parts]),
        np.concatenate([part.axes for part in parts]),
        np.unique(np.concatenate([*corners, ends])),
        sum(part.bound_s for part in parts),
    )


def between(whole: Trajectory, start_ns: int, end_ns: int) -> Trajectory:
    """Return the samples of a trajectory between two times, both included; its bound is divided by time."""
    inside = np.flatnonzero((whole.time_ns >= start_ns) & (whole.time_ns <= end_ns))
    first, last = int(inside[0]), int(inside[-1])
    corner = whole.corner[(whole.corner > first) & (whole.corner < last)] - first
    lasts_ns = max(1, int(whole.time_ns[-1]) - int(whole.time_ns[0]))
    share = (int(whole.time_ns[last]) - int(whole.time_ns[first])) / lasts_ns
    part = slice(first, last + 1)
    return trajectory_of(whole.time_ns[part].copy(), whole.axes[part], corner, share * whole.bound_s)


def stopped(part: Trajectory, stop: Trajectory, told_ns: int) -> Trajectory:
    """Return a trajectory up to the end of its stop; what follows is omitted.

    Args:
        part: The trajectory as planned.
        stop: The stop, times from its own start.
        told_ns: When braking begins, on the clock of ``part``.
    """
    driven = part.time_ns < told_ns
    return trajectory_of(
        np.concatenate([part.time_ns[driven], stop.time_ns + told_ns]),
        np.concatenate([part.axes[driven], stop.axes]),
        part.corner[part.corner < int(driven.sum())],
        part.bound_s,
    )


def _fixed(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
