"""A faster erection sequence than the greedy one, and the yard for it.

The local search (``local_search``) changes the order within its deliveries and keeps the places, so its estimate holds
for them; parts of one stack or rack keep their order. With several cranes it also changes which of them lifts a part.
Then the yard is allocated anew for the order that was found, and the faster of both is searched again. A result counts
if it saves more than the estimate's error.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.travel import Travel
from bimvox.planning.order.local_search import searched
from bimvox.planning.order.makespan import OrderTimes, Places, makespan_s, order_times
from bimvox.planning.order.relations import Precedence
from bimvox.planning.order.sequence import ErectionSequence, Sequencer
from bimvox.planning.truckload import fit_trucks
from bimvox.planning.yard import allocate_yard, risen
from bimvox.site.site import Site

_LEAST_ROUNDS, _MOST_ROUNDS, _PLACED = 3, 16, 800
"""Rounds of search and yard: as many as place this many parts, within limits."""
BUDGET = 20_000
"""Parts looked at in each round, for each part of the site."""
COOL_S, WARM_S = 2.0, 20.0
_LESS_S = 0.01
_WORTH_S = 5.0
_WORTH_SHARED = 0.005
"""What an order must save by the estimate, in all or, with several cranes, as a share of all their work. The estimate
is not better than that."""


class Faster(NamedTuple):
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

    def than(self, greedy: ErectionSequence, places: Places) -> Faster | None:
        """Return a faster order; None if there is none."""
        start = self._judged(self._site, greedy, places)
        best = now = start
        warm_s = COOL_S
        for seed in range(max(_LEAST_ROUNDS, min(_MOST_ROUNDS, _PLACED // len(greedy.order)))):
            found = self._nearby(now, seed, warm_s)
            if found is not None and found.seconds < best.seconds - _LESS_S:
                best = now = found
                warm_s = COOL_S
            else:  # try further away
                now = best if found is None or warm_s > COOL_S else found
                warm_s = WARM_S
        worth_s = _WORTH_S if len(self._travels) == 1 else _WORTH_SHARED * start.work_s
        return None if best.seconds > start.seconds - worth_s else best

    def problem(self, sequence: ErectionSequence, places: Places) -> tuple[OrderTimes, NDArray[np.bool_]]:
        """Return what the search looks at: the times at these places, and which parts keep their order."""
        return self._times(self._site, places), self._fixed_pairs(sequence, places)

    def _nearby(self, now: Faster, seed: int, warm_s: float) -> Faster | None:
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
        choices = [allocate_yard(site, sequence.order, *self._travels)]
        position = _positions(sequence.order)
        deliveries = {part: place.delivery for part, place in enumerate(now.places) if place is not None}
        is_kept = not (fixed & (position[:, None] > position[None])).any()
        if is_kept and fit_trucks(site, sequence.order, deliveries):
            choices.insert(0, risen(site, sequence.order, now.places))
        most = max(_with_place(places) for places in (*choices, now.places))
        kept = [self._judged(site, sequence, places) for places in choices if _with_place(places) == most]
        return min(kept, key=lambda one: one.seconds, default=None)

    def _judged(self, site: Site, sequence: ErectionSequence, places: Places) -> Faster:
        times = self._times(site, places)
        lifted = np.flatnonzero(times.crane >= 0)
        work_s = float((times.lead_s + times.off_s).sum() + times.carry_s[times.crane[lifted], lifted].sum())
        return Faster(makespan_s(times, sequence.order), work_s, site, sequence, places)

    def _times(self, site: Site, places: Places) -> OrderTimes:
        return order_times(site, self._travels, places, self._over_m, self._supports, self._free)

    def _fixed_pairs(self, sequence: ErectionSequence, places: Places) -> NDArray[np.bool_]:
        """Return the pairs that keep their order, those of different deliveries, or of one stack or rack, too."""
        order = sequence.order
        lies = np.array([(-1, 0, 0) if p is None else (p.delivery, p.stack, p.rack) for p in places])
        delivery, stack, rack = lies.T
        lifted = delivery >= 0
        same = delivery[:, None] == delivery[None]
        kept = (lifted[:, None] & lifted[None] & ~same) | (
            same & (((stack[:, None] == stack[None]) & (stack > 0)) | ((rack[:, None] == rack[None]) & (rack != 0)))
        )
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


def _with_place(places: Places) -> int:
    return sum(place is not None for place in places)
