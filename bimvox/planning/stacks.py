"""Stacks and racks in the yard: flat parts on each other, walls against a frame, what is lifted first outermost.

Parts get their places in the order of their lifts, so a stack grows downwards: the next part goes underneath, if
everything above lies within its outline. How high each part lies is known when the delivery is complete.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import whole_cells
from bimvox.records.lift import YardPlace
from bimvox.site.collision import margin_vox
from bimvox.site.component import Component, StoredPose, turned_hook
from bimvox.site.default_rules import RACKED_THINNESS, YardRules
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of

Rectangle = tuple[int, int, int, int]
"""Lowest column and size, cells."""
_LEAST_VOX = 1
_ROUNDING = 1e-9
_STACKED = (Work.SLAB, Work.BEAM)


@dataclass(slots=True)
class _Stack:
    members: list[Component]  # in the order of their lifts: the lowest last
    lowest: Rectangle

    def takes(self, component: Component, size: tuple[int, int], rules: YardRules) -> bool:
        members = [*self.members, component]
        whole_m = sum(_height_m(one) for one in members) + (len(members) - 1) * rules.dunnage_m
        return (
            len(members) <= rules.stack_parts
            and component.crane == members[0].crane
            and size[0] >= self.lowest[2]
            and size[1] >= self.lowest[3]
            and sum(one.mass_kg for one in members) <= rules.stack_kg
            and whole_m <= min(rules.stack_height_m, _width_m(component)) + _ROUNDING
        )

    def around(self, size: tuple[int, int]) -> list[Rectangle]:
        """Return where a part of this size may lie under the stack: under its middle, or flush with a side."""
        x, y, width, depth = self.lowest
        more_x, more_y = size[0] - width, size[1] - depth
        shifts = product((more_x // 2, 0, more_x), (more_y // 2, 0, more_y))
        return list(dict.fromkeys((x - left, y - front, *size) for left, front in shifts))


class Taken:
    """The places of one delivery.

    Args:
        gap_vox: Columns that stay free between two places.
    """

    def __init__(self, gap_vox: int) -> None:
        self._gap_vox = gap_vox
        self._places: list[Rectangle] = []

    def add(self, place: Rectangle) -> None:
        """Add a place."""
        self._places.append(place)

    def replace(self, before: Rectangle, place: Rectangle) -> None:
        """Take a place instead of another one."""
        self._places[self._places.index(before)] = place

    def fits(self, own: Rectangle, besides: Rectangle, free: NDArray[np.bool_]) -> bool:
        """Return whether a place is in the free yard (X, Y), and keeps the gap to all others but one."""
        inside = own[0] >= 0 and own[1] >= 0 and own[0] + own[2] <= free.shape[0] and own[1] + own[3] <= free.shape[1]
        return (
            inside
            and bool(free[_columns_of(own)].all())
            and all(other == besides or _are_apart(own, other, self._gap_vox) for other in self._places)
        )


class Stacks:
    """The stacks of one delivery.

    Args:
        site: The site.
        taken: The places of the delivery.
    """

    def __init__(self, site: Site, taken: Taken) -> None:
        self._site, self._taken = site, taken
        rules, size_m = site.rules.yard, site.frame.voxel_size_m
        self._dunnage_vox = 0 if rules is None else max(_LEAST_VOX, whole_cells(rules.dunnage_m, size_m))
        # Above its stack, a part still has its clearance in transit below and above it.
        self._highest_vox = site.shape[2] - 2 * margin_vox(site)
        self._stacks: list[_Stack] = []
        self._offered: dict[Rectangle, _Stack] = {}

    def room_below(self, component: Component, size: tuple[int, int], free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (X, Y) where a part, stored with this size, lies under a stack; nowhere if it goes under none.

        Args:
            component: The part.
            size: Its columns along x and y.
            free: The yard without this delivery.
        """
        room = np.zeros_like(free)
        self._offered.clear()
        rules = self._site.rules.yard
        if rules is None or not is_stacked(self._site, component):
            return room
        for stack in self._stacks:
            if (
                not stack.takes(component, size, rules)
                or self._top_vox([*stack.members, component]) > self._highest_vox
            ):
                continue
            for own in stack.around(size):
                if not self._taken.fits(own, stack.lowest, free):
                    continue
                # Apart from each other too, so that the part fits into each and nowhere between them.
                if all(_are_apart(own, other, _LEAST_VOX) for other in self._offered):
                    room[_columns_of(own)] = True
                    self._offered[own] = stack
                    break
        return room

    def add(self, component: Component, place: Rectangle) -> None:
        """Add a part that has got its place: under the stack there, or as the first of a new stack."""
        stack = self._offered.get(place)
        self._offered.clear()
        if stack is not None:
            self._taken.replace(stack.lowest, place)
            stack.lowest = place
            stack.members.append(component)
            return
        self._taken.add(place)
        if is_stacked(self._site, component):
            self._stacks.append(_Stack([component], place))

    def settle(self, places: list[YardPlace | None]) -> None:
        """Write number and height of every part of a stack into the places, which are on the ground so far."""
        numbered = (stack for stack in self._stacks if len(stack.members) > 1)
        for number, stack in enumerate(numbered, start=1):
            height = self._site.yard_floor_vox
            for component in reversed(stack.members):
                place = places[component.index]
                assert place is not None
                x, y, _ = place.cell_vox
                places[component.index] = replace(place, cell_vox=(x, y, height), stack=number)
                height += place.shape.size_vox[2] + self._dunnage_vox

    def _top_vox(self, members: Sequence[Component]) -> int:
        """Return the layer above a stack, which stands on the floor of the yard."""
        high = sum(one.shape.size_vox[2] for one in members) + (len(members) - 1) * self._dunnage_vox
        return self._site.yard_floor_vox + high


