"""How early a move may begin before the one before it ends: as early as the load stays free on the rounded corner."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.motion.course import Packed, Room, add_move, first_from
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.profile import TIMES
from bimvox.motion.swept import samples_are_free
from bimvox.motion.swing import STEP_S, Hanging, sways_free
from bimvox.site.collision import CollisionSpace

_CHECK_SPACING_VOX = 0.125
_HALVINGS = 6
_BLOCK = 64
"""Samples that are computed before they are checked."""


class Corner(NamedTuple):
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
    corner: Corner,
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
    corner: Corner,
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
