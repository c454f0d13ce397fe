"""Stacks in the yard: flat parts on each other, the one that is lifted first on top.

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
from bimvox.site.component import Component, StoredPose
from bimvox.site.site import Site
from bimvox.site.transit_clearance import margin_vox
from bimvox.site.work import Work, kind_of
from bimvox.site.yard_rules import YardRules

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
        whole_m = sum(height_m(one) for one in members) + (len(members) - 1) * rules.dunnage_m
        return (
            len(members) <= rules.stack_parts
            and component.crane == members[0].crane
            and size[0] >= self.lowest[2]
            and size[1] >= self.lowest[3]
            and sum(one.mass_kg for one in members) <= rules.stack_kg
            and whole_m <= min(rules.stack_height_m, width_m(component)) + _ROUNDING
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
            and bool(free[columns_of(own)].all())
            and all(other == besides or are_apart(own, other, self._gap_vox) for other in self._places)
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
                if all(are_apart(own, other, _LEAST_VOX) for other in self._offered):
                    room[columns_of(own)] = True
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
        and is_stored_as_built(component)
        and len(component.shape.cells) == int(np.prod(component.shape.size_vox))
        and height_m(component) <= width_m(component)
        and kind_of(component) in _STACKED
    )


def is_stored_as_built(component: Component) -> bool:
    """Return whether a part lies in the yard as it is set, at a place that the planner chooses."""
    return (
        not component.erected and component.start_vox is None and component.stored_pose in (None, StoredPose.AS_BUILT)
    )


def height_m(component: Component) -> float:
    """Return the height of a part as it is set."""
    return float(np.ptp(component.mesh.bounds_m[:, 2]))


def width_m(component: Component) -> float:
    """Return the smaller size of a part on plan."""
    return float(np.ptp(component.mesh.bounds_m[:, :2], axis=0).min())


def columns_of(place: Rectangle) -> tuple[slice, slice]:
    """Return the columns of a rectangle, as an index."""
    return slice(place[0], place[0] + place[2]), slice(place[1], place[1] + place[3])


def are_apart(one: Sequence[int], other: Sequence[int], gap_vox: int) -> bool:
    """Return whether two rectangles have at least this many columns between them, along an axis."""
    return any(
        one[axis] >= other[axis] + other[axis + 2] + gap_vox or other[axis] >= one[axis] + one[axis + 2] + gap_vox
        for axis in (0, 1)
    )
