"""The figures of a plan: how its paths were found, their lengths, and the work of the crane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.crane.sectors import utilisations
from bimvox.records.dates import hire_days
from bimvox.records.lift import Lift, LiftPlan, Method, Status
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory, by_each_crane
from bimvox.records.steps import Steps
from bimvox.records.unloading import Unloading, unloading_of
from bimvox.site.config.calendar import CalendarConfig, Cost, CostsConfig, Rates, rates_of
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.lifting import GoverningWind, governing_wind, hung_kg
from bimvox.site.site import Site, SwingRule
from bimvox.site.tandem import part_on


@dataclass(frozen=True, slots=True)
class CraneFigures:
    """The work of one of several cranes.

    Attributes:
        name: Its name.
        lifts: Planned lifts that are its own.
        busy_s: Working time from the start of the clock to the end of the plan, without waits.
        share: Of the plan's time.
    """

    name: str
    lifts: int
    busy_s: float
    share: float


@dataclass(frozen=True, slots=True)
class PlanFigures:
    """Figures of the planned lifts of a plan.

    Attributes:
        lifts: Lifts, infeasible ones too.
        planned: Planned ones.
        methods: How many paths were found by each method, every method named.
        moves: Unit moves of all paths.
        shortest_moves: The fewest possible, of the paths for which they are known.
        compared_moves: Unit moves of these paths.
        crane_s: From the start of the first lift to the end of the last; None without a crane.
        loaded_s: The part of it in which a load moves.
        hook_travel_m: Travel of the hook, empty and loaded, along the samples of the motions.
        critical: Lifts that use ``critical_share`` of the crane's capacity or more.
        critical_share: 0..1.
        highest: The largest share of the capacity that a lift uses; None without a crane, or beyond the chart.
        unloading: The unloading of its deliveries, which the crane does in addition; None without a crane.
        swing: Whether the crane's moves are shaped against the swing of loads; None without a crane.
        cranes: Each crane, if the site has several.
        wind: The smallest wind in which every planned lift is permitted; None without a crane.
        moves_s: How long a crane takes from one set-up to the next, all moves together; 0 of others and of an extract.
        hire_days: For how many days the crane is hired, see ``PlanDates.hire_days``; None without a crane, or of an
            extract.
        cost: What the work costs; None as for ``hire_days``, or if no rates are given.
    """

    lifts: int
    planned: int
    methods: dict[str, int]
    moves: int
    shortest_moves: int
    compared_moves: int
    crane_s: float | None
    loaded_s: float | None
    hook_travel_m: float | None
    critical: int | None
    critical_share: float
    swing: SwingRule | None = None
    cranes: tuple[CraneFigures, ...] = ()
    wind: GoverningWind | None = None
    highest: float | None = None
    unloading: Unloading | None = None
    moves_s: float = 0.0
    hire_days: int | None = None
    cost: Cost | None = None

    @property
    def hook_s(self) -> float | None:
        """Time on the hook: the lifts and the unloading of deliveries; None without a crane."""
        return None if self.crane_s is None else self.crane_s + (self.unloading.seconds if self.unloading else 0.0)

    @property
    def length_ratio(self) -> float | None:
        """Moves divided by the fewest possible, of the paths for which they are known; None if there are none."""
        return self.compared_moves / self.shortest_moves if self.shortest_moves else None

    def share(self, method: str) -> float:
        """Share of the planned lifts whose path a method found; 0 if none is planned."""
        return self.methods[method] / self.planned if self.planned else 0.0


def plan_figures(
    plan: LiftPlan,
    motions: Sequence[LiftMotion],
    calendar: CalendarConfig | None = None,
    steps: Steps | None = None,
    costs: CostsConfig | None = None,
    *,
    critical_share: float | None = None,
) -> PlanFigures:
    """Return the figures of a plan.

    Args:
        plan: The plan.
        motions: Its motions; none without a crane.
        calendar: When work is done, and what it says about unloading; None: nothing.
        steps: Steps and pauses of the whole plan; None if they are not known.
        costs: What cranes, crew and lorries cost; None: not asked for.
        critical_share: Utilisation from which a lift is critical, 0..1; None for the site's own rule.
    """
    share = plan.site.rules.critical_share if critical_share is None else critical_share
    planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
    used = [max(capacity_used(plan.site, one) for one in by_each_crane([motion])) for motion in motions]
    highest, limits, calendar = max(used, default=inf), wind_limits(motions), calendar or CalendarConfig()
    figures = PlanFigures(
        lifts=len(plan.lifts),
        planned=len(planned),
        methods=_methods(planned),
        moves=sum(lift.moves or 0 for lift in planned),
        shortest_moves=sum(lift.shortest_moves or 0 for lift in planned),
        compared_moves=sum(lift.moves or 0 for lift in planned if lift.shortest_moves is not None),
        crane_s=_clock_s(motions) if motions else None,
        loaded_s=sum(motion.loaded.duration_s for motion in motions) if motions else None,
        hook_travel_m=sum(hook_travel_m(plan.site, motion) for motion in by_each_crane(motions)) if motions else None,
        critical=sum(one >= share for one in used) if motions else None,
        critical_share=share,
        swing=plan.site.rules.swing if plan.site.cranes else None,
        cranes=_each(plan.site, motions) if plan.site.has_several_cranes else (),
        wind=governing_wind(plan.site, (plan.site.components[lift.component] for lift in planned), limits),
        highest=highest if isfinite(highest) else None,
        unloading=unloading_of(calendar, plan.site, plan.lifts) if motions else None,
        moves_s=0.0 if steps is None else steps.moved_ns / 1e9,
        hire_days=None if steps is None else hire_days(calendar, plan.site, plan.lifts, motions, steps),
    )
    return figures if costs is None else replace(figures, cost=_cost(costs, calendar, plan.site, figures))


def _cost(costs: CostsConfig, calendar: CalendarConfig, site: Site, figures: PlanFigures) -> Cost | None:
    """Return what the work of a plan costs; None without hours or days of hire."""
    unloading, hours_s, days = figures.unloading, figures.crane_s, figures.hire_days
    if unloading is None or hours_s is None or days is None:
        return None
    # One that moves is one machine, wherever it stands, and its crew moves it.
    machines = [machine_of_crane(crane) for crane in (site.cranes if site.moving is None else site.cranes[:1])]
    first, *others = (rates_of(costs, calendar, one.name, one.kind, one.load_moment_tm) for one in machines)
    rates = first.with_deliveries(unloading.seconds / 3600.0, costs.lorry * unloading.lorries)
    cost = reduce(Rates.with_another, others, rates).cost((hours_s + figures.moves_s) / 3600.0, days)
    return replace(cost, currency=costs.currency, source=costs.source)


def _methods(planned: Sequence[Lift]) -> dict[str, int]:
    """Return how many paths each method found; planners that the caller brought only if they were asked."""
    found = {method.value: sum(lift.method is method for lift in planned) for method in Method}
    if not any(lift.method is Method.PLANNER or lift.planner_note for lift in planned):
        del found[Method.PLANNER.value]
    return found


def _each(site: Site, motions: Sequence[LiftMotion]) -> tuple[CraneFigures, ...]:
    whole_s = _clock_s(motions) if motions else 0.0
    found = []
    for number, crane in enumerate(site.cranes):
        own = [motion for motion in by_each_crane(motions) if motion.crane == number]
        phases = (phase for motion in own for phase in motion.phases if phase.name is not PhaseName.WAIT)
        busy_s = sum((phase.end_ns - phase.start_ns) / 1e9 for phase in phases)
        found.append(CraneFigures(crane.name, len(own), busy_s, busy_s / whole_s if whole_s else 0.0))
    return tuple(found)


def _clock_s(motions: Sequence[LiftMotion]) -> float:
    return (max(motion.end_ns for motion in motions) - min(motion.start_ns for motion in motions)) / 1e9


def hook_travel_m(site: Site, motion: LiftMotion) -> float:
    """Return the travel of the hook in a lift, along the chords between its samples."""
    _, axes = motion.samples()
    points_m = hook_of(site.cranes[motion.crane], *axes.T)
    return float(np.linalg.norm(np.diff(points_m, axis=0), axis=1).sum())


def capacity_used(site: Site, motion: LiftMotion) -> float:
    """Return the highest utilisation of the crane in a lift, rigging included; infinite beyond its capacity.

    Of a lift by two cranes it is that of the one whose motion this is.
    """
    crane = site.cranes[motion.crane]
    mass_kg = hung_kg(crane, part_on(site, motion.component, motion.crane))
    held = (motion.raising, motion.loaded)
    slew_rad, radius_m = (np.concatenate([getattr(part, key) for part in held]) for key in ("slew_rad", "radius_m"))
    return float(utilisations(crane, slew_rad, radius_m, mass_kg).max())


def wind_limits(motions: Sequence[LiftMotion]) -> dict[int, float]:
    """Return the wind up to which each lift is permitted, m/s, by component; of those whose motion states it."""
    return {one.component: one.least_wind.speed_m_s for one in motions if one.least_wind is not None}


def driven_rates(motions: Sequence[LiftMotion]) -> dict[str, float] | None:
    """Return the highest rates at which a crane is driven, from one sample to the next; None without motions.

    Returns ``slewing_rad_s``, and of the hook ``radius_m_s``, ``loaded_m_s`` and ``empty_m_s`` upwards or downwards,
    with and without a load.
    """
    if not motions:
        return None
    loaded = [part for motion in motions for part in (motion.raising, motion.loaded)]
    empty = [part for motion in motions for part in (motion.approach, motion.departure) if part is not None]
    with_load, without = (np.max([np.zeros(3), *map(_rates, parts)], axis=0) for parts in (loaded, empty))
    slewing, radius, _ = np.maximum(with_load, without).tolist()
    return {
        "slewing_rad_s": slewing,
        "radius_m_s": radius,
        "loaded_m_s": float(with_load[2]),
        "empty_m_s": float(without[2]),
    }


def _rates(part: Trajectory) -> NDArray[np.float64]:
    """Return (3,) the highest rate of each axis of a trajectory."""
    lasts_s = np.diff(part.time_ns)[:, None] / 1e9
    highest: NDArray[np.float64] = (np.abs(np.diff(part.axes, axis=0)) / lasts_s).max(axis=0, initial=0.0)
    return highest
