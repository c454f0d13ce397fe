"""What is where before each lift, derived from a finished plan alone: for proofs, which do not trust the planner."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.kept import kept
from bimvox.records.lift import Lift, LiftPlan, Status, YardPlace
from bimvox.site.component import Component, IntVec
from bimvox.site.site import CRANE_ID, Blocker, Site

NO_SOLID = -1
_FAR_VOX = 2**30


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """A thing at a place on the site.

    Attributes:
        name: Id of the part, structure or obstruction.
        cells: (N, 3) int32 cells of the grid that it occupies.
        solid: Number of its triangles (components by their index, then structure), ``NO_SOLID`` if it has none.
        low: Lowest cell of the box around its cells.
        high: Highest cell of that box.
    """

    name: str
    cells: NDArray[np.int32]
    solid: int
    low: tuple[int, int, int] = field(init=False)
    high: tuple[int, int, int] = field(init=False)

    def __post_init__(self) -> None:
        cells = np.ascontiguousarray(self.cells, np.int32).view()
        cells.flags.writeable = False
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "low", tuple(self.cells.min(axis=0, initial=_FAR_VOX).tolist()))
        object.__setattr__(self, "high", tuple(self.cells.max(axis=0, initial=-_FAR_VOX).tolist()))

    def is_within(self, shape: Sequence[int]) -> bool:
        """Return whether all of it is in a grid."""
        return min(self.low) >= 0 and all(last < count for last, count in zip(self.high, shape, strict=True))


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The moment before a planned lift.

    Attributes:
        lift: The lift.
        before: The planned lift before it; None for the first, also in a set-up of a crane that moves.
        present: Fixed things, parts in place, and parts of the same delivery that wait in the yard; not its own part.
        placed: Indices of the components in place.
        arrived: Those of the present things that came by other means than the crane since the lift before it. They come
            after the hook has left the part before: they are not in the way of its approach.
    """

    lift: Lift
    before: Lift | None
    present: tuple[Thing, ...]
    placed: frozenset[int]
    arrived: frozenset[Thing] = frozenset()


class Standing:
    """What stands and lies on the site before each lift of a plan, one lift after the other.

    Args:
        plan: The plan.
        context: Lifts of the same plan that it does not contain (it is an extract).
    """

    def __init__(self, plan: LiftPlan, context: Collection[Lift] = ()) -> None:
        self.lifts = plan.lifts_with(context)
        self._site, self._fixed = plan.site, fixed_things(plan.site)
        self._at_work: dict[int, tuple[Thing, ...]] = {}
        self._stored = _by_delivery(self.lifts)
        self._delivered: dict[int, list[tuple[Lift, Thing]]] = {}
        self._delivery = 0
        self._standing: list[Thing] = []
        self._placed: set[int] = set()
        self._before: Lift | None = None
        self._arrived: list[Thing] = []

    def moment(self, lift: Lift) -> Moment:
        """Return the moment before a planned lift, the next one."""
        delivery = self._delivery if lift.place is None else lift.place.delivery
        if delivery not in self._delivered:
            stored = self._stored.get(delivery, ())
            self._delivered[delivery] = [(other, stored_thing(self._site, other, place)) for other, place in stored]
        others = self._delivered[delivery]
        waiting = [thing for other, thing in others if other is not lift and other.component not in self._placed]
        present = (*self._fixed_at(self._site.components[lift.component].crane), *self._standing, *waiting)
        before = self._before
        if self._site.moving is not None and before is not None:
            cranes = {self._site.components[one.component].crane for one in (lift, before)}
            before = before if len(cranes) == 1 else None  # it has moved: its hook comes from nowhere
        return Moment(lift, before, present, frozenset(self._placed), frozenset(self._arrived))

    def _fixed_at(self, crane: int) -> tuple[Thing, ...]:
        """Return what is fixed while a crane is at work: one that moves is in one of its places."""
        if self._site.moving is None:
            return self._fixed
        if crane not in self._at_work:
            own = f"{CRANE_ID}:{self._site.cranes[crane].name}"
            kinds = zip(self._fixed, self._site.blockers, strict=True)
            self._at_work[crane] = tuple(one for one, of in kinds if of.kind != CRANE_ID or of.id == own)
        return self._at_work[crane]

    def go_past(self, lift: Lift) -> None:
        """Set the part of the next lift, or leave it in the yard."""
        if lift.place is not None:
            self._delivery = lift.place.delivery
        if not lift.is_set:
            return
        self._placed.add(lift.component)
        self._standing.append(set_thing(self._site, lift))
        if lift.status is Status.PLANNED:
            self._before, self._arrived = lift, []
        else:
            self._arrived.append(self._standing[-1])


def moments(plan: LiftPlan, context: Collection[Lift] = ()) -> Iterator[Moment]:
    """Yield the moment before every planned lift in the plan, in ascending order.

    ``context`` holds lifts of the same plan that it does not contain (it is an extract).
    """
    standing, carried = Standing(plan, context), {id(lift) for lift in plan.lifts}
    for lift in standing.lifts:
        if lift.status is Status.PLANNED and id(lift) in carried:
            yield standing.moment(lift)
        standing.go_past(lift)


def _by_delivery(lifts: Sequence[Lift]) -> dict[int, list[tuple[Lift, YardPlace]]]:
    """Return the lifts of every delivery, each with its place in the yard."""
    result: dict[int, list[tuple[Lift, YardPlace]]] = {}
    for lift in lifts:
        if (place := lift.in_yard) is not None:
            result.setdefault(place.delivery, []).append((lift, place))
    return result


