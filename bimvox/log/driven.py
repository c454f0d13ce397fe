"""A lift as its crane drives it, and which of its samples viewers are shown."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.crane.kinematics import hook_of, joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log.plan_log import LogRate
from bimvox.log.track import crane_track
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.track import LoadTrack
from bimvox.site.site import Site
from bimvox.units import NS_PER_S

OFF_M = 0.01
"""How far what is shown may be from the motion between two shown samples, in each coordinate of hook and load."""
_OFF_QUATERNION = 1e-3
"""The same for each component of a quaternion: about 0.1 degrees."""
APART_S = 2.0
"""Shown samples with others in between are at most this far apart."""


def needed(
    time_ns: NDArray[np.int64], values: NDArray[np.float64], limits: NDArray[np.float64], always_ns: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return (N,) which samples are needed: the first, the last, and after each the last one that a line may reach.

    Args:
        time_ns: (N,) int64 times, ascending.
        values: (N, K) float64.
        limits: (K,) how far a line between two needed samples may be from the values of those in between.
        always_ns: (M,) int64 times at which a sample is needed in any case.
    """
    keep = np.isin(time_ns, always_ns)
    if len(keep):
        keep[0] = keep[-1] = True
        time_s = (time_ns - time_ns[0]) / NS_PER_S
        low, high = np.empty_like(limits), np.empty_like(limits)
        _keep_needed(time_s, np.ascontiguousarray(values), limits, APART_S, (low, high), keep)
    return keep


@leaf_kernel
def _keep_needed(
    time_s: NDArray[np.float64],
    values: NDArray[np.float64],
    limits: NDArray[np.float64],
    apart_s: float,
    slopes: tuple[NDArray[np.float64], NDArray[np.float64]],
    keep: NDArray[np.bool_],
) -> None:
    """Set ``keep`` where a sample is needed; ``slopes`` is room for the slopes that a line may have."""
    low, high = slopes
    first = 0
    low[:] = -np.inf
    high[:] = np.inf
    for at in range(1, len(time_s)):
        step_s = time_s[at] - time_s[first]
        reaches = at == first + 1 or step_s <= apart_s
        for column in range(len(limits)):
            slope = (values[at, column] - values[first, column]) / step_s
            reaches = reaches and low[column] <= slope <= high[column]
        if not reaches:
            keep[at - 1] = True
            first = at - 1
            low[:] = -np.inf
            high[:] = np.inf
            step_s = time_s[at] - time_s[first]
        if keep[at]:
            first = at
            low[:] = -np.inf
            high[:] = np.inf
            continue
        for column in range(len(limits)):
            slope, room = (values[at, column] - values[first, column]) / step_s, limits[column] / step_s
            low[column] = max(low[column], slope - room)
            high[column] = min(high[column], slope + room)


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """A lift as its crane drives it.

    Attributes:
        motion: Its motion.
        crane: The crane.
        component_id: Id of the part.
        track: The track of its load.
        time_ns: (N,) int64 samples of the whole motion.
        axes: (N, 3) float64 slew (rad), radius (m) and height (m).
        loaded: Which of those samples have a load: from the first of them to the last.
        hung: (H, 7) float64 position and quaternion of the load in the hook's frame, at the samples with a load.
        shown: (N,) bool, which samples viewers are shown of the crane.
        load_shown: (M,) bool, which samples of the track they are shown.
    """

    motion: LiftMotion
    crane: TowerCrane
    component_id: str
    track: LoadTrack
    time_ns: NDArray[np.int64]
    axes: NDArray[np.float64]
    loaded: slice
    hung: NDArray[np.float64]
    shown: NDArray[np.bool_]
    load_shown: NDArray[np.bool_]

    def without_load(self) -> Driven:
        """Return it with nothing on its hook: viewers are shown the load on another crane's."""
        none = slice(len(self.time_ns), len(self.time_ns))
        return replace(self, loaded=none, hung=self.hung[:0], load_shown=np.zeros_like(self.load_shown))

    @property
    def shown_ns(self) -> NDArray[np.int64]:
        """Times of the samples that viewers are shown of the crane."""
        return self.time_ns[self.shown]


