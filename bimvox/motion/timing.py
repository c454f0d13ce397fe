"""Samples of a motion."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.bound import point_to_point_s
from bimvox.crane.kinematics import hook_of
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
    must = _ascending(np.array([0, end_ns]), must_ns)
    period_ns = max(1, round(rigged.sample_period_s * NS_PER_S))
    regular = _apart(np.arange(0, end_ns, period_ns, dtype=np.int64), must)
    must = _ascending(must, regular)
    steps = int(np.ceil(end_ns / NS_PER_S * motion.top_speed_m_s / (_DENSE_VOX * voxel_size_m))) + 1
    dense = _ascending(np.linspace(0, end_ns, steps + 1).astype(np.int64), must)
    hook_m = hook_of(motion.crane, *motion.axes_at(dense / NS_PER_S).T)
    x, y, z = np.diff(hook_m, axis=0).T
    travel_m = np.concatenate([[0.0], np.cumsum(np.sqrt(x * x + y * y + z * z))])
    stride = np.floor(travel_m / (_SPACING_VOX * voxel_size_m))
    passing = dense[1:][np.diff(stride) > 0]
    return _ascending(must, _apart(passing, must))


def _ascending(*times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return all times, each once. ``np.unique`` is slower: it hashes first, and these are almost sorted."""
    together = np.sort(np.concatenate(times_ns), kind="stable")
    ascending: NDArray[np.int64] = together[np.concatenate([[True], np.diff(together) > 0])]
    return ascending


def _apart(times_ns: NDArray[np.int64], taken_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the times that are not next to one already taken."""
    after = np.clip(np.searchsorted(taken_ns, times_ns), 0, len(taken_ns) - 1)
    gap = np.minimum(np.abs(taken_ns[after] - times_ns), np.abs(times_ns - taken_ns[np.maximum(after - 1, 0)]))
    apart: NDArray[np.int64] = times_ns[gap > _SAME_NS]
    return apart
