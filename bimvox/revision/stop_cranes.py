"""What several cranes do at a time, which of them a change stops, and their stops with loads and empty hooks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.conflict import CraneTrack, first_conflict
from bimvox.crane.outline import outline_of
from bimvox.cranes.legs import CraneStart
from bimvox.cranes.lift import approach_track, carrying_track
from bimvox.grid.frame import NO_CELLS
from bimvox.motion.swing import rigged_crane
from bimvox.motion.time_lift import empty_hook_clearance, left_cells
from bimvox.motion.trajectories import between, delayed, stopped
from bimvox.planning.assembly import Assembly
from bimvox.planning.rounds import Refused
from bimvox.planning.stage import Obstacle, Stage
from bimvox.proof.footprint import CellMask, hook_footprint, jib_meets, motion_footprint
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.revision.current_plan import CurrentPlan, HeldHook, HookWay, RevisionRequest
from bimvox.site.collision import CollisionSpace
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.stop.brake_axes import stop_under_way
from bimvox.stop.choose_stop import STOPPED, manoeuvre
from bimvox.stop.redirect import (
    NOT_CARRIED,
    Held,
    Redirected,
    UnderWay,
    is_carried,
    is_set,
    redirect,
    redirect_held,
    redirected_if_possible,
)
from bimvox.stop.resume import cut_short

# What several cranes have done of a plan at a given time, and whether a change meets what they are doing.
#
# Parts are hooked on in the erection sequence (R1), so the lifts that have begun are always the first ones of the
# sequence. The empty hooks may be anywhere between two parts.


@dataclass(frozen=True, slots=True, eq=False)
class CraneNow:
    """One crane at a given time.

    Attributes:
        number: Its index in ``Site.cranes``.
        stands: Slew (rad), radius (m) and height (m) at the start of the clock.
        motions: Motions of its lifts that have begun, by order, without the departure of the hook.
        ways: Moves of its empty hook that have begun since, in order.
    """

    number: int
    stands: tuple[float, float, float]
    motions: Mapping[int, LiftMotion]
    ways: tuple[HookWay, ...]

    @property
    def resumes_from(self) -> CraneStart:
        """The position from which it continues."""
        if self.ways:
            return CraneStart(self.motions, self.ways[-1].way.axes[-1])
        return CraneStart(self.motions, None if self.motions else np.array(self.stands))

    @property
    def is_safe(self) -> bool:
        """Whether its hook met nothing when it stopped."""
        return all(way.is_free for way in self.ways)

    @property
    def hook(self) -> HeldHook:
        """Where it is, for the record of held cranes."""
        return HeldHook(self.number, self.stands, self.ways)


def cranes_at(site: Site, current: CurrentPlan, now_ns: int) -> tuple[CraneNow, ...]:
    """Return the state of every crane that has lifts, at a given time.

    ``now_ns``: on the site's clock.
    """
    held = {} if current.held is None else {hook.crane: hook for hook in current.held.hooks}
    found = []
    for number in range(len(site.cranes)):
        own = [motion for motion in current.chain if motion.crane == number]
        if number in held:
            hook = held[number]
            found.append(CraneNow(number, hook.stands, {m.order: _without_leaving(m) for m in own}, hook.ways))
            continue
        if not own:
            continue
        hooked = [motion for motion in own if motion.hooked_ns < now_ns]
        ways = [*_ways_of(hooked[-1], PhaseName.LEAVE)] if hooked else []
        if len(hooked) < len(own):
            ways += _ways_of(own[len(hooked)], PhaseName.APPROACH)
        slew, radius, height = own[0].samples()[1][0].tolist()
        motions = {motion.order: _without_leaving(motion) for motion in hooked}
        begun = tuple(way for way in ways if way.start_ns < now_ns)
        found.append(CraneNow(number, (slew, radius, height), motions, begun))
    return tuple(found)


def is_met(site: Site, current: CurrentPlan, crane: CraneNow, added: NDArray[np.int32], now_ns: int) -> bool:
    """Return whether new obstructed cells meet the rest of what a crane is doing.

    Args:
        site: The site.
        current: The current plan.
        crane: The crane.
        added: (N, 3) the cells.
        now_ns: On the site's clock.
    """
    if not len(added):
        return False
    mask = CellMask(site.shape)
    mask.add(added)
    lifts = {lift.order: lift for lift in current.plan.lifts}
    if any(load_is_met(site, lifts[order], motion, added, now_ns) for order, motion in crane.motions.items()):
        return True
    for way in crane.ways:
        if way.end_ns > now_ns:
            motion = _alone(way, crane.number)
            if mask.meets(hook_footprint(site, motion, way.way, now_ns)) or jib_meets(site, motion, added):
                return True
    return False


def load_is_met(site: Site, lift: Lift, motion: LiftMotion, added: NDArray[np.int32], now_ns: int) -> bool:
    """Return whether new obstructed cells meet the rest of the motion of a load on a hook.

    ``added``: (N, 3) the cells; ``now_ns``: on the site's clock.
    """
    if not len(added) or is_set(motion, now_ns):
        return False
    mask = CellMask(site.shape)
    mask.add(added)
    return mask.meets(motion_footprint(site, lift, motion, now_ns)) or jib_meets(site, motion, added)


def _without_leaving(motion: LiftMotion) -> LiftMotion:
    """Return the motion until its slings are off."""
    if motion.departure is None:
        return motion
    phases = tuple(phase for phase in motion.phases if phase.end_ns <= motion.released_ns)
    return replace(motion, departure=None, phases=phases, end_ns=motion.released_ns)


def _ways_of(motion: LiftMotion, name: PhaseName) -> Iterator[HookWay]:
    """Yield the moves of the empty hook in the approach or the departure of a motion."""
    whole = motion.approach if name is PhaseName.APPROACH else motion.departure
    if whole is None:
        return
    for start_ns, end_ns, stopped_ns in motion.ways_ns(name):
        # The last sample of a stop may be the one at which the next move starts.
        last_ns = end_ns - motion.start_ns - (0 if stopped_ns is None else 1)
        way = between(whole, start_ns - motion.start_ns, last_ns)
        yield HookWay(start_ns, delayed(way, -int(way.time_ns[0])), stopped_ns)


def _alone(way: HookWay, crane: int) -> LiftMotion:
    """Return a move of a crane's empty hook as a separate motion."""
    end_ns = int(way.way.time_ns[-1])
    slew, radius, height = (np.repeat(axis, 2) for axis in way.way.axes[-1])
    still = Trajectory(np.array([end_ns, end_ns + 1]), slew, radius, height, np.zeros(0, np.int64), 0.0)
    ends_ns = way.start_ns + end_ns + 1
    phases = (Phase(PhaseName.APPROACH, way.start_ns, ends_ns),)
    return LiftMotion(-1, -1, way.way, still, still, phases, way.start_ns, ends_ns, crane)


