"""The whole search of a site, with a closer look at the fastest, and which set-ups are planned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.crane.machine import Machine
from bimvox.errors import InputError
from bimvox.extras import require
from bimvox.library.set_up_search.moving import in_set_ups
from bimvox.library.set_up_search.pairs import may_pair, pairs
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, OtherYard, Tried, front_of, proven_front, to_plan
from bimvox.library.set_up_search.timed import FEW_LIFTS, LIFTS
from bimvox.library.set_up_search.yards import may_move, other_yards
from bimvox.progress import Progress
from bimvox.site.catalogue import machine_called, own_machines
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.machine import cranes_of

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

    ``lattice``: machines on their places, as ``Search.tried`` yields them; ``members``: how many set-ups are planned.
    """
    most = max((one.served for one in lattice if one.crane is not None), default=0)
    result = list(lattice)
    able = [n for n, one in enumerate(result) if one.served == most and one.crane is not None]
    for own in _by_machine(lattice, able):
        result[own[0]] = _timed(search, lattice[own[0]])
        longer = _moving_s(search, result[own[0]]) / max(_moving_s(search, lattice[own[0]]), 1e-9)
        for n in own[1:]:
            quick_s = _moving_s(search, lattice[n])
            result[n] = search.taking(lattice[n], lattice[n].crane_s + (longer - 1.0) * quick_s)
    while True:
        fastest = [result[n] for n in sorted(able, key=lambda n: result[n].crane_s)[:_FASTEST]]
        untimed = {id(one) for one in (*fastest, *to_plan(result, front_of(result), members)) if not one.lifts}
        closely = [n for n in able if id(result[n]) in untimed]
        if not closely:
            break
        for n in closely:
            result[n] = _timed(search, result[n])
    for own in _by_machine(result, able)[:_MACHINES]:
        result[own[0]] = better_placed(search, result[own[0]])
    return result


def better_placed(search: Search, one: Tried) -> Tried:
    """Return a set-up of one crane, timed, on the best of a few of its places, or where it stands."""
    return _fastest([one, *_elsewhere(search, one, _PLACES)], search, 1)[0]


def refined(search: Search, best: Tried, effort: Effort) -> list[Tried]:
    """Return set-ups to plan next to the cheapest one, about half as many as were planned before.

    ``best``: the cheapest set-up by its plan, of one crane; ``effort``: how many were planned.
    """
    most = effort.members // 2
    if effort.members < 4 or best.crane is None or best.moving is not None:
        return []
    found = []
    yards = search.config.areas.yard or ()
    load_kg = search.config.rules.truckload_kg if best.yard is None else best.yard.truckload_kg
    polygon = best.yard.polygon if best.yard is not None else yards[0] if len(yards) == 1 else None
    if polygon is not None and load_kg > 0.0:
        number = None if best.yard is None else best.yard.number
        found.append(replace(best, yard=OtherYard(number, polygon, _LOAD * load_kg)))
    if machine_called(best.machine) is not None or best.machine in {one.name for one in own_machines(search.config)}:
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
        result: list[Tried] = []
        left.sort(key=lambda one: (-one.served, one.crane_s))
        for one in left:
            taken = result if best is None else (best, *result)
            if len(result) < most and all(_gap_m(one, other) >= _APART_M for other in taken):
                result.append(one)
        if all(one.lifts == LIFTS for one in result):
            return result
        left = [_timed(search, one) if one in result and one.lifts < LIFTS else one for one in left]


