"""What stands where before each lift, found from a finished plan alone: for proofs, which do not trust the planner."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bimvox.planning.lift import Lift, LiftPlan, Status, YardPlace
from bimvox.site.component import Component
from bimvox.site.site import Site

NO_SOLID = -1
_FAR_VOX = 2**30


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """Something that stands somewhere.

    Attributes:
        name: Id of the part, structure or obstruction.
        cells: (N, 3) int32 cells of the grid that it occupies.
        solid: Number of its triangles (components by their index, then structure), ``NO_SOLID`` where it has none.
        low: Lowest cell of the box around its cells.
        high: Highest cell of that box.
    """

    name: str
    cells: NDArray[np.int32]
    solid: int
    low: tuple[int, int, int] = field(init=False)
    high: tuple[int, int, int] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "low", tuple(self.cells.min(axis=0, initial=_FAR_VOX).tolist()))
        object.__setattr__(self, "high", tuple(self.cells.max(axis=0, initial=-_FAR_VOX).tolist()))

    def is_apart(self, low: Sequence[int], high: Sequence[int]) -> bool:
        """Whether its box lies beside another one, both ends inclusive. Looked at before any cell: most things do."""
        return (
            self.low[0] > high[0]
            or self.high[0] < low[0]
            or self.low[1] > high[1]
            or self.high[1] < low[1]
            or self.low[2] > high[2]
            or self.high[2] < low[2]
        )


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The moment before a planned lift.

    Attributes:
        lift: The lift.
        before: The planned lift before it, None for the first.
        present: Fixed things, parts in place, and parts of the same delivery that wait in the yard; not its own part.
        placed: Indices of the components in place.
    """

    lift: Lift
    before: Lift | None
    present: tuple[Thing, ...]
    placed: frozenset[int]


def moments(plan: LiftPlan, context: Collection[Lift] = ()) -> Iterator[Moment]:
    """Yield the moment before every planned lift that the plan carries, ascending order.

    Args:
        plan: The plan.
        context: Lifts of the same plan that it does not carry (it is an extract).
    """
    site = plan.site
    lifts = sorted([*plan.lifts, *context], key=lambda lift: lift.order)
    carried = {id(lift) for lift in plan.lifts}
    fixed = fixed_things(site)
    waiting: dict[int, Thing] = {}
    standing: list[Thing] = []
    placed: set[int] = set()
    before: Lift | None = None
    delivery = 0
    for lift in lifts:
        if lift.place is not None:
            delivery = lift.place.delivery
        if lift.status is not Status.PLANNED:
            continue
        if id(lift) in carried:
            stored = _stored(site, lifts, lift, delivery, placed, waiting)
            yield Moment(lift, before, (*fixed, *standing, *stored), frozenset(placed))
        placed.add(lift.component)
        standing.append(set_thing(site, lift))
        before = lift


def finished(component: Component) -> Thing:
    """Return a component at its place in the building."""
    return Thing(component.id, component.shape.cells + np.array(component.target_vox, np.int32), component.index)


def set_thing(site: Site, lift: Lift) -> Thing:
    """Return the part of a lift at its place, as much of it as is inside the site."""
    whole = finished(site.components[lift.component])
    return Thing(whole.name, _inside(whole.cells, site), whole.solid)


def stored_thing(site: Site, lift: Lift, place: YardPlace) -> Thing:
    """Return the part of a lift as it lies in the yard."""
    cells = place.shape.cells + np.array(place.cell_vox, np.int32)
    return Thing(site.components[lift.component].id, _inside(cells, site), NO_SOLID)


def near_and_far(component: Component, present: Sequence[Thing]) -> tuple[list[Thing], list[Thing]]:
    """Return which present things have triangles and share or touch cells with a part in its place, and the others."""
    target = finished(component)
    low, high = [n - 1 for n in target.low], [n + 1 for n in target.high]
    near = [
        thing
        for thing in present
        if thing.solid != NO_SOLID and not thing.is_apart(low, high) and _touches(target.cells, thing.cells)
    ]
    close = {id(thing) for thing in near}
    return near, [thing for thing in present if id(thing) not in close]


def passed_by(component: Component, far: Sequence[Thing], path_vox: NDArray[np.int32]) -> list[Thing]:
    """Return which things with triangles a part shares cells with at some of (N, 3) placements."""
    if not len(path_vox):
        return []
    own = component.shape.cells
    low, high = path_vox.min(axis=0), (path_vox + own.max(axis=0)).max(axis=0)
    first, last = low.tolist(), high.tolist()
    close = [thing for thing in far if thing.solid != NO_SOLID and not thing.is_apart(first, last)]
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
            things.append(Thing(blocker.id, blocker.cells, NO_SOLID))
        else:
            things.append(Thing(blocker.id, blocker.cells, solid))
            solid += 1
    return tuple(things)


def _stored(
    site: Site, lifts: list[Lift], lift: Lift, delivery: int, placed: set[int], made: dict[int, Thing]
) -> list[Thing]:
    """Everything of the same delivery that is not in place; each is made once and kept in ``made``."""
    things = []
    for number, other in enumerate(lifts):
        place = other.place
        if other is lift or place is None or place.delivery != delivery or other.component in placed:
            continue
        if number not in made:
            made[number] = stored_thing(site, other, place)
        things.append(made[number])
    return things


def _inside(cells: NDArray[np.int32], site: Site) -> NDArray[np.int32]:
    """Leave out what a spoiled plan puts outside the site: its own lift is to blame, not the one that looks round."""
    return cells[((cells >= 0) & (cells < np.array(site.shape))).all(axis=1)]


def _touches(cells: NDArray[np.int32], others: NDArray[np.int32]) -> bool:
    """Whether two sets of cells share a cell or touch, corners included."""
    return bool(cKDTree(cells).count_neighbors(cKDTree(others), 1.0, p=np.inf))
