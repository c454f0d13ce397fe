"""The motion of one lift: the empty hook's way to the part, hooking on, the carry along its path, and setting it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.errors import MotionError, PlanningError
from bimvox.grid.summed_area import box_sum
from bimvox.motion.drive import drive_free, drive_path, drive_turning
from bimvox.motion.move import Line, Move
from bimvox.motion.swept import HookEnd, LoadFrame, axes_of_cells, pose_next_to
from bimvox.motion.swing import HOOK_OFFSET, RiggedCrane, rigged_crane, with_wind
from bimvox.motion.timeline import Timeline, in_sequence, pause_of, sampled
from bimvox.motion.trajectories import approached, delayed, phases_from, starting
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory, quarters_of
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace, hook_room, placement_is_free
from bimvox.site.component import Component, StoredPose, turned_aside
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times
from bimvox.site.default_rules import FlipRules
from bimvox.site.flip_box import is_flipped
from bimvox.site.lifting import asked_wind_m_s, permitted_for
from bimvox.site.site import Rules, Site
from bimvox.units import NS_PER_S

# The empty hook between two lifts, under the same collision rule.
#
# The empty hook is one cell at the lower end of its slings, where the load's top was, so that it starts where the
# loaded hook ended.

HOOK_CELL = np.array([[0, 0, 0, 1, 1, 1]], np.int32)
_BLOCK = 8
"""Edge of the blocks of columns that are checked together first."""


def empty_hook_clearance(
    site: Site,
    crane: TowerCrane,
    space: CollisionSpace,
    place: YardPlace,
    left_vox: NDArray[np.int32],
    above: Sequence[NDArray[np.int32]] = (),
) -> CollisionSpace:
    """Return the collision rule for the empty hook between two lifts; it may go as far as the jib reaches.

    Args:
        site: The site.
        crane: The crane.
        space: The rule for the next part's own lift: its table holds the part just set, not the next part itself.
        place: Where the next part waits; the hook comes onto it from above.
        left_vox: (N, 3) cells of the slings' end on the last moves to the set point: the hook may leave along the path
            that it came by, even if neighbours share those cells.
        above: (N, 3) cells of other things that the table may lack: the hook is kept above them too.
    """
    top = top_of_table(space.table)
    for cells in above:
        np.maximum.at(top, (cells[:, 0], cells[:, 1]), cells[:, 2] + np.int32(1))
    floor, ceiling = hook_room(site, crane, top, None)
    floor = floor.copy()
    _reach_ends(site, crane, top, floor, [place.shape.cells + np.array(place.cell_vox, np.int32), left_vox])
    # The next part is not in the table: keep the hook above it.
    for cells in (place.shape.cells + np.array(place.cell_vox, np.int32), *above):
        np.maximum.at(floor, (cells[:, 0], cells[:, 1]), cells[:, 2] + np.int32(1))
    low, cleared = NOTHING_CLEARED
    if len(left_vox):
        low = left_vox.min(axis=0).astype(np.int32)
        cleared = np.zeros(left_vox.max(axis=0) - low + 1, np.bool_)
        cleared[tuple((left_vox - low).T)] = True
    return CollisionSpace(space.table, HOOK_CELL, HOOK_OFFSET, floor, low, cleared, ceiling)


def _reach_ends(
    site: Site,
    crane: TowerCrane,
    top: NDArray[np.int32],
    floor: NDArray[np.int32],
    ends: Sequence[NDArray[np.int32]],
) -> None:
    """Admit the columns next to both ends in ``floor`` (in place) although their middles may be just out of reach.

    At its ends the hook is above a centre of mass, where its load may be; the columns around it count as its own.
    """
    wide = hook_room(site, crane, top, None, slack_m=2.0 * site.frame.voxel_size_m).floor
    for cells in ends:
        if len(cells):
            low = np.maximum(cells[:, :2].min(axis=0) - 1, 0)
            near = (slice(low[0], cells[:, 0].max() + 2), slice(low[1], cells[:, 1].max() + 2))
            floor[near] = wide[near]


@kernel
def top_of_table(table: NDArray[np.int32]) -> NDArray[np.int32]:
    """(X, Y) int32 height map from a summed-area table: one above the highest occupied cell of each column."""
    nx, ny = table.shape[0] - 1, table.shape[1] - 1
    top = np.zeros((nx, ny), np.int32)
    # Most columns are as low as their neighbours: the top of a block bounds the tops of its columns.
    for i0 in range(0, nx, _BLOCK):
        for j0 in range(0, ny, _BLOCK):
            i1, j1 = min(i0 + _BLOCK, nx), min(j0 + _BLOCK, ny)
            highest = _top_of_box(table, i0, j0, i1, j1, table.shape[2] - 1)
            # The ground is level, mostly.
            level = highest > 0 and box_sum(table, i0, j0, highest - 1, i1, j1, highest) == (i1 - i0) * (j1 - j0)
            for i in range(i0, i1):
                for j in range(j0, j1):
                    top[i, j] = highest if level else _top_of_box(table, i, j, i + 1, j + 1, highest)
    return top


@leaf_kernel
def _top_of_box(table: NDArray[np.int32], x0: int, y0: int, x1: int, y1: int, highest: int) -> int:
    """One above the highest occupied cell of the columns [x0, x1) x [y0, y1); no cell above ``highest`` is occupied."""
    low, high = 0, highest
    while low < high:
        middle = (low + high) // 2
        if box_sum(table, x0, y0, middle, x1, y1, highest) == 0:
            high = middle
        else:
            low = middle + 1
    return low


class Begins(NamedTuple):
    """Where and when a lift begins.

    Attributes:
        before: The planned lift before it; None for the first.
        clock_ns: When it starts on the site's clock.
        slew_rad: Slewing angle at which the lift before ended, including full turns.
        approach: The way of the empty hook to the part, from time 0, if it is known; otherwise it is made.
        carrying: A motion of the lift that stays the same from hook on, if it is known; otherwise it is made.
    """

    before: Lift | None
    clock_ns: int = 0
    slew_rad: float = 0.0
    approach: Trajectory | None = None
    carrying: LiftMotion | None = None


def time_lift(
    site: Site,
    crane: TowerCrane,
    lift: Lift,
    space: CollisionSpace,
    begins: Begins,
    carrying: CollisionSpace | None = None,
) -> LiftMotion:
    """Return the motion of one planned lift.

    Args:
        site: The site.
        crane: Its crane.
        lift: The lift; it must have a path and a place in the yard.
        space: The collision rule of its stage.
        begins: Where and when it begins.
        carrying: The rule for the load, if it is stricter than that for the empty hook.

    Raises:
        MotionError: If its path is not free or cannot be driven, or the empty hook cannot reach it.
    """
    try:
        return _motion(site, crane, lift, space, begins, carrying or space)
    except PlanningError as error:
        raise MotionError(site.components[lift.component].id, error.message, hint=error.hint) from error


def _motion(
    site: Site,
    crane: TowerCrane,
    lift: Lift,
    space: CollisionSpace,
    begins: Begins,
    carrying: CollisionSpace,
) -> LiftMotion:
    component, place = site.components[lift.component], lift.place
    before, clock_ns, slew_rad, approach, known = begins
    assert lift.path_vox is not None
    assert place is not None
    # The empty hook carries the usual slings, longer ones hooked back; the load moves in its gear, with its own slings.
    empty, rigged = rigged_crane(site, crane, None), rigged_crane(site, crane, component)
    crew = crew_times(site.rules, component, tag_lines=not lift.with_jib)
    spans: list[tuple[PhaseName, int]] = []
    hook_on_vox = hook_on_at(component, place, space)
    if before is not None:
        if approach is None or not _is_at(empty.load, hook_on_vox, approach.axes[-1]):
            left_vox = left_cells(site, before)
            rule = empty_hook_clearance(site, empty.crane, space, place, left_vox)
            approach = empty_hook_move(empty, rule, left_at(site, before), hook_on_vox, slew_rad)
        if known is not None and _is_at(empty.load, hook_on_vox, known.raising.axes[0]):
            return approached(starting(known, clock_ns), approach)
        slew_rad = float(approach.slew_rad[-1])
        spans.append((PhaseName.APPROACH, int(approach.time_ns[-1])))
    spans.append((PhaseName.HOOK_ON, round(crew.hook_on_s * NS_PER_S)))
    raise_timeline = _raising(rigged, empty.load, component, place, hook_on_vox, slew_rad, site.rules.two_hooks)
    raising = delayed(sampled(raise_timeline, 0.0, rigged._replace(pendulum=None)), _total(spans))
    spans.append((PhaseName.RAISE, _length_ns(raising) + round(raised_s(site.rules, component, place) * NS_PER_S)))
    spans.append((PhaseName.TURN, round(quarters_of(place.turn) * site.rules.turn_s * NS_PER_S)))
    slew_rad = float(raising.slew_rad[-1])
    timeline, needed_m = drive_lift(site, rigged, carrying, lift, slew_rad)
    loaded = delayed(sampled(timeline, needed_m, rigged), _total(spans))
    spans += carrying_phases(timeline, _length_ns(loaded))
    spans.append((PhaseName.SET, round(crew.brace_s * NS_PER_S)))
    spans.append((PhaseName.RELEASE, round(crew.hook_off_s * NS_PER_S)))
    phases = phases_from(clock_ns, spans)
    motion = LiftMotion(
        lift.order,
        lift.component,
        approach,
        raising,
        loaded,
        phases,
        start_ns=clock_ns,
        end_ns=phases[-1].end_ns,
        crane=component.crane,
    )
    return insist_on_wind(site, lift, with_wind(site, lift, motion))


_SAME_SPEED = 1e-9


def insist_on_wind(site: Site, lift: Lift, motion: LiftMotion) -> LiftMotion:
    """Return a motion that stays clear in the wind in which the site file asks for every lift.

    Raises PlanningError: if a gust of that wind swings the load further than it keeps clear in transit.
    """
    asked_m_s, component = asked_wind_m_s(site.rules), site.components[lift.component]
    # What crane and sail area permit was asked before there was a path.
    most_m_s = min(asked_m_s, permitted_for(site, site.cranes[motion.crane], component))
    if motion.wind is not None and motion.wind.speed_m_s < most_m_s * (1.0 - _SAME_SPEED):
        kept_m = site.rules.kept_m("transit_clearance_m", lift.kept)
        raise PlanningError(
            f"a gust of more than {motion.wind.speed_m_s:.1f} m/s swings the load further than the {kept_m:g} m that "
            f"it keeps in transit; the site file asks for lifts in {asked_m_s:g} m/s",
            hint="ask for less wind in [rules], or for a larger transit_clearance_m",
        )
    return motion


def raised_s(rules: Rules, component: Component, place: YardPlace) -> float:
    """Return how long the crew takes while a part is raised: for the trial lift, and to upend it if it lies.

    Between two hooks it is turned while the crane hoists; then the crew takes the auxiliary hook off.
    """
    if rules.two_hooks is not None and is_flipped(component, place.pose):
        return TRIAL_LIFT_S + rules.two_hooks.unhook_s
    return TRIAL_LIFT_S + (rules.upend_s if place.is_upended else 0.0)


def drive_lift(
    site: Site, rigged: RiggedCrane, space: CollisionSpace, lift: Lift, slew_rad: float
) -> tuple[Timeline, float]:
    """Return what ``drive_path`` does for the path of a lift, whether or not its load turns with the jib."""
    assert lift.path_vox is not None
    if lift.with_jib:
        return drive_turning(site, rigged, space, lift, slew_rad)
    return drive_path(rigged, space, lift.path_vox, lift.contact_moves, slew_rad, lift.guide)


def empty_hook_move(
    empty: RiggedCrane,
    rule: CollisionSpace,
    start_vox: HookEnd,
    end_vox: HookEnd,
    slew_rad: float,
) -> Trajectory:
    """Return the trajectory of the empty hook between two cells of the slings' lower end (``empty_hook_clearance``).

    Above a part's centre of mass, an end is aside of a whole cell.

    Raises PlanningError: if there is no free route.
    """
    return sampled(*drive_free(empty, rule, start_vox, end_vox, slew_rad), empty)


def carrying_phases(timeline: Timeline, length_ns: int) -> list[tuple[PhaseName, int]]:
    """Return hoist, traverse and lower of a loaded motion: names and lengths, ns.

    They are cut at the start of the first move that is not vertical, and of the final moves down. While the crane
    pauses, the load is turned to its final heading.
    """
    pause = pause_of(timeline)
    if pause is None:
        return _carrying(timeline, 0, len(timeline.moves), (0, length_ns))
    first_after, begins_s, ends_s = pause
    begins_ns, ends_ns = round(begins_s * NS_PER_S), round(ends_s * NS_PER_S)
    return [
        *_carrying(timeline, 0, first_after, (0, begins_ns)),
        (PhaseName.TURN, ends_ns - begins_ns),
        *_carrying(timeline, first_after, len(timeline.moves), (ends_ns, length_ns)),
    ]


def _carrying(timeline: Timeline, first: int, until: int, span_ns: tuple[int, int]) -> list[tuple[PhaseName, int]]:
    """Return hoist, traverse and lower of the moves from one to the one before another, in a span of time."""
    moves = timeline.moves
    flat = [i for i in range(first, until) if not moves[i].is_vertical]
    final = until
    while final > first and moves[final - 1].is_vertical and moves[final - 1].difference[2] < 0.0:
        final -= 1
    lowers = round(timeline.start_s[final] * NS_PER_S) if final < until else span_ns[1]
    hoisted = round(timeline.start_s[flat[0]] * NS_PER_S) if flat else lowers
    return [
        (PhaseName.HOIST, hoisted - span_ns[0]),
        (PhaseName.TRAVERSE, lowers - hoisted),
        (PhaseName.LOWER, span_ns[1] - lowers),
    ]


def hook_on_at(component: Component, place: YardPlace, space: CollisionSpace) -> NDArray[np.float64]:
    """Return (3,) where the slings' lower end is at hook on, in cells: above the part's top as it lies.

    That is above its centre of mass. A part that lies is hooked at its head, the end away from its foot, and upended.
    If the hook may not be over the head, or anywhere between head and foot (reach, rope, zones), the part is hooked
    over its foot. Between two hooks, the main one holds its head, above which it ends upright.
    """
    x, y, z = place.cell_vox
    size_x, size_y, size_z = place.shape.size_vox
    foot = np.add(place.transit_start_vox, component.hook_offset_vox).astype(np.int32)
    foot[2] = z + size_z + component.lifting.sling_rise_vox
    head = foot.copy()
    if is_flipped(component, place.pose):
        pass
    elif place.pose is StoredPose.LYING_X:
        head[0] = x + size_x - 1
    elif place.pose is StoredPose.LYING_Y:
        head[1] = y + size_y - 1
    above = space._replace(boxes=np.array([[0, 0, 0, 1, 1, 1]], np.int32), hook_offset=HOOK_OFFSET)
    path = foot + np.sign(head - foot) * np.arange(np.abs(head - foot).max() + 1, dtype=np.int32)[:, None]
    inside = (path[:, :2] < space.hook_floor.shape).all()
    hooked = head if inside and all(placement_is_free(above, *cell) for cell in path) else foot
    at: NDArray[np.float64] = hooked + np.array([*turned_aside(component.hook_aside_vox, place.turn), 0.0])
    return at


def left_cells(site: Site, lift: Lift) -> NDArray[np.int32]:
    """(N, 3) cells of the slings' lower end on the last moves of a lift, its place last."""
    component = site.components[lift.component]
    rise = np.array([0, 0, component.lifting.sling_rise_vox], np.int32)
    cells: NDArray[np.int32] = lift.last_moves_vox + np.array(component.hook_offset_vox, np.int32) + rise
    return cells


