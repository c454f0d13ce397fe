"""Moves with their profiles, packed so that one kernel returns the axes at given times."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, groupby
from operator import and_
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.move import Line, Move, axes_along, axes_of
from bimvox.motion.profile import Profile, add_shares
from bimvox.motion.shaping import ShapedProfile
from bimvox.motion.swept import samples_are_free
from bimvox.site.collision import CollisionSpace

_ENDS = np.array([0.0, 1.0])
_BLOCK = 64
"""Samples that are computed before they are checked."""


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


class _Packed(NamedTuple):
    """Moves and their profiles as the kernel takes them.

    Attributes:
        ends: (N, 2, 3) float64 slew, radius and height where each move starts and ends.
        start_s: (P,) float64 start of each piece of all profiles.
        state: (P, 4) float64 position, velocity, acceleration and jerk at the start of each piece.
        piece_of: (N + 1,) int64 first piece of each move.
        parts: (Q,) float64 sizes of the parts of all moves.
        part_of: (N + 1,) int64 first part of each move.
        times_s: (N, 3) float64 duration of a part, time from one part to the next, and duration of the move.
    """

    ends: NDArray[np.float64]
    start_s: NDArray[np.float64]
    state: NDArray[np.float64]
    piece_of: NDArray[np.int64]
    parts: NDArray[np.float64]
    part_of: NDArray[np.int64]
    times_s: NDArray[np.float64]


class Course:
    """Moves with their profiles, whenever each begins. Neither moves nor profiles change.

    Attributes:
        profiles: One per move.
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
        pieces = [profile.pieces for profile in profiles]
        self._packed = _Packed(
            moves.ends,
            np.concatenate([piece.start_s for piece in pieces]),
            np.concatenate([piece.state for piece in pieces]),
            np.array([*accumulate((len(piece.start_s) for piece in pieces), initial=0)]),
            np.array([part for piece in pieces for part in piece.parts]),
            np.array([*accumulate((len(piece.parts) for piece in pieces), initial=0)]),
            np.array(
                [(piece.duration_s, piece.apart_s, whole) for piece, whole in zip(pieces, self.duration_s, strict=True)]
            ),
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
                _add_lines(axes, time_s, begins_s, self._packed, begin, end)
                continue
            for n in range(begin, end):
                self._add_curve(axes, time_s - start_s[n], n)
        return axes

    def free_axes_at(
        self,
        time_s: NDArray[np.float64],
        start_s: Sequence[float],
        moves: tuple[int, int],
        space: CollisionSpace,
        load: LoadFrame,
    ) -> NDArray[np.float64] | None:
        """Return the same for consecutive moves along joint lines if the load is free between all times, else None.

        Args:
            time_s: (N,) the times, close together.
            start_s: When each move begins.
            moves: The first move that counts, and one after the last.
            space: The collision rule.
            load: How hook poses and reference cells correspond.
        """
        axes = np.empty((len(time_s), 3))
        free = _lines_are_free(axes, time_s, np.array(start_s), self._packed, *moves, space, load)
        return axes if free else None

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
    packed: _Packed,
    begin: int,
    end: int,
) -> None:
    """Add to axes ((N, 3), in place) the movement along joint lines, from move ``begin`` to the one before ``end``."""
    room = np.empty((2, time_s.shape[0]))
    for n in range(begin, end):
        _add_line(axes, time_s, begins_s[n], packed, n, room)


@leaf_kernel
def _add_line(
    axes: NDArray[np.float64],
    time_s: NDArray[np.float64],
    begin_s: float,
    packed: _Packed,
    n: int,
    room: NDArray[np.float64],
) -> None:
    """Add to axes the movement of one move along a joint line; ``room`` is (2, N or more) float64 to work in."""
    count = time_s.shape[0]
    base_s, apart_s, whole_s = packed.times_s[n, 0], packed.times_s[n, 1], packed.times_s[n, 2]
    low = _first_from(time_s, begin_s, 0.0)
    high = _first_from(time_s, begin_s, whole_s)
    since_s, shares = room[0, : high - low], room[1, : high - low]
    for i in range(low, high):
        since_s[i - low], shares[i - low] = time_s[i] - begin_s, 0.0
    starts_s = packed.start_s[packed.piece_of[n] : packed.piece_of[n + 1]]
    states = packed.state[packed.piece_of[n] : packed.piece_of[n + 1]]
    for part in range(packed.part_of[n], packed.part_of[n + 1]):
        later_s = (part - packed.part_of[n]) * apart_s
        add_shares(shares, since_s, later_s, starts_s, states, base_s, packed.parts[part])
    for k in range(3):
        first, last = packed.ends[n, 0, k], packed.ends[n, 1, k]
        for i in range(low, high):
            axes[i, k] += first + shares[i - low] * (last - first) - first
        for i in range(high, count):
            axes[i, k] += first + (last - first) - first


@kernel
def _lines_are_free(
    axes: NDArray[np.float64],
    time_s: NDArray[np.float64],
    begins_s: NDArray[np.float64],
    packed: _Packed,
    begin: int,
    end: int,
    space: CollisionSpace,
    load: LoadFrame,
) -> bool:
    """Fill axes as ``axes_at``, as far as the load is free between the times; return whether it always is.

    What is most likely in the way is met first: from the start of the last move on.
    """
    count = axes.shape[0]
    blocks = (count + _BLOCK - 1) // _BLOCK
    from_block = min(_first_from(time_s, begins_s[end - 1], 0.0), count - 1) // _BLOCK
    room = np.empty((2, _BLOCK + 1))
    for n in range(blocks):
        first = (from_block + n) % blocks * _BLOCK
        last = min(first + _BLOCK + 1, count)  # the first of the next block too: the load is free up to there
        for i in range(first, last):
            for k in range(3):
                axes[i, k] = packed.ends[begin, 0, k]
        for move in range(begin, end):
            _add_line(axes[first:last], time_s[first:last], begins_s[move], packed, move, room)
        if not samples_are_free(space, load, axes[first:last]):
            return False
    return True


@leaf_kernel
def _first_from(time_s: NDArray[np.float64], begins_s: float, since_s: float) -> int:
    """Return the index of the first of ascending times at or after ``since_s`` from the start of a move."""
    low, high = 0, time_s.shape[0]
    while low < high:
        middle = (low + high) // 2
        if time_s[middle] - begins_s < since_s:
            low = middle + 1
        else:
            high = middle
    return low
