"""How long a crane moves with nothing in its way but the swing of its loads: a closer look at one place.

The quick estimate (:mod:`bimvox.site.set_ups`) lets each axis go as fast as it can. What tells the places of one
machine apart is rather the swing: far out, or with the trolley running while the jib slews and the hook goes down,
moves are driven slower until the load hangs at rest. So some ways up, across and down are laid over time as for a plan
(:mod:`bimvox.motion.steady`), over everything that is built by then.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.fit import radii_for_m
from bimvox.crane.kinematics import nearest_turn, pose_of
from bimvox.crane.rigging import rigged
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.errors import PlanningError
from bimvox.motion.move import Move
from bimvox.motion.steady import Swaying, SwingRules, steadied
from bimvox.motion.swing import PLANNED_RESIDUAL_M, Pendulum
from bimvox.motion.timeline import Timeline
from bimvox.site.set_ups import LiftWork

LIFTS, FEW_LIFTS = 48, 12
"""Lifts that are laid over time, and of a first look; of fewer parts each several times."""
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Each lift begins at a place of the yard this share of all further on, so that all are met evenly."""
_NEVER_AT_REST_S = 600.0
"""A way whose load never comes to rest: the plan needs another one."""


def timed_moving_s(
    crane: TowerCrane, work: LiftWork, served: NDArray[np.bool_], *, swings: bool, lifts: int = LIFTS
) -> float:
    """Return how long a crane moves about for the parts that it serves, in their sequence.

    Args:
        crane: The crane as used, on its base.
        work: The parts, with the places of the yard.
        served: (N,) whether it serves each part.
        swings: Whether moves are shaped against the swing of loads.
        lifts: So many are laid over time, of parts evenly from the sequence.
    """
    lifted = np.flatnonzero(served)
    if not len(lifted):
        return 0.0
    some = min(lifts, len(lifted))
    numbers = lifted[np.arange(some) * len(lifted) // some].tolist() * max(1, lifts // len(lifted))
    over_m = np.maximum.accumulate(work.tops_m) + work.heights_m + crane.sling_m
    places = _poses(crane, work.places_m, work.tops_m + crane.sling_m)
    slew_rad, yard_radius_m, _ = pose_of(crane, np.pad(work.yard_m, ((0, 0), (0, 1))))
    limits_m = radii_for_m(crane, work.masses_kg)
    # As if the sequence began again: of few lifts, a way back that is missing counts.
    total_s, before = 0.0, places[numbers[-1]]
    for lift, n in enumerate(numbers):
        near_m, far_m = limits_m[n].tolist()
        able = np.flatnonzero((yard_radius_m >= near_m) & (yard_radius_m <= far_m))
        at = able[int(lift * _GOLDEN % 1.0 * len(able))]
        high_m = float(work.heights_m[n]) + crane.sling_m
        pick = CranePose(float(slew_rad[at]), float(yard_radius_m[at]), high_m)
        way = (before, pick, max(before.height_m, high_m))
        total_s += _way_s(rigged(crane, 0.0), way, Pendulum(crane.sling_m) if swings else None)
        way = (pick, places[n], float(over_m[n]))
        hangs = Pendulum(crane.sling_m + 0.5 * float(work.heights_m[n]))
        total_s += _way_s(rigged(crane, float(work.masses_kg[n])), way, hangs if swings else None)
        before = places[n]
    return total_s * len(lifted) / len(numbers)


def _poses(crane: TowerCrane, points_m: NDArray[np.float64], heights_m: NDArray[np.float64]) -> list[CranePose]:
    axes = pose_of(crane, np.column_stack([points_m, heights_m]))
    return [CranePose(*pose) for pose in np.stack(axes, axis=1).tolist()]


def _way_s(crane: TowerCrane, way: tuple[CranePose, CranePose, float], pendulum: Pendulum | None) -> float:
    """Return the time of a way from one pose to another over a height."""
    start, end, over_m = way
    end = replace(end, slew_rad=nearest_turn(end.slew_rad, start.slew_rad))
    stops = (start, replace(start, height_m=over_m), replace(end, height_m=over_m), end)
    moves = [Move(a, b) for a, b in pairwise(stops) if a != b]
    if not moves:
        return 0.0
    try:
        found = steadied(crane, moves, pendulum, SwingRules(_overlapping, _swinging_s, inf))
    except PlanningError:
        return _NEVER_AT_REST_S
    assert found is not None
    return found.duration_s


def _swinging_s(timeline: Timeline, sway: Swaying) -> float | None:
    """Return when a load that swings in the end was to be at rest; None if it is."""
    return timeline.duration_s if sway.swing.amplitude_m[-1] > PLANNED_RESIDUAL_M else None


def _overlapping(timeline: Timeline) -> Timeline:
    """Return moves that overlap as much as moves may: never three at once, none beyond the end of the one before."""
    starts: list[float] = []
    ended_s = end_s = 0.0
    for overlaps, lasts_s in zip(timeline.course.overlaps, timeline.course.duration_s, strict=True):
        starts.append(max(starts[-1], ended_s, end_s - lasts_s) if overlaps else end_s)
        ended_s, end_s = end_s, max(end_s, starts[-1] + lasts_s)
    return Timeline(timeline.course, tuple(starts))
