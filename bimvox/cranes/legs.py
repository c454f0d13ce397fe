"""The legs of the empty hooks of several cranes, before their lifts are scheduled or while they are carried out.

Between two lifts of one crane, others set parts. So the empty hook has several legs to its next part, each clear of
the parts in place at that time:

* *early*, right after the crane's previous lift: no later part is in place yet. If the leg crosses the place of a part
  of another crane, that part is set only after the hook has passed, as is the last one before a part that comes by
  other means to where the hook leaves;
* *late*: all parts that come before the next lift in the sequence may be in place;
* *aside*: early to a parking place, where it does not obstruct the lifts in between, and late from there to the part.

On all of them the hook stays above every part that may still be in the yard.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from bimvox.crane.conflict import CraneTrack, first_conflict
from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.outline import CraneOutline, outline_of
from bimvox.crane.tower_crane import CranePose
from bimvox.cranes.lift import (
    KEPT_PARKINGS,
    REST_NS,
    Carried,
    HookError,
    Leg,
    Legs,
    Parking,
    drawn_up,
    parking_cells,
    standing_track,
)
from bimvox.errors import PlanningError
from bimvox.grid.frame import NO_CELLS
from bimvox.motion.move import slowed
from bimvox.motion.swept import HookEnd, axes_of_cells, cells_of_axes, in_cell
from bimvox.motion.swing import RiggedCrane, rigged_crane
from bimvox.motion.time_lift import empty_hook_clearance, empty_hook_move, hook_on_at, left_at, left_cells
from bimvox.motion.timeline import in_sequence, sampled
from bimvox.motion.trajectories import delayed, one_after_another
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.records.lift import Lift, LiftPlan, YardPlace
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.stop.resume import move_to_cell, resume_cells

_TRIED = 10
_APART_RAD = np.radians(25.0)
_CREEPING = 0.15
"""Share of its rates at which a crane creeps past another one to another parking place."""
_FINE_SECTORS = 120
"""Directions in which a place is looked for that does not obstruct a lift which all others obstruct."""
_NEAR_M = 1.0
"""Parts that are set closer than this to an early leg, at its height, are set only after the hook has passed."""


@dataclass(frozen=True, slots=True, eq=False)
class LastLift:
    """A crane's last lift, and the collision rule of its stage.

    Attributes:
        lift: The lift.
        space: The rule.
        slew_rad: Slewing angle at its end, including full turns.
    """

    lift: Lift
    space: CollisionSpace
    slew_rad: float


class LegMaker:
    """Makes the legs of the empty hook to one lift.

    Args:
        plan: The plan.
        number: Index of the crane.
        lift: The lift.
        place: Where its part is in the yard.
        meanwhile: The lifts of other cranes since the crane's last one.
        near: More lifts of other cranes that it must not obstruct.
        every_place: Whether all parking places are wanted, and legs between them.
    """

    def __init__(
        self,
        plan: LiftPlan,
        number: int,
        lift: Lift,
        place: YardPlace,
        meanwhile: Sequence[Carried],
        near: Sequence[Carried],
        *,
        every_place: bool = False,
    ) -> None:
        self.every_place = every_place
        self.plan, self.number, self.lift, self.place = plan, number, lift, place
        self.watched = [*meanwhile, *(one for one in near if one not in meanwhile)]
        self.between = [one.lift for one in meanwhile]
        self.site, self.crane = plan.site, plan.site.cranes[number]
        self.component = self.site.components[lift.component]
        self.empty = rigged_crane(self.site, self.crane, None)

    def made(self, space: CollisionSpace, before: LastLift | None) -> Legs:
        """Return the legs, given the rule of the lift's stage and the crane's previous lift.

        Raises HookError: if there are none although the crane has a previous lift.
        """
        pick_vox = hook_on_at(self.component, self.place, space)
        lying = self.lying()
        now = self.hook_rule(space, above=lying)
        early = late = None
        near: list[HookEnd] = [pick_vox]
        slew_rad = 0.0
        if before is not None:
            slew_rad = before.slew_rad
            exit_vox, exit_at = left_cells(self.site, before.lift), left_at(self.site, before.lift)
            near.append(exit_at)
            above = [
                target_cells(self.site.components[before.lift.component]),
                *self.arrived_since(before.lift, [self.lift]),
                *self.other_means_since(before.lift, self.lift),
            ]
            onto = self._onto(before.lift, exit_vox, self.lift.order)
            then = self.hook_rule(before.space, exit_vox, above)
            early = self._early(then, exit_at, pick_vox, slew_rad, onto)
            late = early
            if self.between or early is None:
                late = self._late(space, before.lift, pick_vox, slew_rad, lying)

        def parking(parked_vox: NDArray[np.int32]) -> Parking | None:
            back = self.leg(now, parked_vox, pick_vox, slew_rad)
            if back is None:
                back = self.leg(self.hook_rule(space), parked_vox, pick_vox, slew_rad, last=True)
            aside = self._early(then, exit_at, parked_vox, slew_rad, onto) if before is not None else None
            return Parking(aside, back) if back is not None and (before is None or aside is not None) else None

        parkings = self.parkings(now, near, parking, slew_rad)
        if before is not None and early is None and late is None and not parkings:
            raise HookError(self.component.id, "the empty hook has no free path to it from its crane's previous lift")
        free = placement_is_free(now, *in_cell(pick_vox))
        return _legs_of(early, late, parkings, slew_rad, starts_there=free)

    def hook_rule(
        self, space: CollisionSpace, left_vox: NDArray[np.int32] = NO_CELLS, above: Sequence[NDArray[np.int32]] = ()
    ) -> CollisionSpace:
        """Return the collision rule of the empty hook before it is over the part; see ``empty_hook_clearance``."""
        return empty_hook_clearance(self.site, self.crane, space, self.place, left_vox, above)

    def parkings(
        self,
        rule: CollisionSpace,
        near: Sequence[HookEnd],
        parking: Callable[[NDArray[np.int32]], Parking | None],
        slew_rad: float,
    ) -> list[Parking]:
        """Return parking places, best first; with every place, also legs between them.

        With every place, a lift that all others obstruct gets one that does not obstruct it.

        Args:
            rule: The collision rule of the empty hook.
            near: Where the hook comes from and where it goes.
            parking: Makes the legs to a cell and back.
            slew_rad: Slewing angle near which the legs between the places begin.
        """
        cells, made = [], []
        for cell in self.parking_cells(rule, near):
            legs = parking(cell)
            if legs is not None:
                cells.append(cell)
                made.append(legs)
            if len(made) == KEPT_PARKINGS and not self.every_place:
                return made
        if not self.every_place:
            return made
        met = [self._met(cell) for cell in cells]
        for one in self.watched:
            if all(one.lift.order in orders for orders in met):
                for cell in parking_cells(self.site, self.number, rule, _FINE_SECTORS):
                    orders = self._met(cell)
                    legs = None if one.lift.order in orders else parking(cell)
                    if legs is not None:
                        cells, made, met = [*cells, cell], [*made, legs], [*met, orders]
                        break
        return [
            replace(legs, across=tuple(self._across(rule, cell, other, slew_rad) for other in cells))
            for cell, legs in zip(cells, made, strict=True)
        ]

    def _across(self, rule: CollisionSpace, start_vox: HookEnd, end_vox: HookEnd, slew_rad: float) -> tuple[Leg, ...]:
        """Return the leg from one parking place to another, and the same at creeping rates, as far as there are any.

        The crane may have to stop anywhere: the slower it goes, the nearer it may pass another one.
        """
        legs = (self.leg(rule, start_vox, end_vox, slew_rad, share=share) for share in (1.0, _CREEPING))
        return tuple(leg for leg in legs if leg is not None)

    def _met(self, cell: NDArray[np.int32]) -> set[int]:
        """Return orders of the watched lifts that the hook over a cell obstructs."""
        still = standing_track(self.site, self.crane, axes_of_cells(self.empty.load, cell))
        return {one.lift.order for one in self.watched if self._meets(outline_of(self.crane), still, one)}

    def parking_cells(self, rule: CollisionSpace, near: Sequence[HookEnd]) -> list[NDArray[np.int32]]:
        """Return cells to wait at, sorted by how many of the other cranes' lifts they obstruct, then by slewing angle.

        Args:
            rule: The collision rule of the empty hook.
            near: Where the hook comes from and where it goes.
        """
        if not self.watched:
            return []
        site, hook = self.site, self.empty.load
        wanted = [float(axes_of_cells(hook, cell)[0]) for cell in near]
        judged: list[tuple[int, float, int, NDArray[np.int32]]] = []
        above = [drawn_up(site, rule, cell) for cell in near]
        for n, cell in enumerate([*above, *parking_cells(site, self.number, rule)]):
            axes = axes_of_cells(hook, cell)
            judged.append((len(self._met(cell)), round(sum(_turn(axes[0] - angle) for angle in wanted), 6), n, cell))
        chosen: list[tuple[float, NDArray[np.int32]]] = []
        for *_, cell in sorted(judged, key=lambda entry: entry[:3]):
            angle = float(axes_of_cells(hook, cell)[0])
            if all(_turn(angle - other) >= _APART_RAD for other, _ in chosen):
                chosen.append((angle, cell))
        return [cell for _, cell in chosen[:_TRIED]]

    def _meets(self, outline: CraneOutline, still: CraneTrack, one: Carried) -> bool:
        other = outline_of(self.site.cranes[one.crane])
        separation_m = self.site.rules.crane_separation_m
        return first_conflict((outline, other), still, one.track, separation_m) is not None

    def lying(self) -> list[NDArray[np.int32]]:
        """Return cells of earlier parts of the sequence that may still be in the yard."""
        places = [one.place for one in self.between if one.place is not None]
        # A part that cannot be lifted stays there as long as the rest of its delivery.
        older = {place.delivery for place in places if place.delivery < self.place.delivery}
        kept = [one.place for one in self.plan.lifts if not one.is_set and one.place is not None]
        return [stored_cells(place) for place in [*places, *(one for one in kept if one.delivery in older)]]

    def left(self, last: LastLift) -> tuple[Leg, ...]:
        """Return the crane's legs to a parking place after its last lift."""
        exit_vox, exit_at = left_cells(self.site, last.lift), left_at(self.site, last.lift)
        above = [
            target_cells(self.component),
            *self.arrived_since(last.lift, self.between[-1:]),
            *self.other_means_since(last.lift, None),
        ]
        rule, onto = self.hook_rule(last.space, exit_vox, above), self._onto(last.lift, exit_vox, len(self.plan.lifts))
        legs = (
            self._early(rule, exit_at, parked_vox, last.slew_rad, onto)
            for parked_vox in self.parking_cells(rule, [exit_at])[:KEPT_PARKINGS]
        )
        return tuple(leg for leg in legs if leg is not None)

    def arrived_since(self, before: Lift, until: Sequence[Lift]) -> list[NDArray[np.int32]]:
        """Return cells of parts that may be delivered during the early leg; its collision rule lacks them."""
        assert before.place is not None
        last = max((one.place.delivery for one in until if one.place is not None), default=0)
        late = range(before.place.delivery + 1, last + 1)
        return [stored_cells(one.in_yard) for one in self.plan.lifts if one.in_yard and one.in_yard.delivery in late]

    def other_means_since(self, before: Lift, until: Lift | None) -> list[NDArray[np.int32]]:
        """Return cells of parts that come by other means after a lift, before another; nobody knows when they come."""
        last = len(self.plan.lifts) if until is None else until.order
        return [target_cells(self.site.components[one.component]) for one in self._coming(before, last)]

    def _coming(self, before: Lift, until: int) -> list[Lift]:
        return [one for one in self.plan.lifts if one.is_set_otherwise and before.order < one.order < until]

    def _onto(self, before: Lift, exit_vox: NDArray[np.int32], until: int) -> list[tuple[int, Lift]]:
        """Return the parts that come by other means to where the hook leaves its set point, after the lift before each.

        They may come as soon as the slings of all earlier lifts are off. So the part of the last lift in between must
        not be set before the hook has left. Without one the hook cannot be away in time; those are left out.
        """
        at, onto = (exit_vox[:, 0], exit_vox[:, 1]), []
        for part in self._coming(before, until):
            last = max((one.order for one in self.between if one.order < part.order), default=None)
            if last is not None and (self._tops([part])[at] > exit_vox[:, 2]).any():
                onto.append((last, part))
        return onto

    def _early(
        self,
        rule: CollisionSpace,
        start_vox: HookEnd,
        end_vox: HookEnd,
        slew_rad: float,
        onto: Sequence[tuple[int, Lift]],
    ) -> Leg | None:
        leg = self.leg(rule, start_vox, end_vox, slew_rad)
        if leg is None:
            return None
        return replace(leg, before=frozenset({*self.crossed(leg.trajectory), *(order for order, _ in onto)}))

    def _late(
        self,
        space: CollisionSpace,
        before: Lift,
        pick_vox: HookEnd,
        slew_rad: float,
        lying: Sequence[NDArray[np.int32]],
    ) -> Leg | None:
        """Return the late leg; the exit from the set point is not free if a part was set above it since."""
        exit_vox, exit_at = left_cells(self.site, before), left_at(self.site, before)
        tops = self._tops([*self.between, *(part for _, part in self._onto(before, exit_vox, self.lift.order))])
        kept = exit_vox[exit_vox[:, 2] >= tops[exit_vox[:, 0], exit_vox[:, 1]]]
        if not len(kept) or (kept[-1] != exit_vox[-1]).any():
            return None
        leg = self.leg(self.hook_rule(space, kept, lying), exit_at, pick_vox, slew_rad)
        if leg is None and lying:
            leg = self.leg(self.hook_rule(space, kept), exit_at, pick_vox, slew_rad, last=True)
        return leg

    def leg(
        self,
        rule: CollisionSpace,
        start_vox: HookEnd,
        end_vox: HookEnd,
        slew_rad: float,
        *,
        last: bool = False,
        share: float = 1.0,
    ) -> Leg | None:
        """Return a leg from cell to cell; None if there is none, or none is needed.

        ``share`` is that of the crane's rates of slewing and trolleying.
        """
        if (start_vox == end_vox).all():
            return None
        try:
            return Leg(empty_hook_move(_slowed(self.empty, share), rule, start_vox, end_vox, slew_rad), last=last)
        except PlanningError:
            return None

    def crossed(self, trajectory: Trajectory) -> list[int]:
        """Return orders of the lifts in between whose part, once set, reaches the height of the hook next to it."""
        cells = np.floor(cells_of_axes(self.empty.load, trajectory.axes)).astype(np.int64)
        x, y = (np.clip(cells[:, i], 0, self.site.shape[i] - 1) for i in (0, 1))
        lowest = np.full(self.site.shape[:2], 2**30, np.int64)
        np.minimum.at(lowest, (x, y), cells[:, 2])
        near = 1 + int(np.ceil(_NEAR_M / self.site.frame.voxel_size_m))
        # Where a part is not, its top is 0: a hook that goes down to the ground there does not meet it.
        lowest = np.maximum(minimum_filter(lowest, size=2 * near + 1, mode="nearest") - near, 0)
        return [one.order for one in self.between if (self._tops([one]) > lowest).any()]

    def _tops(self, lifts: Sequence[Lift]) -> NDArray[np.int64]:
        """Return (X, Y) one above the highest cell of the parts of lifts at their places; 0 if there is none."""
        tops = np.zeros(self.site.shape[:2], np.int64)
        for one in lifts:
            cells = target_cells(self.site.components[one.component])
            np.maximum.at(tops, (cells[:, 0], cells[:, 1]), cells[:, 2] + 1)
        return tops


