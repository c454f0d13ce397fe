"""A second look around the fastest planned set-up: other good places of its mast, and smaller deliveries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.library.set_up_search.search import Effort, OtherYard, Search, Tried
from bimvox.site.catalogue import machine_called

_APART_M = 4.0
"""Places that are nearer to each other take about as long."""
_AS_FAST = 1.25
"""A place is worth a plan if the crane moves no longer than so many times what it moves on the best one."""
_LOAD = 0.5
"""Share of the truckload: with fewer parts in the yard, each lies where it takes least time."""


def refined(search: Search, best: Tried, effort: Effort) -> list[Tried]:
    """Return set-ups to plan next to the fastest one, about half as many as were planned before.

    The estimate ranks places of one machine badly when they are nearly as fast: only a plan knows the better one.

    Args:
        search: The parts.
        best: The fastest set-up by its plan, of one crane.
        effort: How many were planned.
    """
    most = effort.members // 2
    if effort.members < 4 or best.crane is None:
        return []
    found = []
    yards = search.config.areas.yard or ()
    load_kg = search.config.rules.truckload_kg if best.yard is None else best.yard.truckload_kg
    polygon = best.yard.polygon if best.yard is not None else yards[0] if len(yards) == 1 else None
    if polygon is not None and load_kg > 0.0:
        number = None if best.yard is None else best.yard.number
        found.append(replace(best, yard=OtherYard(number, polygon, _LOAD * load_kg)))
    machine = machine_called(best.machine)
    if machine is not None:
        for number, at in enumerate(_spread(best, float(search.work.standing_s.sum()), most - len(found)), start=2):
            crane_s = float(best.all_crane_s[at])
            cost = search.rates(machine).total(crane_s / 3600.0)
            crane = replace(best.crane, base_m=(*best.bases_m[at].tolist(), best.crane.base_m[2]))
            over = search.over(cost)
            found.append(replace(best, crane=crane, crane_s=crane_s, cost=cost, over=over, place=number))
    return [one for one in found if not one.over][:most]


def _spread(best: Tried, standing_s: float, most: int) -> list[int]:
    """Return the places, as fast by the estimate, that are furthest from those planned and from each other."""
    assert best.crane is not None
    limit_s = standing_s + _AS_FAST * (best.crane_s - standing_s)
    able = np.flatnonzero((best.all_served >= best.served) & (best.all_crane_s <= limit_s))
    gap_m = np.hypot(*(best.bases_m[able] - np.array(best.crane.base_m[:2])).T)
    found: list[int] = []
    while len(found) < most and gap_m.max(initial=0.0) >= _APART_M:
        at = int(able[int(np.argmax(gap_m))])
        found.append(at)
        gap_m = np.minimum(gap_m, np.hypot(*(best.bases_m[able] - best.bases_m[at]).T))
    return found
