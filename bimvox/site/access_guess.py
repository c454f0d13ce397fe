"""Where lorries stand: lanes along yard and construction area; of a crane that moves, one for each set-up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import Building, Element
from bimvox.crane.reach import MARGIN_M
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.config.site_config import Polygon, SiteConfig
from bimvox.site.crane_guess import Wanted
from bimvox.site.demand import Demand, Rigs, rigs_of
from bimvox.site.machine import cranes_of
from bimvox.site.moving_guess import meanwhile, set_ups_by_choice
from bimvox.site.placement import top_m
from bimvox.site.set_ups import OPEN_ZONES, ground_plan, mast_room_m
from bimvox.site.trial import yard_points
from bimvox.site.yard_guess import accesses_beside

_LORRY_M = 4.0
"""Height of a loaded lorry (Directive 96/53/EC)."""


def proposed_access(config: SiteConfig, building: Building, lifted: Sequence[Element]) -> tuple[Polygon, ...] | None:
    """Return where lorries stand: a lane from which each crane unloads all that it picks in the yard.

    It lies along the yard or the construction area, clear of building, masts and closed zones, within the plot, near
    the yard's places and a mast. If none serves with the usual share of the load chart, more of it is used. A crane
    that moves has a lane for each set-up, along the yard nearest to it.

    Args:
        config: The site file, with areas and cranes.
        building: The building in the site frame.
        lifted: Its parts that are lifted.

    Returns:
        None if there is no such lane, or not for each set-up, or no crane.
    """
    cranes, yards = cranes_of(config), config.areas.yard or ()
    if not cranes or not yards or not lifted:
        return None
    rigs = rigs_of(config, lifted) if gear_by_crane(config, 1)[0] is not None else None
    limits = dict.fromkeys((config.rules.usual_utilisation, config.rules.utmost_utilisation))
    high_m = top_m(building)
    if config.moves:  # what a crane that moves unloads, it need not carry over the whole building
        high_m = _LORRY_M + max(float(np.ptp(element.mesh.bounds_m[:, 2])) for element in lifted)
    demands = [Demand(lifted, high_m, rigs, most_used) for most_used in limits]
    masts = [shapely.Point(crane.base_m[:2]).buffer(mast_room_m(config, crane)) for crane in cranes]
    areas = [*yards, *((config.areas.construction,) if config.areas.construction else ())]
    areas += [zone.polygon for zone in config.zone if zone.kind not in OPEN_ZONES]
    taken = shapely.union_all([ground_plan(building.elements), *masts, *map(shapely.Polygon, areas)])
    if not config.moves:
        return _one_lane(config, demands, cranes, taken)
    return _lane_of_each(config, demands[-1], cranes, taken, _set_up_of_each(config, building, lifted, rigs))


def _set_up_of_each(
    config: SiteConfig, building: Building, lifted: Sequence[Element], rigs: Rigs | None
) -> NDArray[np.int64]:
    """Return (N,) the set-up in which each part is lifted about, by the choice of ``init``; -1 if in none."""
    wanted = Wanted(config, lifted, ground_plan(building.elements), top_m(building), rigs)
    wanted = wanted.with_whole_chart() or wanted
    return set_ups_by_choice(cranes_of(config), wanted, lifted, *meanwhile(building.elements, lifted))


def _lane_of_each(
    config: SiteConfig,
    demand: Demand,
    cranes: Sequence[TowerCrane],
    taken: BaseGeometry,
    which: NDArray[np.int64],
) -> tuple[Polygon, ...] | None:
    """Return a lane for each set-up, from which the crane unloads what it sets there, and most of all parts.

    Args:
        config: The site file.
        demand: The parts.
        cranes: The crane in each set-up.
        taken: Where no lorry drives.
        which: (N,) the set-up of each part.

    Returns:
        None if parts of a set-up can be unloaded from no lane.
    """
    chosen: list[Polygon] = []
    for number, crane in enumerate(cranes):
        used, own, mast = demand.as_used(crane), np.flatnonzero(which == number), shapely.Point(crane.base_m[:2])
        yard = min(config.areas.yard or (), key=lambda one: float(shapely.Polygon(one).distance(mast)))
        ranked: list[tuple[int, int, Polygon]] = []
        lanes = _lanes(config, (yard,), [crane], taken, short=True)
        for place, lane in enumerate(dict.fromkeys([*chosen, *lanes])):
            points_m = yard_points(_with_areas(config, yard=(lane,), construction=None))
            able = [bool(demand.picks(n, used, points_m, MARGIN_M).any()) for n in range(len(which))]
            if all(able[n] for n in own):
                ranked.append((-sum(able), place, lane))
        if ranked:
            chosen.append(min(ranked)[2])
        elif len(own):
            return None
    return tuple(dict.fromkeys(chosen)) or None


def _lanes(
    config: SiteConfig,
    yards: Sequence[Polygon],
    cranes: Sequence[TowerCrane],
    taken: BaseGeometry,
    *,
    short: bool = False,
) -> list[Polygon]:
    """Return lanes within the plot, the best first."""
    plot = None if config.areas.plot is None else shapely.Polygon(config.areas.plot)
    masts_m = [crane.base_m for crane in cranes]
    lanes = accesses_beside(yards, config.areas.construction, taken, masts_m, short=short)
    return [lane for lane in lanes if plot is None or plot.covers(shapely.Polygon(lane))]


def _one_lane(
    config: SiteConfig, demands: Sequence[Demand], cranes: Sequence[TowerCrane], taken: BaseGeometry
) -> tuple[Polygon, ...] | None:
    """Return the best lane from which each crane unloads all that it picks in the yard; None if there is none.

    ``demands``: the parts, with more and more of the load chart; ``taken``: where no lorry drives.
    """

    def picked(demand: Demand, points_m: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return how many parts each crane picks at some of (P, 2) points."""
        used = [demand.as_used(crane) for crane in cranes]
        numbers = [n for n in range(len(demand.masses_kg)) if n not in demand.without_gear]
        able = [[demand.picks(n, crane, points_m, MARGIN_M).any() for n in numbers] for crane in used]
        counts: NDArray[np.int64] = np.array(able, np.int64).reshape(len(used), -1).sum(axis=1)
        return counts

    within = _lanes(config, config.areas.yard or (), cranes, taken)
    places_m = [yard_points(_with_areas(config, yard=(lane,), construction=None)) for lane in within]
    wanted = [picked(demand, yard_points(config)) for demand in demands]
    counts = [[picked(demand, points_m) for demand in demands] for points_m in places_m]
    for first in range(len(demands)):
        for lane, count in zip(within, counts, strict=True):
            if all((one >= least).all() for one, least in zip(count[first:], wanted[first:], strict=True)):
                return (lane,)
    return None


def _with_areas(config: SiteConfig, **areas: object) -> SiteConfig:
    return config.model_copy(update={"areas": config.areas.model_copy(update=areas)})