def is_stacked(site: Site, component: Component) -> bool:
    """Return whether a part may lie in a stack: flat, level, filling its box, with a place that the planner chooses."""
    rules = site.rules.yard
    return (
        rules is not None
        and rules.stack_parts > 1
        and _is_stored_as_built(component)
        and len(component.shape.cells) == int(np.prod(component.shape.size_vox))
        and _height_m(component) <= _width_m(component)
        and kind_of(component) in _STACKED
    )


def _is_stored_as_built(component: Component) -> bool:
    """Return whether a part lies as it is set, at a place that the planner chooses, for one crane."""
    as_built = not component.erected and component.stored_pose in (None, StoredPose.AS_BUILT)
    return as_built and component.start_vox is None and component.tandem is None


def _height_m(component: Component) -> float:
    """Return the height of a part as it is set."""
    return float(np.ptp(component.mesh.bounds_m[:, 2]))


def _width_m(component: Component) -> float:
    """Return the smaller size of a part on plan."""
    return float(np.ptp(component.mesh.bounds_m[:, :2], axis=0).min())


def _columns_of(place: Rectangle) -> tuple[slice, slice]:
    """Return the columns of a rectangle, as an index."""
    return slice(place[0], place[0] + place[2]), slice(place[1], place[1] + place[3])


def _are_apart(one: Sequence[int], other: Sequence[int], gap_vox: int) -> bool:
    """Return whether two rectangles have at least this many columns between them, along an axis."""
    return any(
        one[axis] >= other[axis] + other[axis + 2] + gap_vox or other[axis] >= one[axis] + one[axis + 2] + gap_vox
        for axis in (0, 1)
    )


# Racks in the yard: walls stand one behind the other against a frame, the one that is lifted first outermost.
#
# Walls get their places in the order of their lifts, so a rack grows away from its outer side: the next wall stands
# behind the last one, and the frame moves behind that. The frame needs room behind the last wall, as long as the
# longest and in proportion to the highest.


@dataclass(slots=True)
class _Rack:
    axis: int  # across the walls
    side: int  # of the frame: 1 or -1 along that axis
    members: list[Component]  # in the order of their lifts: the outermost first
    last: Rectangle  # of the last wall
    room: Rectangle  # of everything, with the frame


