"""Every machine of the catalogue, with each jib and reeving, at every place of a lattice where its mast can stand."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.machine import Machine
from bimvox.crane.reach import MARGIN_M, distances_m, standing
from bimvox.crane.tower_crane import TowerCrane
from bimvox.library.set_up_search.least_moving import Loose, least_of_all_s, lowered
from bimvox.library.set_up_search.placed import PlacedSite, rooms_of
from bimvox.library.set_up_search.set_up import OtherYard, Rig, Tried
from bimvox.library.set_up_search.timed import LIFTS, Ways, timed_moving_s, ways_on
from bimvox.library.site import built_site
from bimvox.planning.order.faster_order import FasterOrder, travel_of
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import prepare
from bimvox.planning.preparation import Preparation
from bimvox.planning.stacks import is_stacked
from bimvox.progress import Progress
from bimvox.records.work_time import WorkTime
from bimvox.site.config.calendar import CalendarConfig, Rates
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.config.site_config import Polygon, SiteConfig
from bimvox.site.crane_guess import Wanted, best_set_up, machine_of_crane
from bimvox.site.crew_times import crew_times
from bimvox.site.demand import rigs_of
from bimvox.site.machine import cranes_of
from bimvox.site.means import Means
from bimvox.site.set_ups import LiftWork, MastPlaces, SetUps, carried, ground_plan, highest_utilisation, set_ups
from bimvox.site.site import HeadingRule, Site, SwingRule, parts_beside
from bimvox.units import NS_PER_S

_CALM = (0.0,) * 12
_MOST_BASES, _MOST_MOVED = 600, 200
"""Places of a mast: with the site file's yard, and with another one."""
_SLACK_VOX = 2.0
"""How much further out of the yard than it is drawn a part may lie for the bound: yard and part are whole cells."""
_MOST_YARD = 24
"""Places of the yard in the estimate."""


