"""Guided last moves: aside and tilted, where neither straight down nor a detour of whole cells leads to a place.

A slab between the flanges of two beams goes in with one end first. The way out is searched, and reversed: A* over
height, distance aside and tilt. A straight step is tested by the exact sweep, a tilt at its end and halfway; the way
found is then shortened, and tested again at fine poses.

What is found depends on the arguments alone. The lattice of poses is the same from every height, so a search that
found no way below a height has found that there is none from higher up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.planning.contact.posed import ALONG, LEVEL, UP, Group, Posed, meets, meets_between, posed
from bimvox.records.lift import MOST_ASIDE_M, MOST_TILT_RAD, Guide

_STEP_M = 0.02
"""A step up, and of an end that is tilted."""
_ASIDE_STEPS_M = (0.02, 0.01)
"""A step aside: the second one if the first is too long to find a way."""
_TURN_COST = 3
"""A change from one kind of step to another costs as much as this many steps."""
_WEIGHT = 2
"""The estimate of the rest counts this much more than the way so far: a way is wanted soon, not the shortest one."""
_MOST_STATES = 10_000
_MOST_WORK = 100_000_000
"""Most boxes and triangles that are compared for one guide: a second or so."""
_MOST_TILT_STEP_RAD = 0.01
_DROP_M = 0.005
"""Least height between two poses."""
_FINE_M = 0.002
"""Furthest that a point of the load moves between two poses of the last test."""
_TILT_TESTS = 10
"""Poses on a step that tilts, each of them 2 mm at the end of the part; and as many if it also leads up."""
_ROUNDING_M = 1e-9

Pose = tuple[float, float, float]


class Pair(NamedTuple):
    """What must not meet: triangles of the part at its place, and of a solid.

    Attributes:
        part_m: (F, 3, 3) float64.
        other_m: (G, 3, 3) float64.
        aside_m: (3,) float64 by which the part is moved: the way out of a modelled clash.
    """

    part_m: NDArray[np.float64]
    other_m: NDArray[np.float64]
    aside_m: NDArray[np.float64]


class NoGuide(NamedTuple):
    """No way was found.

    Attributes:
        top_m: The height above the place from which one was searched for.
        reached_m: The height that the search reached: there is none from anywhere above it; infinite if it was cut off.
    """

    top_m: float
    reached_m: float


def find_guide(
    part_m: NDArray[np.float64],
    pairs: Sequence[Pair],
    centre_m: NDArray[np.float64],
    headings_rad: Sequence[float],
    top_m: float,
    aside_m: float,
    most_work: int = _MOST_WORK,
) -> Guide | NoGuide:
    """Return poses that lead a part to its place from straight above it, or that none were found.

    Args:
        part_m: (F, 3, 3) its triangles at its place.
        pairs: What must not meet.
        centre_m: (3,) its centre of mass at its place.
        headings_rad: Directions in plan in which it may be guided aside, and tilted.
        top_m: Height above its place at which it is free.
        aside_m: Furthest that it may be guided aside.
        most_work: Most boxes and triangles that the search compares.
    """
    at_m = (float(centre_m[0]), float(centre_m[1]), float(centre_m[2]))
    straight = ((top_m, 0.0, 0.0), (0.0, 0.0, 0.0))
    tried = []
    for heading_rad in headings_rad:
        guide = Guide(heading_rad, at_m, straight)
        around = _Around(part_m, pairs, guide, min(aside_m, MOST_ASIDE_M))
        if around.groups:
            tried.append((guide, around))
    reached_m, work = 0.0 if len(tried) == len(headings_rad) else np.inf, most_work
    for step_m in _ASIDE_STEPS_M:
        for guide, around in tried:
            rising, reached, compared = around.way_out(step_m, work)
            work -= compared
            if rising:
                poses = _descending(around.shortened(rising))
                if around.is_free_along(poses):
                    return replace(guide, poses=poses)
            reached_m = max(reached_m, reached)
    return NoGuide(top_m, reached_m)


def _descending(rising: Sequence[Pose]) -> tuple[Pose, ...]:
    """Return a way up as poses from its top down, no two of them at one height."""
    heights = [rising[0][0]]
    for height, _, _ in rising[1:-1]:
        heights.append(max(height, heights[-1] + _DROP_M))
    poses = [(round(h, 6), round(x, 6), round(t, 9)) for h, (_, x, t) in zip(heights, rising[:-1], strict=True)]
    return (rising[-1], *poses[::-1])


class _Around:
    """What must not meet, seen along the direction of a part as x, and whether it does in a pose of the part."""

    def __init__(self, part_m: NDArray[np.float64], pairs: Sequence[Pair], guide: Guide, aside_m: float) -> None:
        x, y, _ = guide.ahead
        self._seen = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])
        self._centre = np.array(guide.centre_m)
        self.top_m, self.aside_m = guide.top_m, aside_m
        parts = {id(pair.part_m): self._along(pair.part_m) for pair in pairs}  # most pairs share the part's triangles
        ends = self._along(part_m).reshape(-1, 3)
        self.reach_m = float(np.hypot(ends[:, 0], ends[:, 2]).max())
        self.longest_m = float(np.abs(ends[:, 0]).max())
        boxes = {key: _box(own_m) for key, own_m in parts.items()}
        alike: dict[tuple[int, bytes], list[Group]] = {}
        for pair in pairs:
            own, way_m = id(pair.part_m), self._seen @ pair.aside_m
            other_m = self._within_reach(self._along(pair.other_m), boxes[own] + way_m)
            if len(other_m):
                alike.setdefault((own, way_m.tobytes()), []).append(Group(parts[own], other_m, way_m))
        self.groups = [
            same[0]._replace(other_m=np.concatenate([group.other_m for group in same])) for same in alike.values()
        ]
        self._posed = posed(self.groups)

    def meets(self, pose: Pose) -> bool:
        """Return whether the part meets anything in a pose."""
        return bool(meets(self._posed, pose, LEVEL, 0.0))

    def is_free(self, start: Pose, end: Pose) -> bool:
        """Return whether nothing meets between two poses, tested at fine ones."""
        by = np.abs(np.subtract(end, start))
        count = int(np.ceil((by[0] + by[1] + by[2] * self.reach_m) / _FINE_M)) + 1
        return not meets_between(self._posed, start, end, count)

    def is_free_along(self, poses: Sequence[Pose]) -> bool:
        """Return whether a whole way is free, tested at fine poses."""
        return all(self.is_free(start, end) for start, end in pairwise(poses))

    def way_out(self, step_m: float, most_work: int) -> tuple[list[Pose], float, int]:
        """Return poses from the place to level above it, none if there is no way; the height reached then; the work.

        The height is infinite if a way was found, or if the search was cut off.

        ``most_work``: most boxes and triangles that it compares.
        """
        tilt_rad = min(_STEP_M / max(self.longest_m, 0.1), _MOST_TILT_STEP_RAD)
        up = max(1, int(np.ceil(self.top_m / _STEP_M - 1e-9)))
        most = (up, int(self.aside_m / step_m + 1e-9), int(MOST_TILT_RAD / tilt_rad))
        size = (up + 1) * (2 * most[1] + 1) * (2 * most[2] + 1)
        known = _Known(np.zeros(size, np.int32), np.zeros(size, np.int8), np.zeros(size, np.int8))
        steps = (_STEP_M, step_m, tilt_rad, self.top_m)
        states, reached = _way_out(self._posed, most, steps, known, _MOVES, most_work)
        poses = [_pose(steps, (int(n), int(aside), int(tilt))) for n, aside, tilt in states]
        return poses, np.inf if reached < 0 else reached * _STEP_M, int(self._posed.counted[0])

    def shortened(self, poses: list[Pose]) -> list[Pose]:
        """Return a way with few poses, between which straight lines are free."""
        kept = [poses[0]]
        at, last = 0, len(poses) - 1
        while at < last:
            at = last if self.is_free(poses[at], poses[last]) else self._furthest(poses, at)
            kept.append(poses[at])
        return kept

    def _furthest(self, poses: list[Pose], at: int) -> int:
        """Return a later pose that a straight line leads to: the step is doubled while it is free, then halved."""
        free, blocked, step = at + 1, len(poses) - 1, 2
        while at + step < blocked:
            if self.is_free(poses[at], poses[at + step]):
                free, step = at + step, 2 * step
            else:
                blocked = at + step
        while blocked - free > 1:
            middle = (free + blocked) // 2
            if self.is_free(poses[at], poses[middle]):
                free = middle
            else:
                blocked = middle
        return free

    def _along(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        seen: NDArray[np.float64] = (points_m - self._centre) @ self._seen.T
        return seen

    def _within_reach(self, other_m: NDArray[np.float64], own_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the triangles that are not apart from all that the part, in a box at its place, may sweep."""
        ends_m = np.abs(own_m).max(axis=0)
        down_m = float(np.hypot(ends_m[0], ends_m[2])) * np.sin(MOST_TILT_RAD)
        around_m = np.array([self.aside_m + down_m, 0.0, down_m]) + _ROUNDING_M
        low, high = own_m[0] - around_m, own_m[1] + around_m + np.array([0.0, 0.0, self.top_m])
        near = ((other_m.min(axis=1) <= high) & (other_m.max(axis=1) >= low)).all(axis=1)
        result: NDArray[np.float64] = other_m[near]
        return result


