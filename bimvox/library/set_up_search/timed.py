"""How long a crane moves with nothing in its way but its own mast and the swing of its loads: a closer look at a place.

The quick estimate (:mod:`bimvox.site.set_ups`) lets each axis go as fast as it can. What tells the places of one
machine apart is rather where parts are picked (``picks.py``), and the swing: far out, or with the trolley running while
the jib slews, moves are driven slower until the load hangs at rest. So some ways up, across and down are laid over time
as for a plan (:mod:`bimvox.motion.steady`). They keep the plan's clearance: a load goes across only when it is clear of
the yard, wherever it passes it is above all that is built there by then (``across.py``), and it ends straight down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, starmap
from math import inf

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import Axes, nearest_turn, pose_of, rigged
from bimvox.crane.reach import radii_for_m
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import Travel, rest_to_rest_s
from bimvox.errors import PlanningError
from bimvox.library.set_up_search.across import SAMPLES, ways_across
from bimvox.library.set_up_search.ways import Ways
from bimvox.motion.drive import SET_DOWN_M
from bimvox.motion.move import Move
from bimvox.motion.steady import Swaying, SwingRules, steadied
from bimvox.motion.swing import PLANNED_RESIDUAL_M, Pendulum
from bimvox.motion.timeline import Timeline

LIFTS, FEW_LIFTS = 48, 12
"""Lifts that are laid over time, and of a first look; of fewer parts each several times."""
_ASIDE = 0.02
"""A part is picked so much of the yard further on each time: where exactly it lies, an estimate cannot know."""
_NEVER_AT_REST_S = 600.0
"""A way whose load never comes to rest: the plan needs another one."""
_AROUND_S = 150.0
"""What a load takes longer if that is not free; 70 s in half of them, 140 s in the mean, up to 500 s."""
_ROUNDING = 1e-9
"""Poses that differ by less, in metres and radians, are the same."""


def timed_moving_s(crane: TowerCrane, ways: Ways, served: NDArray[np.bool_], lifts: int = LIFTS) -> float:
    """Return how long a crane moves about for the parts that it serves, in their sequence.

    Args:
        crane: The crane as used, on its base.
        ways: The parts, with the yard.
        served: (N,) whether it serves each part.
        lifts: So many are laid over time, of parts evenly from the sequence.
    """
    lifted = np.flatnonzero(served)
    if not len(lifted):
        return 0.0
    work, some = ways.work, min(lifts, len(lifted))
    targets = pose_of(crane, np.column_stack([work.places_m, work.tops_m]))
    yard = pose_of(crane, np.pad(ways.picks.points_m, ((0, 0), (0, 1))))
    travel = Travel(crane, crane.jib_length_m + crane.jib_height_m)
    limits_m = radii_for_m(crane, work.masses_kg)
    total_s = 0.0
    times = max(1, lifts // some)
    positions = (np.arange(some) * len(lifted) // some).tolist()
    for lift, position in enumerate(positions * times):
        before, n = (int(lifted[which]) for which in (position - 1, position))
        (near_m, far_m), height_m = limits_m[n].tolist(), float(work.heights_m[n])
        able = (yard[1] >= near_m) & (yard[1] <= far_m)
        hook = (yard[0], yard[1], np.full(len(able), height_m))
        turned, aside = ways.picks.is_turned(n, crane, far_m), _ASIDE * (lift // some)
        at = ways.picks.of(n, able, travel, (_at(targets, before), hook, _at(targets, n)), aside, turned=turned)
        left, end = (_over(targets, part, crane.sling_m) for part in (before, n))
        turn_rad = nearest_turn(float(yard[0][at]), left.slew_rad)
        pick = CranePose(turn_rad, float(yard[1][at]), height_m + crane.sling_m)
        hangs = Pendulum(crane.sling_m) if ways.swings else None
        if position > 0 or some < len(lifted):  # of few lifts, the way to the first one stands for others
            total_s += _way_s(rigged(crane, 0.0), [left, pick], [np.full(SAMPLES, -inf)], hangs)
        loaded = rigged(crane, float(work.masses_kg[n]))
        raise_m = ways.raised_to_turn_m(n, ways.picks.points_m[at]) if turned else ways.cell_m
        raised = replace(pick, height_m=pick.height_m + raise_m)
        carry_s = _carry_s(loaded, (raised, end), ways, n, far_m)
        total_s += rest_to_rest_s(raise_m, loaded.hoist) + carry_s + (ways.turn_s if turned else 0.0)
    return total_s * len(lifted) / (some * times)


def _at(axes: Axes, n: int) -> Axes:
    slew, radius, height = (axis[n : n + 1] for axis in axes)
    return slew, radius, height


def _over(targets: Axes, n: int, sling_m: float) -> CranePose:
    slew, radius, height = (float(axis[n]) for axis in targets)
    return CranePose(slew, radius, height + sling_m)


def _carry_s(crane: TowerCrane, ends: tuple[CranePose, CranePose], ways: Ways, n: int, far_m: float) -> float:
    """Return the time in which a load is carried from above the yard to its place.

    Args:
        crane: The crane with its load.
        ends: Where it is raised to, and its place.
        ways: The parts.
        n: The part.
        far_m: The largest radius that it may have.
    """
    (raised, end), height_m = ends, float(ways.work.heights_m[n])
    hangs = Pendulum(crane.sling_m + 0.5 * height_m) if ways.swings else None
    clear_m, above_m = raised.height_m + ways.clearance_m, height_m + crane.sling_m + ways.clearance_m
    all_m = np.full(SAMPLES, float(ways.work.tops_m[: n + 1].max()))
    plainest, free = ways_across(crane, ends, ways, n, far_m)
    carry_s = inf
    for across in (plainest,) if free is None else (free,) if free.stops == plainest.stops else (plainest, free):
        tops_m = across.tops_m or [all_m] * (len(across.stops) - 1)
        needs_m = [np.maximum(top_m + above_m, clear_m) for top_m in tops_m]
        needs_m[-1][-1] = max(needs_m[-1][-1], end.height_m + SET_DOWN_M)
        longer_s = 0.0 if across is free else _AROUND_S
        carry_s = min(carry_s, longer_s + _way_s(crane, across.stops, needs_m, hangs))
    return carry_s


def _way_s(
    crane: TowerCrane, stops: Sequence[CranePose], needs_m: Sequence[NDArray[np.float64]], pendulum: Pendulum | None
) -> float:
    """Return the time of a way from one pose over others to the last.

    Args:
        crane: The crane.
        stops: The poses; those between the first and the last at any height.
        needs_m: How high the hook must be along each move across.
        pendulum: What hangs on the hook; None if its swing does not matter.
    """
    over_m = max(stops[0].height_m, stops[-1].height_m, *(float(need_m.max()) for need_m in needs_m))
    poses = [stops[0], *(replace(stop, height_m=over_m) for stop in stops), stops[-1]]
    every = zip(starmap(Move, pairwise(poses)), [None, *needs_m, None], strict=True)
    moves = [(move, need_m) for move, need_m in every if np.abs(move.difference).max() > _ROUNDING]
    if not moves:
        return 0.0

    def overlapping(timeline: Timeline) -> Timeline:
        return _overlapping(timeline, [need_m for _, need_m in moves])

    try:
        found = steadied(crane, [move for move, _ in moves], pendulum, SwingRules(overlapping, _swinging_s, inf))
    except PlanningError:
        return _NEVER_AT_REST_S
    assert found is not None
    return found.duration_s


def _swinging_s(timeline: Timeline, sway: Swaying) -> float | None:
    """Return when a load that swings in the end was to be at rest; None if it is."""
    return timeline.duration_s if sway.swing.amplitude_m[-1] > PLANNED_RESIDUAL_M else None


def _overlapping(timeline: Timeline, needs_m: Sequence[NDArray[np.float64] | None]) -> Timeline:
    """Return moves that overlap as much as moves may: never three at once, none beyond the end of the one before it.

    Wherever the hook is on a move across, it is already as high as it must be there, or still.
    """
    starts: list[float] = []
    ended_s = end_s = 0.0
    for n, (overlaps, lasts_s) in enumerate(zip(timeline.course.overlaps, timeline.course.duration_s, strict=True)):
        begins_s = max(starts[-1], ended_s, end_s - lasts_s) if overlaps else end_s
        if overlaps:
            need_m, before_m = needs_m[n], needs_m[n - 1]
            if need_m is None and before_m is not None:
                ahead_s = _along_s(timeline, n - 1) - _until_s(timeline, n, before_m)
                begins_s = max(begins_s, starts[-1] + float(ahead_s.max()))
            elif need_m is not None and before_m is None:
                ahead_s = _until_s(timeline, n - 1, need_m) - _along_s(timeline, n)
                begins_s = max(begins_s, starts[-1] + float(ahead_s.max()))
        starts.append(begins_s)
        ended_s, end_s = end_s, max(end_s, begins_s + lasts_s)
    return Timeline(timeline.course, tuple(starts))


def _until_s(timeline: Timeline, n: int, heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how long a move up or down takes until it reaches heights."""
    move = timeline.moves[n]
    return _reached_s(timeline, n, (heights_m - move.start.height_m) / move.difference[2])


def _along_s(timeline: Timeline, n: int) -> NDArray[np.float64]:
    """Return how long a move takes until each of its samples."""
    return _reached_s(timeline, n, np.linspace(0.0, 1.0, SAMPLES))


def _reached_s(timeline: Timeline, n: int, shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how long a move takes until shares of its way."""
    move, time_s = timeline.moves[n], np.linspace(0.0, timeline.course.duration_s[n], SAMPLES)
    axis = int(np.argmax(np.abs(move.difference)))
    along = timeline.axes_at(time_s + timeline.start_s[n])[:, axis]
    found: NDArray[np.float64] = np.interp(shares, (along - along[0]) / move.difference[axis], time_s)
    return found
