"""A lift and a lift plan: the result of planning; how a crew guides a load on its last moves."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import pairwise
from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from bimvox.records.flip import Flip
from bimvox.records.tandem import SharedLoad
from bimvox.site.component import (
    Component,
    IntVec,
    Shape,
    StoredPose,
    stored_shape,
    turning_columns,
)
from bimvox.site.default_rules import Kept
from bimvox.site.flip_box import hook_at_vox, is_flipped, raised_size_vox
from bimvox.site.site import Blocker, Site
from bimvox.sparse import SPARSE

MOST_ASIDE_M = 0.3
"""Furthest that a crew guides a load out of the line of its hook."""
MOST_TILT_RAD = 0.2
"""Steepest tilt, by two legs of unequal length: 11 degrees."""
ASIDE_RATE_M_S = 0.05
"""Fastest that a crew guides a load aside."""
TILT_RATE_RAD_S = 0.02
"""Fastest that a leg of the sling is shortened, as a tilt of the load: a hand chain hoist, 1.1 degrees a second."""
MOST_FORCE_N = 1000.0
"""Largest horizontal force on the load: several people, or a lever hoist."""

_SWEPT_RAD = 0.02


@dataclass(frozen=True, slots=True)
class Guide:
    """The poses of a load on its last moves, relative to its place; between two of them it moves in proportion.

    The hook goes straight down onto the place. The load hangs on legs of unequal length, and people hold it aside: so
    it passes under the flange of a beam with one end first.

    Attributes:
        heading_rad: Direction in plan in which it is guided aside, counter-clockwise from x.
        centre_m: Its centre of mass at its place, metres in the site frame; it is tilted about it.
        poses: (height, aside, tilt) of each: metres above the place, descending to 0; metres in the direction; radians
            by which the end that is ahead in the direction is raised. The first and the last are level and in line.
    """

    heading_rad: float
    centre_m: tuple[float, float, float]
    poses: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        if len(self.poses) < 2:
            raise ValueError("a guide needs two poses or more")

    @property
    def top_m(self) -> float:
        """Height above the place at which it begins."""
        return self.poses[0][0]

    @property
    def steepest_rad(self) -> float:
        """The largest tilt."""
        return max(abs(tilt) for _, _, tilt in self.poses)

    @property
    def furthest_m(self) -> float:
        """The largest distance aside."""
        return max(abs(aside) for _, aside, _ in self.poses)

    @property
    def least_s(self) -> tuple[float, ...]:
        """The shortest time from each pose to the next at which no rate is exceeded, from rest to rest."""
        return tuple(
            2.0 * max(abs(b[1] - a[1]) / ASIDE_RATE_M_S, abs(b[2] - a[2]) / TILT_RATE_RAD_S)
            for a, b in pairwise(self.poses)
        )

    @property
    def ahead(self) -> NDArray[np.float64]:
        """(3,) float64 the direction."""
        return np.array([cos(self.heading_rad), sin(self.heading_rad), 0.0])

    @property
    def axis(self) -> NDArray[np.float64]:
        """(3,) float64 the axis of a positive tilt."""
        return np.array([sin(self.heading_rad), -cos(self.heading_rad), 0.0])

    def at(self, height_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (N, 2) distances aside and tilts at (N,) heights above the place; zeros above the first pose."""
        heights, asides, tilts = np.array(self.poses)[::-1].T
        result: NDArray[np.float64] = np.stack([np.interp(height_m, heights, n) for n in (asides, tilts)], axis=1)
        return result

    def turns(self, tilt_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (N, 3, 3) rotations by (N,) tilts."""
        x, y, z = self.axis
        across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        sines, versed = np.sin(tilt_rad)[:, None, None], (1.0 - np.cos(tilt_rad))[:, None, None]
        turns: NDArray[np.float64] = np.eye(3) + sines * across + versed * (across @ across)
        return turns

    def moved(self, points_m: NDArray[np.float64], pose: tuple[float, float, float]) -> NDArray[np.float64]:
        """Return points of the load at its place, (..., 3) metres, with the load in a pose."""
        height_m, aside_m, tilt_rad = pose
        centre = np.array(self.centre_m)
        turned = (points_m - centre) @ self.turns(np.array([tilt_rad]))[0].T
        moved: NDArray[np.float64] = turned + centre + aside_m * self.ahead + np.array([0.0, 0.0, height_m])
        return moved


def side_force_n(mass_kg: float, aside_m: float, rope_m: float) -> float:
    """Return the horizontal force that holds a load aside of the line of its hook, on a rope of a length."""
    return 9.80665 * mass_kg * aside_m / max(rope_m, 1.0)


def swept_box_m(points_m: NDArray[np.float64], guide: Guide) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest corner of a box around all that guided points sweep, metres."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for (h, a, t), (h_next, a_next, t_next) in pairwise(guide.poses):
        for share in np.linspace(0.0, 1.0, max(2, int(abs(t_next - t) / _SWEPT_RAD) + 2)):
            pose = (h + share * (h_next - h), a + share * (a_next - a), t + share * (t_next - t))
            moved = guide.moved(points_m, pose)
            low, high = np.minimum(low, moved.min(axis=0)), np.maximum(high, moved.max(axis=0))
    return low, high


# How the reasons begin that make a lift infeasible although a path may lead to its place.
#
# All other reasons come from the planner's search: they follow from the site, the order, and what is in place.

NOT_PROVEN = "its lift could not be proven: "
NOT_PROVEN_TOGETHER = f"{NOT_PROVEN}together with the other lifts"
NOT_DRIVEN = "the crane cannot drive its path: "
HOOK_CANNOT_LEAVE = "the hook cannot leave where the last part was set: "
HOOK_MET = (
    "the empty hook met something while it was stopped, or as far out as it swings: look at it before it is moved"
)
LOAD_IS_HELD = "it is held "

NOT_ITS_CELLS = f"{NOT_PROVEN}shapes: "
"""The lift was refused because the part's cells do not fit its surface: they are taken as they are, a condition."""

OF_THE_PATH = (NOT_PROVEN, NOT_DRIVEN)
"""A path was found, but it, or its motion, was refused."""
OF_A_STOP = (HOOK_CANNOT_LEAVE, HOOK_MET, LOAD_IS_HELD)
"""The plan was being carried out, and its cranes are stopped."""


class Method(StrEnum):
    """How a path was found."""

    POLICY = "policy"
    GREEDY = "greedy"
    """Towards the target, under the loop guard."""
    RETRAINED = "retrained"
    SEARCH = "search"
    PLANNER = "planner"
    """By a planner that the caller brought, which the lift names."""


class Status(StrEnum):
    """The status of a lift."""

    PLANNED = "planned"
    INFEASIBLE = "infeasible"
    IN_SITU = "in_situ"
    """No lift of the crane: its part is cast in its place when it is its turn."""
    BUILT = "built"
    """No lift of the crane: its trade builds it in its place when it is its turn."""
    BY_HAND = "by_hand"
    """No lift of the crane: a few people set its part when it is its turn."""


NOT_LIFTED = frozenset((Status.IN_SITU, Status.BUILT, Status.BY_HAND))


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class YardPlace:
    """Where and how a component is stored in the yard.

    Attributes:
        delivery: Number of its truckload, from 0. A delivery arrives after the lifts of all earlier ones, so the yard
            holds one delivery at a time.
        pose: Its pose in the yard.
        shape: Its shape in that pose.
        cell_vox: Reference cell of that shape.
        turn: Its rotation in quarter turns, counter-clockwise.
        rise_vox: How far it is raised before it is turned or, if it is not turned, before transit. Between two hooks,
            it is lifted as far before it is turned over.
        shift_vox: Reference cell of the part in its final orientation, in plan, relative to ``cell_vox``.
        stack: Number of its stack in its delivery, from 1; 0 if it lies alone.
        rack: Number of its rack in its delivery, from 1; 0 if it stands in none. Below zero, the rack's frame is on the
            lower side along the axis across the wall, otherwise on the higher side.
    """

    delivery: int
    pose: StoredPose
    shape: Shape
    cell_vox: IntVec
    turn: int = 0
    rise_vox: int = 1
    shift_vox: tuple[int, int] = (0, 0)
    stack: int = 0
    rack: int = 0

    @property
    def is_upended(self) -> bool:
        """Whether the part lies, and is upended before it is carried."""
        return self.pose is not StoredPose.AS_BUILT

    @property
    def transit_start_vox(self) -> IntVec:
        """Reference cell of the component in its final orientation, after it was upended, raised and turned."""
        x, y, z = self.cell_vox
        return (x + self.shift_vox[0], y + self.shift_vox[1], z + self.rise_vox)

    def is_same(self, other: YardPlace) -> bool:
        """Return whether a part lies and is raised in the same way at the other place."""
        own = (self.delivery, self.pose, self.turn, self.rise_vox, self.cell_vox)
        return own == (other.delivery, other.pose, other.turn, other.rise_vox, other.cell_vox)

    def raising_size_vox(self, component: Component) -> IntVec:
        """Box, from ``cell_vox`` up, that the component sweeps until it is raised; turning follows."""
        x, y, z = raised_size_vox(component, self.pose, self.turn)
        return (x, y, z + self.rise_vox - 1)

    def reach_vox(self, component: Component) -> float:
        """Return how far on plan any of the component is from its hook until it is raised; turning follows."""
        over = is_flipped(component, self.pose)
        return hypot(*(self.raising_size_vox(component) if over else self.shape.size_vox)[:2])

    def turning_cells(self, component: Component) -> NDArray[np.int32]:
        """Return (N, 3) int32 cells that it sweeps while it is turned; none if it is not turned."""
        if self.turn == 0:
            return np.zeros((0, 3), np.int32)
        columns = turning_columns(component.shape, component.hook_line_vox, self.turn)
        x, y, z = self.transit_start_vox
        height = component.shape.size_vox[2]
        layers = [np.column_stack([columns, np.full(len(columns), k)]) for k in range(height)]
        cells: NDArray[np.int32] = np.concatenate(layers).astype(np.int32) + np.array([x, y, z], np.int32)
        return cells


def not_lifted(component: Component, order: int) -> Lift:
    """Return the entry in the sequence of a part that is no lift of the crane."""
    return Lift(component.index, order, None, Status(component.means.value), reason=component.means_reason)


def yard_place(
    component: Component,
    delivery: int,
    pose: StoredPose,
    cell_vox: IntVec,
    *,
    turn: int = 0,
    rise_vox: int = 1,
    stack: int = 0,
    rack: int = 0,
) -> YardPlace:
    """Return the place of a component at a cell, in a pose and turned by quarters."""
    hook = component.hook_offset_vox
    upright = hook_at_vox(component, pose, turn)
    shift = (upright[0] - hook[0], upright[1] - hook[1])
    if is_flipped(component, pose):
        rise_vox = max(rise_vox, component.flip_rise_vox)
    shape = stored_shape(component.shape, pose, turn)
    return YardPlace(delivery, pose, shape, cell_vox, turn % 4, rise_vox, shift, stack, rack)


@dataclass(frozen=True, slots=True, eq=False)
class LeftPath:
    """A path that a load left because something got in the way.

    Attributes:
        path_vox: (N, 3) int32 the whole path; the load was moving along it when it was stopped.
        contact_moves: How many of its last placements were cleared by the narrow phase.
        until_ns: When the new path was found, on the site's clock; until then the load was stopping or at rest.
        guide: How a crew guides the load on its last moves; None if it only hangs on its hook.
        with_jib: Whether the load turned with the jib on it.
    """

    path_vox: NDArray[np.int32]
    contact_moves: int
    until_ns: int
    guide: Guide | None = None
    with_jib: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Lift:
    """The lift of one component from the yard to its place.

    Attributes:
        component: Index into ``Site.components``.
        order: Position in the erection sequence, from 0.
        place: Its place in the yard; None if the yard has no room for it.
        status: Planned or infeasible.
        method: How the path was found; None if there is no path.
        path_vox: (N, 3) int32 reference cells from the transit start to the target, both included, one unit move
            between neighbours; None if infeasible. For a load that was stopped in transit, from where it resumes.
        shortest_moves: The fewest unit moves possible under the same rules; None if infeasible, or if no longer known:
            the path was kept when something on the site changed.
        contact_moves: How many of the last placements were cleared by the narrow phase.
        reason: Why it is infeasible, or no lift of the crane, in one sentence.
        blocked_by: Ids of what blocks it.
        left: Earlier paths of the load, if it was stopped in transit; in order.
        by_other_means: Whether the part of an infeasible lift counts as set by other means than the crane: from its
            turn on it is in the way and carries what rests on it. Unless it is in a stack, it never lies in the yard;
            ``place`` is where it would.
        guide: How a crew guides the load on its last moves, which then lead straight down; None if it only hangs on
            its hook.
        clearance_m: The clearance that its load keeps in transit if it could not keep the rule's, which gives way;
            None: all.
        rope_clearance_m: The same of hook and rope.
        departure_clearance_m: The same straight up from the yard.
        approach_clearance_m: The same on its last moves.
        upending_clearance_m: The same while its part is upended in the yard.
        turning_clearance_m: The same while its part is turned in the yard.
        with_jib: Whether the load turns with the jib up to its last moves, which then lead straight down. Before them
            it is turned to its final heading, by tag line. Otherwise tag lines keep its heading.
        flip: How it is turned over between two hooks in the yard; None if it is not.
        tandem: The share of each of the two cranes that carry it; None if one crane does.
        planner: Name of the planner or the policy that the caller brought, if it found the path.
        planner_note: Why one that was asked did not find the path: its name and a reason.
    """

    component: int
    order: int
    place: YardPlace | None = field(repr=False)
    status: Status
    method: Method | None = None
    path_vox: NDArray[np.int32] | None = field(default=None, repr=False)
    shortest_moves: int | None = None
    contact_moves: int = 0
    reason: str | None = None
    blocked_by: tuple[str, ...] = ()
    left: tuple[LeftPath, ...] = field(default=(), repr=False)
    by_other_means: bool = field(default=False, metadata=SPARSE)
    guide: Guide | None = field(default=None, metadata=SPARSE)
    clearance_m: float | None = field(default=None, repr=False, metadata=SPARSE)
    with_jib: bool = field(default=False, repr=False, metadata=SPARSE)
    flip: Flip | None = field(default=None, repr=False, metadata=SPARSE)
    tandem: SharedLoad | None = field(default=None, repr=False, metadata=SPARSE)
    rope_clearance_m: float | None = field(default=None, repr=False, metadata=SPARSE)
    departure_clearance_m: float | None = field(default=None, repr=False, metadata=SPARSE)
    approach_clearance_m: float | None = field(default=None, repr=False, metadata=SPARSE)
    upending_clearance_m: float | None = field(default=None, repr=False, metadata=SPARSE)
    turning_clearance_m: float | None = field(default=None, repr=False, metadata=SPARSE)
    planner: str | None = field(default=None, repr=False, metadata=SPARSE)
    planner_note: str | None = field(default=None, repr=False, metadata=SPARSE)

    @property
    def found_by(self) -> str | None:
        """Who found the path: what the caller brought, otherwise the method; None if the lift is infeasible."""
        return self.planner or (None if self.method is None else self.method.value)

    @property
    def kept(self) -> Kept:
        """What it keeps of the clearances that give way."""
        return Kept(
            self.clearance_m,
            self.rope_clearance_m,
            self.departure_clearance_m,
            self.approach_clearance_m,
            self.upending_clearance_m,
            self.turning_clearance_m,
        )

    def keeping(self, kept: Kept) -> Lift:
        """Return the lift with what it keeps of the clearances that give way."""
        return replace(
            self,
            clearance_m=kept.transit_clearance_m,
            rope_clearance_m=kept.rope_clearance_m,
            departure_clearance_m=kept.departure_clearance_m,
            approach_clearance_m=kept.approach_clearance_m,
            upending_clearance_m=kept.upending_clearance_m,
            turning_clearance_m=kept.turning_clearance_m,
        )

    @property
    def ever_with_jib(self) -> bool:
        """Whether its load turns with the jib, or did on a path that it left."""
        return self.with_jib or any(left.with_jib for left in self.left)

    @property
    def is_set(self) -> bool:
        """Whether its part is in place after its turn, set by the crane or otherwise."""
        return self.status is not Status.INFEASIBLE or self.by_other_means

    @property
    def is_set_otherwise(self) -> bool:
        """Whether its part is in place after its turn, but not set by the crane."""
        return self.is_set and self.status is not Status.PLANNED

    @property
    def in_yard(self) -> YardPlace | None:
        """Where its part waits in the yard; None if it never lies there.

        A part of a stack lies there until its turn, also if it is set by other means: others lie on it.
        """
        stacked = self.place is not None and self.place.stack > 0
        return self.place if stacked or not self.is_set_otherwise else None

    @property
    def number(self) -> int:
        """Its number as people see it, from 1."""
        return self.order + 1

    @property
    def moves(self) -> int | None:
        """Number of unit moves; None if infeasible."""
        return None if self.path_vox is None else len(self.path_vox) - 1

    @property
    def last_moves_vox(self) -> NDArray[np.int32]:
        """(N, 3) the last moves of its path, which the narrow phase cleared; the lift must have a path."""
        assert self.path_vox is not None
        return self.path_vox[max(0, len(self.path_vox) - 1 - self.contact_moves) :]


def same_path(before: Lift | None, now: Lift) -> bool:
    """Return whether a lift is unchanged.

    For a lift that an extract omits, only the status is known: without paths, equal statuses count as unchanged.
    """
    if before is None or before.path_vox is None or now.path_vox is None:
        return before is not None and before.status is now.status and before.path_vox is now.path_vox
    same = (before.guide, before.with_jib) == (now.guide, now.with_jib)
    return same and np.array_equal(before.path_vox, now.path_vox)


def infeasible_among(lifts: Iterable[Lift]) -> list[Lift]:
    """Return the lifts that the crane cannot execute, in the order given; their parts may be set by other means."""
    return [lift for lift in lifts if lift.status is Status.INFEASIBLE]


def by_change(before: Iterable[Lift], now: Iterable[Lift]) -> tuple[list[Lift], list[Lift], list[Lift]]:
    """Return the lifts that are unchanged since an earlier plan, those planned anew, and those that are infeasible.

    What the crane does not lift, such as a part that is cast in place, is none of them.
    """
    earlier = {lift.component: lift for lift in before}
    kept: list[Lift] = []
    replanned: list[Lift] = []
    now = tuple(now)
    infeasible = infeasible_among(now)
    for lift in now:
        if lift.status is Status.PLANNED:
            (kept if same_path(earlier.get(lift.component), lift) else replanned).append(lift)
    return kept, replanned, infeasible


@dataclass(frozen=True, slots=True)
class ModelledClash:
    """Two parts that overlap in the model.

    Attributes:
        first: Id of one part.
        second: Id of the other.
        depth_m: Depth of the overlap: the length of ``way_out_m``; a lower bound if that is None.
        way_out_m: The shortest straight displacement along an axis that takes ``first`` out of ``second``; None if none
            was found because they overlap too deep or interlock.
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
    """The obstructions during a period of the plan's execution.

    Attributes:
        until_ns: End of the period, on the site's clock.
        obstructions: The obstructions in the period.
    """

    until_ns: int
    obstructions: tuple[Blocker, ...]


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class LiftPlan:
    """All lifts of a site, in order.

    Attributes:
        site: The planned site.
        lifts: One per component, ascending ``order``; those that are infeasible, or no lift of the crane, included.
        clashes: Pairs that overlap in the model; such a pair may overlap by no more than the model does.
        notes: Notes for the reader (unsupported parts, interlocked groups ...), one sentence each.
        unheld: Ids of parts that are set before anything that could support them: their support is not in the model.
        history: The obstructions before those of the site, for a plan in execution; ascending times.
    """

    site: Site
    lifts: tuple[Lift, ...]
    clashes: tuple[ModelledClash, ...] = ()
    notes: tuple[str, ...] = ()
    unheld: tuple[str, ...] = ()
    history: tuple[Epoch, ...] = ()

    def lifts_with(self, context: Collection[Lift]) -> tuple[Lift, ...]:
        """Return its lifts and those of the same plan that it does not contain, in ascending order."""
        return tuple(sorted((*self.lifts, *context), key=lambda lift: lift.order))

    def __repr__(self) -> str:
        planned = sum(lift.status is Status.PLANNED for lift in self.lifts)
        return f"<LiftPlan of {self.site.name!r}: {planned:,} of {len(self.lifts):,} lifts planned>"
