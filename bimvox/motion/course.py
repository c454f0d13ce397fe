"""Moves with their profiles, packed so that one kernel returns the axes at given times."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from operator import and_
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.move import Line, Move, axes_along, axes_of
from bimvox.motion.profile import PARTS, TIMES, Profile, add_shares
from bimvox.motion.shaping import ShapedProfile

_ENDS = np.array([0.0, 1.0])


class Moves:
    """Moves that follow each other, with everything about them that does not depend on their profiles.

    Args:
        crane: The crane.
        moves: In order; each starts where the one before ends.

    Attributes:
        crane: The crane.
        moves: The moves.
        ends: (N, 2, 3) float64 slew, radius and height where each starts and ends.
        travel_m: Upper bound of the hook's travel in each.
        swings: Whether each makes the load swing.
        overlaps: Whether each may begin before the one before it ends: joint lines that drive different axes.
        runs: Runs of moves along joint lines, or along other lines: first move, one after the last, and which.
    """

    def __init__(self, crane: TowerCrane, moves: Sequence[Move]) -> None:
        self.crane, self.moves = crane, tuple(moves)
        self.ends = np.array([[axes_of(move.start), axes_of(move.end)] for move in moves])
        self.travel_m = tuple(_travel_m(move) for move in moves)
        self.swings = tuple(move.swings for move in moves)
        moving, joint = [move.moving for move in moves], [move.line is Line.JOINT for move in moves]
        self.overlaps = tuple(
            n > 0 and joint[n - 1] and joint[n] and not any(map(and_, moving[n - 1], moving[n]))
            for n in range(len(moves))
        )
        self._sides: dict[int, NDArray[np.float64]] = {}
        self.runs: list[tuple[int, int, bool]] = []
        for is_joint, run in groupby(enumerate(moves), key=lambda one: one[1].line is Line.JOINT):
            numbers = [n for n, _ in run]
            self.runs.append((numbers[0], numbers[-1] + 1, is_joint))

    def sides(self, n: int) -> NDArray[np.float64]:
        """Return (2, 3) float64 what a move along a line that is not a joint line adds before its start, and after."""
        if n not in self._sides:
            self._sides[n] = axes_along(self.crane, self.moves[n], _ENDS) - self.ends[n, 0]
        return self._sides[n]


class Packed(NamedTuple):
    """Moves and their profiles as the kernels take them.

    Attributes:
        ends: (N, 2, 3) float64 slew, radius and height where each move starts and ends.
        rows: (N, 9, 5) float64 their profiles, see ``ROW``.
    """

    ends: NDArray[np.float64]
    rows: NDArray[np.float64]


class Course:
    """Moves with their profiles, whenever each begins. Neither moves nor profiles change.

    Attributes:
        profiles: One per move.
        packed: For kernels.
        duration_s: How long each move takes.
        top_speed_m_s: Upper bound of the hook's speed in each move.
    """

    def __init__(self, moves: Moves, profiles: Sequence[Profile | ShapedProfile]) -> None:
        self._moves = moves
        self.profiles = tuple(profiles)
        self.duration_s = tuple(profile.duration_s for profile in profiles)
        self.top_speed_m_s = tuple(
            travel_m * profile.top_rate for travel_m, profile in zip(moves.travel_m, profiles, strict=True)
        )
        self.packed = Packed(moves.ends, np.array([profile.row for profile in profiles]))

    @property
    def crane(self) -> TowerCrane:
        """The crane."""
        return self._moves.crane

    @property
    def moves(self) -> tuple[Move, ...]:
        """In order; each starts where the one before ends."""
        return self._moves.moves

    @property
    def swings(self) -> tuple[bool, ...]:
        """Whether each move makes the load swing."""
        return self._moves.swings

    @property
    def overlaps(self) -> tuple[bool, ...]:
        """Whether each move may begin before the one before it ends."""
        return self._moves.overlaps

    def axes_at(
        self, time_s: NDArray[np.float64], start_s: Sequence[float], first: int = 0, last: int | None = None
    ) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times that ascend.

        Args:
            time_s: (N,) the times.
            start_s: When each move begins.
            first: The first move that counts; before it nothing moves.
            last: One after the last that counts.
        """
        ends, begins_s = self._moves.ends, np.array(start_s)
        until = len(ends) if last is None else last
        axes = np.empty((len(time_s), 3))
        axes[:] = ends[first, 0]
        for run_begin, run_end, is_joint in self._moves.runs:
            begin, end = max(run_begin, first), min(run_end, until)
            if begin < end and is_joint:
                _add_lines(axes, time_s, begins_s, self.packed, begin, end)
                continue
            for n in range(begin, end):
                self._add_curve(axes, time_s - start_s[n], n)
        return axes

    def _add_curve(self, axes: NDArray[np.float64], since_s: NDArray[np.float64], n: int) -> None:
        """Add the movement of a move along a line that is not a joint line."""
        crane, move, origin = self._moves.crane, self._moves.moves[n], self._moves.ends[n, 0]
        # Before the move begins it adds nothing; after its end it adds its whole movement.
        low, high = np.searchsorted(since_s, (0.0, self.duration_s[n])).tolist()
        if low < high:
            axes[low:high] += axes_along(crane, move, self.profiles[n].share_at(since_s[low:high])) - origin
        before, after = self._moves.sides(n)
        axes[:low] += before
        axes[high:] += after


