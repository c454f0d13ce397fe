"""When work that the crane does not do is done, when joints have cured, and where the crane must pause for either.

Work at a part begins when all earlier lifts of the sequence are set and what it rests on carries; a column or wall
waits for the floor at its feet, too. One crew casts and another one sets parts by hand, each one part after the other.
Meanwhile the crane does the lifts that do not wait for it; then it pauses. Work before the first lift is done before
the clock starts. A crane that moves from one set-up to another pauses for that; other work goes on meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import Label, whole_cells
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.steps import Move, Pause, Step, Steps, cured_ns
from bimvox.site.casting import curing_s, waits_for_joints, work_and_wait_s
from bimvox.site.component import Component
from bimvox.site.crane_distances import is_in, stand_of
from bimvox.site.means import Means
from bimvox.site.site import Site, floors_at_feet
from bimvox.units import NS_PER_S

_NOWHERE = 2**30


def steps_of(site: Site, lifts: Sequence[Lift], motions: Iterable[LiftMotion]) -> Steps:
    """Return the steps and pauses of a plan; none if it has no motions or its rules ask for none.

    ``motions``: the motions of all planned lifts.
    """
    by_order = {motion.order: motion for motion in motions}
    casting = site.rules.casting
    works = any(lift.is_set_otherwise for lift in lifts)
    if not by_order or not (works or site.rules.curing is not None or site.moving is not None):
        return Steps()
    resting = Resting(site, lifts)
    steps: list[Step] = []
    pauses: list[Pause] = []
    moves: list[Move] = []
    set_up: int | None = None
    carries_ns: dict[int, int] = {}
    lifted = {motion.component for motion in by_order.values()}
    free_ns = dict.fromkeys(Means, 0)
    last_ns: int | None = None
    for lift in sorted(lifts, key=lambda lift: lift.order):
        component = site.components[lift.component]
        under = resting.on(lift.component, held=lift.order in by_order)
        waits = waits_for_joints(site.rules.curing, component)
        awaited = [n for n in under if waits or n not in lifted] + resting.floors(lift.component)
        ready_ns = max((carries_ns[n] for n in awaited if n in carries_ns), default=0)
        so_far = Steps((), tuple(pauses))
        if (motion := by_order.get(lift.order)) is not None:
            if last_ns is None:
                # What comes before the first lift is done when the clock starts.
                late_ns = max(carries_ns.values(), default=0)
                steps = [_earlier(step, late_ns) for step in steps]
                carries_ns, free_ns, ready_ns = dict.fromkeys(carries_ns, 0), dict.fromkeys(Means, 0), 0
            at_ns = motion.hooked_ns if site.has_several_cranes else motion.start_ns
            wait_ns = ready_ns - so_far.starting_ns(at_ns)
            if site.moving is not None and set_up not in (None, motion.crane):
                moves.append(_move(site, lift.order, set_up, motion.crane, so_far.starting_ns(at_ns)))
                wait_ns = max(wait_ns, moves[-1].ends_ns - moves[-1].begins_ns)
            set_up = None if site.moving is None else motion.crane
            if wait_ns > 0:
                pauses.append(Pause(lift.order, at_ns, wait_ns))
            last_ns = max(last_ns or 0, motion.released_ns)
            if (carries_at_ns := cured_ns(site, Steps((), tuple(pauses)), motion)) is not None:
                carries_ns[lift.component] = carries_at_ns
        elif lift.is_set_otherwise:
            means = component.means
            work_s, wait_s = work_and_wait_s(casting, site.rules.building, component, component.mass_kg)
            begins_ns = max(ready_ns, 0 if last_ns is None else so_far.ending_ns(last_ns))
            if means is not Means.CRANE:
                begins_ns = max(begins_ns, free_ns[means])
            if set_up is not None and last_ns is not None and _is_where_it_stands(site, set_up, component):
                assert site.moving is not None
                begins_ns = max(begins_ns, so_far.ending_ns(last_ns) + round(site.moving.derig_s * NS_PER_S))
            free_ns[means] = ends_ns = begins_ns + round(work_s * NS_PER_S)
            carries_ns[lift.component] = ends_ns + round(wait_s * NS_PER_S)
            steps.append(Step(lift.order, lift.component, begins_ns, ends_ns, carries_ns[lift.component]))
    return Steps(tuple(steps), tuple(pauses), tuple(moves))


def _is_where_it_stands(site: Site, set_up: int, part: Component) -> bool:
    """Return whether a part would be where the crane stands in a set-up: it is not set before the crane drives away."""
    return any(is_in(solid, part.mesh) for solid in stand_of(site.cranes[set_up]))


def _move(site: Site, order: int, come_from: int, goes_to: int, begins_ns: int) -> Move:
    """Return the move of the crane before a lift, from one set-up to another."""
    moving = site.moving
    assert moving is not None
    drive_s = moving.drive_s(site.cranes[come_from], site.cranes[goes_to])
    drives_ns = begins_ns + round(moving.derig_s * NS_PER_S)
    arrives_ns = drives_ns + ceil(drive_s * NS_PER_S)
    return Move(
        order, come_from, goes_to, begins_ns, drives_ns, arrives_ns, arrives_ns + round(moving.rig_s * NS_PER_S)
    )


def steps_of_log(plan: LiftPlan, motions: Sequence[LiftMotion], context: Sequence[Lift]) -> Steps:
    """Return the steps and pauses of a log; none of an extract, because they follow from all lifts.

    Args:
        plan: What the log carries.
        motions: Its motions.
        context: Lifts of the same plan that it does not carry.
    """
    planned = sum(lift.status is Status.PLANNED for lift in plan.lifts)
    return Steps() if context or len(motions) < planned else steps_of(plan.site, plan.lifts, motions)


def may_pause(plan: LiftPlan) -> frozenset[int]:
    """Return the orders of the lifts before which the cranes may have to pause, whatever their motions."""
    lifts = sorted(plan.lifts, key=lambda lift: lift.order)
    first = next((lift.order for lift in lifts if lift.status is Status.PLANNED), len(lifts))
    rules, parts = plan.site.rules, plan.site.components
    works = {lift.component for lift in lifts if lift.order > first and lift.is_set_otherwise}
    cures = {
        lift.component
        for lift in lifts
        if lift.status is Status.PLANNED and curing_s(rules.curing, parts[lift.component])
    }
    if not works and not cures:
        return frozenset()
    resting = Resting(plan.site, lifts)

    def may(lift: Lift) -> bool:
        waited_for = works | cures if waits_for_joints(rules.curing, parts[lift.component]) else works
        return not waited_for.isdisjoint((*resting.on(lift.component), *resting.floors(lift.component)))

    return frozenset(lift.order for lift in lifts if lift.status is Status.PLANNED and may(lift))


class Resting:
    """Which parts rest on which, and where, by their cells.

    Args:
        site: The site.
        lifts: All its lifts.
    """

    def __init__(self, site: Site, lifts: Iterable[Lift]) -> None:
        parts = site.components
        self._site = site
        self._order = np.full(len(parts), _NOWHERE)
        for lift in lifts:
            if lift.is_set:
                self._order[lift.component] = lift.order
        self._low = np.array([part.target_vox for part in parts], np.int64)
        self._high = self._low + np.array([part.shape.size_vox for part in parts], np.int64)
        self._profiles: dict[int, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}
        numbers = {part.id: n for n, part in enumerate(parts)}
        self._asked: dict[int, list[int]] = {}
        for part in parts:
            for earlier, later in (*((other, part.id) for other in part.after), *((part.id, o) for o in part.before)):
                if earlier in numbers and later in numbers:
                    self._asked.setdefault(numbers[later], []).append(numbers[earlier])
        self._gap_vox = 1 + whole_cells(site.rules.support_gap_m, site.frame.voxel_size_m)

    def on(self, number: int, *, held: bool = True) -> tuple[int, ...]:
        """Return the earlier components that carry this one, or that the site file asks to be earlier.

        A part that rests on nothing may be ``held`` by those that it is next to.
        """
        part, low, high = self._site.components[number], self._low[number], self._high[number]
        earlier = self._order < self._order[number]
        over = earlier & ((self._low[:, :2] < high[:2]) & (self._high[:, :2] > low[:2])).all(axis=1)
        close = (self._low[:, 2] <= high[2]) & (self._high[:, 2] >= low[2] - self._gap_vox)
        found = {n for n in np.flatnonzero(over & close).tolist() if self._carries(n, number)}
        if held and not found and not self.is_grounded(part):
            near = earlier & ((self._low <= high) & (self._high >= low)).all(axis=1)
            found.update(np.flatnonzero(near).tolist())
        found.update(other for other in self._asked.get(number, ()) if earlier[other])
        return tuple(sorted(found))

    def floors(self, number: int) -> list[int]:
        """Return the earlier lifted floors at the feet of this component, whose joints it waits for."""
        earlier = self._order < self._order[number]
        found: list[int] = np.flatnonzero(floors_at_feet(self._site)[number] & earlier).tolist()
        return found

    def bearing(self, number: int) -> NDArray[np.int64]:
        """Return the (N, 2) columns in which a part is on earlier ones, on the ground or over structure."""
        found = [self._borne(other, number) for other in self.on(number, held=False)]
        ground = self._over_ground(self._site.components[number])[:, :2].astype(np.int64)
        return np.asarray(np.unique(np.concatenate([ground, *found]), axis=0), np.int64)

    def _carries(self, other: int, part: int) -> bool:
        """Return whether an underside of a part is on top of another one, or at most the support gap above it."""
        return bool(len(self._borne(other, part)))

    def _borne(self, other: int, part: int) -> NDArray[np.int64]:
        """Return the (N, 2) columns in which it is."""
        low = np.maximum(self._low[part], self._low[other])[:2]
        high = np.minimum(self._high[part], self._high[other])[:2]
        if (high <= low).any():
            return np.zeros((0, 2), np.int64)
        above = self._profile(part, low, high)[0] - self._profile(other, low, high)[1]
        return np.asarray(np.argwhere((above >= -1) & (above <= self._gap_vox)) + low, np.int64)

    def _profile(self, part: int, low: NDArray[np.int64], high: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
        """Return the lowest and the highest cell of a part in a range of columns; far away where it has none."""
        if part not in self._profiles:
            component = self._site.components[part]
            x, y, z = component.shape.cells.T.astype(np.int64)
            bottom = np.full(component.shape.size_vox[:2], _NOWHERE, np.int64)
            top = np.full(component.shape.size_vox[:2], -_NOWHERE, np.int64)
            np.minimum.at(bottom, (x, y), z + component.target_vox[2])
            np.maximum.at(top, (x, y), z + component.target_vox[2])
            self._profiles[part] = (bottom, top)
        x, y = (slice(*ends) for ends in zip(low - self._low[part, :2], high - self._low[part, :2], strict=True))
        return tuple(profile[x, y] for profile in self._profiles[part])

    def is_grounded(self, part: Component) -> bool:
        """Return whether a part is on the ground or over a structure."""
        return bool(len(self._over_ground(part)))

    def _over_ground(self, part: Component) -> NDArray[np.int32]:
        """Return the (N, 3) cells of a part that are on the ground or over a structure."""
        cells = part.shape.cells + np.array(part.target_vox, np.int32)
        below = self._site.labels[cells[:, 0], cells[:, 1], np.maximum(cells[:, 2] - 1, 0)]
        over = cells[:, 2] - self._site.ground_vox[cells[:, 0], cells[:, 1]]
        return np.asarray(cells[(over <= self._gap_vox) | (below == Label.STRUCTURE)], np.int32)


def _earlier(step: Step, by_ns: int) -> Step:
    return replace(
        step, begins_ns=step.begins_ns - by_ns, ends_ns=step.ends_ns - by_ns, carries_ns=step.carries_ns - by_ns
    )
