"""Moves with their profiles, packed so that one kernel says where the axes are."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, groupby

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.move import Line, Move, axes_along, axes_of
from bimvox.motion.profile import Profile, add_along_line
from bimvox.motion.shaping import ShapedProfile

_ENDS = np.array([0.0, 1.0])


class Moves:
    """Moves that follow each other, with all about them that does not depend on their profiles.

    Args:
        crane: The crane.
        moves: In order; each starts where the one before ends.

    Attributes:
        crane: The crane.
        moves: The moves.
        ends: (N, 2, 3) float64 slew, radius and height where each starts and ends.
        way_m: No less than how far the hook goes in each.
        runs: First move and one after the last of those that follow each other along joint lines, or others; and which.
    """

    def __init__(self, crane: TowerCrane, moves: Sequence[Move]) -> None:
        self.crane, self.moves = crane, tuple(moves)
        self.ends = np.array([[axes_of(move.start), axes_of(move.end)] for move in moves])
        self.way_m = tuple(_way_m(move) for move in moves)
        self.runs: list[tuple[int, int, bool]] = []
        for is_joint, run in groupby(enumerate(moves), key=lambda one: one[1].line is Line.JOINT):
            numbers = [n for n, _ in run]
            self.runs.append((numbers[0], numbers[-1] + 1, is_joint))


class Course:
    """What moves drive, whenever each begins. Neither moves nor profiles change.

    Args:
        moves: The moves.
        profiles: One per move.

    Attributes:
        profiles: One per move.
        duration_s: How long each move takes.
        top_speed_m_s: No less than the highest speed of the hook in each move.
    """

    def __init__(self, moves: Moves, profiles: Sequence[Profile | ShapedProfile]) -> None:
        self._moves = moves
        self.profiles = tuple(profiles)
        self.duration_s = tuple(profile.duration_s for profile in profiles)
        self.top_speed_m_s = tuple(
            way_m * profile.top_rate for way_m, profile in zip(moves.way_m, profiles, strict=True)
        )
        pieces = [profile.pieces for profile in profiles]
        self._start_s = np.concatenate([piece.start_s for piece in pieces])
        self._state = np.concatenate([piece.state for piece in pieces])
        self._piece_of = np.array([*accumulate((len(piece.start_s) for piece in pieces), initial=0)])
        self._parts = np.array([part for piece in pieces for part in piece.parts])
        self._part_of = np.array([*accumulate((len(piece.parts) for piece in pieces), initial=0)])
        self._times_s = np.array(
            [(piece.duration_s, piece.apart_s, whole) for piece, whole in zip(pieces, self.duration_s, strict=True)]
        )

    @property
    def crane(self) -> TowerCrane:
        """The crane."""
        return self._moves.crane

    @property
    def moves(self) -> tuple[Move, ...]:
        """In order; each starts where the one before ends."""
        return self._moves.moves

    def axes_at(
        self, time_s: NDArray[np.float64], start_s: Sequence[float], first: int = 0, last: int | None = None
    ) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times that ascend.

        Args:
            time_s: (N,) the times.
            start_s: When each move begins.
            first: The first move that is looked at: before it nothing moves.
            last: One after the last.
        """
        ends = self._moves.ends
        until = len(ends) if last is None else last
        axes = np.empty((len(time_s), 3))
        axes[:] = ends[first, 0]
        for run_begin, run_end, is_joint in self._moves.runs:
            begin, end = max(run_begin, first), min(run_end, until)
            if begin >= end:
                continue
            if is_joint:
                _add_lines(
                    axes,
                    time_s,
                    np.array(start_s[begin:end]),
                    ends[begin:end],
                    self._start_s,
                    self._state,
                    self._piece_of[begin : end + 1],
                    self._parts,
                    self._part_of[begin : end + 1],
                    self._times_s[begin:end],
                )
                continue
            for n in range(begin, end):
                self._add_curve(axes, time_s - start_s[n], n)
        return axes

    def _add_curve(self, axes: NDArray[np.float64], since_s: NDArray[np.float64], n: int) -> None:
        """Add what a move along another line than a joint one drives."""
        crane, move, origin = self._moves.crane, self._moves.moves[n], self._moves.ends[n, 0]
        # Before it begins it adds nothing, and all of it from when it has ended on.
        low, high = np.searchsorted(since_s, (0.0, self.duration_s[n])).tolist()
        if low < high:
            axes[low:high] += axes_along(crane, move, self.profiles[n].share_at(since_s[low:high])) - origin
        before, after = axes_along(crane, move, _ENDS) - origin
        axes[:low] += before
        axes[high:] += after


def _way_m(move: Move) -> float:
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
    ends: NDArray[np.float64],
    start_s: NDArray[np.float64],
    state: NDArray[np.float64],
    piece_of: NDArray[np.int64],
    parts: NDArray[np.float64],
    part_of: NDArray[np.int64],
    times_s: NDArray[np.float64],
) -> None:
    """Add to axes ((N, 3), in place) the way along joint lines, one after the other."""
    for n in range(begins_s.shape[0]):
        first, last = ends[n, 0], ends[n, 1]
        base_s, apart_s, whole_s = times_s[n, 0], times_s[n, 1], times_s[n, 2]
        count = time_s.shape[0]
        low = 0
        while low < count and time_s[low] - begins_s[n] < 0.0:
            low += 1
        high = low
        while high < count and time_s[high] - begins_s[n] < whole_s:
            high += 1
        add_along_line(
            axes[low:high],
            time_s[low:high] - begins_s[n],
            start_s[piece_of[n] : piece_of[n + 1]],
            state[piece_of[n] : piece_of[n + 1]],
            base_s,
            parts[part_of[n] : part_of[n + 1]],
            apart_s,
            whole_s,
            first,
            last,
        )
        for i in range(high, count):
            for k in range(3):
                axes[i, k] += first[k] + (last[k] - first[k]) - first[k]
