"""The crane for a site without one: the cheapest machine that serves it, at a good place, and why smaller ones do not.

Every machine is tried with each jib and reeving at many places of its mast; see :mod:`bimvox.site.set_ups`. The order
of the parts is not known yet: they count from the lowest up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import Element
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.machine import Machine
from bimvox.crane.reach import MARGIN_M, built_heights, distances_m, points_blocked, standing
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.catalogue import machine_called
from bimvox.site.config.calendar import Rates, rates_of
from bimvox.site.config.site_config import Polygon, SiteConfig
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times, standing_s
from bimvox.site.default_rules import TRUCK_KG
from bimvox.site.demand import Demand, Rigs, Unserved, with_share
from bimvox.site.parts import is_erected
from bimvox.site.set_ups import LiftWork, MastPlaces, carried, set_ups
from bimvox.site.trial import closed_over, yard_points

ROOMY = 0.5
"""Share of the yard in which a part should be within reach, with the whole chart if that may be used: then it finds a
place there, whatever lies next to it."""
_FULL = 0.85
"""How full lorries are on average, for an estimate (professional judgement)."""
_UNLOADING_S = 90.0
"""The crane's way from a lorry to the yard and back, for an estimate."""
_AS_GOOD = 0.005
"""Share of the crane time by which a place may be slower if the crane is used less there."""
_NEARLY = 0.05
"""A cheaper machine that, from a coarse grid of places, misses no larger share of the parts may serve them all from
another place nearby."""
_MOST_BASES = 200
_MOST_CHECKED = 50
"""Places at which a jib is checked against the building."""
_MOST_PARTS = 100
_MOST_YARD = 16
"""Parts, and places of the yard, that an estimate looks at."""


@dataclass(frozen=True, slots=True)
class CraneFit:
    """How a machine serves a site, with its best jib and reeving on its best base.

    Attributes:
        machine: Name of the machine.
        kind: Its kind.
        load_moment_tm: Its size.
        jib_m: Length of its jib.
        crane: The crane on that base; None if the mast has no place.
        parts: How many parts there are.
        unserved: The parts that it cannot set, the largest load moment first.
        yard: Why it does not pick the heaviest part in half of the yard; empty if it does.
        utilisation: Highest share of its capacity, over the parts that it sets; 0 if there is none.
        radius_m: Largest radius, over the parts that it sets.
        hours: Estimated crane hours.
        moving_hours: Those of them in which it moves.
        cost: Estimated cost by the rates of the site file.
        is_inside: Whether the mast stands within the outline of the building.
        set_ups: In how many set-ups it stands, one after the other.
    """

    machine: str
    kind: str
    load_moment_tm: float
    jib_m: float
    crane: TowerCrane | None
    parts: int
    unserved: tuple[Unserved, ...]
    yard: str
    utilisation: float
    radius_m: float
    hours: float
    moving_hours: float
    cost: float
    is_inside: bool = False
    set_ups: int = 1

    @property
    def serves(self) -> bool:
        """Whether it sets every part."""
        return self.crane is not None and not self.unserved

    @property
    def reason(self) -> str:
        """Why it does not serve the site; empty if it does."""
        if self.crane is None:
            return "it has no place around the building, clear of the yard and within the plot"
        if self.unserved:
            more = len(self.unserved) - 1
            return f"{self.unserved[0]}" + (f", and {more} more" if more else "")
        return self.yard


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    """A machine on a place.

    Attributes:
        crane: The crane.
        rank: The least is the best: how many parts it carries from some place of the yard to theirs, and how many of
            these it picks in half of the yard, both negative; then the cost.
    """

    crane: TowerCrane
    rank: tuple[float, float, float]


