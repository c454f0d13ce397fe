"""Yard allocation: the place of each part in the yard, by deliveries.

Parts are placed in the order in which they are needed. A place keeps the slinger's gap to its neighbours, is clear of
structures, and lies within the crane's reach for the part's mass. A flat part goes under a stack if it can
(:mod:`bimvox.planning.stacks`), a wall into a rack (:mod:`bimvox.planning.stacks`). Otherwise the place with the least
travel time is used, including the travel from the part before; of equally good places the first.

A new delivery begins if the next part does not fit into the yard or onto its lorries (:mod:`bimvox.records.unloading`),
if the site file gives its place to another part of the delivery, or where the fewest lorries come in all: cuts are
searched with the yard as it is. So does one where the sequence waits long (:mod:`bimvox.planning.long_waits`): the rest
comes near its day. A part lies turned only if it otherwise fits nowhere, or if a lorry less comes then.
It arrives when every earlier lift is finished. By then the yard is empty except for places that the site file gives to
later parts, so an earlier arrival could bring no more. Parts of an earlier delivery that could not be lifted go back
with a lorry.

The allocation scans the yard's cells instead of packing rectangles, because yards are polygons with holes (mast,
structure) and the crane's reach cuts them too. Obstructions are ignored: they come and go, and a lift that one of them
blocks is reported as blocked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush
from itertools import pairwise, product
from operator import attrgetter
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.travel import Travel
from bimvox.grid.frame import whole_cells
from bimvox.planning.best_place import BestPlace, Clearance, Lying, counts
from bimvox.planning.long_waits import begin_days, ends_by_moves, ends_by_waits
from bimvox.planning.occupancy import highest_around
from bimvox.planning.stacks import Racks, Rectangle, Stacks, Taken, is_racked, is_stacked
from bimvox.records.lift import YardPlace, yard_place
from bimvox.records.unloading import Lorries, fewest_lorries
from bimvox.site.collision import clearance_vox, hook_room, levels_vox, margin_vox
from bimvox.site.component import Component, IntVec, StoredPose
from bimvox.site.default_rules import HEADROOM_M, NOTHING_KEPT
from bimvox.site.flip_box import raised_size_vox
from bimvox.site.lifting import shares_to_try
from bimvox.site.means import Means
from bimvox.site.site import HeadingRule, Site

_GAP_VOX = 1


def allocate_yard(
    site: Site, order: tuple[int, ...], *travels: Travel, waits_for: Sequence[Sequence[int]] = ()
) -> tuple[YardPlace | None, ...]:
    """Return the place of every component in the yard, for an order; without travel times the first free place.

    ``waits_for``: per component, those that it waits for; without them, no wait ends a delivery.

    Returns per component (by index) its place; None if it does not fit into the empty yard, turned or not.
    """
    parts = [index for index in order if site.components[index].means is Means.CRANE]
    ends = ends_by_waits(parts, begin_days(site, order, waits_for) if waits_for else {})
    if site.moving is not None:  # what a delivery brings is unloaded and lifted in one set-up
        ends = [min(end, stay) for end, stay in zip(ends, ends_by_moves(site, parts), strict=True)]
    fewest = fewest_lorries(site, [site.components[index] for index in parts], ends)
    allocation = _Allocation(site, parts, travels, ends)
    lorries, cuts = _cuts(allocation, fewest)
    if lorries > fewest[0]:
        fuller = _Allocation(site, parts, travels, ends, turns=True)
        fewer, others = _cuts(fuller, fewest)
        if fewer < lorries:
            allocation, cuts = fuller, others
    for number, (first, end) in enumerate(pairwise(cuts)):
        allocation.deliver(number, first, end)
    return risen(site, order, allocation.places)


_TRIES: Final = 40
"""How many deliveries are tried before the search for the fewest lorries goes straight on."""


def _cuts(allocation: _Allocation, fewest: Sequence[int]) -> tuple[int, tuple[int, ...]]:
    """Return how many lorries come, and where deliveries begin and the last one ends, so that they are the fewest.

    A* over the parts with which a delivery may begin. The bound, ``fewest``: how many lorries bring the rest to a yard
    without limits. Of equally few lorries in all, the longest deliveries are preferred. After ``_TRIES`` deliveries,
    what is left counts twice, so that the search ends soon, though not always with the fewest.
    """
    ahead: list[tuple[int, int, int, tuple[int, ...]]] = [(fewest[0], 0, 0, (0,))]
    tried: set[int] = set()
    weight = 1
    while ahead:
        _, _, lorries, cuts = heappop(ahead)
        if cuts[-1] == len(fewest) - 1:
            return lorries, cuts
        if cuts[-1] in tried:
            continue
        tried.add(cuts[-1])
        if len(tried) == _TRIES:
            weight = 2
            ahead = [(come + weight * fewest[-end], end, come, path) for _, end, come, path in ahead]
            heapify(ahead)
        for end, count in allocation.ends(cuts[-1]):
            come = lorries + count
            heappush(ahead, (come + weight * fewest[end], -end, come, (*cuts, end)))
    raise AssertionError("a delivery brings no part")


class _Allocation:
    """Gives the parts their places, one delivery after the other.

    Args:
        site: The site.
        parts: What cranes lift, in the order of the lifts.
        travels: Travel times of the cranes.
        ends: Where a delivery ends at the latest that begins with each of them.
        turns: Whether a part is turned so that it has room; otherwise it comes with the next delivery if that helps.
    """

    def __init__(
        self, site: Site, parts: Sequence[int], travels: Sequence[Travel], ends: Sequence[int], *, turns: bool = False
    ) -> None:
        self.site = site
        self._parts, self._ends, self._turns = parts, ends, turns
        self._empty = _open_yard(site)
        self._best = BestPlace(site, _fixed_tops(site), tuple(travels))
        self._borders = sorted({margin_vox(site), margin_vox(site, NOTHING_KEPT)}, reverse=True)
        self._upending = levels_vox(site, "upending_clearance_m")
        self._departure = levels_vox(site, "departure_clearance_m")
        self._shares = shares_to_try(site.rules)
        self._before: dict[int, Component] = {}
        self._given: list[int] = []
        self._made: dict[int, _Made] = {}
        self.places: list[YardPlace | None] = [None] * len(site.components)

    def _asides(self, component: Component) -> tuple[int, ...]:
        """Return how many columns around a part may stay clear of structures and the building, the most first."""
        return self._upending if component.erected else self._departure

    def ends(self, first: int) -> list[tuple[int, int]]:
        """Return where a delivery may end that begins with a part, and how many lorries it then is.

        It ends where another lorry would come, at the latest where the yard or its lorries are full, or before a
        long wait.
        """
        made = self._made[first] = self._delivery(first, self._ends[first])
        return sorted((end, lorries) for lorries, end in made.ends.items())

    def deliver(self, number: int, first: int, end: int) -> None:
        """Give some of the parts their places: those of a delivery."""
        made = self._made.get(first)
        if made is None or max(made.ends.values()) != end:
            made = self._delivery(first, end)
        for index, place in zip(self._parts[first:end], made.places, strict=True):
            self.places[index] = place and replace(place, delivery=number)
        made.delivery.settle(self.places)

    def _delivery(self, first: int, end: int) -> _Made:
        """Place parts from one on, one after the other, as long as there is room."""
        self._before = {}
        for index in self._parts[:first]:
            component = self.site.components[index]
            if self.places[index] is not None and component.start_vox is None:
                self._before[component.crane] = component
        self._given = [index for index in self._parts[first:] if self.site.components[index].start_vox is not None]
        now = _Delivery(self.site, _without_given(self.site, self._empty, self._given))
        ends: dict[int, int] = {}
        for at, index in enumerate(self._parts[first:end], start=first):
            if now.load.is_full_for(self.site.components[index]) or not self._place(now, index):
                break
            ends[now.load.count] = at + 1
        return _Made(now, ends, [self.places[index] for index in self._parts[first : max(ends.values())]])

    def _place(self, now: _Delivery, index: int) -> bool:
        """Give a part its place, if there is one; return False if it must come with the next delivery."""
        site = self.site
        component = site.components[index]
        self.places[index] = None
        if component.start_vox is not None:
            pose, turn = _given(component)
            place = (*component.start_vox[:2], *_footprint(component, pose, turn))
            if now.holds_at(place):
                return False
            self.places[index] = yard_place(component, 0, pose, component.start_vox, turn=turn)
            self._given.remove(index)
            now.given.append(place)
            now.stacks.add(component, place)
            now.keep_apart(component, place)
            now.load.add(component)
            return True
        racked, alone = now.rooms(component, _without_given(site, self._empty, self._given))
        if self._turns:
            racked, alone = (sorted(rooms, key=attrgetter("is_fresh")) for rooms in (racked, alone))
        rooms = [
            (Clearance(border, False, share, aside), room)
            for border, aside, share, some in product(
                self._borders, self._asides(component), self._shares, (racked, alone)
            )
            for room in some
        ]
        if site.rules.heading is HeadingRule.WITH_JIB:
            aside = self._asides(component)[0]
            rooms.insert(0, (Clearance(self._borders[0], True, None, aside), (*racked, *alone)[0]))
        for clearance, room in rooms:
            before = self._before.get(component.crane)
            found = self._best.of(component, room.columns, room.lyings, clearance, before)
            if found is not None:
                if room.is_fresh:
                    return False
                (pose, turn), cell = found
                now.add(component, (*cell[:2], *_footprint(component, pose, turn)), room.side)
                self.places[index] = yard_place(component, 0, pose, cell, turn=turn)
                self._before[component.crane] = component
                return True
        return True


class _Made(NamedTuple):
    """A delivery that is as long as there is room.

    Attributes:
        delivery: What it brings.
        ends: How many of all parts have come when so many lorries have been unloaded.
        places: The places of its parts, in the order of their lifts; of its number nothing is known.
    """

    delivery: _Delivery
    ends: dict[int, int]
    places: list[YardPlace | None]


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

    def __init__(self, site: Site, free: NDArray[np.bool_]) -> None:
        self._site, self._gap_vox = site, gap_vox(site)
        self.free, self.load = free, Lorries(site)
        self._apart = np.ones_like(free)
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
                below = self.stacks.room_below(component, _footprint(component, *preferred[0]), fresh & self._apart)
                alone = [*([_Room(below, preferred)] if below.any() else []), *alone]
            return [], alone
        racked = []
        behind = self.racks.room_behind(component, _footprint(component, *preferred[0]), fresh & self._apart)
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
        self.keep_apart(component, place)
        self.load.add(component)

    def keep_apart(self, component: Component, place: Rectangle) -> None:
        """Keep what comes later away from a part that is upended: it is still there then."""
        if component.erected:
            around = clearance_vox(self._site, "upending_clearance_m")
            _take(self.free, place[:2], place[2:], around)
            _take(self._apart, place[:2], place[2:], around)

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
    may_turn = component.stored_turn is None and component.tandem is None
    return tuple((pose, 1) for pose in storage_poses(component)) if may_turn else ()


def _given(component: Component) -> Lying:
    return storage_poses(component)[0], component.stored_turn or 0


def risen(site: Site, order: tuple[int, ...], places: Sequence[YardPlace | None]) -> tuple[YardPlace | None, ...]:
    """Return the places with the rise of turned parts: how far they are raised before they are turned.

    They are raised above everything within the circle of their corners: structures, parts of the same delivery, and
    parts of the building that are set earlier. They keep their clearance, or as much of it as fits below the jib and
    into the site.
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
            found[index] = _raised(site, component, place, near, columns[inside])
        _raise_tops(tops, component.shape.cells + np.array(component.target_vox, np.int32))
    return tuple(found)