def _legs_of(
    early: Leg | None, late: Leg | None, parkings: Sequence[Parking], slew_rad: float, *, starts_there: bool = True
) -> Legs:
    """Return legs that begin at a slewing angle; if there are none, the hook is over the part at that angle."""
    legs = (early, late, *(parking.back for parking in parkings))
    ends_rad = next((float(leg.trajectory.slew_rad[-1]) for leg in legs if leg is not None), slew_rad)
    return Legs(early, late, tuple(parkings), ends_rad, starts_there)


def _slowed(empty: RiggedCrane, share: float) -> RiggedCrane:
    crane = empty.crane
    slow = replace(crane, slewing=slowed(crane.slewing, share), trolley=slowed(crane.trolley, share))
    return empty._replace(crane=slow)


def _turn(angle_rad: float) -> float:
    """Return the absolute angle of the shorter turn."""
    return abs(float(np.remainder(angle_rad + np.pi, 2.0 * np.pi) - np.pi))


# The legs of the empty hooks of several cranes to their next parts, for a plan that is being carried out.
#
# A crane whose last part is set moves to its next one as in a plan. If its hook is elsewhere, stopped between two parts
# or waiting, it continues from there: *early*, while no more parts are set than now; or *late*, when all parts that
# come before the next lift in the sequence may be in place or still in the yard.

