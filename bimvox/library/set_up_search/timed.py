"""How long a crane moves with nothing in its way but its own mast and the swing of its loads: a closer look at a place.

The quick estimate (:mod:`bimvox.site.set_ups`) lets each axis go as fast as it can. What tells the places of one
machine apart is rather where parts are picked (``picks.py``), and the swing: far out, or with the trolley running while
the jib slews, moves are driven slower until the load hangs at rest. So some ways up, across and down are laid over time
as for a plan (:mod:`bimvox.motion.steady`). They keep the plan's clearance: a load passes over everything that is built
by then, goes across only when it is clear of the yard, and among parts around its place straight down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, starmap
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.bound import rest_to_rest_s
from bimvox.crane.fit import radii_for_m
from bimvox.crane.kinematics import Axes, nearest_turn, pose_of
from bimvox.crane.rigging import rigged
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import Travel
from bimvox.errors import PlanningError
from bimvox.library.set_up_search.ways import Ways
from bimvox.motion.drive import SET_DOWN_M
from bimvox.motion.move import Move
from bimvox.motion.shortcut import stops_across
from bimvox.motion.steady import Swaying, SwingRules, steadied
from bimvox.motion.swing import PLANNED_RESIDUAL_M, Pendulum
from bimvox.motion.timeline import Timeline
from bimvox.site.extent import MARGIN_VOX

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
_SAMPLES = 33
"""Positions of a move that are looked at."""
_DIAGONAL = 2.0**0.5


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
    over_m = np.maximum.accumulate(work.tops_m) + work.heights_m + crane.sling_m + ways.clearance_m
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
            heights_m = (max(left.height_m, pick.height_m), -inf, -inf)
            total_s += _way_s(rigged(crane, 0.0), [left, pick], heights_m, hangs)
        loaded = rigged(crane, float(work.masses_kg[n]))
        raise_m = ways.raised_to_turn_m(n, ways.picks.points_m[at]) if turned else ways.cell_m
        raised = replace(pick, height_m=pick.height_m + raise_m)
        first, free = _ways_across(loaded, (raised, end), ways, n, far_m)
        gate_m = max(ways.clear_m(n) + height_m + crane.sling_m, end.height_m + SET_DOWN_M)
        clear_m, above_m = raised.height_m + ways.clearance_m, height_m + crane.sling_m + ways.clearance_m
        hangs = Pendulum(crane.sling_m + 0.5 * height_m) if ways.swings else None
        carry_s = inf
        for across in (first,) if free is None or free is first else (first, free):
            passing_m = across.top_m + above_m if across.top_m < inf else float(over_m[n])
            heights_m = (max(passing_m, raised.height_m, gate_m), clear_m, gate_m)
            longer_s = 0.0 if across is free else _AROUND_S
            carry_s = min(carry_s, longer_s + _way_s(loaded, across.stops, heights_m, hangs))
        total_s += rest_to_rest_s(raise_m, loaded.hoist) + carry_s + (ways.turn_s if turned else 0.0)
    return total_s * len(lifted) / (some * times)


def _at(axes: Axes, n: int) -> Axes:
    slew, radius, height = (axis[n : n + 1] for axis in axes)
    return slew, radius, height


def _over(targets: Axes, n: int, sling_m: float) -> CranePose:
    slew, radius, height = (float(axis[n]) for axis in targets)
    return CranePose(slew, radius, height + sling_m)


class _Across(NamedTuple):
    """A way across: its stops, and how high it is built where it passes; infinite if it is not free."""

    stops: Sequence[CranePose]
    top_m: float


def _ways_across(
    crane: TowerCrane, ends: tuple[CranePose, CranePose], ways: Ways, n: int, far_m: float
) -> tuple[_Across, _Across | None]:
    """Return the plainest of the plan's ways across for a load, and the first that is free, or None.

    A free way is clear of mast and site boundary, and within the radius that the load may have.
    """
    start, end = ends[0], replace(ends[1], slew_rad=nearest_turn(ends[1].slew_rad, ends[0].slew_rad))
    (low_x, low_y), (high_x, high_y) = ways.around_m[n].tolist()
    mast_m = 0.5 * crane.mast_size_m + ways.mast_m + ways.cell_m
    # The site reaches as far around a mast as around everything else.
    edge_m = 0.5 * crane.mast_size_m + MARGIN_VOX * ways.cell_m
    base_m = np.array(crane.base_m[:2])
    (west, south), (east, north) = (
        np.minimum(ways.bounds_m[0] - base_m, -edge_m) - 0.5 * ways.cell_m,
        np.maximum(ways.bounds_m[1] - base_m, edge_m) + 0.5 * ways.cell_m,
    )
    share = np.linspace(0.0, 1.0, _SAMPLES)
    # Slewing passes columns whose middles lie further out.
    most_m = far_m - _DIAGONAL * ways.cell_m

    def top_m(a: CranePose, b: CranePose) -> float:
        slew = a.slew_rad + share * (b.slew_rad - a.slew_rad)
        radius = a.radius_m + share * (b.radius_m - a.radius_m)
        if abs(slew[-1] - slew[0]) * radius.max() > 2.0 * ways.cell_m and radius[1:-1].max() > most_m:
            return inf
        x, y = radius * np.cos(slew), radius * np.sin(slew)
        if (x + low_x < west).any() or (x + high_x > east).any():
            return inf
        if (y + low_y < south).any() or (y + high_y > north).any():
            return inf
        hits = (x + low_x < mast_m) & (x + high_x > -mast_m) & (y + low_y < mast_m) & (y + high_y > -mast_m)
        if hits.any():
            return inf
        hooks_m = base_m + np.column_stack([x, y])
        return ways.passed_m(n, hooks_m + ways.around_m[n, 0], hooks_m + ways.around_m[n, 1])

    first: _Across | None = None
    for stops in stops_across(crane, start, end):
        way = _Across(
            [*stops[:-1], replace(stops[-1], height_m=end.height_m)], max(top_m(a, b) for a, b in pairwise(stops))
        )
        first = first or way
        if way.top_m < inf:
            return first, way
    assert first is not None
    return first, None


def _way_s(
    crane: TowerCrane,
    stops: Sequence[CranePose],
    heights_m: tuple[float, float, float],
    pendulum: Pendulum | None,
) -> float:
    """Return the time of a way from one pose over others to the last.

    Args:
        crane: The crane.
        stops: The poses; those between the first and the last at any height.
        heights_m: At which it goes across, from which on it may while it is still raised, and down to which it may
            still while it is lowered.
        pendulum: What hangs on the hook; None if its swing does not matter.
    """
    over_m, clear_m, gate_m = heights_m
    poses = [stops[0], *(replace(stop, height_m=over_m) for stop in stops), stops[-1]]
    moves = [move for move in starmap(Move, pairwise(poses)) if np.abs(move.difference).max() > _ROUNDING]
    if not moves:
        return 0.0

    def overlapping(timeline: Timeline) -> Timeline:
        return _overlapping(timeline, clear_m, gate_m)

    try:
        found = steadied(crane, moves, pendulum, SwingRules(overlapping, _swinging_s, inf))
    except PlanningError:
        return _NEVER_AT_REST_S
    assert found is not None
    return found.duration_s


def _swinging_s(timeline: Timeline, sway: Swaying) -> float | None:
    """Return when a load that swings in the end was to be at rest; None if it is."""
    return timeline.duration_s if sway.swing.amplitude_m[-1] > PLANNED_RESIDUAL_M else None


def _overlapping(timeline: Timeline, clear_m: float, gate_m: float) -> Timeline:
    """Return moves that overlap as much as moves may: never three at once, none beyond the end of the one before it.

    A move up is followed from a height on, and what comes before a move down ends while that is above another one.
    """
    starts: list[float] = []
    ended_s = end_s = 0.0
    for n, (move, overlaps, lasts_s) in enumerate(
        zip(timeline.moves, timeline.course.overlaps, timeline.course.duration_s, strict=True)
    ):
        begins_s = max(starts[-1], ended_s, end_s - lasts_s) if overlaps else end_s
        if overlaps and move.difference[2] < 0.0:
            begins_s = max(begins_s, end_s - _until_s(timeline, n, gate_m))
        elif overlaps and timeline.moves[n - 1].difference[2] > 0.0:
            begins_s = max(begins_s, starts[-1] + _until_s(timeline, n - 1, clear_m))
        starts.append(begins_s)
        ended_s, end_s = end_s, max(end_s, begins_s + lasts_s)
    return Timeline(timeline.course, tuple(starts))


def _until_s(timeline: Timeline, n: int, height_m: float) -> float:
    """Return how long a move up or down takes until it reaches a height."""
    move, lasts_s = timeline.moves[n], timeline.course.duration_s[n]
    share = (height_m - move.start.height_m) / move.difference[2]
    if share <= 0.0 or share >= 1.0:
        return 0.0 if share <= 0.0 else lasts_s
    time_s = np.linspace(0.0, lasts_s, _SAMPLES)
    heights_m = timeline.axes_at(time_s + timeline.start_s[n])[:, 2]
    return float(np.interp(share, (heights_m - move.start.height_m) / move.difference[2], time_s))
