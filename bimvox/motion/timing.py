"""Samples of a motion."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.bound import point_to_point_s
from bimvox.crane.pendulum import half_period_s, pendulum_length_m
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.motion.rigged_crane import RiggedCrane
from bimvox.motion.timeline import Timeline, pause_of
from bimvox.motion.trajectories import trajectory_of
from bimvox.records.trajectory import Trajectory
from bimvox.units import NS_PER_S

# Shares of a cell: samples are taken from a dense grid so that the hook moves less than half a cell between two.
_DENSE_VOX = 0.05
_SPACING_VOX = 0.4
# Samples closer than this to a required one are left out.
_SAME_NS = 1_000_000


class Motion(Protocol):
    """A motion that can be sampled: the axes as a function of time."""

    @property
    def crane(self) -> TowerCrane:
        """The crane."""

    @property
    def top_speed_m_s(self) -> float:
        """Upper bound of the hook's speed."""

    def axes_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times."""


def sampled(timeline: Timeline, clearance_height_m: float, rigged: RiggedCrane) -> Trajectory:
    """Return a trajectory's samples.

    There is a sample at the start, at the end, at every corner at which the axes rest, at every multiple of the period,
    and wherever the hook would otherwise move half a cell since the last one.

    Args:
        timeline: The moves over time.
        clearance_height_m: Height that the hook has to reach, for the lower bound of its time.
        rigged: The crane; its pendulum, if moves are shaped, also for the bound.
    """
    crane, pendulum = timeline.crane, rigged.pendulum
    end_ns = int(np.ceil(timeline.duration_s * NS_PER_S))
    rests_ns = np.round(np.array(_rests_s(timeline)) * NS_PER_S).astype(np.int64)
    time_ns = sample_times(timeline, end_ns, rests_ns, rigged)
    axes = timeline.axes_at(time_ns / NS_PER_S)
    shaping_s = 0.0
    if pendulum is not None:
        highest = int(np.argmax(axes[:, 2]))
        radius_m, height_m = float(axes[highest, 1]), float(axes[highest, 2])
        shaping_s = half_period_s(pendulum_length_m(crane, height_m, pendulum.below_hook_m, radius_m))
    first, last = (CranePose(*axes[i].tolist()) for i in (0, -1))
    # Moves that are shaped together may need less time than a shaping of half a period for each.
    bound_s = min(point_to_point_s(crane, first, last, clearance_height_m, shaping_s), end_ns / NS_PER_S)
    return trajectory_of(time_ns, axes, np.searchsorted(time_ns, rests_ns), bound_s)


def _rests_s(timeline: Timeline) -> list[float]:
    """Return the times between the first and the last sample at which every axis is at rest."""
    ends, pause = timeline.end_s, pause_of(timeline)
    rests = [start for i, start in enumerate(timeline.start_s) if i > 0 and start >= max(ends[:i]) - 1e-9]
    if pause is not None:
        rests = sorted({*rests, *pause[1:]})
    return [at_s for at_s in rests if _SAME_NS < at_s * NS_PER_S < ends[-1] * NS_PER_S - _SAME_NS]


def sample_times(motion: Motion, end_ns: int, must_ns: NDArray[np.int64], rigged: RiggedCrane) -> NDArray[np.int64]:
    """Return (N,) int64 ascending sample times from 0 to ``end_ns``, with ``must_ns``, at most half a cell apart."""
    voxel_size_m = rigged.load.voxel_size_m
    must = np.unique(np.concatenate([[0, end_ns], must_ns]))
    period_ns = max(1, round(rigged.sample_period_s * NS_PER_S))
    must = _with(must, np.arange(0, end_ns, period_ns, dtype=np.int64), _SAME_NS)
    steps = int(np.ceil(end_ns / NS_PER_S * motion.top_speed_m_s / (_DENSE_VOX * voxel_size_m))) + 1
    dense = _with(must, (np.arange(steps) * (end_ns / steps)).astype(np.int64), 0)
    base_x_m, base_y_m, _ = motion.crane.base_m
    passed = _passes(motion.axes_at(dense / NS_PER_S), base_x_m, base_y_m, _SPACING_VOX * voxel_size_m)
    return _with(must, dense[passed], _SAME_NS)


@kernel
def _with(taken_ns: NDArray[np.int64], more_ns: NDArray[np.int64], apart_ns: int) -> NDArray[np.int64]:
    """Return ascending times with more ascending times: those that are farther apart from each of them."""
    both_ns = np.empty(len(taken_ns) + len(more_ns), np.int64)
    count, n = 0, 0
    for more in more_ns:
        while n < len(taken_ns) and taken_ns[n] <= more:
            both_ns[count] = taken_ns[n]
            count, n = count + 1, n + 1
        if n > 0 and more - taken_ns[n - 1] <= apart_ns:
            continue
        if n < len(taken_ns) and taken_ns[n] - more <= apart_ns:
            continue
        if count == 0 or both_ns[count - 1] < more:
            both_ns[count] = more
            count += 1
    for left in taken_ns[n:]:
        both_ns[count] = left
        count += 1
    return both_ns[:count]


@kernel
def _passes(axes: NDArray[np.float64], base_x_m: float, base_y_m: float, spacing_m: float) -> NDArray[np.bool_]:
    """Return (N,) whether the hook has travelled the next multiple of a spacing at each of (N, 3) axes."""
    passes = np.zeros(axes.shape[0], np.bool_)
    travel_m, stride, x_m, y_m = 0.0, 0.0, 0.0, 0.0
    for i in range(axes.shape[0]):
        was_x_m, was_y_m = x_m, y_m
        if i == 0 or axes[i, 0] != axes[i - 1, 0] or axes[i, 1] != axes[i - 1, 1]:  # mostly it is hoisted
            x_m = base_x_m + axes[i, 1] * np.cos(axes[i, 0])
            y_m = base_y_m + axes[i, 1] * np.sin(axes[i, 0])
        if i > 0:
            x, y, z = x_m - was_x_m, y_m - was_y_m, axes[i, 2] - axes[i - 1, 2]
            travel_m += np.sqrt(x * x + y * y + z * z)
            passes[i] = np.floor(travel_m / spacing_m) > stride
            stride = np.floor(travel_m / spacing_m)
    return passes