class _StoppedCranes(NamedTuple):
    """Cranes at rest.

    Attributes:
        cranes: The cranes, their empty hooks stopped.
        loads: The loads on their hooks, redirected or held, in order.
    """

    cranes: tuple[CraneNow, ...]
    loads: tuple[Redirected | Held, ...]


class Loads(NamedTuple):
    """The loads on the hooks, lifts by order.

    Attributes:
        under_way: Motions of those that are not at their place.
        held: Those that were already held.
        added: (N, 3) int32 new obstructed cells.
        refused: Ids of components whose path to continue on was not proven, and why.
    """

    under_way: Mapping[int, LiftMotion]
    held: Mapping[int, Held]
    added: NDArray[np.int32]
    refused: Refused


def all_stopped(
    request: RevisionRequest, begun: Sequence[Lift], following: Lift | None, cranes: Sequence[CraneNow], loads: Loads
) -> _StoppedCranes:
    """Return cranes stopped as soon as possible, and their loads redirected or held.

    Args:
        request: What to revise the plan for; it has the time.
        begun: The lifts that are on a hook, done or skipped, in order.
        following: The next one.
        cranes: The cranes that stop.
        loads: The loads on their hooks.
    """
    assert request.now_ns is not None
    assembly = Assembly(request.site, request.preparation)
    found: list[Redirected | Held] = []
    rule: tuple[Lift, CollisionSpace] | None = None
    for lift in begun:
        assembly.skip(lift.component)
        if lift is begun[-1] and following is None:
            rule = lift, assembly.space(lift.component)
        if lift.order in loads.under_way or lift.order in loads.held:
            found.append(_load(assembly, request, lift, loads))
        assembly.finish(lift.component, placed=lift.is_set)
    if following is not None:
        assembly.skip(following.component)
        rule = following, assembly.space(following.component)
    if rule is None or rule[0].place is None:
        return _StoppedCranes(tuple(cranes), tuple(found))
    lifts = {lift.order: lift for lift in begun}
    hooks = []
    for crane in cranes:
        site, machine = request.site, request.site.cranes[crane.number]
        leaves = len(crane.ways) == 1 and len(crane.motions) > 0
        left_vox = left_cells(site, lifts[max(crane.motions)]) if leaves else NO_CELLS
        free = empty_hook_clearance(site, machine, rule[1], rule[0].place, left_vox)
        hooks.append(_hook(site, crane, free, request.now_ns))
    return _StoppedCranes(tuple(hooks), tuple(found))