_THERE_VOX = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class CraneStart:
    """The position from which a crane continues.

    Attributes:
        motions: Motions of its lifts that are hooked on or done, by order.
        axes: (3,) slew (rad), radius (m), height (m) at which its empty hook is, or comes to rest; None if it is where
            its last part was set.
    """

    motions: Mapping[int, LiftMotion]
    axes: NDArray[np.float64] | None


def legs_from_there(
    maker: LegMaker, space: CollisionSpace, axes: NDArray[np.float64], last: tuple[Lift, CollisionSpace] | None
) -> Legs:
    """Return the legs to a crane's next part from any pose of its hook.

    Args:
        maker: Makes the legs to that part.
        space: The collision rule of the stage of its lift.
        axes: (3,) the pose: slew (rad), radius (m), height (m).
        last: The last lift of all cranes that is hooked on, and the rule of its stage; None if there is none.

    Raises:
        HookError: If the hook has no free path to the part.
    """
    site, place, component = maker.site, maker.place, maker.component
    pose = CranePose(*(float(n) for n in axes))
    pick_vox = hook_on_at(component, place, space)
    at_vox = cells_of_axes(maker.empty.load, axes)
    now = maker.hook_rule(space, above=maker.lying())
    there = bool(np.abs(at_vox - pick_vox).max() <= _THERE_VOX)
    early = None
    if last is not None:
        since, rule = last
        above = [
            target_cells(site.components[since.component]),
            *maker.arrived_since(since, [maker.lift]),
            *maker.other_means_since(since, maker.lift),
        ]
        then = maker.hook_rule(rule, above=above)
        early = None if there else _early(maker, then, pose, pick_vox, since.order)
    late = None
    if not there:
        late = _leg(maker, now, pose, pick_vox)
        if late is None:
            late = _leg(maker, maker.hook_rule(space), pose, pick_vox, last=True)

    def parking(parked_vox: NDArray[np.int32]) -> Parking | None:
        back = maker.leg(now, parked_vox, pick_vox, pose.slew_rad)
        aside = _leg(maker, now, pose, parked_vox)
        if aside is None and last is not None:
            aside = _early(maker, then, pose, parked_vox, since.order)
        return Parking(aside, back) if back is not None and aside is not None else None

    parkings = maker.parkings(now, [pick_vox, at_vox], parking, pose.slew_rad)
    if not there and early is None and late is None and not parkings:
        raise HookError(component.id, "the empty hook has no free path to it from where it is")
    legs = _legs_of(early, late, parkings, pose.slew_rad)
    return replace(legs, hooked_rad=nearest_turn(legs.hooked_rad, pose.slew_rad)) if there else legs