@kept
def _finished(component: Component) -> Thing:
    """Return a component at its place in the building."""
    return Thing(component.id, component.shape.cells + np.array(component.target_vox, np.int32), component.index)


def set_thing(site: Site, lift: Lift) -> Thing:
    """Return the part of a lift at its place, clipped to the site."""
    return _set(site.components[lift.component], site.shape)


def stored_thing(site: Site, lift: Lift, place: YardPlace) -> Thing:
    """Return the part of a lift as it lies in the yard."""
    return _stored(place, site.components[lift.component].id, site.shape)


def near_and_far(component: Component, present: Sequence[Thing]) -> tuple[list[Thing], list[Thing]]:
    """Return the present things with triangles that share or touch cells with a part in its place, and the others."""
    target = _finished(component)
    low, high = [n - 1 for n in target.low], [n + 1 for n in target.high]
    near = [thing for thing in beside(present, low, high) if thing.solid != NO_SOLID and _touches(target, thing)]
    close = set(near)
    return near, [thing for thing in present if thing not in close]


def beside(things: Sequence[Thing], low: Sequence[int], high: Sequence[int]) -> list[Thing]:
    """Return the things whose boxes are not apart from another one, both ends inclusive."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return [
        thing
        for thing in things
        if thing.low[0] <= x1
        and thing.high[0] >= x0
        and thing.low[1] <= y1
        and thing.high[1] >= y0
        and thing.low[2] <= z1
        and thing.high[2] >= z0
    ]


def passed_by(component: Component, far: Sequence[Thing], path_vox: NDArray[np.int32]) -> list[Thing]:
    """Return the things with triangles that share cells with a part at any of (N, 3) placements."""
    if not len(path_vox):
        return []
    own = component.shape.cells
    low, high = path_vox.min(axis=0), (path_vox + own.max(axis=0)).max(axis=0)
    first, last = low.tolist(), high.tolist()
    close = [thing for thing in beside(far, first, last) if thing.solid != NO_SOLID]
    if not close:
        return []
    swept = np.zeros(high - low + 1, np.bool_)
    for place in path_vox:
        swept[tuple((own + place - low).T)] = True
    passed = []
    for thing in close:
        cells = thing.cells[((thing.cells >= low) & (thing.cells <= high)).all(axis=1)] - low
        if swept[tuple(cells.T)].any():
            passed.append(thing)
    return passed


def cells_in_common(cells: NDArray[np.int32], others: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return those of ``others`` that are among ``cells``, both (N, 3) int32."""
    wanted = {tuple(c) for c in cells.tolist()}
    common: NDArray[np.int32] = others[[tuple(c) in wanted for c in others.tolist()]]
    return common


def fixed_things(site: Site) -> tuple[Thing, ...]:
    """Return what is fixed on a site: ground, masts, structure, obstructions."""
    things = []
    solid = len(site.components)
    for blocker in site.blockers:
        if blocker.mesh is None:
            things.append(_fixed(blocker, NO_SOLID))
        else:
            things.append(_fixed(blocker, solid))
            solid += 1
    return tuple(things)


@kept
def _fixed(blocker: Blocker, solid: int) -> Thing:
    return Thing(blocker.id, blocker.cells, solid)


@kept
def _set(component: Component, shape: IntVec) -> Thing:
    whole = _finished(component)
    return whole if whole.is_within(shape) else Thing(whole.name, _inside(whole.cells, shape), whole.solid)


@kept
def _stored(place: YardPlace, name: str, shape: IntVec) -> Thing:
    whole = Thing(name, place.shape.cells + np.array(place.cell_vox, np.int32), NO_SOLID)
    return whole if whole.is_within(shape) else Thing(name, _inside(whole.cells, shape), NO_SOLID)


def _inside(cells: NDArray[np.int32], shape: IntVec) -> NDArray[np.int32]:
    """Drop cells that an invalid plan puts outside the site: the check of their own lift reports them."""
    return cells[((cells >= 0) & (cells < np.array(shape))).all(axis=1)]


def _touches(target: Thing, thing: Thing) -> bool:
    """Return whether two things share a cell or touch, corners included."""
    if not len(target.cells):
        return False
    low = np.array(target.low) - 1
    around = np.zeros(np.array(target.high) - low + 2, np.bool_)
    return bool(_touch(around, low, target.cells, thing.cells))


@kernel
def _touch(
    around: NDArray[np.bool_], low: NDArray[np.int64], cells: NDArray[np.int32], others: NDArray[np.int32]
) -> bool:
    """Mark cells in an empty, padded box, and test whether others are in a marked cell or next to one."""
    nx, ny, nz = around.shape
    for n in range(cells.shape[0]):
        around[cells[n, 0] - low[0], cells[n, 1] - low[1], cells[n, 2] - low[2]] = True
    for n in range(others.shape[0]):
        x, y, z = others[n, 0] - low[0], others[n, 1] - low[1], others[n, 2] - low[2]
        if x < 0 or y < 0 or z < 0 or x >= nx or y >= ny or z >= nz:
            continue
        for i in range(max(x - 1, 0), min(x + 2, nx)):
            for j in range(max(y - 1, 0), min(y + 2, ny)):
                for k in range(max(z - 1, 0), min(z + 2, nz)):
                    if around[i, j, k]:
                        return True
    return False