def _box(triangles_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, 3) the lowest and the highest corner of a box around (N, 3, 3) triangles."""
    return np.stack([triangles_m.min(axis=(0, 1)), triangles_m.max(axis=(0, 1))])


_MOVES = np.array([(1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 1), (1, 0, -1)], np.int64)

_UNKNOWN, _FREE, _MET = 0, 1, 2


class _Known(NamedTuple):
    """What a search knows of each state of the lattice, (N,).

    Attributes:
        cost: int32 of the way so far, plus one; 0: not reached.
        came: int8 the move that led there, plus one; negative: it is closed.
        met: int8 whether the part meets anything there, if that is known.
    """

    cost: NDArray[np.int32]
    came: NDArray[np.int8]
    met: NDArray[np.int8]


@kernel
def _way_out(
    shapes: Posed,
    most: tuple[int, int, int],
    steps: tuple[float, float, float, float],
    known: _Known,
    moves: NDArray[np.int64],
    most_work: int,
) -> tuple[NDArray[np.int64], int]:
    """Return the (N, 3) states from the place to level above it, none if there are none, and the level reached then.

    The level is negative if there is a way, or if the search was cut off.

    ``shapes``: what must not meet; ``most``: the highest level, steps aside, steps of tilt; ``steps``: length of a step
    up, aside, of a tilt; the height of the highest level; ``moves``: (M, 3) steps; ``most_work``: most boxes and
    triangles that are compared.
    """
    no_way = np.empty((0, 3), np.int64)
    shapes.counted[0] = 0
    # First, what proves without a search that there is no way.
    closed_level = _closed_level(shapes, most, steps, known, most_work)
    if closed_level >= 0:
        return no_way, closed_level
    across, tilts = 2 * most[1] + 1, 2 * most[2] + 1
    # One stack for each estimate: the last state that came to the lowest estimate is taken first.
    tops = np.full(_WEIGHT * (most[0] + most[1] + most[2]) + (2 + _TURN_COST) * _MOST_STATES, -1, np.int32)
    entries = np.empty((moves.shape[0] * _MOST_STATES + 1, 2), np.int64)
    size, lowest, closed, highest = 1, _WEIGHT * most[0], 0, 0
    start = most[1] * tilts + most[2]
    entries[0, 0], entries[0, 1], tops[lowest] = start, -1, 0
    known.cost[start] = 1
    while closed < _MOST_STATES and shapes.counted[0] < most_work:
        # Take the state that came last to the lowest estimate; a closed one has a negative move.
        while lowest < tops.shape[0] and tops[lowest] < 0:
            lowest += 1
        if lowest == tops.shape[0]:
            return no_way, highest + 1
        here, tops[lowest] = entries[tops[lowest], 0], entries[tops[lowest], 1]
        if known.came[here] < 0:
            continue
        kind, so_far = known.came[here] - 1, known.cost[here]
        known.came[here] = -known.came[here] if kind >= 0 else -1 - moves.shape[0]
        closed += 1
        up, aside, tilt = here // (across * tilts), here // tilts % across - most[1], here % tilts - most[2]
        highest = max(highest, up)
        if up == most[0]:
            return _states_back(known, most, here, moves), -1
        for move in range(moves.shape[0]):
            u, a, t = up + moves[move, 0], aside + moves[move, 1], tilt + moves[move, 2]
            # At the highest level the part hangs level above its place.
            if abs(a) > most[1] or abs(t) > most[2] or (u == most[0] and (a != 0 or t != 0)):
                continue
            there = (u * across + a + most[1]) * tilts + t + most[2]
            reached = (
                so_far
                + abs(moves[move, 0])
                + abs(moves[move, 1])
                + abs(moves[move, 2])
                + (_TURN_COST if kind not in (move, -1) else 0)
            )
            if known.came[there] < 0 or (known.cost[there] and reached >= known.cost[there]):
                continue
            # Triangles are compared last, only for a state that would become cheaper.
            if not _step_is_free(shapes, (up, aside, tilt), (u, a, t), most, steps, known):
                continue
            known.cost[there], known.came[there] = reached, move + 1
            estimate = reached - 1 + _WEIGHT * (most[0] - u + abs(a) + abs(t))
            entries[size, 0], entries[size, 1], tops[estimate] = there, tops[estimate], size
            size, lowest = size + 1, min(lowest, estimate)
    return no_way, -1


@kernel
def _closed_level(
    shapes: Posed,
    most: tuple[int, int, int],
    steps: tuple[float, float, float, float],
    known: _Known,
    most_work: int,
) -> int:
    """Return the lowest level on which the part meets something in every pose; -1 if none is known.

    Every way leads through each level.
    """
    aside, tilt = 0, 0
    for up in range(most[0] + 1):
        if not _is_met(shapes, (up, 0, 0), most, steps, known):
            aside, tilt = 0, 0
            continue
        if up in (0, most[0]):
            return up
        if not _is_met(shapes, (up, aside, tilt), most, steps, known):
            continue
        is_closed = shapes.counted[0] < most_work
        for a in range(-most[1], most[1] + 1):
            for t in range(-most[2], most[2] + 1):
                if is_closed and not _is_met(shapes, (up, a, t), most, steps, known):
                    aside, tilt, is_closed = a, t, False
        if is_closed:
            return up
    return -1


@kernel
def _step_is_free(
    shapes: Posed,
    here: tuple[int, int, int],
    there: tuple[int, int, int],
    most: tuple[int, int, int],
    steps: tuple[float, float, float, float],
    known: _Known,
) -> bool:
    """Return whether nothing meets on a step: where the part only slides along something, its end tells."""
    if _is_met(shapes, there, most, steps, known):
        return False
    begin, end = _pose(steps, here), _pose(steps, there)
    if here[2] != there[2]:
        return not meets_between(shapes, begin, end, _TILT_TESTS * (1 + there[0] - here[0]))
    if here[1] == there[1]:
        return not meets(shapes, begin, UP, end[0] - begin[0])
    return not meets(shapes, begin if begin[1] < end[1] else end, ALONG, steps[1])


@kernel
def _is_met(
    shapes: Posed,
    state: tuple[int, int, int],
    most: tuple[int, int, int],
    steps: tuple[float, float, float, float],
    known: _Known,
) -> bool:
    """Return whether the part meets anything in a state."""
    n = (state[0] * (2 * most[1] + 1) + state[1] + most[1]) * (2 * most[2] + 1) + state[2] + most[2]
    if known.met[n] == _UNKNOWN:
        known.met[n] = _MET if meets(shapes, _pose(steps, state), LEVEL, 0.0) else _FREE
    is_met: bool = known.met[n] == _MET
    return is_met


@kernel
def _pose(steps: tuple[float, float, float, float], state: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return the pose of a state."""
    return min(state[0] * steps[0], steps[3]), state[1] * steps[1], state[2] * steps[2]


