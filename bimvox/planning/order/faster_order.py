"""A faster erection sequence than the greedy one, by local search, and the yard for it.

The local search (``local_search``) changes the order within its deliveries and keeps the places, so its estimate holds
for them; parts of one stack or rack keep their order. With several cranes it also changes which of them lifts a part.
Then the yard is allocated anew for the order that was found, and the faster of both is searched again. A result counts
if it saves more than the estimate's error.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.travel import Travel
from bimvox.planning.long_waits import are_in_time, begin_days
from bimvox.planning.order.makespan import (
    STATE_COLUMNS,
    Course,
    OrderTimes,
    Places,
    Shared,
    at,
    course_of,
    makespan_s,
    order_times,
    pick_axes,
    target_axes,
    walk,
    whole_seconds,
)
from bimvox.planning.order.relations import Precedence
from bimvox.planning.order.sequence import ErectionSequence, Prefer, Sequencer
from bimvox.planning.yard import allocate_yard, near_upended, risen
from bimvox.records.unloading import fit_lorries
from bimvox.site.site import Site, floors_at_feet

# A local search on the erection sequence: less time, by the estimate of ``makespan``.
#
# Simulated annealing: a part, or a few that follow each other, go to another position, two parts change positions, or a
# part goes to another crane that may lift it. No move breaks a pair that must stay as it is
# (``Sequencer.fixed_pairs``). What is counted are parts looked at, not seconds, so that every machine finds the same.

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
    count, cranes = len(order), (states.shape[1] - STATE_COLUMNS) // 2
    drawn = np.empty(4 if cranes == 1 else 6)
    crane = times.crane.copy()
    end, width = 2 * cranes + 1, states.shape[1]
    # The course of the given order is what every change is compared with.
    for n in range(count):
        rank[order[n]] = n
    walk(times, crane, order, (0, count), known, known)
    total_s = best_s = states[count, end]
    best, best_crane, new = order.copy(), crane.copy(), order.copy()
    looked, number = 0, np.uint64(seed)
    while looked < budget:
        looked += 1
        number = _draw(number, drawn)
        # Draw a change: another crane for a part, two parts swapped, or some moved past others.
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
        # To see whether the change is allowed costs a quarter of walking through it.
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
        # Only the window of the change is walked, up to where the course is the same again.
        until = walk(times, crane, new, (low, high + 1), known, trial)
        looked += until - low
        later_s = trial.states[until, end] - states[until, end]
        warmth_s = warm_s * (1.0 - looked / budget)
        if later_s <= _LESS_S or (warmth_s > 0.0 and drawn[3] < np.exp(-later_s / warmth_s)):
            # Commit: the states of the window replace those before, and what follows is shifted.
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
            # Roll back.
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


# Erection sequence and yard together, for short travel times of the crane.
#
# The order decides where a part may wait, and the places in the yard decide which order is fast. So both are made in
# turn: an order from the previous places (greedy, one lift ahead), then places from that order. The fastest of a few
# rounds is kept, by the point-to-point bound of all travel, empty and loaded; with several cranes, by the busiest one.

_LORRY_S = 3600.0
"""What a lorry more is worth in time of crane and crew (professional judgement: it costs more than that)."""
_ROUNDS = 3
_LOOKED_AT = 48
"""How many of the parts that may come next, those nearest to the hook, are compared."""
WORTH = 1.02
"""The plain order is kept if its travel time is at most this ratio above the best: the bound ignores obstacles."""


def order_and_yard(site: Site, sequencer: Sequencer) -> tuple[ErectionSequence, Places]:
    """Return an erection sequence and its places in the yard."""
    sequence = sequencer.lowest_first()
    allocate = partial(allocate_yard, site, waits_for=sequencer.waits_for)
    if not site.cranes:
        return sequence, allocate(sequence.order)
    travels = [travel_of(site, crane) for crane in site.cranes]
    rounds = [(sequence, allocate(sequence.order)), (sequence, allocate(sequence.order, *travels))]
    for _ in range(_ROUNDS):
        prefer: Prefer
        if site.has_several_cranes:
            places = rounds[-1][1]
            travel_axes = [(target_axes(site, travel), pick_axes(site, travel, places), travel) for travel in travels]
            prefer = Shared(site, travel_axes)
        elif site.moving is not None:
            prefer = _QuickestOfEach(site, travels, rounds[-1][1])
        else:
            prefer = _Quickest(site, travels[0], rounds[-1][1])
        sequence = sequencer.order(prefer)
        rounds.append((sequence, allocate(sequence.order, *travels)))
    # With several cranes, the plain order does not balance them.
    first = 2 if site.has_several_cranes else 0
    most = max(_with_place(places) for _, places in rounds[first:])
    judged = [
        busiest_s(site, travels, made.order, places) + _LORRY_S * _lorries(site, made.order, places)
        for made, places in rounds
    ]
    kept = [n for n, (_, places) in enumerate(rounds) if n >= first and _with_place(places) == most]
    best = min(kept, key=lambda n: round(judged[n], 3))
    plain_is_good = kept[0] == 0 and judged[0] <= WORTH * judged[best]
    return rounds[0 if plain_is_good else best]


def _lorries(site: Site, order: Sequence[int], places: Places) -> int:
    """Return how many lorries bring the parts."""
    return fit_lorries(site, order, {part: place.delivery for part, place in enumerate(places) if place}) or 0


def travel_of(site: Site, crane: TowerCrane) -> Travel:
    """Return the travel times of a crane over a whole site."""
    base_m, size_m = np.array(crane.base_m[:2]), site.frame.voxel_size_m
    corners_m = np.array(site.frame.origin_m[:2]) + np.array([[0, 0], site.shape[:2]]) * size_m
    return Travel(crane, float(np.abs(corners_m - base_m).max() * 2.0) + crane.jib_height_m)


def busiest_s(site: Site, travels: Sequence[Travel], order: tuple[int, ...], places: Places) -> float:
    """Return the largest travel time of any crane, of one that moves the sum, seconds, see :func:`travel_s`."""
    own = [tuple(i for i in order if site.components[i].crane == k) for k in range(len(travels))]
    each_s = [travel_s(site, travel, own[k], places) for k, travel in enumerate(travels)]
    return max(each_s) if site.moving is None else sum(each_s)


def travel_s(site: Site, travel: Travel, order: tuple[int, ...], places: Places) -> float:
    """Return the hook's travel time, empty and loaded, seconds; parts without a place are left out."""
    targets, picks = target_axes(site, travel), pick_axes(site, travel, places)
    kept = np.array([i for i in order if places[i] is not None], np.int64)
    if not len(kept):
        return 0.0
    loaded = travel.between_s(at(picks, kept), at(targets, kept))
    empty = travel.between_s(at(targets, kept[:-1]), at(picks, kept[1:]))
    return float(loaded.sum() + empty.sum())