def left_at(site: Site, lift: Lift) -> NDArray[np.float64]:
    """(3,) where the slings' lower end is at the set point of a lift, in cells: above the part's centre of mass."""
    aside = site.components[lift.component].hook_aside_vox
    at: NDArray[np.float64] = left_cells(site, lift)[-1] + np.array([*aside, 0.0])
    return at


def _is_at(hook: LoadFrame, at_vox: NDArray[np.float64], axes: NDArray[np.float64]) -> bool:
    """Return whether (3,) slew, radius and height are those above (3,) cells, apart from whole turns."""
    pose = CranePose(*axes.tolist())
    return pose_next_to(hook, at_vox, pose) is pose


def _raising(
    rigged: RiggedCrane,
    hook: LoadFrame,
    component: Component,
    place: YardPlace,
    hook_on_vox: NDArray[np.float64],
    slew_rad: float,
    two_hooks: FlipRules | None,
) -> Timeline:
    """Return the moves that upend a lying part about its foot and lift it straight up to the transit start.

    Between two hooks it is lifted level first, and turned over by hoisting its head.

    A part that is turned afterwards about its hook, onto whole cells, is first moved to where its hook is then.
    """
    on = axes_of_cells(hook, hook_on_vox)
    up = axes_of_cells(rigged.load, np.array(place.transit_start_vox))
    start = CranePose(nearest_turn(float(on[0]), slew_rad), float(on[1]), float(on[2]))
    end = CranePose(nearest_turn(float(up[0]), start.slew_rad), float(up[1]), float(up[2]))
    foot = hook_on_vox.copy()
    foot[:2] = np.add(place.transit_start_vox, component.hook_offset_vox)[:2]
    foot[:2] += turned_aside(component.hook_aside_vox, place.turn)
    raised = pose_next_to(hook, foot, replace(end, height_m=float(on[2])))
    raised = replace(raised, height_m=end.height_m)
    if (hook_on_vox[:2] == foot[:2]).all():
        raised = replace(start, height_m=end.height_m)
        moves = [Move(start, raised)]
        if two_hooks is not None and is_flipped(component, place.pose):
            level = replace(start, height_m=start.height_m + place.rise_vox * hook.voxel_size_m)
            moves = [Move(start, level), Move(level, raised, least_s=two_hooks.turn_s)]
    else:
        upright = replace(raised, height_m=end.height_m - place.rise_vox * hook.voxel_size_m)
        moves = [Move(start, upright, Line.ARC), Move(upright, raised)]
    if place.turn and component.hook_aside_vox != turned_aside(component.hook_aside_vox, place.turn):
        moves.append(Move(raised, end, Line.SITE))
    return in_sequence(rigged.crane, moves)


def _length_ns(trajectory: Trajectory) -> int:
    return int(trajectory.time_ns[-1] - trajectory.time_ns[0])


def _total(spans: list[tuple[PhaseName, int]]) -> int:
    return sum(length_ns for _, length_ns in spans)