@kernel
def _states_back(known: _Known, most: tuple[int, int, int], last: int, moves: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the (N, 3) states from the place to the last one, by the moves that led there."""
    across, tilts = 2 * most[1] + 1, 2 * most[2] + 1
    length, here = 1, last
    while -known.came[here] <= moves.shape[0]:
        move = -known.came[here] - 1
        here -= (moves[move, 0] * across + moves[move, 1]) * tilts + moves[move, 2]
        length += 1
    states, here = np.empty((length, 3), np.int64), last
    for n in range(length - 1, -1, -1):
        states[n, 0], states[n, 1] = here // (across * tilts), here // tilts % across - most[1]
        states[n, 2] = here % tilts - most[2]
        if n:
            move = -known.came[here] - 1
            here -= (moves[move, 0] * across + moves[move, 1]) * tilts + moves[move, 2]
    return states


# Guides by what they were searched for: no search is made twice.
#
# What is returned is what a search would find, whatever was searched before: for the same part, height and surroundings
# the guide that was found; none where a search among fewer things found none. Preparing and planning bays of slabs
# takes 1.3 times as long without it, a frame of 200 precast parts 1.04 times.


class GuideSought(NamedTuple):
    """What the result of a search depends on.

    Attributes:
        part: Number of the part.
        aside_m: Furthest that it may be guided aside.
        top_m: Height above its place from which it is guided.
        met_from_m: By solid that may be in the way, the least height of the part at which it may be.
    """

    part: int
    aside_m: float
    top_m: float
    met_from_m: Mapping[int, float]

    def met_below(self, height_m: float) -> frozenset[int]:
        """Return the solids that may be in the way below a height of the part."""
        return frozenset(solid for solid, from_m in self.met_from_m.items() if from_m <= height_m)


class KnownGuides:
    """What searches have found."""

    def __init__(self) -> None:
        self._found: dict[tuple[int, float, float, frozenset[int]], Guide | None] = {}
        self._in_vain: dict[tuple[int, float], list[tuple[NoGuide, frozenset[int]]]] = {}

    def of(self, sought: GuideSought, search: Callable[[], Guide | NoGuide]) -> Guide | None:
        """Return what a search finds; None if there is no guide."""
        part, aside_m, top_m, _ = sought
        key = (part, aside_m, top_m, sought.met_below(top_m))
        if key not in self._found:
            in_vain = self._in_vain.setdefault((part, aside_m), [])
            found = None if any(_holds(*one, sought) for one in in_vain) else search()
            if isinstance(found, NoGuide):
                if isfinite(found.reached_m):
                    in_vain.append((found, sought.met_below(found.reached_m)))
                found = None
            self._found[key] = found
        return self._found[key]


def _holds(found: NoGuide, met: frozenset[int], sought: GuideSought) -> bool:
    """Return whether there is no way either where all that a search in vain met is in the way."""
    return (found.top_m == sought.top_m or found.reached_m < sought.top_m) and met <= sought.met_from_m.keys()
