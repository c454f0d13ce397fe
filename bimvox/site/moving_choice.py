"""The set-ups of a crane that moves: the fewest places, in their order, from which it sets the most parts.

A part that stands where the crane stands comes later than that set-up, and no part comes before what it rests on. So
the crane backs out of the building: from the places within it, first what nothing else reaches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_LEVEL_M = 0.05
"""Parts whose feet differ by no more stand on the same level."""
_OVERLAP_M = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Stands:
    """Where a crane may stand, and what it does from there.

    Attributes:
        served: (B, N) whether it picks each part in the yard and sets it, from each place.
        taken: (B, N) whether the part stands where the crane stands.
        radius_m: (B, N) its radius over the place of each part.
        free: (N,) whether a part needs no crane: it is cast, built or set by hand.
    """

    served: NDArray[np.bool_]
    taken: NDArray[np.bool_]
    radius_m: NDArray[np.float64]
    free: NDArray[np.bool_]


def carriers(bounds_m: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """Return which parts come before each part, by their boxes: those below it, which may carry it or be shut in by it.

    Loads come from above. So of two parts that overlap on plan, the one whose foot is lower comes first.

    Args:
        bounds_m: (N, 2, 3) boxes of the parts.
    """
    low_m, high_m = bounds_m[:, 0], bounds_m[:, 1]
    over = low_m[:, None, 2] > low_m[:, 2] + _LEVEL_M
    for axis in (0, 1):
        over &= low_m[:, None, axis] < high_m[:, axis] - _OVERLAP_M
        over &= high_m[:, None, axis] > low_m[:, axis] + _OVERLAP_M
    return [np.flatnonzero(row) for row in over]


def chosen_places(stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], most: int) -> list[int]:
    """Return the places of the set-ups, in their order; empty if no part is served from any.

    A place may come again, when more of the building stands. Places are put in one by one, each where it adds most,
    then exchanged while that sets more or the same from nearer, and left out where the others do without.
    Deterministic.

    Args:
        stands: The places.
        under: Per part the parts that may carry it.
        order: The parts, each behind those that may carry it.
        most: The most set-ups.
    """
    found, rank = _grown(stands, under, order, [], most)
    better, at_most = True, int(stands.served[:, ~stands.free].any(axis=0).sum())
    while better and -rank[0] < at_most:
        # Where none more helps, another one in place of one of them may, and then one more.
        better = False
        for at in range(len(found)):
            other, now = _grown(stands, under, order, found[:at] + found[at + 1 :], most)
            if now[0] < rank[0]:
                found, rank, better = other, now, True
                break
    for at in reversed(range(len(found))):
        rest = found[:at] + found[at + 1 :]
        if rest and _rank(stands, under, order, rest)[0] <= rank[0]:
            found = rest
            rank = _rank(stands, under, order, found)
    return found


def _grown(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], found: list[int], most: int
) -> tuple[list[int], tuple[int, float]]:
    """Return set-ups with as many more as serve more parts, and their rank."""
    rank = _rank(stands, under, order, found) if found else (0, 0.0)
    while len(found) < most:
        tried = [(_best_at(stands, under, order, found, at), at) for at in range(len(found) + 1)]
        ((served, reach_m), place), at = min(tried, key=lambda one: (one[0][0], one[1]))
        if served >= rank[0]:
            break
        found = [*found[:at], place, *found[at:]]
        found, rank = _exchanged(stands, under, order, found, (served, reach_m))
    return found, rank


def set_up_of_parts(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], places: Sequence[int]
) -> NDArray[np.int64]:
    """Return (N,) the first set-up that may set each part, or in which it is built; -1 if none does."""
    return _assigned(stands, under, order, np.array(places, np.int64)[:, None])[:, 0]


def _exchanged(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], found: list[int], rank: tuple[int, float]
) -> tuple[list[int], tuple[int, float]]:
    """Return set-ups of which each is on the best place while the others stay, and their rank."""
    better = True
    while better:
        better = False
        for at in range(len(found)):
            now, place = _best_at(stands, under, order, found[:at] + found[at + 1 :], at)
            if now < rank:
                found, rank, better = [*found[:at], place, *found[at + 1 :]], now, True
    return found, rank


def _best_at(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], found: Sequence[int], at: int
) -> tuple[tuple[int, float], int]:
    """Return the best rank with one more place at a position of the set-ups, and that place."""
    count = len(stands.served)
    places = np.empty((len(found) + 1, count), np.int64)
    places[:at], places[at], places[at + 1 :] = (
        np.array(found[:at], np.int64)[:, None], np.arange(count), np.array(found[at:], np.int64)[:, None],
    )  # fmt: skip
    served, reach_m = _ranks(stands, under, order, places)
    best = int(np.lexsort((np.arange(count), reach_m, served))[0])
    return (int(served[best]), float(reach_m[best])), best


def _rank(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], places: Sequence[int]
) -> tuple[int, float]:
    served, reach_m = _ranks(stands, under, order, np.array(places, np.int64)[:, None])
    return int(served[0]), float(reach_m[0])


def _ranks(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], places: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return (C,) how many parts each of (S, C) set-ups serve, negative, and the sum of their radii, to the mm."""
    lifted = np.flatnonzero(~stands.free)
    which = _assigned(stands, under, order, places)[lifted]
    radius_m = stands.radius_m[places[np.maximum(which, 0), np.arange(which.shape[1])], lifted[:, None]]
    reach = np.where(which >= 0, radius_m, 0.0).sum(axis=0)
    return -(which >= 0).sum(axis=0), np.round(reach, 3)


def _assigned(
    stands: Stands, under: Sequence[NDArray[np.int64]], order: Sequence[int], places: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return (N, C) the first of (S, C) set-ups that may set each part; -1 if none does.

    The first one is never worse: whatever rests on the part may come in each later one, too. What needs no crane is
    built then, or after all set-ups: S.
    """
    steps, count = places.shape
    which = np.full((stands.served.shape[1], count), -1, np.int64)
    number = np.arange(steps)[:, None]
    for part in order:
        after = np.where(stands.taken[places, part], number + 1, 0).max(axis=0, initial=0)
        if len(under[part]):
            after = np.maximum(after, which[under[part]].max(axis=0))
        if stands.free[part]:
            which[part] = after
            continue
        able = stands.served[places, part] & (number >= after)
        which[part] = np.where(able.any(axis=0), able.argmax(axis=0), -1)
    return which
