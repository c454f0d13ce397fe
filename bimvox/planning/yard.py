"""Yard allocation: the place of each part in the yard, by deliveries (truckloads), and what one truck carries.

Parts are placed in the order in which they are needed. A place keeps the slinger's gap to its neighbours, is clear of
structures, and lies within the crane's reach for the part's mass. A flat part goes under a stack if it can
(:mod:`bimvox.planning.stacks`), a wall into a rack (:mod:`bimvox.planning.stacks`). Otherwise the place with the least
travel time is used, including the travel from the part before; of equally good places the first.

A new delivery begins if the next part does not fit into the yard or onto the truck (:mod:`bimvox.planning.yard`),
or if the site file gives its place to another part of the delivery.
It arrives when every earlier lift is finished. By then the yard is empty except for places that the site file gives to
later parts, so an earlier arrival could bring no more. Parts of an earlier delivery that could not be lifted go back
with the truck.

The allocation scans the yard's cells instead of packing rectangles, because yards are polygons with holes (mast,
structure) and the crane's reach cuts them too. Obstructions are ignored: they come and go, and a lift that one of them
blocks is reported as blocked.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.own_box import boxes_m
from bimvox.crane.travel import Travel
from bimvox.grid.frame import whole_cells
from bimvox.kept import kept
from bimvox.planning.best_place import BestPlace, Clearance, Lying, counts
from bimvox.planning.stacks import Racks, Rectangle, Stacks, Taken, is_racked, is_stacked
from bimvox.records.lift import YardPlace, yard_place
from bimvox.site.collision import margin_vox
from bimvox.site.component import Component, StoredPose, erection_size_vox, turned_shape
from bimvox.site.default_rules import HEADROOM_M, INLOADER_M, NOTHING_KEPT
from bimvox.site.means import Means
from bimvox.site.site import HeadingRule, Site
from bimvox.site.work import Work, kind_of

# What one truck carries: its mass, and room for its parts on a flat bed or in an inloader.
#
# The rule of room: parts are loaded in the order of their lifts, so the one that is needed first is unloaded last and
# lies on top in the yard. Each lies with its longest edge along the bed and its shortest upwards; a wall stands, and a
# brace or a rafter, which is set at a slope, is laid flat. They lie one behind the other in a row, rows next to each
# other in a layer, layers on each other with dunnage between. It leaves gaps that a good driver fills, and says nothing
# about axle loads or how the load is secured.

Size = tuple[float, float, float]
"""Along, across and above the bed, m."""
_ROUNDING_M = 1e-6
_KG = 1e-6


class Truckload:
    """The parts on one truck so far.

    A heavier part comes alone. A larger one comes with the delivery by a special transport, and takes no room on its
    truck.

    Args:
        site: The site.
    """

    def __init__(self, site: Site) -> None:
        self._most_kg = site.rules.truckload_kg
        yard = site.rules.yard
        beds = () if yard is None or yard.truck_m is None or not self._most_kg else (yard.truck_m, INLOADER_M)
        self._empty = [_Bed(size, yard.dunnage_m) for size in beds if yard is not None]
        self._beds = self._empty
        self._mass_kg, self._parts = 0.0, 0

    def __len__(self) -> int:
        return self._parts

    def is_full_for(self, component: Component) -> bool:
        """Return whether a part must come with the next truck."""
        if not self._parts or not self._most_kg:
            return False
        if self._mass_kg + component.mass_kg > self._most_kg + _KG:
            return True
        return self._takes_room(component) and not any(bed.with_part(_ways_m(component)) for bed in self._beds)

    def add(self, component: Component) -> None:
        """Load a part."""
        if self._takes_room(component):
            loaded = (bed.with_part(_ways_m(component)) for bed in self._beds)
            self._beds = [bed for bed in loaded if bed is not None]
        self._mass_kg += component.mass_kg
        self._parts += 1

    def _takes_room(self, component: Component) -> bool:
        return any(bed.with_part(_ways_m(component)) for bed in self._empty)


def fit_trucks(site: Site, order: Iterable[int], deliveries: Mapping[int, int]) -> bool:
    """Return whether every delivery fits onto its truck, loaded in an order of all parts.

    Args:
        site: The site.
        order: The parts in the order of their lifts.
        deliveries: The delivery of each part that has a place in the yard.
    """
    loads: dict[int, Truckload] = {}
    for part in order:
        if part in deliveries:
            load = loads.setdefault(deliveries[part], Truckload(site))
            if load.is_full_for(site.components[part]):
                return False
            load.add(site.components[part])
    return True


@dataclass(frozen=True, slots=True)
class _Bed:
    size_m: Size
    dunnage_m: float
    top_m: float = 0.0  # of the layers below
    rows_m: float = 0.0  # width of the finished rows of this layer
    high_m: float = 0.0  # of this layer
    row_m: tuple[float, float] = (0.0, 0.0)  # length and width of this row

    def with_part(self, ways_m: tuple[Size, ...]) -> _Bed | None:
        """Return the bed with one more part, which lies in the first way that an empty bed takes; None if full."""
        empty = _Bed(self.size_m, self.dunnage_m)
        way = next((way for way in ways_m if empty.holds(way)), None)
        if way is None:
            return None
        along, across, high = way
        (length, width), tallest = self.row_m, max(self.high_m, high)
        same_row = self._with(self.top_m, self.rows_m, tallest, (length + along, max(width, across)))
        next_row = self._with(self.top_m, self.rows_m + width, tallest, (along, across))
        top_m = self.top_m + self.high_m + self.dunnage_m
        next_layer = self._with(top_m, 0.0, high, (along, across))
        return next((bed for bed in (same_row, next_row, next_layer) if bed.holds()), None)

    def holds(self, more_m: Size | None = None) -> bool:
        """Return whether what is loaded, or one part on an empty bed, is within its limits."""
        used = more_m or (self.row_m[0], self.rows_m + self.row_m[1], self.top_m + self.high_m)
        return all(own <= most + _ROUNDING_M for own, most in zip(used, self.size_m, strict=True))

    def _with(self, top_m: float, rows_m: float, high_m: float, row_m: tuple[float, float]) -> _Bed:
        return _Bed(self.size_m, self.dunnage_m, top_m, rows_m, high_m, row_m)


@kept
def _ways_m(component: Component) -> tuple[Size, ...]:
    """Return how a part may lie on a truck, the usual way first."""
    stands = kind_of(component) is Work.WALL
    boxes = boxes_m(component.mesh)
    pairs = (((long_m, wide_m, thin_m), (long_m, thin_m, wide_m)) for long_m, wide_m, thin_m in boxes)
    return tuple(way for flat, on_edge in pairs for way in ((on_edge, flat) if stands else (flat, on_edge)))


_GAP_VOX = 1


def allocate_yard(site: Site, order: tuple[int, ...], *travels: Travel) -> tuple[YardPlace | None, ...]:
    """Return the place of every component in the yard, for an order; without travel times the first free place.

    Returns per component (by index) its place; None if it does not fit into the empty yard, turned or not.
    """
    empty = _open_yard(site)
    lifted = (index for index in order if site.components[index].means is Means.CRANE)
    given = [index for index in lifted if site.components[index].start_vox is not None]
    places: list[YardPlace | None] = [None] * len(site.components)
    now = _Delivery(site, 0, _without_given(site, empty, given))
    best = BestPlace(site, _fixed_tops(site), travels)
    before: dict[int, Component] = {}
    borders = sorted({margin_vox(site), margin_vox(site, NOTHING_KEPT)}, reverse=True)
    shares = (None, 1.0) if "highest_utilisation" in site.rules.gives_way else (None,)
    for index in order:
        component = site.components[index]
        if component.means is not Means.CRANE:
            continue
        fresh = _without_given(site, empty, given) if now.load else now.free
        if now.load.is_full_for(component):
            now.settle(places)
            now = _Delivery(site, now.number + 1, fresh)
        if component.start_vox is not None:
            pose, turn = _given(component)
            place = (*component.start_vox[:2], *_footprint(component, pose, turn))
            if now.holds_at(place):
                now.settle(places)
                now = _Delivery(site, now.number + 1, fresh)
            places[index] = yard_place(component, now.number, pose, component.start_vox, turn=turn)
            given.remove(index)
            now.given.append(place)
            now.stacks.add(component, place)
            now.load.add(component)
            continue
        racked, alone = now.rooms(component, fresh)
        rooms = [
            (Clearance(border, False, share), room)
            for border, share, some in product(borders, shares, (racked, alone))
            for room in some
        ]
        if site.rules.heading is HeadingRule.WITH_JIB:
            rooms.insert(0, (Clearance(borders[0], True), (*racked, *alone)[0]))
        for clearance, room in rooms:
            found = best.of(component, room.columns, room.lyings, clearance, before.get(component.crane))
            if found is not None:
                if room.is_fresh:
                    now.settle(places)
                    now = _Delivery(site, now.number + 1, fresh)
                (pose, turn), cell = found
                now.add(component, (*cell[:2], *_footprint(component, pose, turn)), room.side)
                places[index] = yard_place(component, now.number, pose, cell, turn=turn)
                before[component.crane] = component
                break
    now.settle(places)
    return risen(site, order, places)


class _Room(NamedTuple):
    """Where a part may lie: (X, Y) columns, and how.

    In a rack, ``side`` is that of the frame; 0: in none. ``is_fresh``: only if it comes with the next delivery.
    """

    columns: NDArray[np.bool_]
    lyings: tuple[Lying, ...]
    is_fresh: bool = False
    side: int = 0


class _Delivery:
    """What one delivery brings, and what it leaves free."""

    def __init__(self, site: Site, number: int, free: NDArray[np.bool_]) -> None:
        self._site, self._gap_vox = site, gap_vox(site)
        self.number, self.free, self.load = number, free, Truckload(site)
        self.given: list[Rectangle] = []
        taken = Taken(self._gap_vox)
        self.stacks, self.racks = Stacks(site, taken), Racks(site, taken)

    def rooms(self, component: Component, fresh: NDArray[np.bool_]) -> tuple[list[_Room], list[_Room]]:
        """Return where a part may lie in racks, and where otherwise, the best first; ``fresh`` is an empty yard."""
        preferred, turned = _preferred(component), _turned(component)
        alone = [_Room(self.free, preferred), _Room(self.free, turned)]
        if self.load:
            # Turning takes time and room: a part is turned only if it does not fit otherwise.
            alone = [alone[0], _Room(fresh, preferred, True), alone[1], _Room(fresh, turned, True)]
        if not is_racked(self._site, component):
            if self.load and is_stacked(self._site, component):
                below = self.stacks.room_below(component, _footprint(component, *preferred[0]), fresh)
                alone = [*([_Room(below, preferred)] if below.any() else []), *alone]
            return [], alone
        racked = []
        behind = self.racks.room_behind(component, _footprint(component, *preferred[0]), fresh)
        if behind.any():
            racked.append(_Room(behind, preferred, side=1))
        for room in alone:
            for lying, side in product(room.lyings, (1, -1)):
                free = self.racks.room_for_new(component, _footprint(component, *lying), room.columns, side)
                racked.append(_Room(free, (lying,), room.is_fresh, side))
        return racked, alone

    def holds_at(self, place: Rectangle) -> bool:
        """Return whether the site file gives a place that overlaps this one to another of its parts."""
        x, y, size_x, size_y = place
        return any(
            x < other_x + other_size_x and other_x < x + size_x and y < other_y + other_size_y and other_y < y + size_y
            for other_x, other_y, other_size_x, other_size_y in self.given
        )

    def add(self, component: Component, place: Rectangle, side: int) -> None:
        """Take a place for a part."""
        if side:
            place = self.racks.add(component, place, side)
        else:
            self.stacks.add(component, place)
        _take(self.free, place[:2], place[2:], self._gap_vox)
        self.load.add(component)

    def settle(self, places: list[YardPlace | None]) -> None:
        """Write stacks and racks into the places of this delivery, which is complete."""
        self.stacks.settle(places)
        self.racks.settle(places)


def gap_vox(site: Site) -> int:
    """Return how many columns stay free between two places."""
    gap_m = 0.0 if site.rules.yard is None else site.rules.yard.gap_m
    return max(_GAP_VOX, whole_cells(gap_m, site.frame.voxel_size_m))


def storage_poses(component: Component) -> tuple[StoredPose, ...]:
    """Return the poses in which a component may be stored, the preferred one first."""
    if component.stored_pose is not None:
        return (component.stored_pose,)
    return (StoredPose.LYING_X, StoredPose.LYING_Y) if component.erected else (StoredPose.AS_BUILT,)


def _preferred(component: Component) -> tuple[Lying, ...]:
    return tuple((pose, component.stored_turn or 0) for pose in storage_poses(component))


def _turned(component: Component) -> tuple[Lying, ...]:
    return tuple((pose, 1) for pose in storage_poses(component)) if component.stored_turn is None else ()


def _given(component: Component) -> Lying:
    return storage_poses(component)[0], component.stored_turn or 0


def risen(site: Site, order: tuple[int, ...], places: Sequence[YardPlace | None]) -> tuple[YardPlace | None, ...]:
    """Return the places with the rise of turned parts: how far they are raised before they are turned.

    They are raised above everything within the circle of their corners: structures, parts of the same delivery, and
    parts of the building that are set earlier.
    """
    if not any(place is not None and place.turn for place in places):
        return tuple(places)
    tops = _fixed_tops(site)
    found = list(places)
    for index in order:
        component, place = site.components[index], places[index]
        if place is not None and place.turn:
            columns = place.turning_cells(component)[:, :2]
            inside = ((columns >= 0) & (columns < site.shape[:2])).all(axis=1)
            near = tops.copy()
            for other, mate in enumerate(places):
                if mate is not None and other != index and mate.delivery == place.delivery:
                    _raise_tops(near, mate.shape.cells + np.array(mate.cell_vox, np.int32))
            top = int(near[tuple(columns[inside].T)].max(initial=0))
            found[index] = replace(place, rise_vox=max(1, top - place.cell_vox[2]))
        _raise_tops(tops, component.shape.cells + np.array(component.target_vox, np.int32))
    return tuple(found)


def _fixed_tops(site: Site) -> NDArray[np.int32]:
    """Return (X, Y) one above the highest cell of ground, structure and masts."""
    tops = site.ground_vox + np.int32(1)
    for blocker in site.blockers:
        if blocker.kind in ("structure", "crane"):
            _raise_tops(tops, blocker.cells)
    return tops


def _raise_tops(tops: NDArray[np.int32], cells: NDArray[np.int32]) -> None:
    np.maximum.at(tops, (cells[:, 0], cells[:, 1]), cells[:, 2] + np.int32(1))


def _open_yard(site: Site) -> NDArray[np.bool_]:
    free = site.yard.copy()
    for blocker in site.blockers:
        if blocker.kind in ("structure", "crane"):
            x, y, z = blocker.cells.T
            above = z > site.ground_vox[x, y]
            free[x[above], y[above]] = False
    if site.rules.yard is not None and site.rules.yard.gap_m > 0.0:
        free &= ~_within(_beside_people(site), whole_cells(site.rules.yard.gap_m, site.frame.voxel_size_m))
    return free


def _beside_people(site: Site) -> NDArray[np.bool_]:
    """Return (X, Y) the columns with structure, a mast or a finished part that a person on the ground meets."""
    floor, head = site.yard_floor_vox, whole_cells(HEADROOM_M, site.frame.voxel_size_m)
    result = np.zeros(site.shape[:2], np.bool_)
    own = [blocker.cells for blocker in site.blockers if blocker.kind in ("structure", "crane")]
    own += [component.shape.cells + np.array(component.target_vox, np.int32) for component in site.components]
    for cells in own:
        result[tuple(cells[(cells[:, 2] >= floor) & (cells[:, 2] < floor + head), :2].T)] = True
    return result


def _within(columns: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Return (X, Y) the columns with a marked column within ``reach`` columns on each axis."""
    table = counts(columns)
    x0, y0 = (np.maximum(np.arange(size) - reach, 0) for size in columns.shape)
    x1, y1 = (np.minimum(np.arange(size) + reach + 1, size) for size in columns.shape)
    result: NDArray[np.bool_] = (
        table[np.ix_(x1, y1)] - table[np.ix_(x0, y1)] - table[np.ix_(x1, y0)] + table[np.ix_(x0, y0)] > 0
    )
    return result


def _without_given(site: Site, empty: NDArray[np.bool_], given: list[int]) -> NDArray[np.bool_]:
    """Return the empty yard without the places that the site file gives to parts still to be lifted."""
    free = empty.copy()
    for index in given:
        component = site.components[index]
        if component.start_vox is not None:
            _take(free, component.start_vox[:2], _footprint(component, *_given(component)), gap_vox(site))
    return free


def _footprint(component: Component, pose: StoredPose, turn: int) -> tuple[int, int]:
    size_x, size_y, _ = erection_size_vox(turned_shape(component.shape, turn), pose)
    return size_x, size_y


def _take(free: NDArray[np.bool_], corner: tuple[int, int], footprint: tuple[int, int], gap_vox: int) -> None:
    x, y = corner
    free[max(0, x - gap_vox) : x + footprint[0] + gap_vox, max(0, y - gap_vox) : y + footprint[1] + gap_vox] = False