class _Quickest:
    """Chooses the part with the least travel time from the part before it and on to the next one."""

    def __init__(self, site: Site, travel: Travel, places: Places) -> None:
        targets, picks = target_axes(site, travel), pick_axes(site, travel, places)
        self._empty_s = whole_seconds(travel, targets, picks)
        self._delivery = [-1 if place is None else place.delivery for place in places]
        self._assembly = [component.hints.assembly for component in site.components]

    def __call__(self, ready: list[int], order: list[int]) -> int:
        """Return the next part."""
        delivery = min(self._delivery[i] for i in ready)
        ready = [i for i in ready if self._delivery[i] == delivery]
        if order and self._assembly[order[-1]] is not None:
            ready = [i for i in ready if self._assembly[i] == self._assembly[order[-1]]] or ready
        if len(ready) == 1:
            return ready[0]
        numbers = np.array(ready)
        if order:
            nearest = np.argsort(self._empty_s[order[-1], numbers], kind="stable")[:_LOOKED_AT]
            numbers = numbers[np.sort(nearest)]
        after = self._empty_s[numbers[:, None], numbers[None]] + np.diag(np.full(len(numbers), np.inf))
        cost = after.min(axis=1) + (self._empty_s[order[-1], numbers] if order else 0.0)
        return int(numbers[np.argmin(cost)])


