"""A lift that a change of the obstructions affects while it is under way.

The load is brought to rest (``bimvox.stop.manoeuvre``), held, and continues along a new path from where it is. A lift
whose load is still in the yard gets another path in time. If there is no path, the load is held until something
changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.errors import PlanningError
from bimvox.motion.drive import drive_path
from bimvox.motion.empty_hook import HOOK_OFFSET, empty_hook_clearance
from bimvox.motion.load_frame import cells_of_axes, load_frame
from bimvox.motion.swing import pendulum_of
from bimvox.motion.time_plan import carrying_phases, left_cells
from bimvox.motion.timing import NS_PER_S, sampled
from bimvox.planning.assembly import Obstacle, Stage
from bimvox.planning.search import shortest_path
from bimvox.records.lift import LeftPath, Lift, Method, Status
from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.records.trajectory import Trajectory
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.stop.emergency_stop import EmergencyStop
from bimvox.stop.interrupt import interrupted, spliced
from bimvox.stop.manoeuvre import manoeuvre, way_is_free
from bimvox.stop.resume import resume, resume_cells

HOLD_S = 10.0
"""Shortest hold of a stopped load before it continues: a nominal value for a check."""
_NO_WAY = "no way leads on from where it is"
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
            reason=f"it is held {where} ({self.how}): {self.reason}",
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


def redirect(
    site: Site,
    crane: TowerCrane,
    under_way: UnderWay,
    rule: Stage,
    blocked: Obstacle | None,
    time_ns: int,
    hold_s: float = HOLD_S,
) -> Redirected | Held:
    """Return a lift under way on a new path, or held.

    Args:
        site: The site now.
        crane: Its crane.
        under_way: The lift.
        rule: What holds for the rest of it now.
        blocked: What is in the way at its end; its last moves are those that it had then.
        time_ns: When the change was noticed, on the site's clock.
        hold_s: Shortest hold.
    """
    lift, motion = under_way.lift, under_way.motion
    if not is_carried(motion, time_ns):
        approached = _approached(site, crane, under_way, rule, time_ns, hold_s)
        if isinstance(approached, str):
            return Held(lift, motion, None, approached, True, _NO_WAY)
        motion = approached
        held = Held(lift, motion, None, NOT_CARRIED, True, *_why(blocked))
        return release(site, crane, held, rule, blocked, time_ns, hold_s)
    loaded = crane_for(site, crane, rule.component)
    load = load_frame(loaded, site.frame, rule.component.hook_offset_vox)
    # Where the end is blocked the last moves are cleared for nothing any more.
    now = rule.clearance_with_insertion if blocked is None else rule.space
    hanging = pendulum_of(site, crane, rule.component)
    found = manoeuvre(site, loaded, motion, motion.loaded, time_ns, now, load, hanging)
    held = Held(lift, motion, found.stop, found.kind, found.is_free, *_why(blocked))
    return release(site, crane, held, rule, blocked, time_ns, hold_s)


def release(
    site: Site,
    crane: TowerCrane,
    held: Held,
    rule: Stage,
    blocked: Obstacle | None,
    time_ns: int,
    hold_s: float = HOLD_S,
) -> Redirected | Held:
    """Return a held lift on a new path, or still held.

    Args:
        site: The site now.
        crane: Its crane.
        held: The lift.
        rule: What holds for the rest of it now.
        blocked: What is in the way at its end.
        time_ns: When the change was noticed, on the site's clock.
        hold_s: Shortest hold.
    """
    held = replace(held, reason=_why(blocked)[0], blocked_by=_why(blocked)[1])
    if not held.is_safe:
        met = "its load met something while it was stopped, or as far out as it swings"
        return replace(held, reason=f"{met}: look at it before it is moved")
    if blocked is not None:
        return held
    if held.stop is None:
        return _other_way(site, crane, held, rule, time_ns, time_ns + round(hold_s * NS_PER_S))
    path_vox = _path_from(site, crane, rule, held.stop.pose)
    if path_vox is None:
        return held
    loaded = crane_for(site, crane, rule.component)
    load = load_frame(loaded, site.frame, rule.component.hook_offset_vox)
    hanging = pendulum_of(site, crane, rule.component)
    moves, resume_ns = rule.insertion.moves, max(held.stop.end_ns, time_ns) + round(hold_s * NS_PER_S)
    try:
        onward, needed_m = resume(loaded, rule.clearance_with_insertion, load, held.stop.pose, path_vox, moves, hanging)
    except PlanningError as error:
        return replace(held, reason=error.message)
    period_s, size_m = site.rules.sample_period_s, site.frame.voxel_size_m
    motion = interrupted(
        held.motion,
        held.stop,
        resume_ns,
        onward,
        needed_m,
        pendulum=hanging,
        sample_period_s=period_s,
        voxel_size_m=size_m,
    )
    return Redirected(_on_path(held, path_vox, moves, time_ns), motion, held.stop, held.how)


def _why(blocked: Obstacle | None) -> tuple[str, tuple[str, ...]]:
    return (_NO_WAY, ()) if blocked is None else (blocked.reason, blocked.blocked_by)


def _approached(
    site: Site,
    crane: TowerCrane,
    under_way: UnderWay,
    rule: Stage,
    time_ns: int,
    hold_s: float,
) -> LiftMotion | str:
    """Return the motion with a free approach: the empty hook stops and goes round what is in its way.

    The motion itself if the rest of its approach is free; a reason if no way was found.
    """
    motion, before = under_way.motion, under_way.before
    approach = motion.approach
    if approach is None or before is None or time_ns >= motion.start_ns + int(approach.time_ns[-1]):
        return motion
    crane = crane_for(site, crane, None)
    hook, empty = load_frame(crane, site.frame, HOOK_OFFSET), pendulum_of(site, crane, None)
    free = empty_hook_clearance(site, crane, rule.space, rule.place, left_cells(site, before))
    if way_is_free(motion, approach, time_ns, motion.end_ns, free, hook):
        return motion
    found = manoeuvre(site, crane, motion, approach, time_ns, free, hook, empty)
    if not found.is_free:
        return f"its empty hook {found.kind}"
    raising = motion.raising
    end = cells_of_axes(hook, np.array([[raising.slew_rad[0], raising.radius_m[0], raising.height_m[0]]]))[0]
    goal = tuple(int(n) for n in np.round(end))
    for cell in resume_cells(free, hook, found.stop.pose):
        path_vox = shortest_path(free, cell, (goal[0], goal[1], goal[2])).path_vox
        if path_vox is None or len(path_vox) < 2:
            continue
        try:
            onward, needed_m = resume(crane, free, hook, found.stop.pose, path_vox, 0, empty)
        except PlanningError:
            continue
        later = sampled(onward, needed_m, site.rules.sample_period_s, site.frame.voxel_size_m, empty)
        again_ns = max(found.stop.end_ns, time_ns + round(hold_s * NS_PER_S))
        told_ns = found.stop.start_ns - motion.start_ns
        other = spliced(approach, found.stop, later, told_ns, again_ns - motion.start_ns)
        return _with_approach(motion, other, found.stop.start_ns, again_ns)
    return "its empty hook was stopped, and finds no way to it"


def _with_approach(motion: LiftMotion, approach: Trajectory, stopped_ns: int, again_ns: int) -> LiftMotion:
    """Return the motion with a longer approach; everything after it is later, with the turns of the new approach."""
    assert motion.approach is not None
    by_ns = int(approach.time_ns[-1] - motion.approach.time_ns[-1])
    turns = round(float(approach.slew_rad[-1] - motion.raising.slew_rad[0]) / (2.0 * np.pi))

    def later(part: Trajectory) -> Trajectory:
        turned = part.slew_rad + 2.0 * np.pi * turns if turns else part.slew_rad
        return replace(part, time_ns=part.time_ns + np.int64(by_ns), slew_rad=turned)

    arrived_ns = motion.start_ns + int(approach.time_ns[-1])
    begun = [phase for phase in motion.phases if phase.name in (PhaseName.APPROACH, PhaseName.STOP)]
    phases = [replace(phase, end_ns=min(phase.end_ns, stopped_ns)) for phase in begun if phase.start_ns < stopped_ns]
    phases.append(Phase(PhaseName.STOP, stopped_ns, again_ns))
    phases.append(Phase(PhaseName.APPROACH, again_ns, arrived_ns))
    phases += [
        Phase(phase.name, phase.start_ns + by_ns, phase.end_ns + by_ns) for phase in motion.phases if phase not in begun
    ]
    return replace(
        motion,
        approach=approach,
        raising=later(motion.raising),
        loaded=later(motion.loaded),
        phases=tuple(phases),
        end_ns=motion.end_ns + by_ns,
    )


def _path_from(site: Site, crane: TowerCrane, stage: Stage, pose: CranePose) -> NDArray[np.int32] | None:
    """Return a shortest path from next to a pose to the part's place; None if there is none."""
    load = load_frame(crane_for(site, crane, stage.component), site.frame, stage.component.hook_offset_vox)
    for cell in resume_cells(stage.space, load, pose):
        transit = shortest_path(stage.space, cell, stage.insertion.gate_vox).path_vox
        if transit is None:
            continue
        path_vox = np.concatenate([transit, stage.insertion.path_vox[1:]]).astype(np.int32)
        if len(path_vox) >= 2:
            return path_vox
    return None


