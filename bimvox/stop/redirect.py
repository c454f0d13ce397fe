"""A lift that a change of the obstructions affects while it is under way.

The load is brought to rest (``bimvox.stop.choose_stop``), held, and continues along a new path from where it is. A lift
whose load is still in the yard gets another path in time. If there is no path, the load is held until something
changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.errors import PlanningError
from bimvox.motion.swept import cells_of_axes, in_cell
from bimvox.motion.swing import RiggedCrane, rigged_crane, with_wind
from bimvox.motion.time_lift import carrying_phases, drive_lift, empty_hook_clearance, left_cells
from bimvox.motion.timeline import after_a_pause, sampled
from bimvox.motion.trajectories import cut_at, delayed, delayed_phases, phases_from, turned
from bimvox.planning.search import shortest_path
from bimvox.planning.stage import Obstacle, Stage, turning_stage
from bimvox.records.lift import LOAD_IS_HELD, NOT_DRIVEN, LeftPath, Lift, Method, Status
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.records.track import turn_back_s
from bimvox.site.collision import IN_THE_YARD, CollisionSpace, any_heading_space, turning_space
from bimvox.site.component import IntVec
from bimvox.site.site import Site
from bimvox.stop.brake_axes import EmergencyStop
from bimvox.stop.choose_stop import manoeuvre, motion_is_free
from bimvox.stop.resume import interrupted, resume, resume_cells, spliced
from bimvox.units import NS_PER_S

HOLD_S = 10.0
"""Shortest hold of a stopped load before it continues: a nominal value for a check."""
_NO_PATH = "no free path leads from where it is to its place"
_NO_ROOM_TO_TURN = "it has no tag lines, and no room to turn with the jib"
NOT_CARRIED = "its load was not carried yet"
_AFTER_THE_LOAD = (PhaseName.SET, PhaseName.RELEASE)


@dataclass(frozen=True, slots=True, eq=False)
class UnderWay:
    """A lift under way.

    Attributes:
        lift: The lift.
        motion: Its motion.
        before: The planned lift before it; None for the first.
    """

    lift: Lift
    motion: LiftMotion
    before: Lift | None


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """A lift that is stopped and has no path to its place.

    Attributes:
        lift: The lift as it was when it was stopped.
        motion: Its motion as it was when it was stopped.
        stop: The stop of its load; None if it was not carried yet: the crane waits over its place in the yard.
        how: Description of the manoeuvre.
        is_safe: Whether the load hit nothing while it was stopped, including its swing.
        reason: Why it has no path.
        blocked_by: Ids of what is in its way.
    """

    lift: Lift
    motion: LiftMotion
    stop: EmergencyStop | None
    how: str
    is_safe: bool
    reason: str
    blocked_by: tuple[str, ...] = ()

    @property
    def infeasible(self) -> Lift:
        """The lift as the plan holds it meanwhile: infeasible."""
        where = "over its place in the yard" if self.stop is None else "on the hook"
        return replace(
            self.lift,
            status=Status.INFEASIBLE,
            method=None,
            path_vox=None,
            shortest_moves=None,
            contact_moves=0,
            guide=None,
            with_jib=self.lift.ever_with_jib,
            reason=f"{LOAD_IS_HELD}{where} ({self.how}): {self.reason}",
            blocked_by=self.blocked_by,
            left=(),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Redirected:
    """A lift on a new path.

    Attributes:
        lift: The lift with the new path; the old one is among those that it left.
        motion: The part before, stop, hold and the part after as one motion.
        stop: The stop; None if its load was not carried yet.
        how: Description of the manoeuvre.
    """

    lift: Lift
    motion: LiftMotion
    stop: EmergencyStop | None
    how: str


def is_carried(motion: LiftMotion, time_ns: int) -> bool:
    """Return whether the load is being carried at a time on the site's clock."""
    start_ns, end_ns = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    return start_ns < time_ns < end_ns


def is_set(motion: LiftMotion, time_ns: int) -> bool:
    """Return whether the load is at its place at a time on the site's clock."""
    return time_ns >= motion.start_ns + int(motion.loaded.time_ns[-1])


def redirected_if_possible(
    ways: Iterable[tuple[Stage, Obstacle | None]],
    attempt: Callable[[Stage, Obstacle | None], Redirected | Held],
    refused: str | None,
) -> Redirected | Held:
    """Return the first attempt that gives a load a new path; the last one if none does.

    Args:
        ways: Stages of the rest of the lift, the largest clearance first, and what blocks each; at least one.
        attempt: Redirects the load at a stage, or holds it.
        refused: Why it must be held; None if it need not be.
    """
    result: Redirected | Held | None = None
    for rule, blocked in ways:
        result = attempt(rule, blocked if refused is None else Obstacle(refused))
        if isinstance(result, Redirected) or refused is not None or not result.is_safe:
            break
    assert result is not None
    return result


