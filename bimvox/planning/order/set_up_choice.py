"""In which set-up of a crane that moves each part is lifted: as few set-ups as serve most parts, then the nearest one.

The set-ups come in the order of the site file, and the crane returns to none. So a part is lifted in no earlier set-up
than what must be set before it. A part that would stand where the crane stands, or where its counterweight turns, is
lifted after that set-up. Which parts the crane reaches in a set-up follows from the radii; what else is in its way,
only the plan tells.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.outline import outline_of, tail_low_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.order.relations import OrderGraph
from bimvox.site.assign import reached_from
from bimvox.site.crane_distances import STANDING_M
from bimvox.site.means import Means
from bimvox.site.site import CRANE_ID, Site, is_mast_of

_Flags = NDArray[np.bool_]


def set_ups_of(site: Site, graph: OrderGraph, free: Collection[str]) -> list[int]:
    """Return the set-up in which each part is lifted, by component; of other parts, after which they are set.

    Args:
        site: The site; its crane moves.
        graph: Which part must come before which.
        free: Ids of the components whose set-up is to be chosen; the others stay in theirs, if they can.
    """
    reached, away_m = reached_from(site)
    for part in site.components:
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


def stands_in_the_way(site: Site, number: int) -> _Flags:
    """Return (N,) whether a part at its place would be where the crane stands in a set-up, or its tail turns."""
    taken = np.zeros(site.shape, np.bool_)
    for blocker in site.blockers:
        if blocker.kind == CRANE_ID and is_mast_of(site.cranes[number], blocker.id):
            taken[tuple(blocker.cells.T)] = True
    _take_tail(site, site.cranes[number], taken)
    _take_outriggers(site, site.cranes[number], taken)
    return np.array([taken[tuple((c.shape.cells + np.array(c.target_vox)).T)].any() for c in site.components], np.bool_)


def _take_tail(site: Site, crane: TowerCrane, taken: _Flags) -> None:
    """Mark the cells that a counterweight sweeps in a whole turn."""
    (x, y, z), size_m, outline = site.frame.origin_m, site.frame.voxel_size_m, outline_of(crane)
    columns = (np.arange(n) for n in site.shape[:2])
    apart = [low + size_m * (at + 0.5) - base for low, at, base in zip((x, y), columns, crane.base_m, strict=False)]
    swept = np.hypot(apart[0][:, None], apart[1][None]) <= outline.tail_m
    low, high = (tail_low_m(crane) - z) / size_m, (outline.tail_height_m[1] - z) / size_m
    taken[swept, max(0, int(np.floor(low + 1e-6))) : max(0, int(np.ceil(high - 1e-6)))] = True


def _take_outriggers(site: Site, crane: TowerCrane, taken: _Flags) -> None:
    """Mark the cells between the outriggers of a carrier on its heading, as high as people beside them."""
    if crane.carrier is None or (base := crane.carrier.outriggers) is None:
        return
    size_m, (x, y, z) = site.frame.voxel_size_m, site.frame.origin_m
    x_m, y_m = (low + size_m * (np.arange(n) + 0.5) for low, n in zip((x, y), site.shape[:2], strict=True))
    east, north = np.meshgrid(x_m - crane.base_m[0], y_m - crane.base_m[1], indexing="ij")
    cos, sin, more_m = np.cos(crane.carrier.heading_rad), np.sin(crane.carrier.heading_rad), size_m / np.sqrt(2.0)
    ahead, left = cos * east + sin * north, cos * north - sin * east
    inside = (ahead > -base.rear_m - more_m) & (ahead < base.front_m + more_m)
    inside &= (left > -base.right_m - more_m) & (left < base.left_m + more_m)
    low, high = ((at_m - z) / size_m for at_m in (crane.base_m[2], crane.base_m[2] + STANDING_M))
    taken[inside, max(0, round(low)) : max(0, int(np.ceil(high - 1e-6)))] = True


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
            first[i] = next((k for k in may[i] if k >= least), least)
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
            found[i] = min(within, key=lambda k: (self._away_m[i, k], k), default=least)
        lifted = [i for i in served if self._is_lifted[i]]
        away_m = float(sum(self._away_m[i, found[i]] for i in lifted))
        return _Chosen([found[i] for i in range(len(after))], len(lifted), away_m)
