"""Many places of a crane at once: which parts it serves from each, and how many crane hours that takes about.

The estimate adds up, over the erection sequence, the crew's times and the crane's fastest way with nothing in the way:
empty from the place before to the yard, loaded to the next place, over everything that is built by then. Where a part
will lie is the plan's to find, so a way is the mean over the places of the yard at which the crane can pick the part.
A luffing jib counts as slow as at its worst radius, so its hours are too many.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import BUILT, Element
from bimvox.crane.kinematics import hoist_limits
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.reach import MARGIN_M, MAST_CLEARANCE_M, distances_m, highest_hooks_m, radii_for_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.travel import Travel
from bimvox.site.areas import shadow
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.crane_distances import base_of

_AT_ONCE = 2_000_000
"""Pairs of a part and a place of the yard, times bases, that are in memory at once."""
_NOWHERE_M = 1e5
"""Further away than any place is from any base."""


@dataclass(frozen=True, slots=True, eq=False)
class LiftWork:
    """What is to be lifted, in the erection sequence.

    Attributes:
        places_m: (N, 2) hook over each part at its place.
        tops_m: (N,) height of each part's top at its place.
        heights_m: (N,) height of each part.
        masses_kg: (N,) mass of each part, with its gear if that is chosen for it.
        standing_s: (N,) how long the crane stands for each part.
        yard_m: (P, 2) places of the yard at which parts may be picked.
        closed: (N,) whether a zone forbids the hook or the load at the part's place.
        rooms: (N, 2) geometries in which the hook is over each part that lies within the yard: as it is built, and
            turned by a quarter; empty if it is larger than the yard, None if that is not asked.
    """

    places_m: NDArray[np.float64]
    tops_m: NDArray[np.float64]
    heights_m: NDArray[np.float64]
    masses_kg: NDArray[np.float64]
    standing_s: NDArray[np.float64]
    yard_m: NDArray[np.float64]
    closed: NDArray[np.bool_]
    rooms: NDArray[np.object_]

    def sample(self, parts: int, yard: int) -> LiftWork:
        """Return about so many parts, evenly from the sequence, and places of the yard."""
        some = slice(None, None, max(1, -(-len(self.masses_kg) // parts)))
        values = {one.name: getattr(self, one.name)[some] for one in fields(self) if one.name != "yard_m"}
        return LiftWork(**values, yard_m=self.yard_m[:: max(1, -(-len(self.yard_m) // yard))])


@dataclass(frozen=True, slots=True, eq=False)
class SetUps:
    """How a crane serves a site from each base.

    Attributes:
        served: (B, N) whether it carries each part from some place of the yard to its place.
        lift_s: (B, N) estimated crane time of each part; 0 if it does not serve it.
        crane_s: (B,) estimated crane time of the parts that it serves.
        used: (B,) highest share of the largest radius allowed for a part's mass, over the parts that it serves.
    """

    served: NDArray[np.bool_]
    lift_s: NDArray[np.float64]
    crane_s: NDArray[np.float64]
    used: NDArray[np.float64]


def carried(
    crane: TowerCrane, bases_m: NDArray[np.float64], work: LiftWork, hook_m: float, margin_m: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return (B, N) whether a crane carries each part to its place, and the share of the yard where it can pick it.

    The share is 0 if the part does not lie within the yard there.

    Args:
        crane: The crane on its mast, with the permitted share of its chart; its base is ignored.
        bases_m: (B, 2) places of its mast.
        work: The parts.
        hook_m: Height that the hook must reach.
        margin_m: By how much radii lie inside the limits.
    """
    low_m, far_m = radii_for_m(crane, work.masses_kg).T
    radius_m, yard_radius_m = distances_m(bases_m, work.places_m), distances_m(bases_m, work.yard_m)
    able = (radius_m >= low_m + margin_m) & (radius_m <= far_m - margin_m) & ~work.closed
    there_m = yard_radius_m
    if crane.luffing is not None:
        able &= _high_enough(crane, radius_m, hook_m)
        there_m = np.where(_high_enough(crane, yard_radius_m, hook_m), yard_radius_m, _NOWHERE_M)
    if not len(work.yard_m):
        return able, np.ones(able.shape)
    # All bases in one sorted row, each in its own range of radii.
    first_m = 2.0 * _NOWHERE_M * np.arange(len(bases_m))[:, None]
    row_m = np.sort(there_m + first_m, axis=None)
    until = np.searchsorted(row_m, np.minimum(far_m - margin_m, _NOWHERE_M / 2.0) + first_m, side="right")
    count = until - np.searchsorted(row_m, low_m + margin_m + first_m, side="left")
    share = np.maximum(count, 0) / len(work.yard_m)
    return able, share * _fits_within(bases_m, work, far_m - margin_m)


