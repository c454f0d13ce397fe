"""Moves laid over time, one after the other or overlapping.

If two consecutive moves drive different axes (hoist up, then slew and trolley), the second may begin while the first
still runs: every axis keeps its own rest-to-rest profile, so no limit is exceeded, and the corner between them is
rounded. The collision check decides how early it may begin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.pendulum import half_period_s, pendulum_length_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.corner import Corner, longest_overlap_s
from bimvox.motion.course import Course, Moves
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.move import Line, Move, no_shorter, share_limits, slowed
from bimvox.motion.profile import Profile, profile_of
from bimvox.motion.shaping import Calm, ShapedProfile
from bimvox.motion.slow_zones import slow_shares
from bimvox.motion.swing import Pendulum, hanging_on
from bimvox.site.collision import CollisionSpace

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
            no_shorter(slowed(share_limits(crane, move), share), move.least_s)
            for move, share in zip(self._moves, slow_shares(crane, self._moves), strict=True)
        ]
        self._half_periods_s = [
            None if pendulum is None or not move.swings else _half_period_s(crane, move, pendulum)
            for move in self._moves
        ]
        self._known: dict[tuple[int, Calm], Profile | ShapedProfile] = {}
        self._paced: dict[tuple[int, float], Profile] = {}

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

        Args:
            calms: The shaping of each move; the plainest for all if None.
        """
        given = calms if calms is not None else (Calm(),) * len(self._moves)
        profiles = tuple(self.profile(n, calm) for n, calm in enumerate(given))
        starts = [0.0]
        for profile in profiles[:-1]:
            starts.append(starts[-1] + profile.duration_s)
        return Timeline(Course(self._packed, profiles), tuple(starts))

    def _profile(self, n: int, calm: Calm) -> Profile | ShapedProfile:
        limits, half_s = self._limits[n], self._half_periods_s[n]
        if half_s is None:
            return profile_of(limits)
        pace = calm.pace
        base = self._paced.get((n, pace))
        if base is None:
            # Along a straight line the load swings by its acceleration alone.
            rate = limits.rate if self._moves[n].line is Line.SITE else limits.rate * pace
            slower = AxisLimits(rate, limits.acceleration * pace**2, limits.jerk * pace**3)
            base = self._paced[n, pace] = profile_of(slower)
        return ShapedProfile(base, calm.parts, calm.stretch * half_s)


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


def _half_period_s(crane: TowerCrane, move: Move, pendulum: Pendulum) -> float:
    height_m = 0.5 * (move.start.height_m + move.end.height_m)
    radius_m = 0.5 * (move.start.radius_m + move.end.radius_m)
    return half_period_s(pendulum_length_m(crane, height_m, pendulum.below_hook_m, radius_m))


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
        corner = Corner(later, longest, fastest, straight_below_m)
        begins_s = np.array(timeline.start_s)
        overlap = float(longest_overlap_s(timeline.course.packed, begins_s, corner, rule, load, hanging))
        timeline = Timeline(timeline.course, _earlier(timeline.start_s, later, overlap))
    return timeline


def evenly_s(start_s: float, end_s: float, steps: int) -> NDArray[np.float64]:
    """Return ``steps`` + 1 times from start to end: those of ``np.linspace``, which takes ten times as long for it."""
    times_s = np.arange(steps + 1, dtype=np.float64) * ((end_s - start_s) / steps) + start_s
    times_s[-1] = end_s
    return times_s


def _earlier(start_s: tuple[float, ...], later: int, overlap_s: float) -> tuple[float, ...]:
    """Return the starts of moves with move ``later`` and all after it begun earlier."""
    return start_s[:later] + tuple([start - overlap_s for start in start_s[later:]])


def _longest_s(start_s: tuple[float, ...], lasts_s: tuple[float, ...], later: int) -> float:
    """Return by how much a move can overlap the one before it at most: never three moves at once."""
    earliest = max(start_s[later - 1], start_s[later - 2] + lasts_s[later - 2] if later > 1 else 0.0)
    return min(start_s[later] - earliest, lasts_s[later])
