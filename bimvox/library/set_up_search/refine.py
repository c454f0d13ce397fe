"""A closer look at the fastest set-ups: other places of their masts, and smaller deliveries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bimvox.library.set_up_search.front import front_of, to_plan
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, OtherYard, Tried
from bimvox.library.set_up_search.timed import FEW_LIFTS, LIFTS
from bimvox.site.catalogue import machine_called

_APART_M = 4.0
"""Places that are nearer to each other take about as long."""
_AS_FAST = 1.25
"""A place is worth a closer look if the crane moves no longer than so many times the least, by the quick estimate."""
_FASTEST = 8
"""So many of the fastest are timed in any case."""
_MACHINES, _PLACES = 4, 12
"""So many of the fastest machines are looked at closer, on so many places each."""
_MOST_PLACES = 60
"""The same of the fastest one by its plan."""
_LOAD = 0.5
"""Share of the truckload: with fewer parts in the yard, each lies where it takes least time."""


def closer(search: Search, lattice: Sequence[Tried], members: int) -> list[Tried]:
    """Return a lattice in which what serves most parts counts the swing of loads, the fastest on better places.

    The fastest of each machine by the quick estimate is timed, and gives the others of that machine a factor. Then the
    fastest by that, and all that would be planned, are timed themselves, until nothing else would be planned.

    Args:
        search: The parts.
        lattice: Machines on their places, as ``Search.tried`` yields them.
        members: How many set-ups are planned.
    """
    most = max((one.served for one in lattice if one.crane is not None), default=0)
    found = list(lattice)
    able = [n for n, one in enumerate(found) if one.served == most and one.crane is not None]
    for own in _by_machine(lattice, able):
        found[own[0]] = _timed(search, lattice[own[0]])
        longer = _moving_s(search, found[own[0]]) / max(_moving_s(search, lattice[own[0]]), 1e-9)
        for n in own[1:]:
            quick_s = _moving_s(search, lattice[n])
            found[n] = search.taking(lattice[n], lattice[n].crane_s + (longer - 1.0) * quick_s)
    while True:
        fastest = [found[n] for n in sorted(able, key=lambda n: found[n].crane_s)[:_FASTEST]]
        untimed = {id(one) for one in (*fastest, *to_plan(found, front_of(found), members)) if not one.lifts}
        closely = [n for n in able if id(found[n]) in untimed]
        if not closely:
            break
        for n in closely:
            found[n] = _timed(search, found[n])
    for own in _by_machine(found, able)[:_MACHINES]:
        found[own[0]] = better_placed(search, found[own[0]])
    return found


def better_placed(search: Search, one: Tried) -> Tried:
    """Return a set-up of one crane, timed, on the best of a few of its places, or where it stands."""
    return _fastest([one, *_elsewhere(search, one, _PLACES)], search, 1)[0]


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
        chosen = _fastest(elsewhere, search, most - len(found), best)
        found += [replace(one, place=number) for number, one in enumerate(chosen, start=2)]
    return [one for one in found if not one.over][:most]


def _timed(search: Search, one: Tried) -> Tried:
    assert one.crane is not None
    return one if one.lifts == LIFTS else search.from_place(one, np.array(one.crane.base_m[:2]))


def _moving_s(search: Search, one: Tried) -> float:
    return one.crane_s - float(search.work.standing_s.sum())


def _by_machine(found: Sequence[Tried], able: Sequence[int]) -> list[list[int]]:
    """Return those of each machine, the fastest first."""
    machines: dict[str, list[int]] = {}
    for n in sorted(able, key=lambda n: found[n].crane_s):
        machines.setdefault(found[n].machine, []).append(n)
    return list(machines.values())


def _elsewhere(search: Search, one: Tried, most: int) -> list[Tried]:
    """Return a set-up on at most so many of its other places that are as fast by the quick estimate, roughly timed.

    A few lifts are timed, and from where it stands too: what they miss there they miss everywhere.
    """
    assert one.crane is not None
    own = search.from_place(one, np.array(one.crane.base_m[:2]), FEW_LIFTS)
    longer = _moving_s(search, _timed(search, one)) / _moving_s(search, own)
    moving_s = one.all_crane_s - float(search.work.standing_s.sum())
    full = one.all_served >= one.served
    if not search.inside(np.array([one.crane.base_m[:2]]))[0]:
        full &= ~search.inside(one.bases_m)
    able = np.flatnonzero(full & (moving_s <= _AS_FAST * moving_s[full].min(initial=np.inf)))
    few = [search.from_place(one, one.bases_m[at], FEW_LIFTS) for at in able[:: max(1, -(-len(able) // most))]]
    return [search.taking(each, each.crane_s + (longer - 1.0) * _moving_s(search, each)) for each in few]


def _fastest(places: Sequence[Tried], search: Search, most: int, best: Tried | None = None) -> list[Tried]:
    """Return so many of the fastest of places, not next to the best one or to each other, all of them timed."""
    left = list(places)
    while True:
        found: list[Tried] = []
        left.sort(key=lambda one: (-one.served, one.crane_s))
        for one in left:
            taken = found if best is None else (best, *found)
            if len(found) < most and all(_gap_m(one, other) >= _APART_M for other in taken):
                found.append(one)
        if all(one.lifts == LIFTS for one in found):
            return found
        left = [_timed(search, one) if one in found and one.lifts < LIFTS else one for one in left]


def _gap_m(one: Tried, other: Tried) -> float:
    assert one.crane is not None
    assert other.crane is not None
    return float(np.hypot(*np.subtract(one.crane.base_m[:2], other.crane.base_m[:2])))
