"""Guided last moves: aside and tilted, where neither straight down nor a detour of whole cells leads to a place.

A slab between the flanges of two beams goes in with one end first. The way out is searched, and reversed: A* over
height, distance aside and tilt. A straight step is tested by the exact sweep, a tilt at its end; the way found is then
shortened, and tested again at fine poses.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise, repeat
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
_SWEPT_TOGETHER = 4
"""Steps that one sweep tests."""
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


class NoGuide(NamedTuple):
    """No way was found.

    Attributes:
        top_m: The height above the place from which one was searched for.
        reached_m: The height that the search reached: there is none from anywhere above it; infinite if it was cut off.
    """

    top_m: float
    reached_m: float


def find_guide(
    pairs: Sequence[Pair],
    centre_m: NDArray[np.float64],
    headings_rad: Sequence[float],
    top_m: float,
    aside_m: float,
    known: Sequence[tuple[Pose, ...]] = (),
) -> Guide | NoGuide:
    """Return poses that lead a part to its place from straight above it, or that none were found.

    Args:
        pairs: What must not meet.
        centre_m: (3,) its centre of mass at its place.
        headings_rad: Directions in plan in which it may be guided aside, and tilted.
        top_m: Height above its place at which it is free.
        aside_m: Furthest that it may be guided aside.
        known: Poses, but for the first, that led other parts to their places; tried first, mirrored too.
    """
    at_m = (float(centre_m[0]), float(centre_m[1]), float(centre_m[2]))
    straight = ((top_m, 0.0, 0.0), (0.0, 0.0, 0.0))
    tried = []
    for heading_rad in headings_rad:
        guide = Guide(heading_rad, at_m, straight)
        around = _Around(pairs, guide, min(aside_m, MOST_ASIDE_M))
        for rest in known:
            for sign in (1.0, -1.0):
                poses = (
                    straight[0],
                    *((height, sign * aside + 0.0, sign * tilt + 0.0) for height, aside, tilt in rest),
                )
                if rest[0][0] < top_m and around.reaches(poses) and around.is_free_along(poses):
                    return replace(guide, poses=poses)
        if around.groups:
            tried.append((guide, around))
    reached_m = 0.0
    for step_m in _ASIDE_STEPS_M:
        for guide, around in tried:
            way = _Way(around, step_m)
            states = way.out()
            if states is not None:
                poses = _descending(around.shortened([way.pose(state) for state in states]))
                if around.is_free_along(poses):
                    return replace(guide, poses=poses)
            reached_m = max(reached_m, np.inf if states else way.reached_m)
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

    def __init__(self, pairs: Sequence[Pair], guide: Guide, aside_m: float) -> None:
        x, y, _ = guide.ahead
        self._seen = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])
        self._centre = np.array(guide.centre_m)
        self.top_m, self.aside_m = guide.top_m, aside_m
        parts = {id(pair.part_m): self._along(pair.part_m) for pair in pairs}  # most pairs share the part's triangles
        ends = np.concatenate([part_m.reshape(-1, 3) for part_m in parts.values()] or [np.zeros((1, 3))])
        self.reach_m = float(np.hypot(ends[:, 0], ends[:, 2]).max())
        self.longest_m = float(np.abs(ends[:, 0]).max())
        boxes = {key: _box(part_m) for key, part_m in parts.items()}
        alike: dict[tuple[int, bytes], list[tuple[Pair, NDArray[np.float64]]]] = {}
        for pair in pairs:
            own, way_m = id(pair.part_m), self._seen @ pair.aside_m
            other_m = self._within_reach(self._along(pair.other_m), boxes[own] + way_m)
            if len(other_m):
                alike.setdefault((own, way_m.tobytes()), []).append((Pair(parts[own], other_m, way_m), boxes[own]))
        near = [one for same in alike.values() for one in same]
        self._own = np.array([box for _, box in near]).reshape(-1, 2, 3)
        self._others = np.array([_box(pair.other_m) for pair, _ in near]).reshape(-1, 2, 3)
        self._asides = np.array([pair.aside_m for pair, _ in near]).reshape(-1, 3)
        self._begins = np.cumsum([0, *map(len, alike.values())])[:-1]
        self.groups = [
            same[0][0]._replace(other_m=np.concatenate([pair.other_m for pair, _ in same])) for same in alike.values()
        ]
        objects = {own: collision_object(parts[own]) for own, _ in alike}
        self._objects = [
            (objects[own], collision_object(group.other_m), group.aside_m)
            for (own, _), group in zip(alike, self.groups, strict=True)
        ]
        self._met: dict[Pose, bool] = {}

    def meets(self, pose: Pose, close: Iterable[bool] = repeat(True)) -> bool:
        """Return whether the part meets anything of the close groups in a pose."""
        up_m, aside_m, tilt_rad = pose
        turn, at_m = _turn(tilt_rad), np.array([aside_m, 0.0, up_m])
        for (part, other, way_m), is_close in zip(self._objects, close, strict=False):
            if is_close:
                part.setTransform(fcl.Transform(turn, way_m + at_m))
                if fcl.collide(part, other):
                    return True
        return False

    def met_at(self, pose: Pose) -> bool:
        """Return what ``meets`` does, and remember it: finer steps lead through poses of coarser ones."""
        height, aside, tilt = pose
        key = (height, round(aside, 6), tilt)
        if key not in self._met:
            self._met[key] = self.meets(pose)
        return self._met[key]

    def is_free(self, start: Pose, end: Pose, spacing_m: float) -> bool:
        """Return whether nothing meets between two poses, tested where no point of the part moved by more."""
        return self._none_meets(self._poses(start, end, spacing_m))

    def is_free_along(self, poses: Sequence[Pose]) -> bool:
        """Return whether a whole way is free, tested at fine poses."""
        return self._none_meets(np.concatenate([self._poses(a, b, _FINE_M) for a, b in pairwise(poses)]))

    def reaches(self, poses: Sequence[Pose]) -> bool:
        """Return whether a crew can hold the part as far aside as poses demand."""
        return max(abs(aside) for _, aside, _ in poses) <= self.aside_m

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

    def _along(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        seen: NDArray[np.float64] = (points_m - self._centre) @ self._seen.T
        return seen

    def _within_reach(self, other_m: NDArray[np.float64], own_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the triangles that are not apart from all that the part, in a box at its place, may sweep."""
        down_m = self.reach_m * np.sin(MOST_TILT_RAD)
        around_m = np.array([self.aside_m + down_m, 0.0, down_m]) + _ROUNDING_M
        low, high = own_m[0] - around_m, own_m[1] + around_m + np.array([0.0, 0.0, self.top_m])
        near = ((other_m.min(axis=1) <= high) & (other_m.max(axis=1) >= low)).all(axis=1)
        found: NDArray[np.float64] = other_m[near]
        return found

    def _poses(self, start: Pose, end: Pose, spacing_m: float) -> NDArray[np.float64]:
        by = np.abs(np.subtract(end, start))
        count = int(np.ceil((by[0] + by[1] + by[2] * self.reach_m) / spacing_m)) + 1
        poses: NDArray[np.float64] = np.array(start) + np.arange(count + 1)[:, None] / count * np.subtract(end, start)
        return poses

    def _none_meets(self, poses: NDArray[np.float64]) -> bool:
        """Return whether nothing meets in any of (N, 3) poses; those far from each other are tested first."""
        number, close = np.arange(len(poses)), self._close(poses)
        spread = np.argsort(-(number & -number), kind="stable")
        spread = spread[close[spread].any(axis=1)]
        return not any(self.meets(tuple(poses[n].tolist()), close[n]) for n in spread)

    def _close(self, poses: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return (N, G) for which poses and groups the boxes around any pair are not apart."""
        if not self.groups:
            return np.zeros((len(poses), 0), np.bool_)
        up, aside, tilt = poses.T[:, :, None]
        cos, sin = np.cos(tilt), np.sin(tilt)
        middle, half = self._own.mean(axis=1), np.ptp(self._own, axis=1) / 2.0
        away = self._asides - self._others.mean(axis=1)
        room = np.ptp(self._others, axis=1) / 2.0 + _ROUNDING_M
        x = np.abs(cos * middle[:, 0] - sin * middle[:, 2] + aside + away[:, 0])
        z = np.abs(sin * middle[:, 0] + cos * middle[:, 2] + up + away[:, 2])
        close = x <= cos * half[:, 0] + np.abs(sin) * half[:, 2] + room[:, 0]
        close &= z <= np.abs(sin) * half[:, 0] + cos * half[:, 2] + room[:, 2]
        return np.logical_or.reduceat(close, self._begins, axis=1)


class _Way:
    """The lattice of poses: (height, aside, tilt) in steps.

    Attributes:
        reached_m: The height that a search reached which found no way; infinite if it was cut off.
    """

    def __init__(self, around: _Around, step_m: float) -> None:
        self._around, self._step_m = around, step_m
        self._steps_up = max(1, int(np.ceil(around.top_m / _STEP_M - 1e-9)))
        self._up_m = around.top_m / self._steps_up
        self._steps_aside = int(around.aside_m / step_m + 1e-9)
        self._tilt_rad = min(self._up_m / max(around.longest_m, 0.1), _MOST_TILT_STEP_RAD)
        self._steps_tilt = int(MOST_TILT_RAD / self._tilt_rad)
        self.reached_m = 0.0
        self._tilted: dict[int, list[NDArray[np.float64]]] = {}
        self._swept: dict[tuple[int, int, int, int], NDArray[np.bool_]] = {}

    def pose(self, state: State) -> Pose:
        """Return the pose of a state."""
        return state[0] * self._up_m, state[1] * self._step_m, state[2] * self._tilt_rad

    def out(self) -> list[State] | None:
        """Return the states from the place to level above it, or None."""
        start, goal = (0, 0, 0), (self._steps_up, 0, 0)
        if self._around.meets((0.0, 0.0, 0.0)):
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
        self.reached_m = np.inf if heap else (max(up for up, _, _ in closed) + 1) * self._up_m
        return None

    def _left(self, state: State) -> float:
        up, aside, tilt = self._steps_up - state[0], abs(state[1]), abs(state[2])
        return up + tilt + aside

    def _is_inside(self, state: State) -> bool:
        up, aside, tilt = state
        if up >= self._steps_up:
            return state == (self._steps_up, 0, 0)
        return up >= 0 and abs(aside) <= self._steps_aside and abs(tilt) <= self._steps_tilt

    def _step_is_free(self, here: State, there: State) -> bool:
        (_, aside, tilt), (_, aside_there, tilt_there) = here, there
        if tilt == tilt_there:
            return not self._is_blocked(min(here, there), 2 if aside == aside_there else 0)
        # An end of the part moves by one step: the test of the whole way is finer.
        halfway = _between(self.pose(here), self.pose(there), 0.5)
        return not self._around.met_at(self.pose(there)) and not self._around.met_at(halfway)

    def _is_blocked(self, state: State, axis: int) -> bool:
        """Return whether the step up (axis 2) or aside (0) from a state is blocked; a few steps are swept at once."""
        up, aside, tilt = state
        along = aside if axis == 0 else up
        first = along - along % _SWEPT_TOGETHER
        key = (tilt, axis, up if axis == 0 else aside, first)
        if key not in self._swept:
            height, beside, _ = self.pose((up, first, tilt) if axis == 0 else (first, aside, tilt))
            step_m = self._step_m if axis == 0 else self._up_m
            self._swept[key] = self._blocked(tilt, np.array([beside, 0.0, height]), axis, step_m)
        return bool(self._swept[key][along - first])

    def _blocked(self, tilt: int, start_m: NDArray[np.float64], axis: int, step_m: float) -> NDArray[np.bool_]:
        blocked = np.zeros(_SWEPT_TOGETHER, np.bool_)
        groups = self._around.groups
        if tilt not in self._tilted:
            turn = _turn(tilt * self._tilt_rad)
            parts = {id(pair.part_m): pair.part_m for pair in groups}
            leaning = {key: part_m @ turn.T for key, part_m in parts.items()}
            self._tilted[tilt] = [leaning[id(pair.part_m)] for pair in groups]
        for part_m, pair in zip(self._tilted[tilt], groups, strict=True):
            at_m = start_m + pair.aside_m
            blocked |= blocked_steps(part_m, pair.other_m, axis, 1, step_m, _SWEPT_TOGETHER, at_m)
        return blocked


_MOVES = ((1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 1), (1, 0, -1))


def _box(triangles_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, 3) the lowest and the highest corner of a box around (N, 3, 3) triangles."""
    return np.stack([triangles_m.min(axis=(0, 1)), triangles_m.max(axis=(0, 1))])


def _turn(tilt_rad: float) -> NDArray[np.float64]:
    """Return the rotation that raises the end ahead, along x."""
    cos, sin = np.cos(tilt_rad), np.sin(tilt_rad)
    return np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])


def _between(start: Pose, end: Pose, share: float) -> Pose:
    height, aside, tilt = (a + share * (b - a) for a, b in zip(start, end, strict=True))
    return height, aside, tilt
