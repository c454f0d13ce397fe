"""The set-ups of a mobile crane for a site without any, each with a place for parts beside it.

It may also stand where the building will be, as long as nothing is there yet; see :mod:`bimvox.site.moving_choice`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import Element, Role
from bimvox.crane.machine import Machine, carries_most
from bimvox.crane.outline import outline_of
from bimvox.crane.reach import MARGIN_M, distances_m, highest_hooks_m, highest_loads_m, radii_for_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.config.crane import MOST_SET_UPS
from bimvox.site.config.site_config import Polygon
from bimvox.site.crane_distances import is_in, stand_of
from bimvox.site.crane_guess import CraneFit, Wanted, fit_in_set_ups
from bimvox.site.default_rules import ON_GROUND_M
from bimvox.site.demand import hooks_over_m
from bimvox.site.machine import moving_times_s
from bimvox.site.moving_choice import Stands, carriers, chosen_places, set_up_of_parts
from bimvox.site.parts import is_erected
from bimvox.site.set_ups import MastPlaces, ground_plan, lattice, mast_room_m

_MOST_BASES = 400
_MORE_BASES = (100, 900)
"""With fewer parts than the first, so many places."""
DRIVEN_ON_M = 0.5
"""A crane drives onto what lies on the ground and is no higher: a slab, which it stands on."""
_LEVEL_M = 0.05
"""What is no higher above the ground counts as level: parts lie on it."""
_PITCH_M = 1.0
"""Of the places for parts that are tried."""
_MOST_ROWS = 4
"""So many of the widest parts of a set-up lie side by side at most: about two lorry loads."""
_MOVING_S = 120.0
"""About how long a crane moves for a lift, its hook empty and back again, for an estimate."""

_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MovingCrane:
    """A crane in its set-ups.

    Attributes:
        machine: The machine.
        cranes: The crane in each of them, in their order.
        yard: The places for parts, at least one beside each.
        parts: Per set-up the numbers of the parts that it sets.
        lifts_s: Estimated time of the lifts.
        moves_s: Estimated time of the moves.
        cost: Estimated cost by the rates of the site file.
    """

    machine: Machine
    cranes: tuple[TowerCrane, ...]
    yard: tuple[Polygon, ...]
    parts: tuple[tuple[int, ...], ...]
    lifts_s: float
    moves_s: float
    cost: float

    @property
    def served(self) -> int:
        """How many parts it sets."""
        return sum(map(len, self.parts))

    @property
    def rank(self) -> tuple[int, float, int]:
        """The least is the best: most parts, then the least cost."""
        return (-self.served, round(self.cost, 2), len(self.cranes))


def best_moving(
    machines: Sequence[Machine],
    wanted: Wanted,
    lifted: Sequence[Element],
    others: Sequence[Element],
    plans: tuple[BaseGeometry, BaseGeometry],
    gap_m: float,
) -> MovingCrane | None:
    """Return the mobile machine and its set-ups that set most parts at the least cost; None if none sets any.

    With the usual share of the charts, or with the whole ones if that sets more parts and the site file leaves it open.
    Deterministic; of the same rank, the machine that comes first.

    Args:
        machines: The machines; those that do not drive are left out.
        wanted: What the crane is chosen for.
        lifted: The parts.
        others: Those that are cast, built or set by hand meanwhile.
        plans: Outline of the building, and what of it stands as long as the crane is there.
        gap_m: Room around a part that lies beside the crane.
    """
    return _Problem(wanted, lifted, others, plans, gap_m).best(machines)


def each_moving(
    machines: Sequence[Machine],
    wanted: Wanted,
    lifted: Sequence[Element],
    others: Sequence[Element],
    plans: tuple[BaseGeometry, BaseGeometry],
    gap_m: float,
) -> Iterator[MovingCrane]:
    """Yield each mobile machine in its best set-ups, if it sets any part; as for :func:`best_moving`."""
    problem = _Problem(wanted, lifted, others, plans, gap_m)
    yield from (found for machine in machines if (found := problem.best([machine])) is not None)


def _rigs_of(machine: Machine) -> list[TowerCrane]:
    """Return a machine with each boom and counterweight, on the reeving that carries most."""
    by_boom: dict[tuple[object, ...], list[TowerCrane]] = {}
    for crane in machine.cranes:
        carrier = crane.carrier
        key = (crane.jib_own_m, None if carrier is None else (carrier.counterweight_kg, carrier.outriggers))
        by_boom.setdefault(key, []).append(crane)
    return [carries_most(alike) for alike in by_boom.values()]


def set_ups_by_choice(
    cranes: Sequence[TowerCrane],
    wanted: Wanted,
    lifted: Sequence[Element],
    others: Sequence[Element],
    plans: tuple[BaseGeometry, BaseGeometry],
) -> NDArray[np.int64]:
    """Return (N,) the set-up of a crane in which each part is lifted, -1 if in none; as for :func:`best_moving`."""
    return _Problem(wanted, lifted, others, plans, 0.0).in_set_ups(cranes)[0]


def fit_of_moving(
    cranes: Sequence[TowerCrane],
    wanted: Wanted,
    lifted: Sequence[Element],
    others: Sequence[Element],
    plans: tuple[BaseGeometry, BaseGeometry],
) -> CraneFit:
    """Return how a mobile crane serves a site from its set-ups, in their order; as for :func:`best_moving`."""
    which, seconds = _Problem(wanted, lifted, others, plans, 0.0).in_set_ups(cranes)
    return fit_in_set_ups(wanted, cranes, which, (seconds + moves_of_s(cranes)) / 3600.0)


def moves_of_s(cranes: Sequence[TowerCrane]) -> float:
    """Return about how long a crane takes from set-up to set-up, all moves together; it drives a short way."""
    return (len(cranes) - 1) * sum(moving_times_s(cranes))


def meanwhile(
    elements: Sequence[Element], lifted: Sequence[Element]
) -> tuple[list[Element], tuple[BaseGeometry, BaseGeometry]]:
    """Return what is built while a crane lifts these parts, and two outlines: the building, and what is in its way.

    The first is what stands above the ground in the end. The second is what stands on the ground and no crane lifts.
    """
    ids = {element.id for element in lifted}
    others = [element for element in elements if element.id not in ids]
    high = [element for element in elements if element.mesh.bounds_m[1, 2] > _LEVEL_M]
    there = [e for e in others if e.mesh.bounds_m[0, 2] <= ON_GROUND_M and e.mesh.bounds_m[1, 2] > DRIVEN_ON_M]
    return [one for one in others if one.role is Role.COMPONENT], (ground_plan(high), ground_plan(there))


class _Stand(NamedTuple):
    """A crane as it comes, and as used, on a base."""

    usual: TowerCrane
    crane: TowerCrane
    base_m: _Floats


class _Problem:
    """The parts of a site, and where a crane and parts beside it may be."""

    def __init__(
        self,
        wanted: Wanted,
        lifted: Sequence[Element],
        others: Sequence[Element],
        plans: tuple[BaseGeometry, BaseGeometry],
        gap_m: float,
    ) -> None:
        building, standing = plans
        self._wanted, self._parts = wanted, (*lifted, *others)
        self._bounds_m = np.array([element.mesh.bounds_m for element in lifted])
        all_m = np.array([element.mesh.bounds_m for element in self._parts])
        self._free_parts = np.arange(len(all_m)) >= len(lifted)
        self._under = carriers(all_m)
        self._order = np.lexsort((all_m[:, 1, 2], all_m[:, 0, 2])).tolist()
        size_m = np.ptp(self._bounds_m, axis=1)
        lies = np.array([is_erected(element) for element in lifted])
        on_plan = np.where(lies[:, None], np.stack([size_m[:, 2], size_m[:, :2].max(axis=1)], axis=1), size_m[:, :2])
        self._lying_m = np.sort(on_plan, axis=1)[:, ::-1] + 2.0 * gap_m
        low_m, high_m = all_m[:, 0], all_m[:, 1]
        boxes = shapely.box(low_m[:, 0], low_m[:, 1], high_m[:, 0], high_m[:, 1])
        driven_on = (low_m[:, 2] <= ON_GROUND_M) & (high_m[:, 2] <= DRIVEN_ON_M)
        self._boxes = np.where(driven_on, shapely.Point(), boxes)
        self._slabs = boxes[driven_on], high_m[driven_on, 2]
        self._masses_kg = wanted.demand.masses_kg
        self._places = MastPlaces(wanted.config, building, standing)
        # Parts lie in the yard of the site file, otherwise where the building never is.
        self._given = wanted.config.areas.yard
        self._free = MastPlaces(wanted.config, building).free
        self._centres_m = wanted.yard_m if self._given else lattice(self._free, _PITCH_M)

    def best(self, machines: Sequence[Machine]) -> MovingCrane | None:
        """Return the machine and its set-ups of the least rank, with the whole charts if that sets more parts."""
        found = self._best(machines)
        if found is not None and found.served == len(self._masses_kg):
            return found
        if (whole := self._wanted.with_whole_chart()) is None:
            return found
        other = copy(self)
        other._wanted = whole
        more = other._best(machines)
        return found if more is None or (found is not None and found.served >= more.served) else more

    def _best(self, machines: Sequence[Machine]) -> MovingCrane | None:
        found = (self._set_ups_of(one, _rigs_of(one)) for one in machines if one.kind == "mobile")
        return min((one for one in found if one is not None), key=lambda one: one.rank, default=None)

    def _set_ups_of(self, machine: Machine, rigs: Sequence[TowerCrane]) -> MovingCrane | None:
        """Return a machine in the set-ups that set most parts, with a boom of its own in each; None if it sets none."""
        where: list[_Stand] = []
        stands: list[tuple[NDArray[np.bool_], NDArray[np.bool_], _Floats]] = []
        for usual in rigs:
            crane = self._wanted.demand.as_used(usual)
            few, more = _MORE_BASES
            bases_m = self._places.bases_m(crane, more if len(self._masses_kg) < few else _MOST_BASES)
            if crane.luffing is None or not len(bases_m):
                continue
            where += [_Stand(usual, crane, base_m) for base_m in bases_m]
            stands.append(self._stands(crane, bases_m))
        if not where:
            return None
        served, taken, radius_m = (np.concatenate(one) for one in zip(*stands, strict=True))
        kept = _best_rigs(where, served[:, ~self._free_parts])
        where = [where[n] for n in kept]
        if not where:
            return None
        all_stands = Stands(served[kept], taken[kept], radius_m[kept], self._free_parts)
        places = chosen_places(all_stands, self._under, self._order, MOST_SET_UPS)
        if not places:
            return None
        which = set_up_of_parts(all_stands, self._under, self._order, places)[~self._free_parts]
        parts = [np.flatnonzero(which == n) for n in range(len(places))]
        yard = self._yard([where[n] for n in places], parts)
        used = [n for n, own in enumerate(parts) if len(own) and (self._given or yard[n] is not None)]
        if not used:
            return None
        cranes = tuple(self._on_base(where[places[n]]) for n in used)
        lifts_s, moves_s = self._lifts_s(sum(len(parts[n]) for n in used)), moves_of_s(cranes)
        return MovingCrane(
            machine,
            cranes,
            self._given or tuple(polygon for n in used if (polygon := yard[n]) is not None),
            tuple(tuple(parts[n].tolist()) for n in used),
            lifts_s,
            moves_s,
            self._wanted.rates(machine).total((lifts_s + moves_s) / 3600.0),
        )

    def in_set_ups(self, cranes: Sequence[TowerCrane]) -> tuple[NDArray[np.int64], float]:
        """Return (N,) the set-up in which each part is lifted, -1 if in none, and about how long the lifts take."""
        found = [self._stands(self._wanted.demand.as_used(one), np.array([one.base_m[:2]])) for one in cranes]
        served, _, radius_m = (np.concatenate(one) for one in zip(*found, strict=True))
        # Where it stands is known, so what is in its way there is too: by its solids, not with room around them.
        solids = [stand_of(one) for one in cranes]
        taken = [[any(is_in(one, part.mesh) for one in own) for part in self._parts] for own in solids]
        stands = Stands(served, np.array(taken, np.bool_) & ~shapely.is_empty(self._boxes), radius_m, self._free_parts)
        which = set_up_of_parts(stands, self._under, self._order, range(len(cranes)))[~self._free_parts]
        return which, self._lifts_s(int((which >= 0).sum()))

    def _lifts_s(self, lifts: int) -> float:
        """Return about how long some of the lifts take."""
        return self._wanted.standing_s * lifts / len(self._masses_kg) + _MOVING_S * lifts

    def _on_base(self, one: _Stand) -> TowerCrane:
        """Return a crane on its base: on the ground, or on the slabs below it."""
        boxes, tops_m = self._slabs
        half_m = one.crane.mast_size_m / 2.0
        below = shapely.intersects(boxes, shapely.box(*(one.base_m - half_m), *(one.base_m + half_m)))
        foot_m = max(0.0, float(tops_m[below].max(initial=0.0)))
        return replace(one.usual, base_m=(*one.base_m.tolist(), round(foot_m, 3)))

    def _stands(self, crane: TowerCrane, bases_m: _Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_], _Floats]:
        """Return (B, N) whether a crane as used serves each part from (B, 2) bases, is in its way, and its radius."""
        assert crane.luffing is not None
        low_m, far_m = radii_for_m(crane, self._masses_kg).T
        radius_m = distances_m(bases_m, self._wanted.demand.places_m)
        able = (radius_m >= low_m + MARGIN_M) & (radius_m <= far_m - MARGIN_M) & ~self._wanted.closed
        # Not over the whole building, as a crane that stays: each part over its own place.
        hook_m = hooks_over_m(self._bounds_m[:, 1, 2], crane)
        able &= highest_hooks_m(crane.luffing, radius_m.ravel()).reshape(radius_m.shape) >= hook_m
        able &= self._below_boom(crane, bases_m)
        able &= self._nearest_m(crane, bases_m) + MARGIN_M <= far_m
        room_m = _room_m(self._wanted, crane)
        taken = shapely.distance(shapely.points(bases_m)[:, None], self._boxes) < room_m
        more = ((0, 0), (0, int(self._free_parts.sum())))
        return np.pad(able, more, constant_values=True), taken, np.pad(radius_m, more)

    def _below_boom(self, crane: TowerCrane, bases_m: _Floats) -> NDArray[np.bool_]:
        """Return (B, N) whether each part hangs below the boom over its place, in its heading there."""
        assert crane.luffing is not None
        hooks_m, bounds_m = self._wanted.demand.places_m, self._bounds_m
        away_m = hooks_m - bases_m[:, None]
        load_m = [bounds_m[:, end, axis] - hooks_m[:, axis] for end in (0, 1) for axis in (0, 1)]
        high_m = highest_loads_m(crane.luffing, (away_m[..., 0], away_m[..., 1]), load_m)
        below: NDArray[np.bool_] = high_m >= hooks_over_m(bounds_m[:, 1, 2], crane) - crane.sling_m
        return below

    def _nearest_m(self, crane: TowerCrane, bases_m: _Floats) -> _Floats:
        """Return (B, N) the least radius at which each part may lie beside a crane."""
        apart_m = distances_m(bases_m, self._centres_m)
        room_m = _room_m(self._wanted, crane)
        wide_m = self._lying_m[:, 1] / 2.0
        nearest = np.full((len(bases_m), len(wide_m)), np.inf)
        for half_m in np.unique(np.ceil(wide_m)):
            there_m = np.where(apart_m >= room_m + half_m, apart_m, np.inf).min(axis=1, initial=np.inf)
            own = np.ceil(wide_m) == half_m
            nearest[:, own] = there_m[:, None] + wide_m[own]
        return nearest

    def _yard(self, stands: Sequence[_Stand], parts: Sequence[NDArray[np.int64]]) -> list[Polygon | None]:
        """Return a rectangle beside each set-up, the nearest in which its parts lie, clear of all set-ups."""
        rooms = [shapely.Point(one.base_m).buffer(_room_m(self._wanted, one.crane)) for one in stands]
        taken = shapely.union_all(rooms)
        found: list[Polygon | None] = []
        for one, own in zip(stands, parts, strict=True):
            polygon = self._beside(one, own, taken) if len(own) and not self._given else None
            if polygon is not None:
                taken = shapely.union_all([taken, shapely.Polygon(polygon)])
            found.append(polygon)
        return found

    def _picked(self, one: _Stand, own: NDArray[np.int64], boxes: NDArray[np.object_]) -> NDArray[np.int64]:
        """Return how many parts of a set-up lie within its reach in each of (C,) rectangles, along the longer side."""
        x0, y0, x1, y1 = shapely.bounds(boxes).reshape(-1, 4).T
        centres_m, half_m = np.column_stack([x0 + x1, y0 + y1]) / 2.0, np.column_stack([x1 - x0, y1 - y0]) / 2.0
        along_x = (half_m[:, 0] >= half_m[:, 1])[:, None, None]
        sizes_m = np.where(along_x, self._lying_m[own], self._lying_m[own, ::-1])
        # The hook is over the middle of a part, which lies within the rectangle.
        spare_m = np.maximum(half_m[:, None] - sizes_m / 2.0, 0.0)
        away_m = np.maximum(np.abs(centres_m - one.base_m)[:, None] - spare_m, 0.0)
        _, far_m = radii_for_m(one.crane, self._masses_kg[own]).T
        count: NDArray[np.int64] = (np.hypot(away_m[..., 0], away_m[..., 1]) + MARGIN_M <= far_m).sum(axis=1)
        return count

    def _beside(self, one: _Stand, own: NDArray[np.int64], taken: BaseGeometry) -> Polygon | None:
        """Return the rectangle for the parts of a set-up: where most of them may lie, the largest, then the nearest."""
        long_m, wide_m = (float(np.ceil(value)) for value in self._lying_m[own].max(axis=0))
        open_area = shapely.difference(self._free, taken)
        shapely.prepare(open_area)
        base, tried = shapely.Point(one.base_m), list[tuple[tuple[int, int, float, int], BaseGeometry]]()
        for rows in range(1, min(_MOST_ROWS, len(own)) + 1):
            for sides_m in ((long_m, rows * wide_m), (rows * wide_m, long_m)):
                half_m = np.array(sides_m) / 2.0
                boxes = shapely.box(*(self._centres_m - half_m).T, *(self._centres_m + half_m).T)
                fits = boxes[shapely.contains_properly(open_area, boxes)]
                at_m = shapely.distance(base, fits) + wide_m / 2.0
                most = self._picked(one, own, fits)
                tried += [
                    ((-int(count), -rows, round(float(m), 6), len(tried) + n), box)
                    for n, (count, m, box) in enumerate(zip(most, at_m, fits, strict=True))
                ]
        if not tried:
            return None
        _, box = min(tried, key=lambda each: each[0])
        x0, y0, x1, y1 = box.bounds
        return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def _best_rigs(where: Sequence[_Stand], served: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the stands that serve a part, without those on whose base another rig serves the same parts and more."""
    rigs: dict[tuple[float, ...], list[int]] = {}
    for n in np.flatnonzero(served.any(axis=1)).tolist():
        rigs.setdefault(tuple(where[n].base_m.tolist()), []).append(n)
    best: list[int] = []
    for rows in rigs.values():
        own = served[rows]
        within = (own[:, None] <= own).all(axis=-1)
        worse = ((within & ~within.T) | np.tril(within & within.T, -1)).any(axis=1)
        best += np.array(rows)[~worse].tolist()
    return np.sort(np.array(best, np.int64))


def _room_m(wanted: Wanted, crane: TowerCrane) -> float:
    """Return how far from a crane's axis nothing stands or lies: its base and its counterweight keep clear."""
    return max(mast_room_m(wanted.config, crane), outline_of(crane).tail_m + MARGIN_M)
