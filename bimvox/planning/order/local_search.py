"""A local search on the erection sequence: less time, by the estimate of ``makespan``.

Simulated annealing: a part, or a few that follow each other, go to another position, two parts change positions, or a
part goes to another crane that may lift it. No move breaks a pair that must stay as it is (``Sequencer.fixed_pairs``).
What is counted are parts looked at, not seconds, so that every machine finds the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.planning.order.makespan import COLUMNS, Course, OrderTimes, course_of, walk

_LONGEST = 4
"""Most parts that are moved together."""
_FARTHEST = 60
"""A part moves no further in the order."""
_SWAPS = 0.3
_OTHER_CRANES = 0.3
_LESS_S = 1e-6


def searched(
    times: OrderTimes,
    order: Sequence[int],
    fixed: NDArray[np.bool_],
    budget: int,
    seed: int,
    warm_s: float,
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the best order found, and the crane of each part; the given ones if none takes less time.

    Args:
        times: The times.
        order: The order to start from.
        fixed: (N, N) whether a part must stay before another one, by component.
        budget: How many parts are looked at.
        seed: Seed of the random numbers.
        warm_s: How much longer an order may become at first to be accepted as often as not; 0: no longer at all.
    """
    count = len(order)
    if count < 2:
        return tuple(order), tuple(times.crane.tolist())
    courses = course_of(count, times.may.shape[1]), course_of(count, times.may.shape[1])
    found, crane = _annealed(times, np.array(order, np.int64), fixed, courses, budget, seed, warm_s)
    return tuple(found.tolist()), tuple(crane.tolist())


@kernel
def _annealed(
    times: OrderTimes,
    order: NDArray[np.int64],
    fixed: NDArray[np.bool_],
    courses: tuple[Course, Course],
    budget: int,
    seed: int,
    warm_s: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    known, trial = courses
    states, rank = known.states, known.rank
    count, cranes = len(order), (states.shape[1] - COLUMNS) // 2
    drawn = np.empty(4 if cranes == 1 else 6)
    crane = times.crane.copy()
    end, width = 2 * cranes + 1, states.shape[1]
    for n in range(count):
        rank[order[n]] = n
    walk(times, crane, order, (0, count), known, known)
    total_s = best_s = states[count, end]
    best, best_crane, new = order.copy(), crane.copy(), order.copy()
    looked, number = 0, np.uint64(seed)
    while looked < budget:
        looked += 1
        number = _draw(number, drawn)
        a = int(drawn[0] * count)
        part, own = order[a], crane[order[a]]
        gives = cranes > 1 and drawn[4] < _OTHER_CRANES
        if gives:
            other = int(drawn[5] * cranes)
            if own < 0 or other == own or not times.may[part, other]:
                continue
            crane[part] = other
        b = a if gives else min(count - 1, max(0, a + int((2.0 * drawn[1] - 1.0) * (_FARTHEST + 1))))
        if a == b and not gives:
            continue
        low, high = min(a, b), max(a, b)
        length, allowed = 0, True
        if gives:
            pass
        elif drawn[2] < _SWAPS:
            allowed = _may_swap(order, fixed, low, high)
        else:
            length = min(1 + int(((drawn[2] - _SWAPS) / (1.0 - _SWAPS)) ** 2 * _LONGEST), high - low)
            allowed = _may_move(order, fixed, low, high, length, a > b)
        looked += (high - low) // 4
        if not allowed:
            continue
        if length == 0:
            new[low], new[high] = order[high], order[low]
        elif a < b:  # the first ones go to the end
            new[low : high + 1 - length] = order[low + length : high + 1]
            new[high + 1 - length : high + 1] = order[low : low + length]
        else:
            new[low : low + length] = order[high + 1 - length : high + 1]
            new[low + length : high + 1] = order[low : high + 1 - length]
        until = walk(times, crane, new, (low, high + 1), known, trial)
        looked += until - low
        later_s = trial.states[until, end] - states[until, end]
        warmth_s = warm_s * (1.0 - looked / budget)
        if later_s <= _LESS_S or (warmth_s > 0.0 and drawn[3] < np.exp(-later_s / warmth_s)):
            order[low : high + 1] = new[low : high + 1]
            for n in range(low, until):
                for column in range(width):
                    states[n + 1, column] = trial.states[n + 1, column]
                rank[order[n]] = n
                known.carried_s[order[n]] = trial.carried_s[order[n]]
            if until < count and later_s != 0.0:
                _shift(states, until + 1, later_s, cranes)
            total_s += later_s
            if total_s < best_s - _LESS_S:
                best_s = total_s
                best[:], best_crane[:] = order, crane
        else:
            new[low : high + 1] = order[low : high + 1]
            crane[part] = own
    return best, best_crane


@leaf_kernel
def _draw(number: np.uint64, drawn: NDArray[np.float64]) -> np.uint64:
    """Fill an array with random numbers in [0, 1) by a linear congruential generator (Knuth's); return its state."""
    for n in range(len(drawn)):
        number = number * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
        drawn[n] = (number >> np.uint64(11)) / 9007199254740992.0
    return number


@leaf_kernel
def _shift(states: NDArray[np.float64], first: int, later_s: float, cranes: int) -> None:
    """Make states later from one on, in place."""
    for n in range(first, len(states)):
        for column in range(cranes):
            states[n, column] += later_s
        for column in range(2 * cranes, 2 * cranes + 3):
            states[n, column] += later_s


@leaf_kernel
def _may_swap(order: NDArray[np.int64], fixed: NDArray[np.bool_], low: int, high: int) -> bool:
    one, other = order[low], order[high]
    if fixed[one, other]:
        return False
    free = True
    for n in range(low + 1, high):
        free &= not (fixed[one, order[n]] or fixed[order[n], other])
    return free


@leaf_kernel
def _may_move(
    order: NDArray[np.int64], fixed: NDArray[np.bool_], low: int, high: int, length: int, is_last: bool
) -> bool:
    """Return whether the last parts of a range may go before its others, or the first ones behind them."""
    middle = high + 1 - length if is_last else low + length
    for m in range(low, middle):
        for n in range(middle, high + 1):
            if fixed[order[m], order[n]]:
                return False
    return True
