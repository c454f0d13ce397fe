"""Moves laid over time, one after the other or overlapping, and their samples.

If two consecutive moves drive different axes (hoist up, then slew and trolley), the second may begin while the first
still runs: every axis keeps its own rest-to-rest profile, so no limit is exceeded, and the corner between them is
rounded. The collision check decides how early it may begin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s, rest_to_rest_s
from bimvox.motion.move import Line, Move, share_limits, slow_shares, slowed
from bimvox.motion.profile import (
    TIMES,
    Calm,
    Course,
    Moves,
    Packed,
    Profile,
    Room,
    ShapedProfile,
    add_move,
    first_from,
    profile_of,
    smoothed,
)
from bimvox.motion.swept import LoadFrame, samples_are_free
from bimvox.motion.swing import (
    STEP_S,
    Hanging,
    Pendulum,
    RiggedCrane,
    half_periods_s,
    hanging_on,
    sways_free,
)
from bimvox.motion.trajectories import trajectory_of
from bimvox.records.motion import Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.units import NS_PER_S

_CHECK_SPACING_VOX = 0.125
_HALVINGS = 6
_BLOCK = 64
"""Samples that are computed before they are checked."""


class _Corner(NamedTuple):
    """A corner between two moves along joint lines that drive different axes.

    Attributes:
        later: The second move.
        longest_s: Its longest possible overlap with the first.
        top_speed_m_s: Upper bound of the hook's speed in either move.
        straight_below_m: Height of the hook below which it is lowered only when the other axes are at rest.
    """

    later: int
    longest_s: float
    top_speed_m_s: float
    straight_below_m: float


@kernel
def longest_overlap_s(
    packed: Packed,
    begins_s: NDArray[np.float64],
    corner: _Corner,
    space: CollisionSpace,
    load: LoadFrame,
    hanging: Hanging,
) -> float:
    """Return the largest overlap found free: the longest possible, otherwise by halving the interval.

    Args:
        packed: Moves and their profiles.
        begins_s: (N,) when each move begins, the second move of the corner at the end of the first.
        corner: The corner.
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        hanging: The load on its rope.
    """
    if corner.longest_s <= 0.0:
        return 0.0
    if _fits(packed, begins_s, corner.longest_s, corner, space, load, hanging):
        return corner.longest_s
    free, blocked = 0.0, corner.longest_s
    for _ in range(_HALVINGS):
        middle = 0.5 * (free + blocked)
        if _fits(packed, begins_s, middle, corner, space, load, hanging):
            free = middle
        else:
            blocked = middle
    return free


@kernel
def _fits(
    packed: Packed,
    begins_s: NDArray[np.float64],
    overlap_s: float,
    corner: _Corner,
    space: CollisionSpace,
    load: LoadFrame,
    hanging: Hanging,
) -> bool:
    """Return whether the motion with an overlap is free from the start of the first move to the end of the second."""
    later = corner.later
    tried_s = begins_s[: later + 1].copy()
    tried_s[later] -= overlap_s
    ended_s = tried_s[later - 1] + packed.rows[later - 1, TIMES, 2]
    if not _stops_above(packed, later, ended_s - tried_s[later], corner.straight_below_m):
        return False
    start_s, end_s = tried_s[later - 1], max(ended_s, tried_s[later] + packed.rows[later, TIMES, 2])
    top_speed_m_s = 2.0 * corner.top_speed_m_s if tried_s[later] < ended_s else corner.top_speed_m_s
    lasts_s = end_s - start_s
    steps = int(np.ceil(max(lasts_s * top_speed_m_s / (_CHECK_SPACING_VOX * load.voxel_size_m), lasts_s / STEP_S))) + 1
    time_s = np.arange(steps + 1) * (lasts_s / steps) + start_s
    time_s[-1] = end_s
    axes = np.empty((steps + 1, 3))
    if not _lines_are_free(axes, time_s, tried_s, packed, later - 1, space, load):
        return False
    return not hanging.swings or sways_free(space, load, axes, hanging, lasts_s / steps)


@kernel
def _stops_above(packed: Packed, later: int, until_s: float, height_m: float) -> bool:
    """Return whether a move down is above a height until a time from its start."""
    ends = packed.ends[later]
    if ends[1, 2] >= ends[0, 2]:
        return True
    at = ends[:1].copy()
    add_move(at, np.full(1, until_s), 0.0, packed, later, Room(np.empty((2, 1)), np.empty((1, 3))))
    return bool(at[0, 2] >= min(height_m, ends[0, 2]))


@kernel
def _lines_are_free(
    axes: NDArray[np.float64],
    time_s: NDArray[np.float64],
    begins_s: NDArray[np.float64],
    packed: Packed,
    first_move: int,
    space: CollisionSpace,
    load: LoadFrame,
) -> bool:
    """Fill (N, 3) axes of a move and the next at times, as far as the load is free; return whether it always is.

    What is most likely in the way is met first: from the start of the second move on.
    """
    count = axes.shape[0]
    blocks = (count + _BLOCK - 1) // _BLOCK
    from_block = min(first_from(time_s, begins_s[first_move + 1], 0.0), count - 1) // _BLOCK
    room = Room(np.empty((2, _BLOCK + 1)), np.empty((_BLOCK + 1, 3)))
    for n in range(blocks):
        first = (from_block + n) % blocks * _BLOCK
        last = min(first + _BLOCK + 1, count)  # the first of the next block too: the load is free up to there
        for i in range(first, last):
            for k in range(3):
                axes[i, k] = packed.ends[first_move, 0, k]
        for move in (first_move, first_move + 1):
            add_move(axes[first:last], time_s[first:last], begins_s[move], packed, move, room)
        if not samples_are_free(space, load, axes[first:last]):
            return False
    return True


_PAUSE_S = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Timeline:
    """Moves and when each begins.

    Attributes:
        course: The moves and what they drive, whenever they begin.
        start_s: When each begins.
        end_s: When each ends.
    """

    course: Course
    start_s: tuple[float, ...]
    end_s: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        ends = tuple([start + lasts for start, lasts in zip(self.start_s, self.course.duration_s, strict=True)])
        object.__setattr__(self, "end_s", ends)

    @property
    def crane(self) -> TowerCrane:
        """The crane."""
        return self.course.crane

    @property
    def moves(self) -> tuple[Move, ...]:
        """In order; each starts where the one before ends."""
        return self.course.moves

    @property
    def profiles(self) -> tuple[Profile | ShapedProfile, ...]:
        """One per move."""
        return self.course.profiles

    @property
    def duration_s(self) -> float:
        """When the last move ends."""
        return self.end_s[-1]

    @property
    def top_speed_m_s(self) -> float:
        """Upper bound of the hook's speed."""
        fastest = max(self.course.top_speed_m_s)
        # Two moves may run at once.
        return 2.0 * fastest if self.is_blended else fastest

    @property
    def is_blended(self) -> bool:
        """Whether any move begins before the one before it ends."""
        ends = self.end_s
        return any(start < ends[i] for i, start in enumerate(self.start_s[1:]))

    def axes_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times that ascend."""
        return self.course.axes_at(time_s, self.start_s)


class Pacer:
    """Gives moves their profiles; each profile is computed once.

    Args:
        crane: The crane.
        moves: In order; each starts where the one before ends.
        pendulum: What hangs on the hook; None if moves are not shaped.
    """

    def __init__(self, crane: TowerCrane, moves: Sequence[Move], pendulum: Pendulum | None = None) -> None:
        self._crane, self._moves = crane, tuple(moves)
        self._packed = Moves(crane, moves)
        self._limits = [
            _no_shorter(slowed(share_limits(crane, move), share), move.least_s)
            for move, share in zip(self._moves, slow_shares(crane, self._moves), strict=True)
        ]
        self._half_periods_s = [
            None if pendulum is None or not move.swings else _half_periods_s(crane, move, pendulum)
            for move in self._moves
        ]
        self._known: dict[tuple[int, Calm], Profile | ShapedProfile] = {}
        self._paced: dict[tuple[int, float, float], Profile] = {}

    def least_s(self, lengths_s: Sequence[float]) -> float:
        """Return a lower bound of the time of the moves if each takes a time or longer, however much they overlap.

        No three of them overlap, and none ends before the one before it.
        """
        start_s = end_s = ended_s = 0.0
        for overlaps, length_s in zip(self._packed.overlaps, lengths_s, strict=True):
            start_s = max(start_s, ended_s) if overlaps else end_s
            ended_s, end_s = end_s, max(start_s + length_s, end_s)
        return end_s

    def profile(self, n: int, calm: Calm) -> Profile | ShapedProfile:
        """Return the profile of a move with this shaping; the plain one if the move makes nothing swing."""
        known = self._known.get((n, calm))
        if known is None:
            known = self._known[n, calm] = self._profile(n, calm)
        return known

    def in_sequence(self, calms: Sequence[Calm] | None = None) -> Timeline:
        """Return the timeline on which every move waits for the end of the one before it.

        ``calms``: the shaping of each move; the plainest for all if None.
        """
        given = calms if calms is not None else (Calm(),) * len(self._moves)
        profiles = tuple(self.profile(n, calm) for n, calm in enumerate(given))
        starts = [0.0]
        for profile in profiles[:-1]:
            starts.append(starts[-1] + profile.duration_s)
        return Timeline(Course(self._packed, profiles), tuple(starts))

    def _profile(self, n: int, calm: Calm) -> Profile | ShapedProfile:
        limits, halves_s = self._limits[n], self._half_periods_s[n]
        if halves_s is None:
            return profile_of(limits)
        pace = calm.pace
        slow_s, fast_s = halves_s
        ramp_s = 2.0 * fast_s if calm.smooth else 0.0
        base = self._paced.get((n, pace, ramp_s))
        if base is None:
            # Along a straight line the load swings by its acceleration alone.
            rate = limits.rate if self._moves[n].line is Line.SITE else limits.rate * pace
            slower = AxisLimits(rate, limits.acceleration * pace**2, limits.jerk * pace**3)
            base = self._paced[n, pace, ramp_s] = profile_of(smoothed(slower, ramp_s) if ramp_s else slower)
        return ShapedProfile(base, calm.parts, calm.stretch * slow_s)


def in_sequence(crane: TowerCrane, moves: Sequence[Move], pendulum: Pendulum | None = None) -> Timeline:
    """Return the timeline on which every move, plainly shaped, waits for the end of the one before it.

    Args:
        crane: The crane.
        moves: In order; each starts where the one before ends.
        pendulum: What hangs on the hook; None if moves are not shaped.
    """
    return Pacer(crane, moves, pendulum).in_sequence()


def followed(first: Timeline, then: Timeline, pause_s: float = 0.0) -> Timeline:
    """Return moves over time, and others that begin when they have ended and a pause is over."""
    begins_s = first.duration_s + pause_s
    course = Course(Moves(first.crane, first.moves + then.moves), first.profiles + then.profiles)
    return Timeline(course, first.start_s + tuple(start + begins_s for start in then.start_s))


def after_a_pause(timeline: Timeline, pause_s: float) -> Timeline:
    """Return moves that begin when a pause is over."""
    return Timeline(timeline.course, tuple(start + pause_s for start in timeline.start_s))


def pause_of(timeline: Timeline) -> tuple[int, float, float] | None:
    """Return the move before which the crane pauses, and start and end of the pause, s; None without a pause."""
    for later, begins_s in enumerate(timeline.start_s):
        ended_s = max(timeline.end_s[:later], default=0.0)
        if begins_s > ended_s + _PAUSE_S:
            return later, ended_s, begins_s
    return None


def _half_periods_s(crane: TowerCrane, move: Move, pendulum: Pendulum) -> tuple[float, float]:
    height_m = 0.5 * (move.start.height_m + move.end.height_m)
    radius_m = 0.5 * (move.start.radius_m + move.end.radius_m)
    return half_periods_s(crane, pendulum, height_m, radius_m)


def overlapping_as(timeline: Timeline, other: Timeline) -> Timeline:
    """Return a timeline in sequence with the overlaps of another one of the same moves, as far as they are possible."""
    starts, lasts = timeline.start_s, timeline.course.duration_s
    for later in range(1, len(starts)):
        wanted = other.end_s[later - 1] - other.start_s[later]
        if wanted > 0.0:
            starts = _earlier(starts, later, min(wanted, _longest_s(starts, lasts, later)))
    return Timeline(timeline.course, starts)


def blended(
    timeline: Timeline,
    space: CollisionSpace,
    load: LoadFrame,
    straight_below_m: float = -np.inf,
    last: CollisionSpace | None = None,
    pendulum: Pendulum | None = None,
) -> Timeline:
    """Return the timeline with every corner rounded as far as the motion stays free.

    Only moves along joint lines that drive different axes are blended, and never three at once.

    Args:
        timeline: Moves in sequence, each of them free.
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        straight_below_m: Height of the hook below which it is lowered only when the other axes are at rest.
        last: The rule for the corner before the last move, if it differs.
        pendulum: What hangs on the hook; None if its swing is not checked.
    """
    hanging = hanging_on(timeline.crane, pendulum)
    for later in range(1, len(timeline.moves)):
        if not timeline.course.overlaps[later]:
            continue
        longest = _longest_s(timeline.start_s, timeline.course.duration_s, later)
        rule = space if last is None or later + 1 < len(timeline.moves) else last
        fastest = max(timeline.course.top_speed_m_s[later - 1 : later + 1])
        corner = _Corner(later, longest, fastest, straight_below_m)
        begins_s = np.array(timeline.start_s)
        overlap = float(longest_overlap_s(timeline.course.packed, begins_s, corner, rule, load, hanging))
        timeline = Timeline(timeline.course, _earlier(timeline.start_s, later, overlap))
    return timeline


def _earlier(start_s: tuple[float, ...], later: int, overlap_s: float) -> tuple[float, ...]:
    """Return the starts of moves with move ``later`` and all after it begun earlier."""
    return start_s[:later] + tuple([start - overlap_s for start in start_s[later:]])


def _longest_s(start_s: tuple[float, ...], lasts_s: tuple[float, ...], later: int) -> float:
    """Return by how much a move can overlap the one before it at most: never three moves at once."""
    earliest = max(start_s[later - 1], start_s[later - 2] + lasts_s[later - 2] if later > 1 else 0.0)
    return min(start_s[later] - earliest, lasts_s[later])


# Shares of a cell: samples are taken from a dense grid so that the hook moves less than half a cell between two.
_DENSE_VOX = 0.05
_SPACING_VOX = 0.4
# Samples closer than this to a required one are left out.
_SAME_NS = 1_000_000


class _Motion(Protocol):
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
        shaping_s, _ = half_periods_s(crane, pendulum, height_m, radius_m)
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


def sample_times(motion: _Motion, end_ns: int, must_ns: NDArray[np.int64], rigged: RiggedCrane) -> NDArray[np.int64]:
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


def _no_shorter(limits: AxisLimits, least_s: float) -> AxisLimits:
    """Return limits on the share driven under which a move from rest to rest takes no less than a time."""
    pace = min(1.0, rest_to_rest_s(1.0, limits) / least_s) if least_s > 0.0 else 1.0
    if pace == 1.0:
        return limits
    return AxisLimits(limits.rate * pace, limits.acceleration * pace**2, limits.jerk * pace**3)
