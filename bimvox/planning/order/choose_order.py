"""Erection sequence and yard together, for short travel times of the crane.

The order decides where a part may wait, and the places in the yard decide which order is fast. So both are made in
turn: an order from the previous places (greedy, one lift ahead), then places from that order. The fastest of a few
rounds is kept, by the point-to-point bound of all travel, empty and loaded; with several cranes, by the busiest one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.travel import Travel
from bimvox.planning.order.makespan import Places, pick_axes, target_axes
from bimvox.planning.order.sequence import ErectionSequence, Prefer, Sequencer
from bimvox.planning.order.shared_order import Shared, at, whole_seconds
from bimvox.planning.yard import allocate_yard
from bimvox.site.site import Site

_ROUNDS = 3
_LOOKED_AT = 48
"""How many of the parts that may come next, those nearest to the hook, are compared."""
_WORTH = 1.02
"""The plain order is kept if its travel time is at most this ratio above the best: the bound ignores obstacles."""


def order_and_yard(site: Site, sequencer: Sequencer) -> tuple[ErectionSequence, Places]:
    """Return an erection sequence and its places in the yard."""
    sequence = sequencer.lowest_first()
    if not site.cranes:
        return sequence, allocate_yard(site, sequence.order)
    travels = [travel_of(site, crane) for crane in site.cranes]
    rounds = [
        (sequence, allocate_yard(site, sequence.order)),
        (sequence, allocate_yard(site, sequence.order, *travels)),
    ]
    for _ in range(_ROUNDS):
        prefer: Prefer
        if site.has_several_cranes:
            places = rounds[-1][1]
            travel_axes = [(target_axes(site, travel), pick_axes(site, travel, places), travel) for travel in travels]
            prefer = Shared(site, travel_axes)
        else:
            prefer = _Quickest(site, travels[0], rounds[-1][1])
        sequence = sequencer.order(prefer)
        rounds.append((sequence, allocate_yard(site, sequence.order, *travels)))
    # With several cranes, the plain order does not balance them.
    first = 2 if site.has_several_cranes else 0
    most = max(_with_place(places) for _, places in rounds[first:])
    judged = [busiest_s(site, travels, made.order, places) for made, places in rounds]
    kept = [n for n, (_, places) in enumerate(rounds) if n >= first and _with_place(places) == most]
    best = min(kept, key=lambda n: round(judged[n], 3))
    plain_is_good = kept[0] == 0 and judged[0] <= _WORTH * judged[best]
    return rounds[0 if plain_is_good else best]


def travel_of(site: Site, crane: TowerCrane) -> Travel:
    """Return the travel times of a crane over a whole site."""
    base_m, size_m = np.array(crane.base_m[:2]), site.frame.voxel_size_m
    corners_m = np.array(site.frame.origin_m[:2]) + np.array([[0, 0], site.shape[:2]]) * size_m
    return Travel(crane, float(np.abs(corners_m - base_m).max() * 2.0) + crane.jib_height_m)


def busiest_s(site: Site, travels: Sequence[Travel], order: tuple[int, ...], places: Places) -> float:
    """Return the largest travel time of any crane, seconds, see :func:`travel_s`."""
    own = [tuple(i for i in order if site.components[i].crane == k) for k in range(len(travels))]
    return max(travel_s(site, travel, own[k], places) for k, travel in enumerate(travels))


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


def _with_place(places: Places) -> int:
    return sum(place is not None for place in places)
