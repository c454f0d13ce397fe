"""Stop cranes of a site with their loads and empty hooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import NO_CELLS
from bimvox.motion.swing import rigged_crane
from bimvox.motion.time_lift import empty_hook_clearance, left_cells
from bimvox.motion.trajectories import stopped
from bimvox.planning.assembly import Assembly
from bimvox.planning.rounds import Refused
from bimvox.planning.stage import Obstacle, Stage
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.revision.cranes_now import CraneNow, alone, load_is_met
from bimvox.revision.held_cranes import HookWay
from bimvox.revision.request import RevisionRequest
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
    redirect,
    redirect_held,
    redirected_if_possible,
)


class StoppedCranes(NamedTuple):
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
) -> StoppedCranes:
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
        return StoppedCranes(tuple(cranes), tuple(found))
    lifts = {lift.order: lift for lift in begun}
    hooks = []
    for crane in cranes:
        site, machine = request.site, request.site.cranes[crane.number]
        leaves = len(crane.ways) == 1 and len(crane.motions) > 0
        left_vox = left_cells(site, lifts[max(crane.motions)]) if leaves else NO_CELLS
        free = empty_hook_clearance(site, machine, rule[1], rule[0].place, left_vox)
        hooks.append(_hook(site, crane, free, request.now_ns))
    return StoppedCranes(tuple(hooks), tuple(found))


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

    Args:
        site: The site.
        crane: The crane.
        free: The collision rule for its empty hook now.
        now_ns: When the stop is ordered, on the site's clock.
    """
    if not crane.ways or crane.ways[-1].end_ns <= now_ns or crane.ways[-1].stopped_ns is not None:
        return crane
    way = crane.ways[-1]
    empty = rigged_crane(site, site.cranes[crane.number], None)
    found = manoeuvre(empty, alone(way, crane.number), way.way, now_ns, free)
    stop = found.stop
    if stop.start_ns >= way.end_ns:
        return crane
    trajectory = stopped(way.way, stop.trajectory, stop.start_ns - way.start_ns)
    return replace(crane, ways=(*crane.ways[:-1], HookWay(way.start_ns, trajectory, stop.start_ns, found.is_free)))