class _QuickestOfEach:
    """Chooses as :class:`_Quickest` does, by the travel times of the set-up in which the part is lifted."""

    def __init__(self, site: Site, travels: Sequence[Travel], places: Places) -> None:
        self._crane = [component.crane for component in site.components]
        self._each = [_Quickest(site, travel, places) for travel in travels]

    def __call__(self, ready: list[int], order: list[int]) -> int:
        """Return the next part: those that may come next belong to one set-up."""
        number = min(self._crane[i] for i in ready)
        here = order[-1:] if order and self._crane[order[-1]] == number else []
        return self._each[number]([i for i in ready if self._crane[i] == number], here)


def _with_place(places: Places) -> int:
    return sum(place is not None for place in places)


_LEAST_ROUNDS, _MOST_ROUNDS, _PLACED = 3, 16, 800
"""Rounds of search and yard: as many as place this many parts, within limits."""
BUDGET = 20_000
"""Parts looked at in each round, for each part of the site."""
COOL_S, WARM_S = 2.0, 20.0
_WORTH_A_YARD_S = 0.01
_WORTH_S = 5.0
_WORTH_SHARED = 0.005
"""What an order must save by the estimate, in all or, with several cranes, as a share of all their work. The estimate
is not better than that."""


class _Faster(NamedTuple):
    """An order by the estimate.

    Attributes:
        seconds: How long it takes.
        work_s: How long the cranes work, all together.
        site: The site, with the crane of each part.
        sequence: The order.
        places: The places in the yard.
    """

    seconds: float
    work_s: float
    site: Site
    sequence: ErectionSequence
    places: Places