class Search:
    """The parts of a site in their erection sequence, ready for every machine.

    ``placed``: the site; it has one crane.

    Attributes:
        config: Its site file.
        work: Its parts.
        crews: The crew's times for each.
    """

    def __init__(self, placed: PlacedSite, progress: Progress) -> None:
        config = at_one_place(placed.searched)
        if placed.searched.moves:
            config = _outside(config, placed)
        site = built_site(config, placed.building, {}, progress).site
        progress.stage("order")
        elements = {part.id: part for part in placed.parts}
        made = prepare(site)
        self._sequence = [site.components[n] for n in made.sequence.order]
        components = [component for component in self._sequence if component.means is Means.CRANE]
        parts = [elements[component.id] for component in components]
        self._stacked = np.array([is_stacked(site, component) for component in components], np.bool_)
        rigs = rigs_of(config, parts) if gear_by_crane(config, 1)[0] is not None else None
        plan = ground_plan(placed.placed.elements)
        self.config, self._placed, self._site, self._components = config, placed.placed, site, components
        wanted = Wanted(config, parts, plan, placed.load_top_m, rigs, range(len(parts)))
        self._wanted = self._with_yard(wanted, config.areas.yard or ())
        self.work = self._wanted.work.sample(len(parts), _MOST_YARD)
        self._waits_h = _waits_h(
            site, made, config.calendar, self._wanted.rates(machine_of_crane(site.cranes[0])).unloading_h
        )
        self._ways: dict[OtherYard | None, Ways] = {}
        self.crews = [crew_times(config.rules_in_force, part) for part in parts]
        progress.finish()

    @cached_property
    def beside(self) -> NDArray[np.bool_]:
        """(N, N) which parts stand next to each other."""
        numbers = [component.index for component in self._components]
        return parts_beside(self._site)[np.ix_(numbers, numbers)]

    def rigs(self, machines: Sequence[Machine]) -> Iterator[Rig]:
        """Yield each machine with each jib and reeving."""
        demand = self._wanted.demand
        for machine in machines:
            for jib_m, usual in zip(machine.jibs_m, machine.cranes, strict=True):
                crane = demand.as_used(usual)
                hook_m = demand.height_m(crane)
                yield Rig(machine, jib_m, standing(usual, hook_m), standing(crane, hook_m), hook_m)

    def tried(self, machines: Sequence[Machine]) -> Iterator[Tried]:
        """Yield each machine with each jib and reeving on its best place: most parts, then least time.

        If another place serves as many parts at a lower utilisation, it follows.
        """
        for rig in self.rigs(machines):
            yield from self._tried(rig)

    def places_m(self, rig: Rig, most: int = _MOST_BASES) -> NDArray[np.float64]:
        """Return about ``most`` (B, 2) places where a rig's mast can stand."""
        return self._wanted.places.bases_m(rig.crane, most)

    def inside(self, bases_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of (B, 2) places are within the outline of the building: only if none outside serves as much."""
        return self._wanted.places.inside(bases_m)

    def served(self, rig: Rig, bases_m: NDArray[np.float64], work: LiftWork | None = None) -> SetUps:
        """Return how a rig serves the parts, or other work, from (B, 2) bases."""
        return set_ups(rig.crane, bases_m, work or self.work, rig.hook_m, MARGIN_M)

    def of(self, crane: TowerCrane) -> tuple[int, float]:
        """Return how many parts a crane serves from where it stands, and the estimated crane time."""
        return self._timed(crane)

    def _timed(self, crane: TowerCrane, lifts: int = LIFTS, yard: OtherYard | None = None) -> tuple[int, float]:
        wanted, work = self._seen(yard)
        used = wanted.demand.as_used(crane)
        able, share = carried(used, np.array([crane.base_m[:2]]), work, wanted.demand.height_m(used), 0.0)
        served = able[0] & (share[0] > 0.0)
        return int(served.sum()), self.timed_s(used, served, lifts, yard)

    def timed_s(
        self, crane: TowerCrane, served: NDArray[np.bool_], lifts: int = LIFTS, yard: OtherYard | None = None
    ) -> float:
        """Return the estimated crane time of a crane as used, on its base, for the parts that it serves.

        It ranks places; see :mod:`bimvox.library.set_up_search.timed`.
        """
        moving_s = timed_moving_s(crane, self._ways_of(yard), served, lifts)
        return float(self.work.standing_s[served].sum()) + moving_s

    def _ways_of(self, yard: OtherYard | None) -> Ways:
        if yard not in self._ways:
            self._ways[yard] = self._ways_with(yard)
        return self._ways[yard]

    def _ways_with(self, yard: OtherYard | None) -> Ways:
        site, config = self._site, self.config
        if yard is not None:
            site = replace(site, rules=replace(site.rules, truckload_kg=yard.truckload_kg))
            config = config.model_copy(update={"areas": config.areas.model_copy(update={"yard": (yard.polygon,)})})
        return ways_on(site, self._sequence, self._seen(yard)[0].work, config, self._placed)

    def from_place(self, one: Tried, base_m: NDArray[np.float64], lifts: int = LIFTS) -> Tried:
        """Return a set-up of one crane on one of its places, (2,), with so many lifts timed with the swing of loads."""
        assert one.crane is not None
        crane = replace(one.crane, base_m=(*base_m.tolist(), one.crane.base_m[2]))
        served, crane_s = self._timed(crane, lifts, one.yard)
        return self.taking(replace(one, crane=crane, served=served, lifts=lifts), crane_s)

    def taking(self, one: Tried, crane_s: float) -> Tried:
        """Return a set-up of one crane with another estimate of its crane time, and the cost by that."""
        assert one.crane is not None
        cost = self.rates(machine_of_crane(one.crane), one.yard).total(crane_s / 3600.0)
        return replace(one, crane_s=crane_s, cost=cost, over=self.over(cost))

    def _seen(self, yard: OtherYard | None) -> tuple[Wanted, LiftWork]:
        """Return the parts with a yard; None: the site file's."""
        if yard is None or yard.number is None:
            return self._wanted, self.work
        wanted = self._with_yard(self._wanted, (yard.polygon,))
        return wanted, wanted.work.sample(len(self.work.masses_kg), _MOST_YARD)

    def _with_yard(self, wanted: Wanted, yard: tuple[Polygon, ...]) -> Wanted:
        return wanted.with_yard(yard, rooms_of(yard, self._components, self._site.frame.voxel_size_m))

    def rates(self, machine: Machine, yard: OtherYard | None = None) -> Rates:
        """Return what a machine costs on this site, with its lorries or those of another truckload, and its waits."""
        rates = self._wanted.rates(machine, None if yard is None else yard.truckload_kg)
        return replace(rates, waits_h=self._waits_h)

    def least_moving_s(self, found: Sequence[Tried]) -> float:
        """Return a time below which no hammerhead of some set-ups moves, each with its yard.

        From every place that serves most parts, whatever the order, the places in the yard and the paths, while lifts
        keep the transit clearance; see :mod:`bimvox.library.set_up_search.least_moving`. Plans that refuse more parts
        may move less. 0 if the site file gives parts their starts, which may be outside of the yard.

        ``found``: machines on their places, as :meth:`tried` and :meth:`with_yard` return them.
        """
        if any(one.start is not None for one in self.config.component):
            return 0.0
        alone = [one for one in found if one.crane is not None and one.second is None]
        most = max((one.served for one in alone), default=0)
        by_yard: dict[OtherYard | None, dict[tuple[str, float, int], Tried]] = {}
        for one in alone:
            if one.served == most and one.crane is not None and one.crane.luffing is None:
                yard = None if one.yard is None or one.yard.number is None else one.yard
                by_yard.setdefault(yard, {}).setdefault((one.machine, one.jib_m, one.falls), one)
        least = [self._least_moving_s(yard, list(some.values()), most) for yard, some in by_yard.items()]
        return min((seconds for seconds in least if seconds > 0.0), default=0.0)

    def _least_moving_s(self, yard: OtherYard | None, found: Sequence[Tried], most: int) -> float:
        rules, cell_m = self.config.rules_in_force, self.config.model.voxel_size_m or 0.0
        (wanted, _), ways = self._seen(yard), self._ways_of(yard)
        stands = [
            (wanted.demand.as_used(one.crane), one.bases_m[one.all_served == most])
            for one in found
            if one.crane is not None
        ]
        stack_m = 0.0 if rules.yard is None else rules.yard.stack_height_m
        turns = rules.heading is HeadingRule.KEPT and all(part.stored_turn is None for part in self._components)
        slack_m = _SLACK_VOX * cell_m

        def fits(points_m: NDArray[np.float64], near_m: float) -> NDArray[np.bool_]:
            return ways.picks.fits(points_m, near_m + slack_m)

        loose = Loose(
            0.5 * cell_m,
            0.5 * cell_m,
            lies_m=cell_m + np.where(self._stacked, stack_m, 0.0),
            raised_m=cell_m,
            clearance_m=0.0 if rules.heading is HeadingRule.WITH_JIB else ways.clearance_m,
            lowered=lowered(self._site, self._components),
            swings=rules.swing is SwingRule.SHAPED,
            turn_s=rules.turn_s if turns else 0.0,
        )
        area = (self.config.areas.yard or ()) if yard is None else (yard.polygon,)
        return least_of_all_s(stands, wanted.work, area, loose, fits)

    def least_cost(self, machines: Sequence[Machine], parts: int, moving: Container[str] = ()) -> float:
        """Return a cost below which no machine serves so many parts alone, wherever the yard is; 0 if none does.

        What standing for them costs: the shortest times count, without waits and wind. ``moving``: machines that serve
        as many from several set-ups.
        """
        standing_h = float(np.sort(self.work.standing_s)[:parts].sum()) / 3600.0
        able = [machine for machine in machines if machine.name in moving or self.carries(machine) >= parts]
        rates = (replace(self.rates(machine), waits_h=0.0, lost=0.0) for machine in able)
        return min((one.total(standing_h) for one in rates), default=0.0)

    def rates_of(self, one: Tried) -> Rates:
        """Return what a set-up costs; of two cranes, both."""
        assert one.crane is not None
        own = self.rates(machine_of_crane(one.crane), one.yard)
        return own if one.second is None else own.with_another(self.rates_of(one.second))

    def over(self, cost: float) -> str:
        """Return why a cost is refused; empty if it is within the budget."""
        costs = self.config.costs
        if costs.budget is None or cost <= costs.budget:
            return ""
        return f"costs {cost:,.0f} {costs.currency}, more than the budget of {costs.budget:,.0f}"

    def _tried(self, rig: Rig) -> list[Tried]:
        bases_m = self.places_m(rig)
        found = self.served(rig, bases_m)
        counts, crane_s = found.served.sum(axis=1), found.crane_s
        if not len(bases_m):
            why = "it has no place clear of all areas and within the plot"
            return [Tried(*rig.names, None, 0, 0.0, bases_m, counts, crane_s, why, 0.0)]
        highest = highest_utilisation(rig.whole_chart, bases_m, self.work, found.served)

        def at(n: int, *, is_least_used: bool = False) -> Tried:
            placed = rig.on(bases_m[n])
            why = self._why_not(placed, found.served[n])
            cost = self.rates(rig.machine).total(float(crane_s[n]) / 3600.0)
            return Tried(
                *rig.names, placed, int(counts[n]), float(crane_s[n]), bases_m, counts, crane_s, why, cost,
                float(highest[n]), self.over(cost), is_least_used,
            )  # fmt: skip

        inside = self.inside(bases_m)
        best = int(np.lexsort((highest, np.round(crane_s), inside, -counts))[0])
        least = int(np.lexsort((crane_s, np.round(highest, 2), inside, -counts))[0])
        spared = round(float(highest[best] - highest[least]), 9) >= 0.01
        return [at(best), *([at(least, is_least_used=True)] if spared else [])]

    def _why_not(self, crane: TowerCrane, served: NDArray[np.bool_]) -> str:
        """Return why a crane on its base does not serve the heaviest part that it does not serve; empty if all."""
        if served.all():
            return ""
        missed = np.flatnonzero(~served)
        first = int(missed[np.argmax(self.work.masses_kg[missed])])
        why = str(self._wanted.why_not(first, self._wanted.demand.as_used(crane), MARGIN_M, self.work))
        return why + (f", and {len(missed) - 1} more" if len(missed) > 1 else "")

    def with_yard(self, machine: Machine, yard: OtherYard, lifts: int = LIFTS) -> Tried | None:
        """Return a machine with the best of its jibs, reevings and places for another yard; None if it has no place.

        So many lifts are timed.
        """
        wanted, work = self._seen(yard)
        chosen = best_set_up([machine], wanted)
        if chosen is None:
            return None
        crane = wanted.demand.as_used(chosen.crane)
        base_m, height_m = np.array([crane.base_m[:2]]), wanted.demand.height_m(crane)
        bases_m = np.concatenate([base_m, wanted.places.bases_m(crane, _MOST_MOVED)])
        found = set_ups(crane, bases_m, work, height_m, MARGIN_M)
        own = found.served[0]
        highest = highest_utilisation(replace(crane, chart=chosen.crane.chart), base_m, work, own[None])
        crane_s = self.timed_s(crane, own, lifts, yard)
        why = "" if own.all() else "serves fewer parts with this yard"
        cost = self.rates(machine, yard).total(crane_s / 3600.0)
        return Tried(
            machine.name, crane.jib_own_m, crane.falls, machine.load_moment_tm, chosen.crane, int(own.sum()), crane_s,
            bases_m, found.served.sum(axis=1), found.crane_s, why, cost, float(highest[0]), self.over(cost), yard=yard,
            lifts=lifts,
        )  # fmt: skip

    def carries(self, machine: Machine) -> int:
        """Return how many parts a machine carries to their places from its best place, wherever the yard is."""
        found = [0]
        for rig in self.rigs([machine]):
            able, _ = carried(rig.crane, self.places_m(rig), self.work, rig.hook_m, MARGIN_M)
            found.append(int(able.sum(axis=1).max(initial=0)))
        return max(found)


def at_one_place(config: SiteConfig) -> SiteConfig:
    """Return a site file whose crane stays in the first of its set-ups, if it moves; itself otherwise."""
    if not config.moves:
        return config
    parts = tuple(one.model_copy(update={"setup": None}) for one in config.component)
    return config.model_copy(update={"crane": config.cranes[0], "component": parts})


def _outside(config: SiteConfig, placed: PlacedSite) -> SiteConfig:
    """Return a site file whose crane stands beside the building, as near as it can to where parts may be later."""
    (crane,) = cranes_of(config)
    bases_m = MastPlaces(config, ground_plan(placed.placed.elements)).bases_m(crane, _MOST_BASES)
    if not len(bases_m):
        return config
    x, y = bases_m[int(np.argmin(distances_m(np.array([crane.base_m[:2]]), bases_m)[0]))].tolist()
    assert config.one_crane is not None
    return config.model_copy(update={"crane": config.one_crane.model_copy(update={"base_m": (x, y)})})


def _waits_h(site: Site, made: Preparation, calendar: CalendarConfig, unloading_h: float) -> float:
    """Return how many working hours the crane stands idle, by the estimate of an order in the calendar without wind.

    It waits for joints and for work of others, and before breaks that the next lift would run into. Other set-ups wait
    about as long: their lifts take as long but for some per cent.
    """
    known = (calendar if calendar.start is not None else calendar.usual).model_copy(update={"weather_days": _CALM})
    if known.begins is None:
        return 0.0
    sequencer, travels = Sequencer(site, made.relations, made.contacts), [travel_of(site, one) for one in site.cranes]
    times = FasterOrder(site, sequencer, made.relations, travels).times(made.places)
    lifts = [i for i in made.sequence.order if times.crane[i] >= 0]
    empty_s = [0.0, *(float(times.empty_s[times.crane[j], i, j]) for i, j in pairwise(lifts))]
    carry_s = times.carry_s[times.crane, np.arange(len(times.crane))]
    stands_s = times.lead_s + times.off_s + 3600.0 * unloading_h / max(1, len(lifts))
    work = WorkTime(known.hours, known.begins)
    took_s = dict(zip(lifts, ((carry_s + stands_s)[lifts] + empty_s).tolist(), strict=True))
    first_ns = end_ns = work.fitting(0, 0)
    carries_ns, crew_ns = dict[int, int](), dict[int, int]()
    for i in made.sequence.order:
        under = times.under[times.first[i] : times.first[i + 1]].tolist()
        ready_ns = max([end_ns, *(carries_ns.get(j, 0) for j in under)])
        if i in took_s:
            lasts_ns = round(NS_PER_S * took_s[i])
            end_ns = work.fitting(ready_ns, lasts_ns) + lasts_ns
            carries_ns[i] = end_ns + round(NS_PER_S * times.hold_s[i])
        elif end_ns > first_ns:  # what comes before the first lift is done when it begins
            crew = int(times.crew[i])
            ends_ns = work.worked(max(ready_ns, crew_ns.get(crew, 0)), round(NS_PER_S * times.work_s[i]))
            crew_ns[crew], carries_ns[i] = ends_ns, ends_ns + round(NS_PER_S * times.hold_s[i])
    idle_s = work.between(first_ns, end_ns) / NS_PER_S - sum(took_s.values())
    return float(max(0.0, idle_s / 3600.0))