class Racks:
    """The racks of one delivery.

    Args:
        site: The site.
        taken: The places of the delivery, which stacks and racks share.
    """

    def __init__(self, site: Site, taken: Taken) -> None:
        self._site, self._taken = site, taken
        rules, self._size_m = site.rules.yard, site.frame.voxel_size_m
        self._rules = YardRules() if rules is None else rules
        self._between_vox = max(_LEAST_VOX, whole_cells(self._rules.dunnage_m, self._size_m))
        self._racks: list[_Rack] = []
        self._offered: dict[Rectangle, tuple[_Rack, Rectangle]] = {}

    def room_behind(self, component: Component, size: tuple[int, int], free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (X, Y) where a wall, stored with this size, stands in a rack that is there; nowhere if in none.

        Args:
            component: The wall.
            size: Its columns along x and y.
            free: The yard without this delivery.
        """
        room = np.zeros_like(free)
        self._offered.clear()
        for rack in self._racks:
            axis = rack.axis
            if (
                len(rack.members) >= self._rules.rack_parts
                or component.crane != rack.members[0].crane
                or _thin_axis(size) != axis
            ):
                continue
            for own in self._behind(rack, size):
                whole = _around(rack.room, self._with_frame(own, rack, component))
                if not self._taken.fits(whole, rack.room, free):
                    continue
                if all(_are_apart(own, other, _LEAST_VOX) for other in self._offered):
                    room[_columns_of(own)] = True
                    self._offered[own] = (rack, whole)
                    break
        return room

    def room_for_new(
        self, component: Component, size: tuple[int, int], free: NDArray[np.bool_], side: int
    ) -> NDArray[np.bool_]:
        """Return (X, Y) the columns on which a wall may stand as the first of a rack with its frame on a side."""
        deep, axis = self._deep_vox(component, []), _thin_axis(size)
        result = free.copy()
        for step in range(1, deep + 1):
            moved = np.zeros_like(free)
            here, there = [slice(None)] * 2, [slice(None)] * 2
            here[axis], there[axis] = (slice(None, -step), slice(step, None))[:: 1 if side > 0 else -1]
            moved[tuple(here)] = free[tuple(there)]
            result &= moved
        return result

    def add(self, component: Component, place: Rectangle, side: int) -> Rectangle:
        """Add a wall that has got its place: behind the rack there, or as the first of a new one.

        Returns what the rack takes now.
        """
        offered = self._offered.get(place)
        self._offered.clear()
        if offered is not None:
            rack, whole = offered
            self._taken.replace(rack.room, whole)
            rack.members.append(component)
            rack.last, rack.room = place, whole
            return whole
        rack = _Rack(_thin_axis(place[2:]), side, [], place, place)
        rack.room = self._with_frame(place, rack, component)
        rack.members.append(component)
        self._taken.add(rack.room)
        self._racks.append(rack)
        return rack.room

    def settle(self, places: list[YardPlace | None]) -> None:
        """Write the number of every rack into the places of its walls."""
        for number, rack in enumerate(self._racks, start=1):
            for component in rack.members:
                place = places[component.index]
                assert place is not None
                places[component.index] = replace(place, rack=number * rack.side)

    def _behind(self, rack: _Rack, size: tuple[int, int]) -> list[Rectangle]:
        """Return where a wall of this size may stand behind a rack: at its middle, or flush with an end."""
        axis, along = rack.axis, 1 - rack.axis
        at, length = rack.last[axis], rack.last[axis + 2]
        across = at + length + self._between_vox if rack.side > 0 else at - self._between_vox - size[axis]
        spare = rack.last[along + 2] - size[along]
        result = []
        for shift in dict.fromkeys((spare // 2, 0, spare)):
            low = [0, 0]
            low[axis], low[along] = across, rack.last[along] + shift
            result.append((low[0], low[1], *size))
        return result

    def _with_frame(self, own: Rectangle, rack: _Rack, component: Component) -> Rectangle:
        deep, axis, along = self._deep_vox(component, rack.members), rack.axis, 1 - rack.axis
        low, size = [own[0], own[1]], [own[2], own[3]]
        if rack.members:
            first, last = rack.room[along], rack.room[along] + rack.room[along + 2]
            end = max(last, low[along] + size[along])
            low[along] = min(first, low[along])
            size[along] = end - low[along]
        low[axis] -= deep if rack.side < 0 else 0
        size[axis] += deep
        return (low[0], low[1], size[0], size[1])

    def _deep_vox(self, component: Component, members: list[Component]) -> int:
        highest_m = max(_height_m(one) for one in (*members, component))
        return max(_LEAST_VOX, whole_cells(self._rules.rack_depth * highest_m, self._size_m))


def is_racked(site: Site, component: Component) -> bool:
    """Return whether a part stands in a rack: an upright wall with a place that the planner chooses."""
    rules = site.rules.yard
    return (
        rules is not None
        and rules.rack_parts > 0
        and _is_stored_as_built(component)
        and kind_of(component) is Work.WALL
        and _height_m(component) >= RACKED_THINNESS * _width_m(component)
    )


def _thin_axis(size: tuple[int, ...]) -> int:
    """Return the axis across a wall of this size on plan."""
    return 0 if size[0] < size[1] else 1


def _around(one: Rectangle, other: Rectangle) -> Rectangle:
    low = min(one[0], other[0]), min(one[1], other[1])
    high = max(one[0] + one[2], other[0] + other[2]), max(one[1] + one[3], other[1] + other[3])
    return (*low, high[0] - low[0], high[1] - low[1])


def lying_width_vox(component: Component, place: YardPlace) -> int:
    """Return the width of a part along the axis about which it is upended, cells."""
    across = (place.pose is StoredPose.LYING_Y) != bool(place.turn % 2)
    return component.shape.size_vox[1 if across else 0]


def from_box_to_origin_m(
    site: Site, component: Component, place: YardPlace, angle_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (N, 3) vectors from the lowest corner of a stored part's box, tipped by (N,) angles, to its origin.

    The origin of the part's own frame is that same corner if the part is not turned.
    """
    hook = np.array(component.hook_offset_vox[:2]) + 0.5
    turned = np.array(turned_hook(component.shape, component.hook_offset_vox, place.turn)[:2]) + 0.5
    quarter = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), place.turn % 4)
    x, y = site.frame.voxel_size_m * (turned - quarter @ hook)
    cos, sin, same = np.cos(angle_rad), np.sin(angle_rad), np.ones(len(angle_rad))
    if place.pose is StoredPose.LYING_X:
        return np.stack([x * cos, y * same, -x * sin], axis=1)
    if place.pose is StoredPose.LYING_Y:
        return np.stack([x * same, y * cos, -y * sin], axis=1)
    return np.stack([x * same, y * same, 0.0 * same], axis=1)
