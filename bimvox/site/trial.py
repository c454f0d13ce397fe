"""A set-up tried without planning: which parts each crane carries from the yard to their places, and at what share.

It asks what ``bimvox cranes`` asks: reach, load chart and gear, at a part's place and at some place of the yard. Paths,
order and neighbours are the plan's business; so a part that is served here may still be infeasible, and the plan's
utilisation is that of the worst moment of its lift, which is at least the one at its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.outline import mast_box_m
from bimvox.crane.reach import distances_m, highest_hooks_m, radii_for_m
from bimvox.crane.sectors import capacities_kg, charts_of, towards
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import ConfigError
from bimvox.site.areas import NO_HOOK, NO_LOAD, PLAN, hull, shadow
from bimvox.site.checks import check_cranes
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.config.site_config import Polygon, SiteConfig, ZoneConfig
from bimvox.site.demand import Demand, Rigs, hooks_over_m

_PITCH_M = 1.0
_MOST_POINTS = 4000
_RINGS_M = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class _Ring:
    """What a crane carries at a radius: the permitted share of its load chart, less hook block and usual rigging."""

    radius_m: float
    capacity_kg: float


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A set-up, and how it serves each of N parts.

    Attributes:
        utilisation: (N,) share of the load chart's capacity at its place or, if more, at the best place of the yard;
            NaN if it is not to be lifted.
        radius_m: (N,) radius of the hook at its place; NaN if it is not to be lifted.
        crane: (N,) index of the crane; -1 if none carries it.
        reasons: (N,) why none carries it; None if one does or if it is not to be lifted.
        rings: Of each crane.
        problems: What is wrong with the places of masts and areas, one sentence each.
    """

    utilisation: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    crane: NDArray[np.int64]
    reasons: tuple[str | None, ...]
    rings: tuple[tuple[_Ring, ...], ...]
    problems: tuple[str, ...]


