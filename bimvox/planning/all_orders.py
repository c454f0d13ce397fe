"""The best erection sequence of a small site, by trying all, and a bound on the time of any sequence of any site."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import islice

import numpy as np

from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.given_order import yard_for
from bimvox.planning.order.faster_order import FasterOrder, travel_of
from bimvox.planning.order.makespan import makespan_s, target_axes
from bimvox.planning.order.relations import order_graph, precedence
from bimvox.planning.order.sequence import Sequencer
from bimvox.site.assign import reached_from
from bimvox.site.crew_times import standing_s
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True)
class BestOrder:
    """The fastest of all sequences of a site, by the estimate of ``order.makespan``.

    Attributes:
        ids: Of all parts, first lift first.
        estimate_s: Its makespan by the estimate, in the yard that is laid out for it.
        tried: Number of sequences, each with a yard of its own.
    """

    ids: tuple[str, ...]
    estimate_s: float
    tried: int


def best_of_all(site: Site, most: int) -> BestOrder | None:
    """Return the fastest of all sequences of a site with one crane; None if there are more than ``most``.

    A sequence keeps every relation of the engine: what a part rests on, and what would be in its way. Of equally fast
    ones, that with the lower component indices first is returned.
    """
    contacts = Contacts(site)
    relations = precedence(site, contacts, lambda done, total: None)
    graph, sequencer = order_graph(site, relations, contacts), Sequencer(site, relations, contacts)
    orders = list(islice(_orders(graph.earlier), most + 1))
    if len(orders) > most:
        return None
    judge = FasterOrder(site, sequencer, relations, [travel_of(site, crane) for crane in site.cranes])

    def estimate_s(order: tuple[int, ...]) -> float:
        places = yard_for(site, order, sequencer.waits_for)
        return makespan_s(judge.times(places), order) if all(places) else np.inf

    times_s = [estimate_s(order) for order in orders]
    best = int(np.argmin(times_s))
    return BestOrder(tuple(site.components[i].id for i in orders[best]), times_s[best], len(orders))


def _orders(earlier: Sequence[Set[int]]) -> Iterator[tuple[int, ...]]:
    """Yield every order in which each part comes after all that must be earlier."""
    order: list[int] = []

    def further(left: frozenset[int]) -> Iterator[tuple[int, ...]]:
        if not left:
            yield tuple(order)
        for part in sorted(left):
            if left.isdisjoint(earlier[part]):
                order.append(part)
                yield from further(left - {part})
                order.pop()

    return further(frozenset(range(len(earlier))))


def least_makespan_s(site: Site) -> float:
    """Return a time that no sequence, yard and assignment of a site can go below, seconds.

    Each lift takes the crew's times, and at least the slewing and trolleying from the nearest column of the yard; after
    it the empty hook goes back to the yard, but for the last lift of each crane. Several cranes share the sum at best
    equally. Hoisting, obstacles, swing, waits and the other cranes are left out.
    """
    yard_m = np.array(site.frame.origin_m)[:2] + site.frame.voxel_size_m * (np.argwhere(site.yard) + 0.5)
    points_m = np.concatenate([yard_m, np.zeros((len(yard_m), 1))], axis=1)
    lifted = np.array([part.means.value == "crane" for part in site.components])
    can = reached_from(site)[0] if site.has_several_cranes else np.ones((len(lifted), 1), np.bool_)
    across_s = np.full(can.shape, np.inf)
    for k, crane in enumerate(site.cranes):
        travel = travel_of(site, crane)
        slew, radius, _ = travel.axes_of(points_m)
        at_slew, at_radius, _ = target_axes(site, travel)
        for n in np.flatnonzero(can[:, k] & lifted):
            across_s[n, k] = travel.across_s(at_slew[n] - slew, at_radius[n] - radius).min()
    nearest_s = across_s[lifted].min(axis=1)
    crew_s = [
        standing_s(site.rules, part, upended=part.erected, flipped=part.flip_rise_vox > 0) for part in site.components
    ]
    work_s = np.array(crew_s)[lifted].sum() + 2.0 * nearest_s.sum() - np.sort(nearest_s)[-len(site.cranes) :].sum()
    return float(work_s / len(site.cranes))
