"""Guided last moves: aside and tilted, where neither straight down nor a detour of whole cells leads to a place.

A slab between the flanges of two beams goes in with one end first. The way out is searched, and reversed: A* over
height, distance aside and tilt. A straight step is tested by the exact sweep, a tilt at its end; the way found is then
shortened, and tested again at fine poses.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import fcl
import numpy as np
from numpy.typing import NDArray

from bimvox.planning.contact.sweep import blocked_steps
from bimvox.planning.contact.triangle_object import collision_object
from bimvox.records.guide import MOST_ASIDE_M, MOST_TILT_RAD, Guide

_STEP_M = 0.02
"""A step up, and of an end that is tilted."""
_ASIDE_STEPS_M = (0.02, 0.01)
"""A step aside: the second one if the first is too long to find a way."""
_TURN_COST = 3.0
"""A change from one kind of step to another costs as much as this many steps."""
_WEIGHT = 2.0
"""The estimate of the rest counts this much more than the way so far: a way is wanted soon, not the shortest one."""
_MOST_STATES = 10_000
_MOST_TILT_STEP_RAD = 0.01
_DROP_M = 0.005
"""Least height between two poses."""
_FINE_M = 0.002
"""Furthest that a point of the load moves between two poses of the last test."""
_ROUNDING_M = 1e-9

Pose = tuple[float, float, float]
State = tuple[int, int, int]


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


def find_guide(
    pairs: Sequence[Pair],
    centre_m: NDArray[np.float64],
    heading_rad: float,
    top_m: float,
    aside_m: float,
    known: Sequence[tuple[Pose, ...]] = (),
) -> Guide | None:
    """Return poses that lead a part to its place from straight above it, or None if none were found.

    Args:
        pairs: What must not meet.
        centre_m: (3,) its centre of mass at its place.
        heading_rad: Direction in plan in which it may be guided aside, and tilted.
        top_m: Height above its place at which it is free.
        aside_m: Furthest that it may be guided aside.
        known: Poses that led other parts to their places; tried first.
    """
    at_m = (float(centre_m[0]), float(centre_m[1]), float(centre_m[2]))
    guide = Guide(heading_rad, at_m, ((top_m, 0.0, 0.0), (0.0, 0.0, 0.0)))
    for step_m in _ASIDE_STEPS_M:
        way = _Way(pairs, guide, step_m, min(aside_m, MOST_ASIDE_M))
        for poses in known:
            if poses[0][0] == top_m and way.is_free_along(poses):
                return replace(guide, poses=poses)
        states = way.out() if way.pairs else None
        if states is None:
            continue
        poses = _descending(way.shortened([way.pose(state) for state in states]))
        if way.is_free_along(poses):
            return replace(guide, poses=poses)
    return None


def _descending(rising: Sequence[Pose]) -> tuple[Pose, ...]:
    """Return a way up as poses from its top down, no two of them at one height."""
    heights = [rising[0][0]]
    for height, _, _ in rising[1:-1]:
        heights.append(max(height, heights[-1] + _DROP_M))
    poses = [(round(h, 6), round(x, 6), round(t, 9)) for h, (_, x, t) in zip(heights, rising[:-1], strict=True)]
    return (rising[-1], *poses[::-1])


class _Way:
    """The lattice of poses: (height, aside, tilt) in steps, of a part seen along its direction as x."""

    def __init__(self, pairs: Sequence[Pair], guide: Guide, step_m: float, aside_m: float) -> None:
        x, y, _ = guide.ahead
        self._seen = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])
        self._step_m = step_m
        self._centre = np.array(guide.centre_m)
        self.top_m = guide.top_m
        self._steps_up = max(1, int(np.ceil(guide.top_m / _STEP_M - 1e-9)))
        self._up_m = guide.top_m / self._steps_up
        self._steps_aside = int(aside_m / step_m + 1e-9)
        parts = {id(pair.part_m): self._along(pair.part_m) for pair in pairs}  # most pairs share the part's triangles
        seen = [Pair(parts[id(p.part_m)], self._along(p.other_m), self._seen @ p.aside_m) for p in pairs]
        ends = np.concatenate([part_m.reshape(-1, 3) for part_m in parts.values()])
        self._reach_m = float(np.hypot(ends[:, 0], ends[:, 2]).max())
        self._tilt_rad = min(self._up_m / max(float(np.abs(ends[:, 0]).max()), 0.1), _MOST_TILT_STEP_RAD)
        self._steps_tilt = int(MOST_TILT_RAD / self._tilt_rad)
        self.pairs = [pair for pair in seen if self._may_meet(pair)]
        used = {id(pair.part_m): pair.part_m for pair in self.pairs}
        own = {key: collision_object(part_m) for key, part_m in used.items()}
        self._objects = [(own[id(pair.part_m)], collision_object(pair.other_m)) for pair in self.pairs]
        self._tilted: dict[int, list[NDArray[np.float64]]] = {}
        self._rows: dict[tuple[int, int], NDArray[np.bool_]] = {}
        self._columns: dict[tuple[int, int], NDArray[np.bool_]] = {}
        self._free: dict[State, bool] = {}

    def pose(self, state: State) -> Pose:
        """Return the pose of a state."""
        return state[0] * self._up_m, state[1] * self._step_m, state[2] * self._tilt_rad

    def out(self) -> list[State] | None:
        """Return the states from the place to level above it, or None."""
        start, goal = (0, 0, 0), (self._steps_up, 0, 0)
        if not self.is_free((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), _STEP_M):
            return None
        heap = [(_WEIGHT * self._left(start), 0.0, start, -1)]
        came: dict[State, State | None] = {start: None}
        cost, closed = {start: 0.0}, set[State]()
        while heap and len(closed) < _MOST_STATES:
            _, so_far, state, kind = heapq.heappop(heap)
            if state in closed:
                continue
            closed.add(state)
            if state == goal:
                found = []
                at: State | None = state
                while at is not None:
                    found.append(at)
                    at = came[at]
                return found[::-1]
            for way, move in enumerate(_MOVES):
                there = (state[0] + move[0], state[1] + move[1], state[2] + move[2])
                reached = so_far + sum(map(abs, move)) + (_TURN_COST if kind not in (way, -1) else 0.0)
                if there in closed or reached >= cost.get(there, np.inf) or not self._is_inside(there):
                    continue
                if not self._step_is_free(state, there):
                    continue
                cost[there], came[there] = reached, state
                heapq.heappush(heap, (reached + _WEIGHT * self._left(there), reached, there, way))
        return None

    def shortened(self, poses: list[Pose]) -> list[Pose]:
        """Return a way with as few poses as straight lines between them allow."""
        kept = [poses[0]]
        at = 0
        while at < len(poses) - 1:
            last = next(
                (n for n in range(len(poses) - 1, at + 1, -1) if self.is_free(poses[at], poses[n], _FINE_M)), at + 1
            )
            kept.append(poses[last])
            at = last
        return kept

    def is_free(self, start: Pose, end: Pose, spacing_m: float) -> bool:
        """Return whether nothing meets between two poses, tested where no point of the part moved by more."""
        by = np.abs(np.subtract(end, start))
        count = int(np.ceil((by[0] + by[1] + by[2] * self._reach_m) / spacing_m)) + 1
        return not any(self._meets(_between(start, end, n / count)) for n in range(count + 1))

    def is_free_along(self, poses: Sequence[Pose]) -> bool:
        """Return whether a whole way is free, tested at fine poses."""
        return all(self.is_free(a, b, _FINE_M) for a, b in pairwise(poses))

    def _along(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        seen: NDArray[np.float64] = (points_m - self._centre) @ self._seen.T
        return seen

    def _may_meet(self, pair: Pair) -> bool:
        """Return whether a solid is not apart from all that the part may sweep."""
        low, high = pair.part_m.min(axis=(0, 1)) + pair.aside_m, pair.part_m.max(axis=(0, 1)) + pair.aside_m
        aside_m, down_m = self._steps_aside * self._step_m, self._reach_m * np.sin(MOST_TILT_RAD)
        around_m = np.array([aside_m + down_m, 0.0, down_m])
        low, high = low - around_m, high + around_m + np.array([0.0, 0.0, self.top_m])
        other_low, other_high = pair.other_m.min(axis=(0, 1)), pair.other_m.max(axis=(0, 1))
        return bool((low <= other_high + _ROUNDING_M).all() and (high >= other_low - _ROUNDING_M).all())

    def _left(self, state: State) -> float:
        up, aside, tilt = self._steps_up - state[0], abs(state[1]), abs(state[2])
        return up + tilt + aside

    def _is_inside(self, state: State) -> bool:
        up, aside, tilt = state
        if up >= self._steps_up:
            return state == (self._steps_up, 0, 0)
        return up >= 0 and abs(aside) <= self._steps_aside and abs(tilt) <= self._steps_tilt

    def _step_is_free(self, here: State, there: State) -> bool:
        (up, aside, tilt), (up_there, aside_there, tilt_there) = here, there
        if tilt == tilt_there and aside == aside_there:
            return not self._column(tilt, aside)[min(up, up_there)]
        if tilt == tilt_there:
            return not self._row(tilt, up)[min(aside, aside_there) + self._steps_aside]
        # An end of the part moves by one step: the test of the whole way is finer.
        if there not in self._free:
            self._free[there] = not self._meets(self.pose(there))
        halfway = _between(self.pose(here), self.pose(there), 0.5)
        return self._free[there] and not self._meets(halfway)

    def _column(self, tilt: int, aside: int) -> NDArray[np.bool_]:
        key = (tilt, aside)
        if key not in self._columns:
            self._columns[key] = self._blocked(tilt, (aside * self._step_m, 0.0), 2, self._up_m, self._steps_up)
        return self._columns[key]

    def _row(self, tilt: int, up: int) -> NDArray[np.bool_]:
        key = (tilt, up)
        if key not in self._rows:
            start = (-self._steps_aside * self._step_m, up * self._up_m)
            self._rows[key] = self._blocked(tilt, start, 0, self._step_m, 2 * self._steps_aside)
        return self._rows[key]

    def _blocked(
        self, tilt: int, start: tuple[float, float], axis: int, step_m: float, count: int
    ) -> NDArray[np.bool_]:
        blocked, start_m = np.zeros(count, np.bool_), np.array([start[0], 0.0, start[1]])
        if tilt not in self._tilted:
            turn = _turn(tilt * self._tilt_rad)
            parts = {id(pair.part_m): pair.part_m for pair in self.pairs}
            leaning = {key: part_m @ turn.T for key, part_m in parts.items()}
            self._tilted[tilt] = [leaning[id(pair.part_m)] + pair.aside_m for pair in self.pairs]
        for part_m, pair in zip(self._tilted[tilt], self.pairs, strict=True):
            blocked |= blocked_steps(part_m, pair.other_m, axis, 1, step_m, count, start_m)
        return blocked

    def _meets(self, pose: Pose) -> bool:
        up_m, aside_m, tilt_rad = pose
        turn, at_m = _turn(tilt_rad), np.array([aside_m, 0.0, up_m])
        for pair, (part, other) in zip(self.pairs, self._objects, strict=True):
            part.setTransform(fcl.Transform(turn, pair.aside_m + at_m))
            if fcl.collide(part, other):
                return True
        return False


_MOVES = ((1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 1), (1, 0, -1))


def _turn(tilt_rad: float) -> NDArray[np.float64]:
    """Return the rotation that raises the end ahead, along x."""
    cos, sin = np.cos(tilt_rad), np.sin(tilt_rad)
    return np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])


def _between(start: Pose, end: Pose, share: float) -> Pose:
    height, aside, tilt = (a + share * (b - a) for a, b in zip(start, end, strict=True))
    return height, aside, tilt