def _gap_m(one: Tried, other: Tried) -> float:
    assert one.crane is not None
    assert other.crane is not None
    return float(np.hypot(*np.subtract(one.crane.base_m[:2], other.crane.base_m[:2])))


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """What a search found.

    Attributes:
        search: The parts.
        lattice: Every machine with each jib and reeving on its best places.
        found: The same, then those with other yards and those of two cranes.
        front: Those that no other beats, by their estimates.
        chosen: Those to be planned.
        trials: How many other yards were tried.
    """

    search: Search
    lattice: tuple[Tried, ...]
    found: tuple[Tried, ...]
    front: tuple[Tried, ...]
    chosen: tuple[Tried, ...]
    trials: int

    @property
    def rigs(self) -> tuple[Tried, ...]:
        """Every machine with each jib and reeving, once."""
        return tuple(one for one in self.lattice if not one.is_least_used)

    @property
    def tried(self) -> int:
        """Number of set-ups that were estimated."""
        return sum(len(one.bases_m) for one in self.rigs)

    def planned(
        self, documents_of: Callable[[Sequence[Tried]], list[dict[str, Any]]], effort: Effort
    ) -> tuple[list[Tried], list[dict[str, Any]]]:
        """Return what is planned, and the documents of that: the chosen ones, :meth:`instead`, :meth:`around_cheapest`.

        Args:
            documents_of: Returns the documents of set-ups, as for ``proven_front``; called with more each time.
            effort: How much is tried.
        """
        tried = list(self.chosen)
        planned = documents_of(tried)
        for more_of in (self.instead, partial(self.around_cheapest, tried, effort=effort)):
            if more := more_of(planned):
                tried += more
                planned = documents_of(tried)
        return tried, planned

    def instead(self, planned: Sequence[dict[str, Any]]) -> list[Tried]:
        """Return as many others to plan as chosen ones have no plan, or refuse more parts than another one.

        ``planned``: documents of the chosen set-ups, in their order, as for ``proven_front``.
        """
        fewest = min((one["refused"] for one in planned if one["hours"] is not None), default=0)
        lost = sum(one["hours"] is None or one["refused"] > fewest for one in planned)
        left = [one for one in self.found if one not in self.chosen]
        return to_plan(left, front_of(left), lost)

    def around_cheapest(self, tried: Sequence[Tried], planned: Sequence[dict[str, Any]], effort: Effort) -> list[Tried]:
        """Return more to plan around the cheapest planned set-up of one crane; see ``refined``.

        Args:
            tried: What was planned.
            planned: Documents of that, as for ``proven_front``.
            effort: How much is tried.
        """
        front = proven_front(planned, self.search.config.costs.budget)
        cheapest = next((one for one in front if one["second"] is None), None)
        return [] if cheapest is None else refined(self.search, tried[planned.index(cheapest)], effort)


def search_set_ups(
    site: PlacedSite, name: str, machines: Sequence[Machine], effort: Effort, folder: Path | None, progress: Progress
) -> Searched:
    """Return what to plan for a site of one crane, which may move.

    Args:
        site: The site.
        name: What messages call it.
        machines: The machines.
        effort: How much is tried.
        folder: Where the journal of other yards is kept, so that a killed call is continued; None: in memory.
        progress: Receives the stages.

    Raises:
        InputError: If the site has several cranes or none, no machine serves any part, or all cost more than the
            budget, or the site file states of the given crane what does not hold for another machine.
        MissingPackageError: If other yards are to be tried, and Optuna is not installed.
    """
    count = 1 if site.config.moves else len(site.config.cranes)
    if count != 1 or site.config.cranes[0].kind == "none":
        raise InputError(
            f"{name}: the place of one crane is looked for, but the site has {count if count > 1 else 0}",
            hint="give the site file one crane",
        )
    _refuse_support_of_any(site.config, name, machines)
    may_try_yards = effort.yards > 0 and may_move(site.searched)
    if may_try_yards:
        require("optimise", "trying other yards")
    search = Search(site, progress)
    progress.stage("try", len(machines))
    lattice: list[Tried] = []
    for machine in machines:
        lattice += search.tried([machine])
        progress.advance()
    lattice = closer(search, lattice, effort.members)
    progress.finish()
    found, trials = list(lattice), 0
    if may_try_yards:
        most = max((one.served for one in lattice), default=0)
        able = [machine for machine in machines if search.carries(machine) >= most]
        moved, trials = other_yards(site, search, able, folder, effort, progress)
        found += [better_placed(search, one) if one.served >= most else one for one in moved]
    if effort.cranes > 1 and may_pair(site.searched):
        progress.stage("pairs")
        found += pairs(search, machines)
        progress.finish()
    progress.stage("set-ups")
    found += in_set_ups(site, search, machines, found)
    progress.finish()
    front = front_of(found)
    chosen = to_plan(found, front, effort.members)
    if not chosen and any(one.served for one in found):
        cheapest = min(one.cost for one in found if one.served)
        raise InputError(
            f"{name}: no set-up is within the budget; the cheapest costs {cheapest:,.0f}",
            hint="raise [costs] budget",
        )
    if not chosen:
        raise InputError(
            f"{name}: no machine serves any part", hint="`bimvox cranes SITE` says why; move the yard, or lift less"
        )
    return Searched(search, tuple(lattice), tuple(found), tuple(front), tuple(chosen), trials)


def _refuse_support_of_any(config: SiteConfig, name: str, machines: Sequence[Machine]) -> None:
    """Refuse what the site file states of a crane without its machine, if other machines are tried."""
    given = machine_of_crane(cranes_of(config)[0]).name
    for number, one in enumerate(config.support):
        stated = (one.crane_mass_kg, one.back_moment_knm, one.free_standing_m, one.mat_m2)
        if one.machine is None and any(value is not None for value in stated) and {m.name for m in machines} != {given}:
            raise InputError(
                f"{name}: support[{number}] states mass or foundation of a crane, and would count for every machine",
                hint=f'give it machine = "{given}", or another machine for which it holds',
            )