class Trial:
    """The parts of a building, ready to be tried with many set-ups.

    Args:
        parts: Everything that may be lifted, in the site frame.
        top_m: Height that the load's top must reach.
        rigs: The gear of the parts, of the same order.

    Attributes:
        hulls: (N,) convex hull of each part on plan.
    """

    def __init__(self, parts: Sequence[Element], top_m: float, rigs: Rigs) -> None:
        self._parts = parts
        self.hulls: NDArray[np.object_] = np.array([hull(part.mesh, PLAN) for part in parts], dtype=object)
        self._demands = {chosen: Demand(parts, top_m, rigs if chosen else None, 1.0) for chosen in (True, False)}

    def hook_height_m(self, config: SiteConfig, crane: TowerCrane) -> float:
        """Return the height that the hook of a crane must reach, as ``init`` chooses it."""
        demand = self._demands[gear_by_crane(config, 1)[0] is not None]
        return demand.height_m(demand.as_used(crane))

    def of(self, config: SiteConfig, cranes: Sequence[TowerCrane], lifts: NDArray[np.bool_]) -> Tried:
        """Return how cranes serve the parts.

        Args:
            config: The site file; its cranes are given separately.
            cranes: The cranes, each on its base.
            lifts: (C, N) whether each crane may lift each part.
        """
        chosen = [gear is not None for gear in gear_by_crane(config, len(cranes))]
        points_m = yard_points(config)
        ways = [self._by(crane, own, config, points_m) for crane, own in zip(cranes, chosen, strict=True)]
        rings = tuple(_rings(crane, config.rules.usual_utilisation) for crane in cranes)
        problems = tuple(self._problems(config, cranes))
        count = len(self._parts)
        if not ways:
            nothing = np.full(count, np.nan)
            return Tried(nothing, nothing, np.full(count, -1), (None,) * count, rings, problems)
        shares, radii_m = np.array([way.utilisation for way in ways]), np.array([way.radius_m for way in ways])
        able = lifts & np.array([way.able for way in ways])
        # The crane that is used least; of those that may but cannot, the nearest.
        best = np.where(able, shares, np.inf).argmin(axis=0)
        nearest = np.where(lifts, radii_m, np.inf).argmin(axis=0)
        served, asked = able.any(axis=0), lifts.any(axis=0)
        shown = (np.where(served, best, nearest), np.arange(count))
        reasons: list[str | None] = [None] * count
        for n in np.flatnonzero(asked & ~served).tolist():
            own = np.flatnonzero(lifts[:, n]).tolist()
            reasons[n] = "; ".join(f"{cranes[c].name} {ways[c].reasons[n]}" for c in own)
        return Tried(
            np.where(asked, shares[shown], np.nan),
            np.where(asked, radii_m[shown], np.nan),
            np.where(served, best, -1),
            tuple(reasons),
            rings,
            problems,
        )

    def _by(self, crane: TowerCrane, chosen: bool, config: SiteConfig, points_m: NDArray[np.float64]) -> _Way:
        """Return how one crane serves every part."""
        demand = self._demands[chosen].permitting(config.rules.utmost_utilisation)
        used, masses_kg = demand.as_used(crane), demand.masses_kg
        high_m = np.full(len(masses_kg), demand.height_m(used))
        if config.moves:  # as its set-ups are chosen: each part over its own place
            high_m = hooks_over_m(np.array([part.mesh.bounds_m[1, 2] for part in self._parts]), used)
        base = np.array([crane.base_m[:2]])
        radius_m = distances_m(base, demand.places_m)[0]
        in_yard_m = np.sort(distances_m(base, points_m)[0])
        if used.luffing is not None:
            in_yard_m = in_yard_m[highest_hooks_m(used.luffing, in_yard_m) >= high_m.min(initial=np.inf)]
        low_m, far_m = radii_for_m(used, masses_kg).T
        hung_kg = masses_kg + used.tackle_kg
        slew_rad = np.arctan2(*(demand.places_m - base[0]).T[::-1])
        able = (radius_m >= low_m) & (radius_m <= used.jib_length_m)
        able &= hung_kg <= capacities_kg(used, slew_rad, radius_m)
        if used.luffing is not None:
            able &= highest_hooks_m(used.luffing, radius_m) >= high_m
        at = np.minimum(np.searchsorted(in_yard_m, low_m), len(in_yard_m) - 1)
        picked_m = in_yard_m[at] if len(in_yard_m) else np.full(len(masses_kg), np.inf)
        picked = (picked_m >= low_m) & (picked_m <= far_m)
        if not len(points_m):
            picked, picked_m = np.ones(len(masses_kg), np.bool_), np.zeros(len(masses_kg))
        closed = closed_over(config.zone, demand.places_m)
        # Where a part is picked is not known yet, so the chart counts that holds in every direction.
        picked_m = np.where(np.isfinite(picked_m), picked_m, 0.0)
        end_m = max(chart.radius_m[-1] for chart in charts_of(crane))
        at_place, picking = (
            capacities_kg(crane, slew_rad, np.minimum(radius_m, end_m)),
            capacity_kg(crane.chart, np.minimum(picked_m, crane.chart.radius_m[-1])),
        )
        share = hung_kg / np.maximum(np.minimum(at_place, picking), 1e-9)
        serves = able & picked & (closed == "")
        serves[list(demand.without_gear)] = False
        reasons = {}
        for n in np.flatnonzero(~serves).tolist():
            if n in demand.without_gear:
                reasons[n] = f"has no gear for it: {demand.without_gear[n]}"
            elif closed[n]:
                reasons[n] = f"may not hang over {closed[n]}, where its place is"
            elif not able[n]:
                facing = towards(used, float(slew_rad[n]))
                reasons[n] = demand.unserved(n, facing, float(radius_m[n]), "").reason
            else:
                nearest_m = float(in_yard_m[at[n]]) if len(in_yard_m) else float(distances_m(base, points_m).min())
                reasons[n] = demand.unserved(n, used, nearest_m, " in the yard").reason
        return _Way(radius_m, np.where(radius_m <= end_m, share, np.inf), serves, reasons)

    def _problems(self, config: SiteConfig, cranes: Sequence[TowerCrane]) -> list[str]:
        """Return what is wrong with the places of masts and areas."""
        result = []
        yards = [shapely.Polygon(polygon) for polygon in config.areas.yard or ()]
        areas = [("the construction area", [config.areas.construction] if config.areas.construction else [])]
        areas.append(("the access of trucks", list(config.areas.access or ())))
        if not yards:
            result.append("There is no yard")
        yard = shapely.union_all(yards)
        for name, polygons in areas:
            common_m2 = float(shapely.union_all([shapely.Polygon(one) for one in polygons]).intersection(yard).area)
            if common_m2 > 0.01:
                result.append(f"The yard lies on {name}; these {common_m2:.0f} m² hold no parts")
        demand = self._demands[True]
        for crane in cranes:
            (x0, y0, _), (x1, y1, _) = mast_box_m(crane)
            mast = shapely.box(x0, y0, x1, y1)
            near = np.flatnonzero(shapely.intersects(self.hulls, mast)).tolist()
            hit = [part for part in (self._parts[n] for n in near) if shadow(part.mesh).intersects(mast)]
            if hit and not config.moves:  # what is built where it stands comes later
                part = hit[0]
                result.append(f"The mast of {crane.name} stands at the place of {part.label}")
            if mast.intersects(yard):
                result.append(f"The mast of {crane.name} stands in the yard")
            needed_m = demand.height_m(demand.as_used(crane))
            if crane.luffing is None and crane.highest_hook_m < needed_m:
                result.append(
                    f"The hook of {crane.name} reaches {crane.highest_hook_m:.1f} m; to carry every part over the "
                    f"finished building takes {needed_m:.1f} m"
                )
        try:
            check_cranes(config, cranes, config.rules_in_force.crane_separation_m)
        except ConfigError as error:
            said = error.message.removeprefix(f"{error.path}: {error.key}").lstrip(": ")
            result.append(f"{said}; {error.hint}" if error.hint else said)
        return result