class FasterOrder:
    """Searches for a faster order than a greedy one.

    Args:
        site: A site with a crane.
        sequencer: Makes its sequences.
        relations: Which part must be set before which.
        travels: The travel times of its cranes.
        free: Ids of the components that another crane may lift.
    """

    def __init__(
        self,
        site: Site,
        sequencer: Sequencer,
        relations: Precedence,
        travels: Sequence[Travel],
        free: Collection[str] = (),
    ) -> None:
        self._site, self._sequencer, self._travels = site, sequencer, travels
        self._supports = [(*on, *first) for on, first in zip(relations.supports, relations.wanted, strict=True)]
        self._free = np.array([part.id in free for part in site.components])
        self._over_m = _heights_m(site, sequencer.lowest_first().order)

    def than(self, greedy: ErectionSequence, places: Places) -> _Faster | None:
        """Return a faster order; None if there is none."""
        start = self._judged(self._site, greedy, places)
        best = now = start
        warm_s = COOL_S
        for seed in range(max(_LEAST_ROUNDS, min(_MOST_ROUNDS, _PLACED // len(greedy.order)))):
            found = self._nearby(now, seed, warm_s)
            if found is not None and found.seconds < best.seconds - _WORTH_A_YARD_S:
                best = now = found
                warm_s = COOL_S
            else:  # try further away
                now = best if found is None or warm_s > COOL_S else found
                warm_s = WARM_S
        worth_s = _WORTH_S if len(self._travels) == 1 else _WORTH_SHARED * start.work_s
        return None if best.seconds > start.seconds - worth_s else best

    def problem(self, sequence: ErectionSequence, places: Places) -> tuple[OrderTimes, NDArray[np.bool_]]:
        """Return what the search looks at: the times at these places, and which parts keep their order."""
        return self.times(places), self._fixed_pairs(sequence, places)

    def times(self, places: Places) -> OrderTimes:
        """Return what the parts take at these places."""
        return self._times(self._site, places)

    def _nearby(self, now: _Faster, seed: int, warm_s: float) -> _Faster | None:
        """Return the faster one of the order that is found next, in these places or in new ones; None if none is."""
        order = now.sequence.order
        times, fixed = self._times(now.site, now.places), self._fixed_pairs(now.sequence, now.places)
        found, cranes = searched(times, order, fixed, BUDGET * len(order), seed, warm_s)
        given = tuple(times.crane.tolist())
        del times  # as large as those of the orders that are judged next
        if found == order and cranes == given:
            return None
        sequence, site = self._sequencer.following(found), now.site
        if cranes != given:
            whose = zip(site.components, cranes, strict=True)
            parts = tuple(part if k in (-1, part.crane) else replace(part, crane=k) for part, k in whose)
            site = replace(site, components=parts)
        choices = [allocate_yard(site, sequence.order, *self._travels, waits_for=self._sequencer.waits_for)]
        position = _positions(sequence.order)
        deliveries = {part: place.delivery for part, place in enumerate(now.places) if place is not None}
        is_kept = not (fixed & (position[:, None] > position[None])).any()
        is_kept &= are_in_time(begin_days(site, sequence.order, self._sequencer.waits_for), deliveries)
        lorries = [fit_lorries(site, order.order, deliveries) for order in (sequence, now.sequence)]
        if is_kept and lorries[0] is not None and (lorries[1] is None or lorries[0] <= lorries[1]):
            choices.insert(0, risen(site, sequence.order, now.places))
        most = max(_with_place(places) for places in (*choices, now.places))
        kept = [self._judged(site, sequence, places) for places in choices if _with_place(places) == most]
        return min(kept, key=lambda one: one.seconds, default=None)

    def _judged(self, site: Site, sequence: ErectionSequence, places: Places) -> _Faster:
        times = self._times(site, places)
        lifted = np.flatnonzero(times.crane >= 0)
        work_s = float((times.lead_s + times.off_s).sum() + times.carry_s[times.crane[lifted], lifted].sum())
        lorries_s = _LORRY_S * _lorries(site, sequence.order, places)
        return _Faster(makespan_s(times, sequence.order) + lorries_s, work_s, site, sequence, places)

    def _times(self, site: Site, places: Places) -> OrderTimes:
        return order_times(site, self._travels, places, self._over_m, self._supports, self._free)

    def _fixed_pairs(self, sequence: ErectionSequence, places: Places) -> NDArray[np.bool_]:
        """Return the pairs that keep their order.

        So do those of different deliveries, of one stack or rack, a part that lies near one that is upended, and a part
        and the floor at its feet.
        """
        order = sequence.order
        lies = np.array([(-1, 0, 0) if p is None else (p.delivery, p.stack, p.rack) for p in places])
        delivery, stack, rack = lies.T
        lifted = delivery >= 0
        same = delivery[:, None] == delivery[None]
        kept = (lifted[:, None] & lifted[None] & ~same) | (
            same & (((stack[:, None] == stack[None]) & (stack > 0)) | ((rack[:, None] == rack[None]) & (rack != 0)))
        )
        kept |= same & near_upended(self._site, places)
        kept |= floors_at_feet(self._site).T
        position = _positions(order)
        fixed = self._sequencer.fixed_pairs(order)
        fixed |= kept & (position[:, None] < position[None])
        return fixed


def _heights_m(site: Site, order: Sequence[int]) -> NDArray[np.float64]:
    """Return (N,) how high the hook must go with each part, over everything that comes before it in an order."""
    size_m = site.frame.voxel_size_m
    high_m = size_m * np.array([part.shape.size_vox[2] for part in site.components])
    top_m = size_m * (np.array([part.target_vox[2] for part in site.components]) - 1) + high_m
    over_m, numbers = np.empty(len(order)), np.array(order)
    over_m[numbers] = np.maximum.accumulate(top_m[numbers]) + high_m[numbers]
    return over_m


def _positions(order: Sequence[int]) -> NDArray[np.int64]:
    """Return the (N,) position of each part in an order."""
    position = np.empty(len(order), np.int64)
    position[np.array(order)] = np.arange(len(order))
    return position