def _load(assembly: Assembly, request: RevisionRequest, lift: Lift, loads: Loads) -> Redirected | Held:
    """Return a load redirected, or held."""
    assert request.now_ns is not None
    assert lift.path_vox is not None
    component, now_ns, hold_s = request.site.components[lift.component], request.now_ns, request.hold_s
    site, crane = request.site, request.site.cranes[component.crane]

    def attempt(rule: Stage, blocked: Obstacle | None) -> Redirected | Held:
        if (held := loads.held.get(lift.order)) is not None:
            return redirect_held(site, crane, held, rule, blocked, now_ns, hold_s)
        motion = loads.under_way[lift.order]
        if not is_carried(motion, now_ns):
            if blocked is None and not load_is_met(site, lift, motion, loads.added, now_ns):
                return Redirected(lift, motion, None, NOT_CARRIED)
        elif (stop := stop_under_way(crane_for(site, crane, component), motion, now_ns)) is not None:
            stopped = Held(lift, motion, stop, STOPPED, True, "")
            return redirect_held(site, crane, stopped, rule, blocked, now_ns, hold_s)
        return redirect(site, crane, UnderWay(lift, motion, None), rule, blocked, now_ns, hold_s)

    ways = assembly.ways_on(lift.component, lift.last_moves_vox)
    return redirected_if_possible(ways, attempt, loads.refused.get(component.id))


def _hook(site: Site, crane: CraneNow, free: CollisionSpace, now_ns: int) -> CraneNow:
    """Return a crane with its empty hook stopped, if it is under way.

    ``free``: the collision rule for its empty hook now; ``now_ns``: when the stop is ordered, on the site's clock.
    """
    if not crane.ways or crane.ways[-1].end_ns <= now_ns or crane.ways[-1].stopped_ns is not None:
        return crane
    way = crane.ways[-1]
    empty = rigged_crane(site, site.cranes[crane.number], None)
    found = manoeuvre(empty, _alone(way, crane.number), way.way, now_ns, free)
    stop = found.stop
    if stop.start_ns >= way.end_ns:
        return crane
    trajectory = stopped(way.way, stop.trajectory, stop.start_ns - way.start_ns)
    return replace(crane, ways=(*crane.ways[:-1], HookWay(way.start_ns, trajectory, stop.start_ns, found.is_free)))