def _other_way(
    site: Site, crane: TowerCrane, held: Held, stage: Stage, time_ns: int, ready_ns: int
) -> Redirected | Held:
    """Return a lift whose load is not carried yet on another path, after the same approach and raising."""
    motion = held.motion
    transit = shortest_path(stage.space, stage.start_vox, stage.insertion.gate_vox).path_vox
    if transit is None:
        return held
    path_vox = np.concatenate([transit, stage.insertion.path_vox[1:]]).astype(np.int32)
    loaded_crane = crane_for(site, crane, stage.component)
    load = load_frame(loaded_crane, site.frame, stage.component.hook_offset_vox)
    slew_rad = float(motion.raising.slew_rad[-1])
    rule, moves = stage.clearance_with_insertion, stage.insertion.moves
    hanging = pendulum_of(site, crane, stage.component)
    try:
        timeline, needed_m = drive_path(loaded_crane, rule, load, path_vox, moves, slew_rad, hanging)
    except PlanningError as error:
        return replace(held, reason=f"the crane cannot drive its path: {error.message}")
    trajectory = sampled(timeline, needed_m, site.rules.sample_period_s, site.frame.voxel_size_m, hanging)
    raised_ns, length_ns = motion.start_ns + int(motion.loaded.time_ns[0]), int(trajectory.time_ns[-1])
    again_ns = max(raised_ns, ready_ns)
    loaded = replace(trajectory, time_ns=trajectory.time_ns + np.int64(again_ns - motion.start_ns))
    phases = [phase for phase in motion.phases if phase.end_ns <= raised_ns]
    spans = [
        (PhaseName.STOP, again_ns - raised_ns),
        *carrying_phases(timeline, length_ns),
        *((phase.name, phase.end_ns - phase.start_ns) for phase in motion.phases if phase.name in _AFTER_THE_LOAD),
    ]
    at_ns = raised_ns
    for name, span_ns in spans:
        if span_ns > 0:
            phases.append(Phase(name, at_ns, at_ns + span_ns))
            at_ns += span_ns
    other = replace(motion, loaded=loaded, phases=tuple(phases), end_ns=at_ns)
    return Redirected(_on_path(held, path_vox, moves, time_ns), other, None, held.how)


def _on_path(held: Held, path_vox: NDArray[np.int32], contact_moves: int, found_ns: int) -> Lift:
    lift = held.lift
    assert lift.path_vox is not None
    path_vox.flags.writeable = False
    return replace(
        lift,
        path_vox=path_vox,
        contact_moves=contact_moves,
        method=Method.SEARCH,
        shortest_moves=len(path_vox) - 1,
        left=(*lift.left, LeftPath(lift.path_vox, lift.contact_moves, found_ns)),
    )