@dataclass(frozen=True, slots=True, eq=False)
class _Way:
    """How one crane serves every part: radius at its place, share of the chart, whether it can, and why not."""

    radius_m: NDArray[np.float64]
    utilisation: NDArray[np.float64]
    able: NDArray[np.bool_]
    reasons: dict[int, str]


def yard_points(config: SiteConfig) -> NDArray[np.float64]:
    """Return (P, 2) places of the yard at which parts may be picked: a lattice of a metre, and every middle."""
    closed = [zone.polygon for zone in config.zone if zone.kind in NO_HOOK | NO_LOAD]
    closed += [*(config.areas.access or ()), *([config.areas.construction] if config.areas.construction else [])]
    return _points_in(config.areas.yard or (), tuple(closed))


def _pitch_of_m(bounds_m: tuple[float, float, float, float]) -> float:
    x0, y0, x1, y1 = bounds_m
    return max(_PITCH_M, float(np.sqrt((x1 - x0) * (y1 - y0) / _MOST_POINTS)))


@lru_cache(maxsize=4)  # while a crane is dragged, the yard stays
def _points_in(yard: tuple[Polygon, ...], closed: tuple[Polygon, ...]) -> NDArray[np.float64]:
    barred = shapely.union_all([shapely.Polygon(one) for one in closed])
    found = []
    for polygon in yard:
        area = shapely.Polygon(polygon).difference(barred)
        if area.is_empty:
            continue
        x0, y0, x1, y1 = area.bounds
        step_m = _pitch_of_m(area.bounds)
        x, y = np.meshgrid(np.arange(x0 + step_m / 2.0, x1, step_m), np.arange(y0 + step_m / 2.0, y1, step_m))
        inside = shapely.contains_xy(area, x, y)
        middle = area.representative_point()
        found.append(np.concatenate([np.column_stack([x[inside], y[inside]]), [[middle.x, middle.y]]]))
    points_m = np.concatenate(found) if found else np.zeros((0, 2))
    points_m.setflags(write=False)
    return points_m


def closed_over(zones: Sequence[ZoneConfig], places_m: NDArray[np.float64]) -> NDArray[np.str_]:
    """Return (N,) the zone over which the hook of each place may not be; empty if it may."""
    found = np.full(len(places_m), "", dtype=object)
    for number, zone in enumerate(zones, start=1):
        if zone.kind in NO_HOOK | NO_LOAD:
            found[shapely.contains_xy(shapely.Polygon(zone.polygon), places_m)] = f"zone {zone.name or number}"
    return found.astype(np.str_)


def _rings(crane: TowerCrane, most_used: float) -> tuple[_Ring, ...]:
    """Return rings every few metres, and at the end of the chart."""
    low_m, end_m = crane.min_radius_m, crane.jib_length_m
    radii = [n * _RINGS_M for n in range(1, int(end_m / _RINGS_M) + 1) if low_m < n * _RINGS_M < end_m - 0.5]
    carried = most_used * capacity_kg(crane.chart, np.array([*radii, end_m])) - crane.tackle_kg
    return tuple(_Ring(radius, max(0.0, kg)) for radius, kg in zip((*radii, end_m), carried.tolist(), strict=True))