def set_ups(
    crane: TowerCrane, bases_m: NDArray[np.float64], work: LiftWork, hook_m: float, margin_m: float = 0.0
) -> SetUps:
    """Return how a crane serves the work from each of (B, 2) bases.

    Args:
        crane: The crane on its mast, with the permitted share of its chart; its base is ignored.
        bases_m: (B, 2) places of its mast.
        work: The parts.
        hook_m: Height that the hook must reach.
        margin_m: By how much radii lie inside the limits.
    """
    pairs = max(1, len(work.places_m) * len(work.yard_m))
    step = max(1, _AT_ONCE // pairs)
    radii_m = radii_for_m(crane, work.masses_kg).T + np.array([[margin_m], [-margin_m]])
    fits = _fits_within(bases_m, work, radii_m[1])
    parts = [
        _set_ups(crane, bases_m[n : n + step], work, hook_m, radii_m, fits[n : n + step])
        for n in range(0, max(1, len(bases_m)), step)
    ]
    return SetUps(*(np.concatenate([getattr(one, each.name) for one in parts]) for each in fields(SetUps)))


def _set_ups(
    crane: TowerCrane,
    bases_m: NDArray[np.float64],
    work: LiftWork,
    hook_m: float,
    radii_m: NDArray[np.float64],
    fits: NDArray[np.bool_],
) -> SetUps:
    low_m, far_m = radii_m
    radius_m, yard_radius_m = distances_m(bases_m, work.places_m), distances_m(bases_m, work.yard_m)
    able = (radius_m >= low_m) & (radius_m <= far_m) & ~work.closed
    picked = (yard_radius_m[:, None] >= low_m[:, None]) & (yard_radius_m[:, None] <= far_m[:, None])
    if crane.luffing is not None:
        able &= _high_enough(crane, radius_m, hook_m)
        picked &= _high_enough(crane, yard_radius_m, hook_m)[:, None]
    served = able & picked.any(axis=2) & fits
    lift_s = _lift_s(crane, bases_m, work, served, picked, (radius_m, yard_radius_m))
    share = np.where(served, radius_m / np.maximum(far_m, 1e-9), 0.0)
    return SetUps(served, lift_s, lift_s.sum(axis=1), share.max(axis=1, initial=0.0))


def highest_utilisation(
    crane: TowerCrane, bases_m: NDArray[np.float64], work: LiftWork, served: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return for (B, 2) bases the highest utilisation of a crane over the parts that it serves.

    Each part counts at its place or, if that is more, at the nearest place of the yard.

    Args:
        crane: The crane with its whole load chart; its rigging is that of the masses.
        bases_m: (B, 2) places of its mast.
        work: The parts.
        served: (B, N) whether it serves each part.
    """
    low_m = float(radii_for_m(crane, work.masses_kg)[:, 0].max(initial=0.0))
    yard_m = distances_m(bases_m, work.yard_m)
    nearest_m = np.where(yard_m >= low_m, yard_m, np.inf).min(axis=1, initial=np.inf)
    nearest_m = np.where(np.isfinite(nearest_m), nearest_m, 0.0)
    radius_m = np.maximum(distances_m(bases_m, work.places_m), nearest_m[:, None])
    share = (work.masses_kg + crane.tackle_kg) / np.maximum(capacity_kg(crane.chart, radius_m), 1e-9)
    result: NDArray[np.float64] = np.where(served, share, 0.0).max(axis=1, initial=0.0)
    return result


def winches(crane: TowerCrane, work: LiftWork, longest_m: float) -> list[Travel]:
    """Return the crane's travel in the gear of the empty hook, then in that of each part."""
    gears = {kg: hoist_limits(crane, kg) for kg in {0.0, *work.masses_kg.tolist()}}
    return [
        Travel(replace(crane, hoist=gears[kg], base_m=(0.0, 0.0, 0.0)), longest_m)
        for kg in (0.0, *work.masses_kg.tolist())
    ]


def _fits_within(bases_m: NDArray[np.float64], work: LiftWork, far_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return (B, N) whether each part lies within the yard, turned or not, with its hook nearer than (N,) radii."""
    numbers: dict[tuple[int, int], int] = {}
    # Parts of the same size share their rooms.
    which = [numbers.setdefault((id(as_built), id(turned)), len(numbers)) for as_built, turned in work.rooms.tolist()]
    rooms = work.rooms[np.unique(which, return_index=True)[1]]
    apart_m = shapely.distance(rooms, shapely.points(bases_m)[:, None, None])
    # Without a room, the distance is not a number: such a part counts as lying anywhere.
    result: NDArray[np.bool_] = ~(np.fmin(*np.moveaxis(apart_m, -1, 0))[:, which] > far_m)
    return result


def _high_enough(crane: TowerCrane, radius_m: NDArray[np.float64], hook_m: float) -> NDArray[np.bool_]:
    assert crane.luffing is not None
    result: NDArray[np.bool_] = highest_hooks_m(crane.luffing, radius_m.ravel()).reshape(radius_m.shape) >= hook_m
    return result


def _lift_s(
    crane: TowerCrane,
    bases_m: NDArray[np.float64],
    work: LiftWork,
    served: NDArray[np.bool_],
    picked: NDArray[np.bool_],
    radii_m: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Return the (B, N) estimated crane time of each part."""
    radius_m, yard_radius_m = radii_m
    over_m = np.maximum.accumulate(work.tops_m) + work.heights_m + crane.sling_m
    longest_m = float(max(radius_m.max(initial=1.0), yard_radius_m.max(initial=1.0), over_m.max(initial=1.0)))
    travel = Travel(replace(crane, base_m=(0.0, 0.0, 0.0)), longest_m)
    slew, yard_slew = slews(bases_m, work.places_m), slews(bases_m, work.yard_m)
    at_yard_m, at_place_m = work.heights_m + crane.sling_m, work.tops_m + crane.sling_m
    ups_m = np.stack([over_m - at_yard_m, over_m - at_place_m], axis=1)
    empty, *loaded = winches(crane, work, longest_m)
    empty_s = empty.hoisting_s(ups_m).sum(axis=1)
    loaded_s = np.array([one.hoisting_s(up_m).sum() for one, up_m in zip(loaded, ups_m, strict=True)])
    across_s = travel.across_s(
        yard_slew[:, None, :] - slew[:, :, None], yard_radius_m[:, None, :] - radius_m[:, :, None]
    )
    there_s = np.maximum(across_s, loaded_s[:, None])
    # The empty hook comes from the place of the part before; the first one starts above its own place.
    back_s = np.maximum(np.concatenate([across_s[:, :1], across_s[:, :-1]], axis=1), empty_s[:, None])
    count = np.maximum(picked.sum(axis=2), 1)
    mean_s = ((there_s + back_s) * picked).sum(axis=2) / count
    lift_s: NDArray[np.float64] = (mean_s + work.standing_s) * served
    return lift_s


def slews(bases_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (B, N) directions from bases to points."""
    result: NDArray[np.float64] = np.arctan2(points_m[:, 1] - bases_m[:, 1, None], points_m[:, 0] - bases_m[:, 0, None])
    return result


# Where a mast can stand: around building and yard, clear of both, of the access and of every closed zone.
#
# It also can where the outline of the building leaves room over its whole height, in a court or between two wings; a
# mobile crane cannot leave a court. A jib that would sweep over more than the plot has no place.

_RING_M = 20.0
"""How far from building and yard a mast may stand."""
_LEAST_PITCH_M = 1.0
OPEN_ZONES = ("assembly", "slow", "limiter")
"""Kinds of zones in which a mast may stand."""


def ground_plan(elements: Iterable[Element]) -> BaseGeometry:
    """Return what the building covers on plan, every part and what exists already; courts and openings are free."""
    return shapely.union_all([shadow(one.mesh) for one in elements if one.role in BUILT])


def mast_room_m(config: SiteConfig, crane: TowerCrane) -> float:
    """Return how far the middle of a mast is from all areas: loads in transit pass it, and its foundation has room."""
    clear_m = max(MAST_CLEARANCE_M, config.rules_in_force.transit_clearance_m + MARGIN_M)
    return max(clear_m + crane.mast_size_m / 2.0, base_of(crane).edge_m / 2.0)


class MastPlaces:
    """Where masts can stand on a site.

    Args:
        config: Its yard, access, plot and zones.
        building: Its outline on plan, see :func:`ground_plan`.
        standing: What of it stands while a crane that leaves is there; default: all.

    Attributes:
        free: What is around the building and in none of these areas.
    """

    def __init__(self, config: SiteConfig, building: BaseGeometry, standing: BaseGeometry | None = None) -> None:
        yards = [shapely.Polygon(one) for one in config.areas.yard or ()]
        closed = [*(config.areas.access or ()), *(zone.polygon for zone in config.zone if zone.kind not in OPEN_ZONES)]
        standing = building if standing is None else standing
        taken = shapely.union_all([standing, *yards, *(shapely.Polygon(one) for one in closed)])
        around = shapely.union_all([building, *yards]).convex_hull.buffer(_RING_M)
        self.free = shapely.difference(around, taken)
        self._outline = building.convex_hull
        self._courts = shapely.difference(_filled(standing), standing)
        self._config = config
        self._plot = None if config.areas.plot is None else shapely.Polygon(config.areas.plot)
        self._areas: dict[tuple[float, float, bool], BaseGeometry] = {}

    def bases_m(self, crane: TowerCrane, most: int) -> NDArray[np.float64]:
        """Return about ``most`` (B, 2) places of a square lattice for a crane's mast, by y, then x."""
        return lattice(self._area(crane), self._pitch_m(crane, most))

    def near_m(self, crane: TowerCrane, base_m: NDArray[np.float64], most: int) -> NDArray[np.float64]:
        """Return the (B, 2) places of a lattice of a metre around one of ``most`` places of a crane's mast."""
        pitch_m = self._pitch_m(crane, most)
        around = shapely.box(*(base_m - pitch_m), *(base_m + pitch_m))
        return lattice(self._area(crane).intersection(around), _LEAST_PITCH_M)

    def inside(self, bases_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of (B, 2) places are within the convex outline of the building.

        There a mast must stay until the end, and its foundation must fit between the parts.
        """
        result: NDArray[np.bool_] = shapely.contains_xy(self._outline, bases_m)
        return result

    def _pitch_m(self, crane: TowerCrane, most: int) -> float:
        return max(_LEAST_PITCH_M, float(np.ceil(np.sqrt(self._area(crane).area / most))))

    def _area(self, crane: TowerCrane) -> BaseGeometry:
        room_m = mast_room_m(self._config, crane)
        key = room_m, crane.jib_length_m, crane.kind == "mobile"
        if key not in self._areas:
            area = (self.free.difference(self._courts) if key[2] else self.free).buffer(-key[0])
            self._areas[key] = area if self._plot is None else area.intersection(self._plot.buffer(-crane.jib_length_m))
        return self._areas[key]


def _filled(area: BaseGeometry) -> BaseGeometry:
    """Return an area without its holes."""
    shells = [shapely.Polygon(one.exterior) for one in shapely.get_parts(area) if isinstance(one, shapely.Polygon)]
    return shapely.union_all(shells)


def lattice(area: BaseGeometry, pitch_m: float) -> NDArray[np.float64]:
    """Return the (B, 2) points of a square lattice within an area, by y, then x."""
    if area.is_empty:
        return np.zeros((0, 2))
    x0, y0, x1, y1 = area.bounds
    first = np.ceil(np.array([x0, y0]) / pitch_m) * pitch_m
    y, x = np.meshgrid(np.arange(first[1], y1 + 1e-9, pitch_m), np.arange(first[0], x1 + 1e-9, pitch_m), indexing="ij")
    inside = shapely.intersects_xy(area, x, y)
    return np.column_stack([x[inside], y[inside]])
