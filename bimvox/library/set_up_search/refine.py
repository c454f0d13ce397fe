"""A closer look at the fastest set-ups: other places of their masts, and smaller deliveries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bimvox.library.set_up_search.search import Effort, OtherYard, Search, Tried
from bimvox.site.catalogue import machine_called

_APART_M = 4.0
"""Places that are nearer to each other take about as long."""
_AS_FAST = 1.25
"""A place is worth a closer look if the crane moves no longer than so many times the least, by the quick estimate."""
_MACHINES, _PLACES = 4, 12
"""So many of the fastest machines are looked at closer, on so many places each."""
_MOST_PLACES = 60
"""The same of the fastest one by its plan."""
_LOAD = 0.5
"""Share of the truckload: with fewer parts in the yard, each lies where it takes least time."""


def closer(search: Search, lattice: Sequence[Tried]) -> list[Tried]:
    """Return a lattice in which what serves most parts is timed with the swing of loads, the fastest on better places.

    Args:
        search: The parts.
        lattice: Machines on their places, as ``Search.tried`` yields them.
    """
    most = max((one.served for one in lattice if one.crane is not None), default=0)
    found = [_timed(search, one) if one.served == most and one.crane is not None else one for one in lattice]
    fastest: dict[str, int] = {}
    able = [n for n, one in enumerate(found) if one.served == most and one.crane is not None]
    for n in sorted(able, key=lambda n: found[n].crane_s):
        fastest.setdefault(found[n].machine, n)
    for n in list(fastest.values())[:_MACHINES]:
        found[n] = better_placed(search, found[n])
    return found


def better_placed(search: Search, one: Tried) -> Tried:
    """Return a set-up of one crane on the best of a few of its places, or where it stands."""
    return min(one, *_elsewhere(search, one, _PLACES), key=lambda one: (-one.served, one.crane_s))


def refined(search: Search, best: Tried, effort: Effort) -> list[Tried]:
    """Return set-ups to plan next to the fastest one, about half as many as were planned before.

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
    if machine_called(best.machine) is not None:
        elsewhere = [one for one in _elsewhere(search, best, _MOST_PLACES) if one.served >= best.served]
        chosen = _apart(best, sorted(elsewhere, key=lambda one: one.crane_s), most - len(found))
        found += [replace(one, place=number) for number, one in enumerate(chosen, start=2)]
    return [one for one in found if not one.over][:most]


def _timed(search: Search, one: Tried) -> Tried:
    assert one.crane is not None
    return search.from_place(one, np.array(one.crane.base_m[:2]))


def _elsewhere(search: Search, one: Tried, most: int) -> list[Tried]:
    """Return a set-up on at most so many of its other places that are as fast by the quick estimate."""
    standing_s = float(search.work.standing_s.sum())
    moving_s = one.all_crane_s - standing_s
    full = one.all_served >= one.served
    assert one.crane is not None
    if not search.inside(np.array([one.crane.base_m[:2]]))[0]:
        full &= ~search.inside(one.bases_m)
    able = np.flatnonzero(full & (moving_s <= _AS_FAST * moving_s[full].min(initial=np.inf)))
    return [search.from_place(one, one.bases_m[at]) for at in able[:: max(1, -(-len(able) // most))]]


def _apart(best: Tried, others: Sequence[Tried], most: int) -> list[Tried]:
    """Return the first of other places that are not next to the best one or to each other."""
    found: list[Tried] = []
    for one in others:
        if len(found) < most and all(_gap_m(one, other) >= _APART_M for other in (best, *found)):
            found.append(one)
    return found


def _gap_m(one: Tried, other: Tried) -> float:
    assert one.crane is not None
    assert other.crane is not None
    return float(np.hypot(*np.subtract(one.crane.base_m[:2], other.crane.base_m[:2])))