def redirect(
    site: Site,
    crane: TowerCrane,
    under_way: UnderWay,
    rule: Stage,
    blocked: Obstacle | None,
    time_ns: int,
    hold_s: float,
) -> Redirected | Held:
    """Return a lift under way on a new path, or held.

    Args:
        site: The site now.
        crane: Its crane.
        under_way: The lift.
        rule: The stage of the rest of it now.
        blocked: What is in the way at its end; its last moves are those that it had then.
        time_ns: When the change was noticed, on the site's clock.
        hold_s: Shortest hold.
    """
    lift, motion = under_way.lift, under_way.motion
    if not is_carried(motion, time_ns):
        approached = _approached(site, crane, under_way, rule, time_ns, hold_s)
        if isinstance(approached, str):
            return Held(lift, motion, None, approached, True, _NO_PATH)
        held = Held(lift, approached, None, NOT_CARRIED, True, "")
        return redirect_held(site, crane, held, rule, blocked, time_ns, hold_s)
    # If the end is blocked, the last moves are not cleared any more.
    now = rule.free_with_insertion if blocked is None else rule.free
    if lift.with_jib:
        if motion.turned_ns is not None and motion.turned_ns[0] <= time_ns < motion.turned_ns[1]:
            time_ns = motion.turned_ns[1]  # the hook is still: the crew finishes the turn
        if _is_off_heading(lift, motion, time_ns):
            now = _free_at_any_heading(site, rule)
    found = manoeuvre(rigged_crane(site, crane, rule.component), motion, motion.loaded, time_ns, now)
    held = Held(lift, motion, found.stop, found.kind, found.is_free, "")
    return redirect_held(site, crane, held, rule, blocked, time_ns, hold_s)


def redirect_held(
    site: Site, crane: TowerCrane, held: Held, rule: Stage, blocked: Obstacle | None, time_ns: int, hold_s: float
) -> Redirected | Held:
    """Return a held lift on a new path, or still held; arguments as for :func:`redirect`."""
    reason, blocked_by = (_NO_PATH, ()) if blocked is None else (blocked.reason, blocked.blocked_by)
    held = replace(held, reason=reason, blocked_by=blocked_by)
    if not held.is_safe:
        met = "its load met something while it was stopped, or as far out as it swings"
        return replace(held, reason=f"{met}: look at it before it is moved")
    if blocked is not None:
        return held
    if held.stop is None:
        return _redirected_in_yard(site, crane, held, rule, time_ns, time_ns + round(hold_s * NS_PER_S))
    rigged = rigged_crane(site, crane, rule.component)
    path_vox = _path_from(rigged, rule, held.stop.pose)
    if path_vox is None:
        return held
    last, resume_ns = rule.insertion, max(held.stop.end_ns, time_ns) + round(hold_s * NS_PER_S)
    try:
        onward, needed_m = resume(
            rigged, rule.clearance_with_insertion, held.stop.pose, path_vox, last.moves, last.guide
        )
    except PlanningError as error:
        return replace(held, reason=error.message)
    if _is_off_heading(held.lift, held.motion, held.stop.start_ns):
        off_rad = held.stop.pose.slew_rad - float(held.motion.loaded.slew_rad[0])
        onward = after_a_pause(onward, turn_back_s(off_rad, site.rules.turn_s))
    motion = interrupted(held.motion, held.stop, resume_ns, onward, needed_m, rigged)
    lift = _on_path(held, path_vox, rule, time_ns)
    return Redirected(lift, with_wind(site, lift, motion), held.stop, held.how)


def _is_off_heading(lift: Lift, motion: LiftMotion, time_ns: int) -> bool:
    """Return whether a load in the air has turned with the jib and not back yet."""
    return lift.with_jib and (motion.turned_ns is None or time_ns < motion.turned_ns[1])


def _free_at_any_heading(site: Site, rule: Stage) -> CollisionSpace:
    """Return the rule for a load that must be stopped while it turns with the jib: no clearances."""
    component = rule.component
    column = turning_space(site, component, rule.free, rule.start_vox, 0)
    return any_heading_space(site, component, rule.free, 0) if column is None else column


def _approached(
    site: Site, crane: TowerCrane, under_way: UnderWay, rule: Stage, time_ns: int, hold_s: float
) -> LiftMotion | str:
    """Return the motion with a free approach: the empty hook stops and moves around what is in its way.

    The motion itself if the rest of its approach is free; a reason if no path was found.
    """
    motion, before = under_way.motion, under_way.before
    approach = motion.approach
    if approach is None or before is None or time_ns >= motion.start_ns + int(approach.time_ns[-1]):
        return motion
    empty = rigged_crane(site, crane, None)
    hook = empty.load
    free = empty_hook_clearance(site, empty.crane, rule.space, rule.place, left_cells(site, before))
    if motion_is_free(motion, approach, time_ns, motion.end_ns, free, hook):
        return motion
    found = manoeuvre(empty, motion, approach, time_ns, free)
    if not found.is_free:
        return f"its empty hook {found.kind}"
    at_vox = cells_of_axes(hook, motion.raising.axes[0])
    for cell in resume_cells(free, hook, found.stop.pose):
        path_vox = shortest_path(free, cell, in_cell(at_vox)).path_vox
        if path_vox is None or len(path_vox) < 2:
            continue
        try:
            onward, needed_m = resume(empty, free, found.stop.pose, path_vox, 0, end_vox=at_vox)
        except PlanningError:
            continue
        later = sampled(onward, needed_m, empty)
        again_ns = max(found.stop.end_ns, time_ns + round(hold_s * NS_PER_S))
        told_ns = found.stop.start_ns - motion.start_ns
        other = spliced(approach, found.stop, later, told_ns, again_ns - motion.start_ns)
        return _with_approach(motion, other, found.stop.start_ns, again_ns)
    return "its empty hook was stopped, and has no free path to it"