def driven(site: Site, lift: Lift, motion: LiftMotion, rate: LogRate) -> Driven:
    """Return a lift as its crane drives it.

    ``rate``: which samples viewers are shown.
    """
    crane, track = site.cranes[motion.crane], crane_track(site, lift, motion)
    time_ns, axes = motion.samples()
    first = int(np.searchsorted(time_ns, track.time_ns[0]))
    held = _among(time_ns, track.time_ns)
    last = first + int(held[first:].argmin()) if not held[first:].all() else len(time_ns)
    sampled = _among(track.time_ns, time_ns)  # while it turns, the load has additional samples
    hung = _in_hook_frame(crane, time_ns, axes, track)[sampled]
    shown, load_shown = np.ones(len(time_ns), np.bool_), np.ones(len(track.time_ns), np.bool_)
    if rate is LogRate.MOTION:
        always_ns = _around(_ends_ns(motion, track), time_ns)
        values = np.concatenate([axes, joints_of(crane, axes), _at_all(hung, first, last, len(time_ns))], axis=1)
        shown = needed(time_ns, values, _limits(crane, float(axes[:, 1].max())), always_ns)
        places = np.concatenate([track.corner_m, track.tilt], axis=1)
        load_shown = needed(track.time_ns, places, np.array(_OF_A_POSE), always_ns)
    component_id = site.components[lift.component].id
    return Driven(motion, crane, component_id, track, time_ns, axes, slice(first, last), hung, shown, load_shown)


_OF_A_POSE = (OFF_M, OFF_M, OFF_M, *4 * (_OFF_QUATERNION,))


def _limits(crane: TowerCrane, reach_m: float) -> NDArray[np.float64]:
    """Return how far axes, joints and the load in the hook's frame may be from a line between samples."""
    slewing = OFF_M / max(reach_m, 1.0)
    second = OFF_M if crane.luffing is None else OFF_M / crane.luffing.length_m
    return np.array([slewing, OFF_M, OFF_M, slewing, second, OFF_M, *_OF_A_POSE])


def _at_all(hung: NDArray[np.float64], first: int, last: int, samples: int) -> NDArray[np.float64]:
    """Return (N, 7) the load in the hook's frame at every sample; without a load as at the nearest one with a load."""
    return hung[np.clip(np.arange(samples) - first, 0, last - first - 1)]


def _ends_ns(motion: LiftMotion, track: LoadTrack) -> NDArray[np.int64]:
    """Return the times at which something begins or ends: phases, trajectories, the load on the hook."""
    phases = [time_ns for phase in motion.phases for time_ns in (phase.start_ns, phase.end_ns)]
    parts = [motion.start_ns + int(part.time_ns[n]) for part in motion.trajectories for n in (0, -1)]
    return np.array([*phases, *parts, *(time_ns for time_ns, _ in track.states)], np.int64)


def _around(at_ns: NDArray[np.int64], times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return times and, of one between two samples, these two: a command at it is on the line between them."""
    before = np.searchsorted(times_ns, at_ns, side="right") - 1
    after = np.searchsorted(times_ns, at_ns)
    last = len(times_ns) - 1
    return np.concatenate([at_ns, times_ns[np.clip(before, 0, last)], times_ns[np.clip(after, 0, last)]])


def _in_hook_frame(
    crane: TowerCrane, time_ns: NDArray[np.int64], axes: NDArray[np.float64], track: LoadTrack
) -> NDArray[np.float64]:
    """Return (M, 7) position and quaternion of the load in the hook's frame, at the track's samples.

    The load keeps its heading while the jib slews, so its frame counter-rotates in the hook's.
    """
    slew, radius, height = axes[np.searchsorted(time_ns, track.time_ns)].T
    away = track.corner_m - hook_of(crane, slew, radius, height)
    cos, sin = np.cos(slew), np.sin(slew)
    position = [cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0], away[:, 2]]
    x, y, z, w = track.tilt.T
    c, s = np.cos(slew / 2.0), -np.sin(slew / 2.0)
    return np.stack([*position, c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z], axis=1)


def _among(times_ns: NDArray[np.int64], others_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (N,) which times are among the others (at least one, ascending)."""
    at = np.searchsorted(others_ns, times_ns)
    there: NDArray[np.bool_] = others_ns[np.minimum(at, len(others_ns) - 1)] == times_ns
    return there