class Wanted:
    """What a crane is chosen for.

    Args:
        config: The site file: areas, zones, rules and rates.
        components: The parts to be lifted, in the site frame.
        building: Outline of the building on plan.
        top_m: Height that the load's top must reach.
        rigs: The gear of the parts; None: they hang on the machine's usual rigging.
        order: The parts in their erection sequence; None: from the lowest up.

    Attributes:
        config: The site file.
        demand: The parts, as a crane has to serve them.
        built: Heights of the finished building.
        standing_s: How long the crane stands for all parts.
        load_kg: Their mass.
        unloading_s: About how long the crane unloads them.
        yard_m: (P, 2) places of the yard.
        closed: (N,) whether a zone forbids the hook or the load at the part's place, or no gear serves it.
        places: Where a mast may stand.
        order: (N,) the parts in their sequence.
        work: The parts in that order.
        sample: Some of them, for an estimate.
    """

    def __init__(
        self,
        config: SiteConfig,
        components: Sequence[Element],
        building: BaseGeometry,
        top_m: float,
        rigs: Rigs | None,
        order: Sequence[int] | None = None,
    ) -> None:
        bounds_m = np.array([element.mesh.bounds_m for element in components])
        rules = config.rules_in_force
        stands_s = np.array([standing_s(rules, element, upended=is_erected(element)) for element in components])
        self.demand = Demand(components, top_m, rigs, config.rules.usual_utilisation)
        self.built = built_heights(bounds_m)
        self.standing_s = float(stands_s.sum())
        self.load_kg = float(sum(element.mass_kg for element in components))
        times = [crew_times(rules, element) for element in components]
        self.unloading_s = sum(one.hook_on_s + TRIAL_LIFT_S + one.hook_off_s + _UNLOADING_S for one in times)
        upwards = np.lexsort((bounds_m[:, 1, 2], np.round(bounds_m[:, 0, 2], 1)))
        self.order = upwards if order is None else np.array(order, np.int64)
        self._building, self.closed = building, closed_over(config.zone, self.demand.places_m) != ""
        self.closed[list(self.demand.without_gear)] = True
        self.work = LiftWork(
            places_m=self.demand.places_m[self.order],
            tops_m=bounds_m[self.order, 1, 2],
            heights_m=np.ptp(bounds_m[self.order, :, 2], axis=1),
            masses_kg=self.demand.masses_kg[self.order],
            standing_s=stands_s[self.order],
            yard_m=np.zeros((0, 2)),
            closed=self.closed[self.order],
            rooms=np.full((len(components), 2), None),
        )
        self._set(config)

    def _set(self, config: SiteConfig) -> None:
        self.config = config
        self.yard_m = yard_points(config)
        self.places = MastPlaces(config, self._building)
        self.work = replace(self.work, yard_m=self.yard_m)
        self.sample = self.work.sample(_MOST_PARTS, _MOST_YARD)

    def with_yard(self, yard: tuple[Polygon, ...], rooms: NDArray[np.object_] | None = None) -> Wanted:
        """Return the same with another yard, and where the hook is over each part in it, see :class:`LiftWork`."""
        other = copy(self)
        other.work = self.work if rooms is None else replace(self.work, rooms=rooms)
        areas = self.config.areas.model_copy(update={"yard": yard})
        other._set(self.config.model_copy(update={"areas": areas}))
        return other

    def with_whole_chart(self) -> Wanted | None:
        """Return the same with the whole load chart; None if the site file limits its share."""
        if self.config.rules.highest_utilisation is not None:
            return None
        other = copy(self)
        other.demand = self.demand.permitting(1.0)
        return other

    def to_the_utmost(self, crane: TowerCrane) -> TowerCrane:
        """Return a crane as used with as much of its chart as no lift may exceed."""
        return with_share(crane, self.config.rules.utmost_utilisation / self.demand.most_used)

    def why_not(self, part: int, crane: TowerCrane, margin_m: float = 0.0, sample: LiftWork | None = None) -> Unserved:
        """Return why a crane as used, on its base, does not serve a part; see :meth:`Demand.why_not`.

        ``sample``: all parts with fewer places of the yard, if that is what it was tried with.
        """
        work, demand = sample or self.work, self.demand
        if part in demand.without_gear:
            return demand.said(part, f"has no gear for it: {demand.without_gear[part]}")
        if self.closed[part]:
            return demand.said(part, "may not hang over a zone, where its place is")
        if all(demand.picks(part, crane, at_m, margin_m).any() for at_m in (demand.places_m[[part]], work.yard_m)):
            rooms, mast = work.rooms[self.order == part], shapely.Point(crane.base_m[:2])
            nearest_m = float(np.nanmin(shapely.distance(rooms, mast)))
            return demand.unserved(part, crane, nearest_m + margin_m, " where it lies within the yard")
        return demand.why_not(part, crane, work.yard_m, margin_m)

    def rates(self, machine: Machine, truckload_kg: float | None = None) -> Rates:
        """Return what a machine costs, with an estimate of the deliveries.

        ``truckload_kg``: payload of a lorry; None: the site file's.
        """
        costs, calendar = self.config.costs, self.config.calendar
        rates = rates_of(costs, calendar, machine.name, machine.kind, machine.load_moment_tm)
        truckload_kg = self.config.rules.truckload_kg if truckload_kg is None else truckload_kg
        lorries = ceil(self.load_kg / (_FULL * (truckload_kg or TRUCK_KG)))
        stated_s = calendar.unloading_s
        unloading_s = self.unloading_s if stated_s is None else stated_s * lorries
        return rates.with_deliveries(unloading_s / 3600.0, costs.lorry * lorries)

    def estimated(
        self, crane: TowerCrane, bases_m: NDArray[np.float64], margin_m: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return for (B, 2) bases the estimated crane time of a crane as used, and its highest share of a radius."""
        found = set_ups(crane, bases_m, self.sample, self.demand.height_m(crane), margin_m)
        moving_s = found.crane_s - (found.served * self.sample.standing_s).sum(axis=1)
        share = len(self.work.masses_kg) / len(self.sample.masses_kg)
        return moving_s * share + self.standing_s, found.used


def best_set_up(machines: Sequence[Machine], wanted: Wanted) -> Chosen | None:
    """Return the machine, with its jib, reeving and place, that serves most parts at the least cost; deterministic.

    First as many parts as possible, then as many of them as possible within reach in half of the yard, then the least
    cost; of the same, the machine, jib and reeving that come first.

    Returns:
        None if no mast has a place.
    """
    tried = []
    for machine in machines:
        least = wanted.rates(machine).total(wanted.standing_s / 3600.0)
        for usual in machine.cranes:
            crane = wanted.demand.as_used(usual)
            hook_m = wanted.demand.height_m(crane)
            crane = standing(crane, hook_m)
            bases_m = wanted.places.bases_m(crane, _MOST_BASES)
            if not len(bases_m):
                continue
            most, bases_m = _serving_most(crane, bases_m, wanted)
            tried.append(((*most, least), machine, usual, crane, bases_m))
    tried.sort(key=lambda one: one[0])
    best: Chosen | None = None
    for (served, roomy, least), machine, usual, crane, bases_m in tried:
        if best is not None and (served, roomy, least) >= best.rank:
            missing = max(served - best.rank[0], roomy - best.rank[1])
            if least >= best.rank[2] or missing > _NEARLY * len(wanted.work.masses_kg):
                continue
        found = _placed(machine, usual, crane, bases_m, wanted)
        if best is None or found.rank < best.rank:
            best = found
    return best


def _parts(crane: TowerCrane, bases_m: NDArray[np.float64], wanted: Wanted) -> list[tuple[int, int]]:
    """Return for each base how many parts a crane serves, and picks in half of the yard; both negative."""
    work = replace(wanted.work, yard_m=wanted.sample.yard_m)
    able, share = carried(crane, bases_m, work, wanted.demand.height_m(crane), MARGIN_M)
    _, at_most = carried(wanted.to_the_utmost(crane), bases_m, work, wanted.demand.height_m(crane), MARGIN_M)
    served, roomy = (able & (share > 0.0)).sum(axis=1), (able & (at_most >= ROOMY)).sum(axis=1)
    return list(zip((-served).tolist(), (-roomy).tolist(), strict=True))


def _serving_most(
    crane: TowerCrane, bases_m: NDArray[np.float64], wanted: Wanted
) -> tuple[tuple[int, int], NDArray[np.float64]]:
    """Return the most that a crane serves from (B, 2) bases, as :func:`_parts` counts it, and the bases that do.

    Those inside the outline of the building only if none outside does.
    """
    parts = _parts(crane, bases_m, wanted)
    most = min(parts)
    able = bases_m[np.array([one == most for one in parts])]
    outside = able[~wanted.places.inside(able)]
    return most, outside if len(outside) else able


def _placed(
    machine: Machine, usual: TowerCrane, crane: TowerCrane, bases_m: NDArray[np.float64], wanted: Wanted
) -> Chosen:
    """Return a machine on the best of (B, 2) bases, or on a better one next to it."""
    first = _best_base(crane, bases_m, wanted)
    most, near_m = _serving_most(crane, wanted.places.near_m(crane, first, _MOST_BASES), wanted)
    base_m = _best_base(crane, near_m, wanted)
    crane_s = float(wanted.estimated(crane, base_m[None], MARGIN_M)[0][0])
    placed = replace(standing(usual, wanted.demand.height_m(crane)), base_m=(*base_m.tolist(), 0.0))
    return Chosen(placed, (*most, round(wanted.rates(machine).total(crane_s / 3600.0), 2)))


def _best_base(crane: TowerCrane, bases_m: NDArray[np.float64], wanted: Wanted) -> NDArray[np.float64]:
    """Return the best of (B, 2) bases.

    Of those with nearly the least crane time the one with the lowest utilisation, nearest to the parts; of a luffing
    jib, the one where the finished building blocks it at the fewest points.
    """
    crane_s, used = wanted.estimated(crane, bases_m, MARGIN_M)
    is_slow = crane_s > crane_s.min() * (1.0 + _AS_GOOD)
    apart_m = distances_m(bases_m, wanted.sample.places_m).mean(axis=1)
    ascending = bases_m[
        np.lexsort((np.round(apart_m, 6), np.round(used, 6), np.where(is_slow, np.round(crane_s), 0.0)))
    ]
    best: NDArray[np.float64] = ascending[0]
    if crane.luffing is None:
        return best
    points_m = np.concatenate([wanted.demand.places_m, wanted.sample.yard_m])
    fewest = len(points_m) + 1
    for base_m in ascending[:_MOST_CHECKED]:
        placed = replace(crane, base_m=(*base_m.tolist(), 0.0))
        blocked = points_blocked(placed, crane.luffing, points_m, wanted.built)
        if blocked < fewest:
            best, fewest = base_m, blocked
        if blocked == 0:
            break
    return best


def compare_cranes(wanted: Wanted, machines: Sequence[Machine]) -> Iterator[CraneFit]:
    """Yield how each of the machines serves a site, on its best base."""
    for machine in machines:
        found = best_set_up([machine], wanted)
        yield _fit(machine, None if found is None else found.crane, wanted)


def fit_here(wanted: Wanted, crane: TowerCrane) -> CraneFit:
    """Return how a crane serves a site from where it stands."""
    return _fit(machine_of_crane(crane), crane, wanted)


def fit_in_set_ups(wanted: Wanted, cranes: Sequence[TowerCrane], which: NDArray[np.int64], hours: float) -> CraneFit:
    """Return how a crane serves a site from several set-ups.

    Args:
        wanted: What it is wanted for.
        cranes: The crane in each set-up.
        which: (N,) the set-up in which it sets each part; -1 if in none.
        hours: Estimated time of all lifts and moves.
    """
    machine, demand = machine_of_crane(cranes[0]), wanted.demand
    bases_m = np.array([crane.base_m[:2] for crane in cranes])
    apart_m = distances_m(bases_m, demand.places_m)
    own = np.flatnonzero(which >= 0)
    radii_m = apart_m[which[own], own]
    capacities_kg = [float(capacity_kg(cranes[which[n]].chart, radii_m[i : i + 1])[0]) for i, n in enumerate(own)]
    hung_kg = [demand.masses_kg[n] + demand.as_used(cranes[which[n]]).tackle_kg for n in own]
    why = f"carries it in none of {len(cranes)} set-ups from the yard to its place"
    unserved = [demand.said(int(n), why) for n in np.flatnonzero(which < 0)]
    return CraneFit(
        machine.name, machine.kind, machine.load_moment_tm, cranes[0].jib_own_m, cranes[0], len(which), tuple(unserved),
        "",
        utilisation=max((kg / max(most, 1e-9) for kg, most in zip(hung_kg, capacities_kg, strict=True)), default=0.0),
        radius_m=float(radii_m.max(initial=0.0)),
        hours=hours,
        moving_hours=max(0.0, hours - wanted.standing_s / 3600.0),
        cost=wanted.rates(machine).total(hours),
        set_ups=len(cranes),
    )  # fmt: skip


def machine_of_crane(crane: TowerCrane) -> Machine:
    """Return the machine of the catalogue that a crane is; otherwise one of its own with that jib alone."""
    found = machine_called(crane.machine or crane.name)
    return found or Machine(crane.machine or crane.name, crane.kind, "", (crane.jib_own_m,), (crane,))


def _fit(machine: Machine, usual: TowerCrane | None, wanted: Wanted) -> CraneFit:
    """Return how a machine serves the parts from where it stands."""
    who = (machine.name, machine.kind, machine.load_moment_tm)
    demand = wanted.demand
    if usual is None:
        return CraneFit(*who, max(machine.jibs_m), None, len(demand.masses_kg), (), "", 0.0, 0.0, 0.0, 0.0, 0.0)
    crane, base_m = demand.as_used(usual), np.array([usual.base_m[:2]])
    able, share = carried(crane, base_m, wanted.work, demand.height_m(crane), 0.0)
    utmost = wanted.to_the_utmost(crane)
    _, at_most = carried(utmost, base_m, wanted.work, demand.height_m(crane), 0.0)
    done, roomy = np.zeros((2, len(demand.masses_kg)), np.bool_)
    done[wanted.order], roomy[wanted.order] = able[0] & (share[0] > 0.0), at_most[0] >= ROOMY
    radii_m = distances_m(base_m, demand.places_m)[0]
    used = (demand.masses_kg + crane.tackle_kg) / np.maximum(capacity_kg(usual.chart, radii_m), 1e-9)
    by_moment = np.argsort(-demand.masses_kg * np.maximum(radii_m, 1.0), kind="stable")
    unserved = [wanted.why_not(n, crane) for n in by_moment[~done[by_moment]].tolist()]
    highest, furthest = (float(values[done].max(initial=0.0)) for values in (used, radii_m))
    heaviest = int(np.argmax(demand.masses_kg))
    yard = ""
    if done[heaviest] and not roomy[heaviest]:
        beyond_m = wanted.yard_m[~demand.picks(heaviest, utmost, wanted.yard_m)]
        yard = str(demand.why_not(heaviest, utmost, beyond_m)).replace(" in the yard;", " in half of the yard;")
    crane_s = float(wanted.estimated(crane, base_m, 0.0)[0][0])
    return CraneFit(
        *who, usual.jib_own_m, usual, len(radii_m), tuple(unserved), yard, highest, furthest,
        hours=crane_s / 3600.0,
        moving_hours=(crane_s - wanted.standing_s) / 3600.0,
        cost=wanted.rates(machine).total(crane_s / 3600.0),
        is_inside=bool(wanted.places.inside(base_m)[0]),
    )  # fmt: skip
