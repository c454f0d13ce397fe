"""One lift: by policy first, then by complete search, otherwise infeasible with a reason.

A path that a policy proposes is used only if every move passes the collision rule; otherwise search gives a shortest
path. If search finds nothing, the set of reachable placements is the proof, and what encloses it is reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.env.actions import MOVES
from bimvox.grid.bricks import distinct
from bimvox.planning.assembly import Assembly
from bimvox.planning.external import External, NotUsedError
from bimvox.planning.flip import flip_of
from bimvox.planning.search import all_free, reachable, shortest_path, which_free
from bimvox.planning.stage import Obstacle, Propose, ProposedGreedily, Stage, turning_stage
from bimvox.planning.tandem import with_shares
from bimvox.records.lift import Lift, Method, Status, YardPlace
from bimvox.site.collision import CollisionSpace, smaller_clearances
from bimvox.site.component import IntVec
from bimvox.site.default_rules import Kept
from bimvox.site.site import Site

_FIRST_LIMIT = 4_096
_FLOOD_LIMIT = 300_000
_BORDER_LIMIT = 20_000
_BORDER_CELLS = 1_000_000
"""Most placements, and cells of the part there, that are asked for what encloses a room."""


def unplanned_lift(site: Site, component: int, order: int, place: YardPlace | None) -> Lift:
    """Return a lift without a path; by the rules of the site its part is set by other means, or not at all."""
    return Lift(component, order, place, Status.INFEASIBLE, by_other_means=site.rules.by_other_means)


def plan_lift(
    assembly: Assembly, stage: Stage | Obstacle, unplanned: Lift, before: Lift | None, propose: Propose | None
) -> Lift:
    """Return one lift, planned; ``stage`` is the result of ``assembly.begin``, ``before`` is kept if still valid."""
    return planned_by(assembly, stage, unplanned, before, policies_of(propose))


def planned_by(
    assembly: Assembly,
    stage: Stage | Obstacle,
    unplanned: Lift,
    before: Lift | None,
    policies: Sequence[tuple[Propose, Method]],
) -> Lift:
    """Return what ``plan_lift`` does, with several policies, asked in this order."""
    stage, lift = _turning_or_not(assembly, stage, unplanned, before)
    if lift is before or lift.path_vox is None or isinstance(stage, Obstacle):
        return lift
    return with_shares(assembly.site, _proposed(stage, lift, policies))


def proposed_again(stage: Stage, lift: Lift, retrained: Propose) -> Lift:
    """Return a planned lift with the path of a retrained policy; the lift itself if that is invalid or longer."""
    result = _proposed(stage, lift, [(retrained, Method.RETRAINED)])
    if result.path_vox is None or lift.path_vox is None or len(result.path_vox) > len(lift.path_vox):
        return lift
    return result


def policies_of(propose: Propose | None, retrained: Propose | None = None) -> list[tuple[Propose, Method]]:
    """Return the policies to ask, in this order, each with the method that its paths are recorded under."""
    if isinstance(propose, External):
        return [(propose, propose.method), *policies_of(propose.instead, retrained)]
    first = Method.GREEDY if isinstance(propose, ProposedGreedily) else Method.POLICY
    both = ((propose, first), (retrained, Method.RETRAINED))
    return [(ask, method) for ask, method in both if ask is not None]


def _turning_or_not(
    assembly: Assembly, stage: Stage | Obstacle, unplanned: Lift, before: Lift | None
) -> tuple[Stage | Obstacle, Lift]:
    """Return what ``_searched`` does, with a load that turns with the jib if the rules say so and there is room."""
    turns = assembly.turns_with_jib(unplanned.component)
    turning = turning_stage(assembly.site, stage) if turns and isinstance(stage, Stage) else None
    if turning is not None:
        lift = searched_at(assembly, turning, unplanned, before)
        if lift.path_vox is not None:
            return turning, lift
    return _searched(assembly, stage, unplanned, before)


def _searched(
    assembly: Assembly, stage: Stage | Obstacle, unplanned: Lift, before: Lift | None
) -> tuple[Stage | Obstacle, Lift]:
    """Return a lift with a shortest path, the earlier lift if that is still valid, or an infeasible one; and its stage.

    If the rules' clearances give way and leave no path, the lift keeps the largest of the load's that leaves one, and
    with it the largest of the rope's.
    """
    lift = searched_at(assembly, stage, unplanned, before)
    rows = smaller_clearances(assembly.site)
    if lift.path_vox is not None or not rows or (isinstance(stage, Obstacle) and not stage.on_the_way):
        return stage, lift

    def keeping(kept: Kept) -> tuple[Stage | Obstacle, Lift]:
        other = assembly.begin(unplanned.component, kept)
        return other, searched_at(assembly, other, unplanned, before)

    least = rows[-1][-1]
    result = keeping(least)
    if result[1].path_vox is None:  # the clearances are not the reason
        return result
    for *more, fewest in rows:
        way = result if fewest == least else keeping(fewest)
        if way[1].path_vox is not None:
            tighter = (keeping(kept) for kept in more)
            return next((one for one in tighter if one[1].path_vox is not None), way)
    return result


def searched_at(assembly: Assembly, stage: Stage | Obstacle, unplanned: Lift, before: Lift | None) -> Lift:
    """Return a lift with a shortest path, the earlier lift if that is still valid, or an infeasible one."""
    if isinstance(stage, Obstacle):
        otherwise = unplanned.by_other_means and not stage.is_unsupported
        return replace(unplanned, reason=stage.reason, blocked_by=stage.blocked_by, by_other_means=otherwise)
    same = before is not None and before.kept == stage.kept and before.with_jib == stage.is_turning
    kept = same and before is not None and _is_still_valid(before, stage)
    if kept and before is not None and before.shortest_moves == _distance(stage) + stage.insertion.moves:
        return before  # no path can be shorter
    transit = stage.transit
    shortest = shortest_path(transit.space, transit.start_vox, transit.goal_vox).path_vox
    if kept and before is not None:
        fewest = None if shortest is None else len(shortest) - 1 + stage.insertion.moves
        return before if before.shortest_moves == fewest else replace(before, shortest_moves=fewest)
    if shortest is None and stage.is_turning:
        return unplanned
    if shortest is None:
        found = _why_unreachable(assembly, stage)
        return replace(unplanned, reason=found.reason, blocked_by=found.blocked_by)
    planned = replace(
        unplanned,
        status=Status.PLANNED,
        by_other_means=False,
        method=Method.SEARCH,
        path_vox=_whole_path(shortest, stage),
        shortest_moves=len(shortest) - 1 + stage.insertion.moves,
        contact_moves=stage.insertion.moves,
        guide=stage.insertion.guide,
        with_jib=stage.is_turning,
        flip=flip_of(assembly.site, stage.component, stage.place),
    )
    return with_shares(assembly.site, planned).keeping(stage.kept)


def _proposed(stage: Stage, lift: Lift, policies: Sequence[tuple[Propose, Method]]) -> Lift:
    """Return a lift with the path of the first policy whose path is valid; if none is, with the searched path.

    Greedy values are nobody's choice but the default: where their path is longer than the searched one, that is used.
    """
    for ask, method in policies:
        try:
            transit_vox = ask(stage.transit)
        except NotUsedError as error:
            lift = with_planner_note(lift, f"{ask.name}: {error}" if isinstance(ask, External) else str(error))
            continue
        if transit_vox is not None and _is_valid_transit(stage, transit_vox):
            path_vox = _whole_path(transit_vox, stage)
            if method is not Method.GREEDY or lift.path_vox is None or len(path_vox) <= len(lift.path_vox):
                planner = ask.name if isinstance(ask, External) else None
                return replace(lift, method=method, path_vox=path_vox, planner=planner)
    return lift


def with_planner_note(lift: Lift, note: str) -> Lift:
    """Return a lift with one more note on why a planner that the caller brought did not find its path."""
    return replace(lift, planner_note=f"{lift.planner_note}; {note}" if lift.planner_note else note)


def _whole_path(transit_vox: NDArray[np.int32], stage: Stage) -> NDArray[np.int32]:
    """Return a transit followed by the last moves, read-only."""
    path: NDArray[np.int32] = np.concatenate([transit_vox, stage.insertion.path_vox[1:]]).astype(np.int32)
    path.flags.writeable = False
    return path


def _is_valid_transit(stage: Stage, path_vox: NDArray[np.int32]) -> bool:
    """Return whether a path goes from the transit start to the gate by unit moves over free placements."""
    steps = np.abs(np.diff(path_vox.astype(np.int64), axis=0)).sum(axis=1)
    return bool(
        len(path_vox)
        and tuple(path_vox[0]) == stage.start_vox
        and tuple(path_vox[-1]) == stage.insertion.gate_vox
        and (steps == 1).all()
        and all_free(stage.transit.space, path_vox)
    )


def _is_still_valid(before: Lift, stage: Stage) -> bool:
    """Return whether an earlier path ends in the same last moves and its transit is still free."""
    path_vox, last = before.path_vox, stage.insertion.path_vox
    if path_vox is None or before.guide != stage.insertion.guide:
        return False
    transit = path_vox[: len(path_vox) - len(last) + 1]
    return np.array_equal(path_vox[-len(last) :], last) and _is_valid_transit(stage, transit)


def _distance(stage: Stage) -> int:
    """Return the fewest moves of a transit with nothing in the way."""
    return sum(abs(a - b) for a, b in zip(stage.start_vox, stage.insertion.gate_vox, strict=True))


def _why_unreachable(assembly: Assembly, stage: Stage) -> Obstacle:
    """Return what encloses the start or the place, whichever is the smaller room."""
    from_start, from_gate = _smaller_room(stage.space, stage.start_vox, stage.insertion.gate_vox)
    where, room = (
        ("its place in the yard", from_start) if len(from_start) <= len(from_gate) else ("its place", from_gate)
    )
    # The last moves may begin in an enclosed room that is too narrow for the clearance.
    border = _around(room if len(room) else np.array([stage.insertion.gate_vox], np.int32))
    border = border[: min(_BORDER_LIMIT, max(1, _BORDER_CELLS // len(stage.component.shape.cells)))]
    blocked = border[~which_free(stage.space, border)]
    cells = (blocked[:, None, :] + stage.component.shape.cells[None, :, :]).reshape(-1, 3)
    who = tuple(name for name in assembly.who_is_at(cells) if name != "ground")
    by = f"checked with cells of {assembly.voxel_size_m:g} m"
    if stage.insertion.enclosed:
        by += " and the true shapes around its place"
    by += _clearance_in_the_way(assembly.site, stage)
    return Obstacle(f"no path leads out of the free space around {where} ({len(room)} placements); {by}", who)


def _clearance_in_the_way(site: Site, stage: Stage) -> str:
    """Return which clearance of the site file leaves no path, for the end of a reason; nothing if another is it."""
    space, free = stage.space, stage.free
    without = {
        "transit_clearance_m": space._replace(boxes=free.boxes),
        "rope_clearance_m": space._replace(hook_floor=free.hook_floor),
    }
    for rule, less in without.items():
        asked_m = getattr(site.rules, rule)
        if asked_m == 0.0 or rule in site.rules.gives_way:
            continue
        if shortest_path(less, stage.start_vox, stage.insertion.gate_vox).path_vox is not None:
            return f"; with less than {asked_m:g} m of [rules] {rule} a path does"
    return ""


def _smaller_room(space: CollisionSpace, start: IntVec, gate: IntVec) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the rooms around start and gate, the smaller one complete, the other one up to the same size."""
    limit = _FIRST_LIMIT
    while True:
        rooms = reachable(space, start, limit), reachable(space, gate, limit)
        if min(map(len, rooms)) < limit or limit >= _FLOOD_LIMIT:
            return rooms
        limit = min(8 * limit, _FLOOD_LIMIT)


def _around(room: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the placements one move away from those of a room ((N, 3)), each once, in ascending order."""
    around = (room[:, None, :] + MOVES[None, :, :]).reshape(-1, 3)
    low, size = around.min(axis=0), np.ptp(around, axis=0) + 1
    flat = distinct(np.ravel_multi_index(tuple((around - low).T), tuple(size)))
    there: NDArray[np.int32] = (np.stack(np.unravel_index(flat, tuple(size)), axis=1) + low).astype(np.int32)
    return there