def _raised(
    site: Site, component: Component, place: YardPlace, near: NDArray[np.int32], columns: NDArray[np.int32]
) -> YardPlace:
    """Return a place with its rise; ``near``: (X, Y) how high things are; ``columns``: (N, 2) what it sweeps."""
    asides = levels_vox(site, "turning_clearance_m")
    ceiling = hook_room(site, site.crane_of(component), np.zeros_like(near), component, place.turn).ceiling
    for aside in asides:
        top = int(highest_around(near, aside)[tuple(columns.T)].max(initial=0)) + aside
        raised = replace(place, rise_vox=max(place.rise_vox, top - place.cell_vox[2]))
        foot = np.add(raised.transit_start_vox, component.hook_offset_vox)
        inside = raised.transit_start_vox[2] + component.shape.size_vox[2] <= site.shape[2]
        if aside == asides[-1] or (inside and (not ceiling.size or foot[2] <= ceiling[foot[0], foot[1]])):
            break
    return raised


def near_upended(site: Site, places: Sequence[YardPlace | None]) -> NDArray[np.bool_]:
    """Return (N, N) whether a part lies nearer than the clearance to the room in which another is upended.

    The first index is the part that lies there.
    """
    parts, asked = site.components, clearance_vox(site, "upending_clearance_m")
    near = np.zeros((len(parts), len(parts)), np.bool_)
    lying = [index for index, place in enumerate(places) if place is not None]
    if not asked or not lying:
        return near
    boxes = np.array([_box(place.cell_vox, place.shape.size_vox) for place in places if place is not None])
    for index, place in enumerate(places):
        if place is not None and place.is_upended:
            low, high = _box(place.cell_vox, place.raising_size_vox(parts[index]))
            close = ((boxes[:, 0] < high + asked) & (boxes[:, 1] > low - asked)).all(axis=1)
            near[np.array(lying)[close], index] = True
    return near


def _box(low: IntVec, size: IntVec) -> NDArray[np.int64]:
    return np.array([low, np.add(low, size)])


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
    size_x, size_y, _ = raised_size_vox(component, pose, turn)
    return size_x, size_y


def _take(free: NDArray[np.bool_], corner: tuple[int, int], footprint: tuple[int, int], gap_vox: int) -> None:
    x, y = corner
    free[max(0, x - gap_vox) : x + footprint[0] + gap_vox, max(0, y - gap_vox) : y + footprint[1] + gap_vox] = False