def _travel_m(move: Move) -> float:
    slew, radius, height = move.difference
    reach = max(move.start.radius_m, move.end.radius_m)
    # 2: an arc is at most pi / 2 times its chord, and no line is longer.
    longer = 1.0 if move.line is Line.JOINT else 2.0
    return float(np.hypot(longer * np.hypot(reach * slew, radius), longer * height))


@kernel
def _add_lines(
    axes: NDArray[np.float64],
    time_s: NDArray[np.float64],
    begins_s: NDArray[np.float64],
    packed: Packed,
    begin: int,
    end: int,
) -> None:
    """Add to axes ((N, 3), in place) the movement along joint lines, from move ``begin`` to the one before ``end``."""
    room = np.empty((2, time_s.shape[0]))
    for n in range(begin, end):
        add_line(axes, time_s, begins_s[n], packed, n, room)


@leaf_kernel
def add_line(
    axes: NDArray[np.float64],
    time_s: NDArray[np.float64],
    begin_s: float,
    packed: Packed,
    n: int,
    room: NDArray[np.float64],
) -> None:
    """Add to axes the movement of one move along a joint line; ``room`` is (2, N or more) float64 to work in."""
    count = time_s.shape[0]
    times_s = packed.rows[n, TIMES]
    base_s, apart_s, whole_s = times_s[0], times_s[1], times_s[2]
    low = first_from(time_s, begin_s, 0.0)
    high = first_from(time_s, begin_s, whole_s)
    since_s, shares = room[0, : high - low], room[1, : high - low]
    for i in range(low, high):
        since_s[i - low], shares[i - low] = time_s[i] - begin_s, 0.0
    pieces = packed.rows[n, : int(times_s[3])]
    for part in range(int(times_s[4])):
        add_shares(shares, since_s, part * apart_s, pieces, base_s, packed.rows[n, PARTS, part])
    for k in range(3):
        first, last = packed.ends[n, 0, k], packed.ends[n, 1, k]
        for i in range(low, high):
            axes[i, k] += first + shares[i - low] * (last - first) - first
        for i in range(high, count):
            axes[i, k] += first + (last - first) - first


@leaf_kernel
def first_from(time_s: NDArray[np.float64], begins_s: float, since_s: float) -> int:
    """Return the index of the first of ascending times at or after ``since_s`` from the start of a move."""
    low, high = 0, time_s.shape[0]
    while low < high:
        middle = (low + high) // 2
        if time_s[middle] - begins_s < since_s:
            low = middle + 1
        else:
            high = middle
    return low