# Which cranes stop with one that must stop, and which go on with what they are doing.
#
# A crane goes on if it keeps its distance from where the others come to rest, and sets no part before an earlier one
# that is held. If an empty hook is stopped, all cranes stop: a part may only be set after it has passed.


class WhoStops:
    """Finds the cranes that stop.

    Args:
        site: The site.
        cranes: Its cranes now, by number.
        lifts: The lifts that have begun, by order.
        loads: The loads on the hooks.
        now_ns: The time on the site's clock.
    """

    def __init__(
        self, site: Site, cranes: Mapping[int, CraneNow], lifts: Mapping[int, Lift], loads: Loads, now_ns: int
    ) -> None:
        self._site, self._cranes, self._lifts, self._loads, self._now_ns = site, cranes, lifts, loads, now_ns

    def with_those(
        self, numbers: Iterable[int], stop: Callable[[list[CraneNow], Loads], _StoppedCranes]
    ) -> _StoppedCranes:
        """Return the cranes that stop because some must, stopped.

        Args:
            numbers: Those that must.
            stop: Stops cranes with their loads.
        """
        stopping = set(numbers)
        while True:
            cranes = [crane for number, crane in self._cranes.items() if number in stopping]
            stopped = stop(cranes, self._loads_of(stopping))
            left = [crane for number, crane in self._cranes.items() if number not in stopping]
            is_hook = any(self._is_under_way(crane) for crane in cranes)
            more = {crane.number for crane in left if is_hook or self._must_stop(crane, stopped)}
            if not more:
                return stopped
            stopping |= more

    def _loads_of(self, numbers: set[int]) -> Loads:
        def own(order: int) -> bool:
            return self._site.components[self._lifts[order].component].crane in numbers

        under_way = {order: motion for order, motion in self._loads.under_way.items() if own(order)}
        held = {order: one for order, one in self._loads.held.items() if own(order)}
        return self._loads._replace(under_way=under_way, held=held)

    def _is_under_way(self, crane: CraneNow) -> bool:
        """Return whether its empty hook moves."""
        return bool(crane.ways) and crane.ways[-1].end_ns > self._now_ns

    def _must_stop(self, crane: CraneNow, stopped: _StoppedCranes) -> bool:
        loads = [order for order, motion in crane.motions.items() if not is_set(motion, self._now_ns)]
        first = min((load.lift.order for load in stopped.loads), default=max(loads, default=0))
        if any(order > first for order in loads):
            return True
        site, outline = self._site, outline_of(self._site.cranes[crane.number])
        rests = self._rests(stopped)
        return any(
            first_conflict(
                (outline_of(site.cranes[number]), outline),
                rest,
                track,
                site.rules.crane_separation_m,
                from_ns=self._now_ns,
            )
            is not None
            for track in self._doing(crane)
            for number, rest in rests
        )

    def _rests(self, stopped: _StoppedCranes) -> list[tuple[int, CraneTrack]]:
        """Return the tracks of stopped loads until they rest, each with the number of its crane."""
        result = []
        for load in stopped.loads:
            order, number = load.lift.order, self._site.components[load.lift.component].crane
            held = self._loads.held.get(order)
            whole = self._loads.under_way[order] if held is None else held.motion
            result.append((number, self._track(self._lifts[order], cut_short(whole, load.stop), number)))
        return result

    def _doing(self, crane: CraneNow) -> Iterable[CraneTrack]:
        """Yield the tracks of what a crane does now: lifts whose slings are not off, and moves of its hook."""
        for order, motion in crane.motions.items():
            if motion.end_ns > self._now_ns:
                yield self._track(self._lifts[order], motion, crane.number)
        for way in crane.ways:
            if way.end_ns > self._now_ns:
                yield approach_track(self._site, self._site.cranes[crane.number], way.way, way.start_ns)

    def _track(self, lift: Lift, motion: LiftMotion, number: int) -> CraneTrack:
        return carrying_track(self._site, self._site.cranes[number], lift, motion)