def _early(maker: LegMaker, rule: CollisionSpace, pose: CranePose, end_vox: HookEnd, since: int) -> Leg | None:
    """Return a leg that passes the places of later lifts before their parts are set; None if there is none."""
    leg = _leg(maker, rule, pose, end_vox)
    if leg is None:
        return None
    return replace(leg, before=frozenset(n for n in maker.crossed(leg.trajectory) if n > since))


def _leg(maker: LegMaker, rule: CollisionSpace, pose: CranePose, end_vox: HookEnd, *, last: bool = False) -> Leg | None:
    """Return a leg of the empty hook from rest at any pose to a cell; None if there is none."""
    empty = maker.empty
    hook = empty.load
    for cell in resume_cells(rule, hook, pose):
        start_vox = np.array(cell, np.int32)
        first = move_to_cell(hook, pose, cell)
        moves = any(abs(part) > _THERE_VOX * hook.voxel_size_m for part in first.difference)
        onward = maker.leg(rule, start_vox, end_vox, first.end.slew_rad, last=last)
        if onward is None and (start_vox != end_vox).any():
            continue
        parts: list[Trajectory] = []
        if moves:
            try:
                timeline = in_sequence(empty.crane, [first], empty.pendulum)
            except PlanningError:
                continue
            parts.append(sampled(timeline, max(first.start.height_m, first.end.height_m), empty))
        if onward is not None:
            later = onward.trajectory
            parts.append(delayed(later, int(parts[0].time_ns[-1]) + REST_NS) if parts else later)
        if parts:
            return Leg(one_after_another(parts), last=last)
    return None
