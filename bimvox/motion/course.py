"""Moves with their profiles, packed so that one kernel returns the axes at given times."""

from __future__ import annotations

from collections.abc import Sequence
from operator import and_
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.move import LINES, Line, Move, axes_of, write_along
from bimvox.motion.profile import PARTS, TIMES, Profile, add_shares
from bimvox.motion.shaping import ShapedProfile


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
        lines: (N,) int64 the line of each, its place in ``LINES``.
    """

    def __init__(self, crane: TowerCrane, moves: Sequence[Move]) -> None:
        self.crane, self.moves = crane, tuple(moves)
        self.ends = np.array([[axes_of(move.start), axes_of(move.end)] for move in moves])
        self.lines = np.array([LINES.index(move.line) for move in moves])
        self.travel_m = tuple(_travel_m(move) for move in moves)
        self.swings = tuple(move.swings for move in moves)
        moving, joint = [move.moving for move in moves], [move.line is Line.JOINT for move in moves]
        self.overlaps = tuple(
            n > 0 and joint[n - 1] and joint[n] and not any(map(and_, moving[n - 1], moving[n]))
            for n in range(len(moves))
        )


class Packed(NamedTuple):
    """Moves and their profiles as the kernels take them.

    Attributes:
        ends: (N, 2, 3) float64 slew, radius and height where each move starts and ends.
        lines: (N,) int64 the line of each, its place in ``LINES``.
        rows: (N, 9, 5) float64 their profiles, see ``ROW``.
        x_m: The slewing axis.
        y_m: The slewing axis.
    """

    ends: NDArray[np.float64]
    lines: NDArray[np.int64]
    rows: NDArray[np.float64]
    x_m: float
    y_m: float


class Room(NamedTuple):
    """Room in which a kernel works.

    Attributes:
        shares: (2, N) float64.
        axes: (N, 3) float64.
    """

    shares: NDArray[np.float64]
    axes: NDArray[np.float64]


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
        self.packed = Packed(
            moves.ends, moves.lines, np.array([profile.row for profile in profiles]), *moves.crane.base_m[:2]
        )

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

    def axes_at(self, time_s: NDArray[np.float64], start_s: Sequence[float]) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times ((N,)) that ascend, with each move's start."""
        axes: NDArray[np.float64] = _axes_at(time_s, np.array(start_s), self.packed)
        return axes


def _travel_m(move: Move) -> float:
    slew, radius, height = move.difference
    reach = max(move.start.radius_m, move.end.radius_m)
    # 2: an arc is at most pi / 2 times its chord, and no line is longer.
    longer = 1.0 if move.line is Line.JOINT else 2.0
    return float(np.hypot(longer * np.hypot(reach * slew, radius), longer * height))


@kernel
def _axes_at(time_s: NDArray[np.float64], begins_s: NDArray[np.float64], packed: Packed) -> NDArray[np.float64]:
    count = time_s.shape[0]
    axes, room = np.empty((count, 3)), Room(np.empty((2, count)), np.empty((count, 3)))
    for i in range(count):
        for k in range(3):
            axes[i, k] = packed.ends[0, 0, k]
    for n in range(packed.ends.shape[0]):
        add_move(axes, time_s, begins_s[n], packed, n, room)
    return axes


@leaf_kernel
def add_move(
    axes: NDArray[np.float64], time_s: NDArray[np.float64], begin_s: float, packed: Packed, n: int, room: Room
) -> None:
    """Add the movement of one move to axes ((N, 3)) at times ((N,)) that ascend; there is ``room`` for N or more."""
    count = time_s.shape[0]
    times_s = packed.rows[n, TIMES]
    base_s, apart_s, whole_s = times_s[0], times_s[1], times_s[2]
    # Before the move begins it adds nothing; after its end it adds its whole movement.
    low = first_from(time_s, begin_s, 0.0)
    high = first_from(time_s, begin_s, whole_s)
    since_s, shares, along = room.shares[0, : high - low], room.shares[1, : high - low], room.axes[: high - low]
    for i in range(low, high):
        since_s[i - low], shares[i - low] = time_s[i] - begin_s, 0.0
    pieces = packed.rows[n, : int(times_s[3])]
    for part in range(int(times_s[4])):
        add_shares(shares, since_s, part * apart_s, pieces, base_s, packed.rows[n, PARTS, part])
    write_along(along, shares, packed.ends[n], packed.lines[n], packed.x_m, packed.y_m)
    for k in range(3):
        first, last = packed.ends[n, 0, k], packed.ends[n, 1, k]
        for i in range(low, high):
            axes[i, k] += along[i - low, k] - first
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
