"""Trajectories shifted, turned, joined and cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.records.trajectory import Trajectory


def shifted(way: Trajectory, by_ns: int) -> Trajectory:
    """Return a trajectory delayed by nanoseconds."""
    return replace(way, time_ns=_fixed(way.time_ns + np.int64(by_ns)))


def turned(way: Trajectory, slew_rad: float | None) -> Trajectory:
    """Return a trajectory with whole turns added, so that it begins nearest to a slewing angle."""
    turns = 0 if slew_rad is None else round((slew_rad - float(way.slew_rad[0])) / (2.0 * np.pi))
    return replace(way, slew_rad=_fixed(way.slew_rad + 2.0 * np.pi * turns)) if turns else way


def one_after_another(ways: Sequence[Trajectory]) -> Trajectory:
    """Return trajectories that follow each other on one clock joined into one; between them the hook stands still."""
    if len(ways) == 1:
        return ways[0]
    before = np.cumsum([0, *(len(way.time_ns) for way in ways)])
    corners = [way.corner + at for way, at in zip(ways, before, strict=False)]
    ends = np.array([[at - 1, at] for at in before[1:-1]], np.int64).ravel()
    return Trajectory(
        time_ns=_fixed(np.concatenate([way.time_ns for way in ways])),
        slew_rad=_fixed(np.concatenate([way.slew_rad for way in ways])),
        radius_m=_fixed(np.concatenate([way.radius_m for way in ways])),
        height_m=_fixed(np.concatenate([way.height_m for way in ways])),
        corner=_fixed(np.unique(np.concatenate([*corners, ends])).astype(np.int64)),
        bound_s=sum(way.bound_s for way in ways),
    )


def between(way: Trajectory, start_ns: int, end_ns: int) -> Trajectory:
    """Return the samples of a trajectory between two times, both included; its bound is divided by time."""
    inside = np.flatnonzero((way.time_ns >= start_ns) & (way.time_ns <= end_ns))
    first, last = int(inside[0]), int(inside[-1])
    corner = way.corner[(way.corner > first) & (way.corner < last)] - first
    share = (int(way.time_ns[last]) - int(way.time_ns[first])) / max(1, int(way.time_ns[-1]) - int(way.time_ns[0]))
    part = slice(first, last + 1)
    return Trajectory(
        _fixed(way.time_ns[part].copy()),
        _fixed(way.slew_rad[part].copy()),
        _fixed(way.radius_m[part].copy()),
        _fixed(way.height_m[part].copy()),
        _fixed(corner.astype(np.int64)),
        share * way.bound_s,
    )


def _fixed(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
