"""In which set-up of a crane that moves each part is lifted: as few set-ups as serve most parts, then the nearest one.

The set-ups come in the order of the site file, and the crane returns to none. So a part is lifted in no earlier set-up
than what must be set before it. A part that would stand where the crane stands, or where its counterweight turns, is
lifted after that set-up. Which parts the crane reaches in a set-up follows from the radii; what else is in its way,
only the plan tells.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.kept import kept
from bimvox.planning.order.relations import OrderGraph
from bimvox.site.assign import reached_from
from bimvox.site.checks import unloading_columns
from bimvox.site.crane_distances import is_in, stand_of
from bimvox.site.means import Means
from bimvox.site.site import Site

_Flags = NDArray[np.bool_]


def set_ups_of(
    site: Site, graph: OrderGraph, free: Collection[str], barred: Collection[tuple[int, int]] = ()
) -> list[int]:
    """Return the set-up in which each part is lifted, by component; of other parts, after which they are set.

    Args:
        site: The site; its crane moves.
        graph: Which part must come before which.
        free: Ids of the components whose set-up is to be chosen; the others stay in theirs, if they can.
        barred: Components, each with a set-up in which it cannot be lifted.
    """
    reached, away_m = reached_from(site)
    for index, number in barred:
        reached[index, number] = False
    for part in site.components:
        if site.access is not None and part.means is Means.CRANE:
            for number in np.flatnonzero(reached[part.index]).tolist():
                reached[part.index, number] = len(unloading_columns(site, replace(part, crane=number))) > 0
        if part.means is not Means.CRANE:
            reached[part.index], away_m[part.index] = True, 0.0
        elif part.id not in free:
            reached[part.index] = np.arange(len(site.cranes)) == part.crane
    stands = np.stack([stands_in_the_way(site, number) for number in range(len(site.cranes))], axis=1)
    choose = _Choice(graph, reached, away_m, stands, np.array([part.means is Means.CRANE for part in site.components]))
    best = choose.among(tuple(range(len(site.cranes))))
    for count in range(1, len(site.cranes)):
        some = [choose.among(these) for these in combinations(range(len(site.cranes)), count)]
        fewest = max(some, key=lambda one: (one.served, -round(one.away_m, 6)))
        if fewest.served >= best.served:
            return fewest.set_ups
    return best.set_ups


def times_of_set_ups(site: Site, graph: OrderGraph) -> list[int]:
    """Return in which set-up each part is set, by component; the number of set-ups: after the crane has left them all.

    A part that would stand where the crane stands is set after that set-up. Nothing is set before what it needs.
    """
    used = sorted({part.crane for part in site.components if part.means is Means.CRANE})
    stands = np.stack([stands_in_the_way(site, number) for number in used], axis=1)
    after = np.where(stands, np.array(used) + 1, 0).max(axis=1)
    times = [max(part.crane, int(least)) for part, least in zip(site.components, after, strict=True)]
    for i in graph.topological():
        times[i] = max([times[i], *(times[j] for j in graph.earlier[i])])
    return times


@kept
def stands_in_the_way(site: Site, number: int) -> _Flags:
    """Return (N,) whether a part at its place would be where the crane stands in a set-up, or its tail turns."""
    solids, more_m = stand_of(site.cranes[number]), site.rules.clearance_m
    found = [any(is_in(solid, part.mesh, more_m) for solid in solids) for part in site.components]
    result = np.array(found, np.bool_)
    result.flags.writeable = False
    return result


class _Chosen(NamedTuple):
    """A set-up for every part, how many parts the crane reaches then, and how far it is from their places together."""

    set_ups: list[int]
    served: int
    away_m: float


class _Choice:
    """Chooses among set-ups.

    Args:
        graph: Which part must come before which.
        reached: (N, K) whether the crane reaches a part in a set-up; True for parts that it does not lift.
        away_m: (N, K) how far it is from the part's place.
        stands: (N, K) whether a part is in the way of the crane in a set-up.
        is_lifted: (N,) whether the crane lifts a part.
    """

    def __init__(
        self, graph: OrderGraph, reached: _Flags, away_m: NDArray[np.float64], stands: _Flags, is_lifted: _Flags
    ) -> None:
        self._graph, self._order = graph, graph.topological()
        self._reached, self._away_m, self._stands, self._is_lifted = reached, away_m, stands, is_lifted

    def among(self, these: tuple[int, ...]) -> _Chosen:
        """Return the choice among some set-ups, in ascending order."""
        numbers = np.array(these)
        after = np.where(self._stands[:, numbers], numbers, -1).max(axis=1)
        may = [[k for k in these if k > after[n] and self._reached[n, k]] for n in range(len(after))]
        first, earliest, served = dict[int, int](), these[0], set[int]()
        for i in self._order:
            least = max((first[j] for j in self._graph.earlier[i]), default=earliest)
            # What no set-up serves is set all the same: after those in which it would stand in the way.
            first[i] = next((k for k in may[i] if k >= least), max(least, int(after[i]) + 1))
            if first[i] in may[i]:
                served.add(i)
        last: dict[int, int] = {}
        for i in reversed(self._order):
            most = min((last[j] for j in self._graph.later[i]), default=these[-1])
            last[i] = max((k for k in may[i] if k <= most), default=most) if i in served else most
            last[i] = max(last[i], first[i])
        found: dict[int, int] = {}
        for i in self._order:
            least = max((found[j] for j in self._graph.earlier[i]), default=earliest)
            within = [k for k in may[i] if least <= k <= last[i]] if i in served else []
            found[i] = min(within, key=lambda k: (self._away_m[i, k], k), default=max(least, int(after[i]) + 1))
        lifted = [i for i in served if self._is_lifted[i]]
        away_m = float(sum(self._away_m[i, found[i]] for i in lifted))
        return _Chosen([min(found[i], these[-1]) for i in range(len(after))], len(lifted), away_m)
