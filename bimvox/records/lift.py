"""A lift and a lift plan: what planning hands on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.site.component import Component, IntVec, Shape, StoredPose
from bimvox.site.shape import erection_size_vox, stored_shape, turned_hook, turned_shape, turning_columns
from bimvox.site.site import Blocker, Site


class Method(StrEnum):
    """How a path was found."""

    POLICY = "policy"
    RETRAINED = "retrained"
    SEARCH = "search"


class Status(StrEnum):
    """What became of a lift."""

    PLANNED = "planned"
    INFEASIBLE = "infeasible"


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class YardPlace:
    """Where and how a component waits in the yard.

    Attributes:
        delivery: Number of the truckload it comes with, from 0. A delivery arrives when the lifts of all earlier ones
            are done, so the yard holds one delivery at a time.
        pose: How it lies.
        shape: Its shape as it lies.
        cell_vox: Reference cell of that shape.
        turn: Quarter turns, counter-clockwise, by which it lies turned.
        rise_vox: How far it is raised before it is turned, or, where it is not turned, before transit.
        shift_vox: Where the reference cell of the part as built in is, in plan, relative to ``cell_vox``.
    """

    delivery: int
    pose: StoredPose
    shape: Shape
    cell_vox: IntVec
    turn: int = 0
    rise_vox: int = 1
    shift_vox: tuple[int, int] = (0, 0)

    @property
    def transit_start_vox(self) -> IntVec:
        """Reference cell of the component as built in, after it was erected, raised and turned."""
        x, y, z = self.cell_vox
        return (x + self.shift_vox[0], y + self.shift_vox[1], z + self.rise_vox)

    def raising_size_vox(self, component: Component) -> IntVec:
        """Box, from ``cell_vox`` up, that the component sweeps until it is raised; turning comes after that."""
        x, y, z = erection_size_vox(turned_shape(component.shape, self.turn), self.pose)
        return (x, y, z + self.rise_vox - 1)

    def turning_cells(self, component: Component) -> NDArray[np.int32]:
        """(N, 3) int32 cells that it sweeps while it is turned; none where it is not."""
        if self.turn == 0:
            return np.zeros((0, 3), np.int32)
        columns = turning_columns(component.shape, component.hook_offset_vox)
        x, y, z = self.transit_start_vox
        height = component.shape.size_vox[2]
        layers = [np.column_stack([columns, np.full(len(columns), k)]) for k in range(height)]
        cells: NDArray[np.int32] = np.concatenate(layers).astype(np.int32) + np.array([x, y, z], np.int32)
        return cells


def yard_place(
    component: Component, delivery: int, pose: StoredPose, cell_vox: IntVec, *, turn: int = 0, rise_vox: int = 1
) -> YardPlace:
    """Return the place of a component that lies in a pose, turned by quarters, at a cell."""
    hook = component.hook_offset_vox
    turned = turned_hook(component.shape, hook, turn)
    shift = (turned[0] - hook[0], turned[1] - hook[1])
    shape = stored_shape(component.shape, pose, turn)
    return YardPlace(delivery, pose, shape, cell_vox, turn % 4, rise_vox, shift)


@dataclass(frozen=True, slots=True, eq=False)
class LeftPath:
    """A path that a load was on, and left because something came into its way.

    Attributes:
        path_vox: (N, 3) int32 the whole path; the load was on its way along it when it was stopped.
        contact_moves: How many of its last placements were cleared by the narrow phase.
        until_ns: When the way on was found, on the site's clock; until then it was stopped, or stood.
    """

    path_vox: NDArray[np.int32]
    contact_moves: int
    until_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class Lift:
    """One component's way from the yard to its place.

    Attributes:
        component: Index into ``Site.components``.
        order: Position in the assembly order, from 0.
        place: Where it waits; None where the yard has no room for it.
        status: Planned or infeasible.
        method: How the path was found; None where there is none.
        path_vox: (N, 3) int32 reference cells from the transit start to the target, both included, one unit move
            between neighbours; None where infeasible. Of a load that was stopped on its way, from where it goes on.
        shortest_moves: The fewest unit moves possible under the same rules; None where infeasible.
        contact_moves: How many of the last placements were cleared by the narrow phase.
        reason: Why it is infeasible, one sentence.
        blocked_by: Ids of what blocks it.
        left: Paths that the load was on before, if it was stopped on its way; in order.
    """

    component: int
    order: int
    place: YardPlace | None
    status: Status
    method: Method | None = None
    path_vox: NDArray[np.int32] | None = None
    shortest_moves: int | None = None
    contact_moves: int = 0
    reason: str | None = None
    blocked_by: tuple[str, ...] = ()
    left: tuple[LeftPath, ...] = ()

    @property
    def number(self) -> int:
        """Its number for people, from 1."""
        return self.order + 1

    @property
    def moves(self) -> int | None:
        """Number of unit moves, or None where infeasible."""
        return None if self.path_vox is None else len(self.path_vox) - 1

    @property
    def last_moves_vox(self) -> NDArray[np.int32]:
        """(N, 3) the end of its path from where the last moves, cleared by the narrow phase, begin; it has a path."""
        assert self.path_vox is not None
        return self.path_vox[max(0, len(self.path_vox) - 1 - self.contact_moves) :]


def same_path(before: Lift | None, now: Lift) -> bool:
    """Say whether a lift is as it was before.

    Of a lift that an extract does not carry only the status is known: without paths, equal states are the same.
    """
    if before is None or before.path_vox is None or now.path_vox is None:
        return before is not None and before.status is now.status and before.path_vox is now.path_vox
    return np.array_equal(before.path_vox, now.path_vox)


def by_change(before: Iterable[Lift], now: Iterable[Lift]) -> tuple[list[Lift], list[Lift], list[Lift]]:
    """Return the lifts of a plan that an earlier one had alike, those planned anew, and those that are infeasible."""
    earlier = {lift.component: lift for lift in before}
    kept: list[Lift] = []
    replanned: list[Lift] = []
    infeasible: list[Lift] = []
    for lift in now:
        if lift.status is Status.INFEASIBLE:
            infeasible.append(lift)
        else:
            (kept if same_path(earlier.get(lift.component), lift) else replanned).append(lift)
    return kept, replanned, infeasible


@dataclass(frozen=True, slots=True)
class ModelledClash:
    """Two parts that the building's author drew into each other.

    Attributes:
        first: Id of one part.
        second: Id of the other.
        depth_m: How deep: the length of ``way_out_m``; a lower bound where there is none.
        way_out_m: The shortest straight way along an axis that takes ``first`` out of ``second``; None where they run
            so deep into each other, or interlock, that none was found.
    """

    first: str
    second: str
    depth_m: float
    way_out_m: tuple[float, float, float] | None

    @property
    def at_least(self) -> bool:
        """Whether ``depth_m`` is a lower bound."""
        return self.way_out_m is None


@dataclass(frozen=True, slots=True, eq=False)
class Epoch:
    """What was in the way while a part of the plan was carried out.

    Attributes:
        until_ns: When it changed, on the site's clock.
        obstructions: The obstructions until then.
    """

    until_ns: int
    obstructions: tuple[Blocker, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LiftPlan:
    """All lifts of a site, in order.

    Attributes:
        site: What was planned.
        lifts: One per component, ascending ``order``; infeasible ones included.
        clashes: Pairs drawn into each other; such a pair may overlap as deep as drawn and no deeper.
        notes: What a reader should know (parts that nothing supports, interlocked groups ...), one sentence each.
        unheld: Ids of parts that have to be set before anything that they could hold on to: what holds them is not in
            the model.
        history: The obstructions before those of the site, of a plan that is being carried out; ascending times.
    """

    site: Site
    lifts: tuple[Lift, ...]
    clashes: tuple[ModelledClash, ...] = ()
    notes: tuple[str, ...] = ()
    unheld: tuple[str, ...] = ()
    history: tuple[Epoch, ...] = ()