def _with_approach(motion: LiftMotion, approach: Trajectory, stopped_ns: int, again_ns: int) -> LiftMotion:
    """Return the motion with a longer approach; everything after it is later, with the turns of the new approach."""
    assert motion.approach is not None
    by_ns = int(approach.time_ns[-1] - motion.approach.time_ns[-1])
    turns = round(float(approach.slew_rad[-1] - motion.raising.slew_rad[0]) / (2.0 * np.pi))

    arrived_ns = motion.start_ns + int(approach.time_ns[-1])
    begun = [phase for phase in motion.phases if phase.name in (PhaseName.APPROACH, PhaseName.STOP)]
    raising, loaded = (turned(delayed(part, by_ns), turns) for part in (motion.raising, motion.loaded))
    return replace(
        motion,
        approach=approach,
        raising=raising,
        loaded=loaded,
        phases=(
            *cut_at(begun, stopped_ns),
            Phase(PhaseName.STOP, stopped_ns, again_ns),
            Phase(PhaseName.APPROACH, again_ns, arrived_ns),
            *delayed_phases((phase for phase in motion.phases if phase not in begun), by_ns),
        ),
        end_ns=motion.end_ns + by_ns,
    )


def _path_from(rigged: RiggedCrane, stage: Stage, pose: CranePose) -> NDArray[np.int32] | None:
    """Return a shortest path from next to a pose to the part's place; None if there is none."""
    for cell in resume_cells(stage.space, rigged.load, pose):
        path_vox = _path_to_place(stage, cell)
        if path_vox is not None and len(path_vox) >= 2:
            return path_vox
    return None


def _path_to_place(stage: Stage, start_vox: IntVec) -> NDArray[np.int32] | None:
    transit = shortest_path(stage.transit.space, start_vox, stage.insertion.gate_vox).path_vox
    return None if transit is None else np.concatenate([transit, stage.insertion.path_vox[1:]]).astype(np.int32)


def _redirected_in_yard(
    site: Site, crane: TowerCrane, held: Held, stage: Stage, time_ns: int, ready_ns: int
) -> Redirected | Held:
    """Return a lift whose load is not carried yet on another path, after the same approach and raising."""
    if held.lift.ever_with_jib:  # no tag lines were fixed
        turning = turning_stage(site, stage)
        if turning is None:
            return replace(held, reason=_NO_ROOM_TO_TURN)
        stage = turning
    motion, path_vox = held.motion, _path_to_place(stage, stage.start_vox)
    if path_vox is None:
        return held
    rigged = rigged_crane(site, crane, stage.component)
    lift, slew_rad = _on_path(held, path_vox, stage, time_ns), float(motion.raising.slew_rad[-1])
    try:
        timeline, needed_m = drive_lift(site, rigged, stage.clearance_with_insertion, lift, slew_rad)
    except PlanningError as error:
        return replace(held, reason=f"{NOT_DRIVEN}{error.message}")
    trajectory = sampled(timeline, needed_m, rigged)
    raised_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    again_ns = max(raised_ns, ready_ns)
    spans = [
        (PhaseName.STOP, again_ns - raised_ns),
        *carrying_phases(timeline, int(trajectory.time_ns[-1])),
        *((phase.name, phase.end_ns - phase.start_ns) for phase in motion.phases if phase.name in _AFTER_THE_LOAD),
    ]
    begun = (phase for phase in motion.phases if phase.end_ns <= raised_ns)
    all_phases = (*begun, *phases_from(raised_ns, spans))
    loaded = delayed(trajectory, again_ns - motion.start_ns)
    other = replace(motion, loaded=loaded, phases=all_phases, end_ns=all_phases[-1].end_ns)
    return Redirected(lift, with_wind(site, lift, other), None, held.how)


def _on_path(held: Held, path_vox: NDArray[np.int32], stage: Stage, found_ns: int) -> Lift:
    lift = held.lift
    assert lift.path_vox is not None
    path_vox.flags.writeable = False
    yard = {rule: getattr(lift.kept, rule) for rule in IN_THE_YARD}  # it has left it
    return replace(
        lift,
        path_vox=path_vox,
        contact_moves=stage.insertion.moves,
        guide=stage.insertion.guide,
        method=Method.SEARCH,
        planner=None,
        shortest_moves=len(path_vox) - 1,
        with_jib=stage.is_turning,
        left=(*lift.left, LeftPath(lift.path_vox, lift.contact_moves, found_ns, lift.guide, lift.with_jib)),
    ).keeping(stage.kept._replace(**yard))
