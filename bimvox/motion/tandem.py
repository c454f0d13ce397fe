"""The motion of a part that two cranes carry together: one course of the load, which both cranes drive in time.

The load is moved without turning, along straight lines, and rests at each corner: so both hooks make the same moves,
and their ropes stay vertical. On a line, the share of the way is that of the least jerk (10 u^3 - 15 u^4 + 6 u^5). It
takes as long as the slower crane needs for its rates, accelerations and jerks, and longer where the load would swing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joint_limits, joints_of, nearest_turn
from bimvox.crane.tower_crane import CranePose
from bimvox.crane.travel import point_to_point_s
from bimvox.errors import MotionError, PlanningError
from bimvox.motion.shortcut import check_path, corners_of
from bimvox.motion.swept import axes_of_cells, line_is_free
from bimvox.motion.swing import (
    PLANNED_OFF_RESIDUAL_M,
    PLANNED_RESIDUAL_M,
    STEP_S,
    RiggedCrane,
    hanging_on,
    left_m,
    rigged_crane,
    sways_free,
    with_wind,
)
from bimvox.motion.time_lift import insist_on_wind, raised_s
from bimvox.motion.trajectories import delayed, phases_from, trajectory_of
from bimvox.planning.shorten_path import straightened, with_room
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.site.crew_times import crew_times
from bimvox.site.site import Site
from bimvox.site.tandem import halves, seen_by
from bimvox.units import NS_PER_S

RATE_SHARE = 0.5
"""Of its rates, each crane uses no more: two drivers keep in time with each other (professional judgement)."""
_OF_LIMITS = 0.98
_SPACING_VOX = 0.4
_TOP = 1.875
"""The highest rate on a line, by the mean one."""
_FINE = 400
_LONGER, _TRIES = 1.2, 16
_UNMOVED_M = 1e-9


class _Course(NamedTuple):
    """Where the load is over time.

    Attributes:
        time_ns: (N,) int64 samples from 0.
        cells: (N, 3) float64 reference cells.
        corner: (M,) int64 samples between the ends at which it rests.
        flat_ns: When it first moves aside; None if it never does.
        lowers_ns: When it is only lowered from then on; None if it is not.
    """

    time_ns: NDArray[np.int64]
    cells: NDArray[np.float64]
    corner: NDArray[np.int64]
    flat_ns: int | None
    lowers_ns: int | None


def time_together(site: Site, lift: Lift, space: CollisionSpace) -> LiftMotion:
    """Return the motion of a planned lift by two cranes, from hooking on, with that of the second one.

    Args:
        site: The site.
        lift: The lift; it must have a path and a place in the yard.
        space: The collision rule of its stage.

    Raises:
        MotionError: If its path is not free, or its load swings too far however slowly it is moved.
    """
    try:
        return _motion(site, lift, space)
    except PlanningError as error:
        raise MotionError(site.components[lift.component].id, error.message, hint=error.hint) from error


def _motion(site: Site, lift: Lift, space: CollisionSpace) -> LiftMotion:
    component, place = site.components[lift.component], lift.place
    assert lift.path_vox is not None
    assert place is not None
    both = [rigged_crane(site, site.cranes[half.crane], half) for half in halves(site, component)]
    for one in both:
        check_path(one, space, lift.path_vox)
    up = np.array([place.cell_vox, place.transit_start_vox], np.float64)
    raised = _course(both, up, 1.0)
    carried = _steady(both, space, _corners(both, space, lift))
    crew = crew_times(site.rules, component, tag_lines=True)
    hook_on_ns = round(crew.hook_on_s * NS_PER_S)
    raise_ns = int(raised.time_ns[-1]) + round(raised_s(site.rules, component, place) * NS_PER_S)
    length_ns = int(carried.time_ns[-1])
    flat_ns = length_ns if carried.flat_ns is None else carried.flat_ns
    lowers_ns = length_ns if carried.lowers_ns is None else carried.lowers_ns
    flat_ns = min(flat_ns, lowers_ns)
    phases = phases_from(
        0,
        [
            (PhaseName.HOOK_ON, hook_on_ns),
            (PhaseName.RAISE, raise_ns),
            (PhaseName.HOIST, flat_ns),
            (PhaseName.TRAVERSE, lowers_ns - flat_ns),
            (PhaseName.LOWER, length_ns - lowers_ns),
            (PhaseName.SET, round(crew.brace_s * NS_PER_S)),
            (PhaseName.RELEASE, round(crew.hook_off_s * NS_PER_S)),
        ],
    )
    motions = []
    for one, half in zip(both, halves(site, component), strict=True):
        raising = delayed(_trajectory(one, raised, 0.0), hook_on_ns)
        loaded = delayed(_trajectory(one, carried, float(raising.slew_rad[-1])), hook_on_ns + raise_ns)
        motion = LiftMotion(
            lift.order, lift.component, None, raising, loaded, phases, 0, phases[-1].end_ns, crane=half.crane
        )
        own = seen_by(site, half.crane)
        motions.append(insist_on_wind(own, lift, with_wind(own, lift, motion)))
    return replace(motions[0], second=motions[1])


def _corners(both: Sequence[RiggedCrane], space: CollisionSpace, lift: Lift) -> NDArray[np.float64]:
    """Return the (N, 3) corners of a course of straight lines along the path of a lift, as long as they are free.

    Its last moves stay as they are, and so do its ways straight up in the beginning and straight down in the end.
    """
    assert lift.path_vox is not None
    load, last_vox = both[0].load, lift.last_moves_vox
    path_vox = lift.path_vox[: len(lift.path_vox) - lift.contact_moves]
    path_vox = straightened(space, path_vox) if both[0].pendulum is None else with_room(space, path_vox)
    every = path_vox[corners_of(path_vox)].astype(np.float64)
    upright = (np.diff(every[:, :2], axis=0) == 0.0).all(axis=1)
    at, last = (int(upright[0]), len(every) - 1 - int(upright[-1])) if len(upright) > 1 else (0, len(every) - 1)
    axes, result = axes_of_cells(load, every), sorted({0, at})
    while at < last:
        further = (n for n in range(last, at + 1, -1) if line_is_free(space, load, axes[at], axes[n], True))
        at = next(further, at + 1)
        result.append(at)
    result += [len(every) - 1] if last < len(every) - 1 else []
    corners = np.concatenate([every[result], last_vox[corners_of(last_vox)[1:]]])
    return _joined(corners)


def _joined(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return corners without those between two vertical moves in one direction."""
    ways = np.diff(corners, axis=0)
    is_between = (np.abs(ways[:-1, :2]) + np.abs(ways[1:, :2])).max(axis=1, initial=0.0) == 0.0
    is_between &= np.sign(ways[:-1, 2]) == np.sign(ways[1:, 2])
    joined: NDArray[np.float64] = corners[np.concatenate([[True], ~is_between, [True]])]
    return joined


def _steady(both: Sequence[RiggedCrane], space: CollisionSpace, corners: NDArray[np.float64]) -> _Course:
    """Return the fastest course found along corners on which the load swings into nothing and comes to rest.

    Raises PlanningError: if there is none.
    """
    longer = 1.0
    for _ in range(_TRIES):
        course = _course(both, corners, longer)
        if all(one.pendulum is None or _hangs_still(one, space, course) for one in both):
            return course
        longer *= _LONGER
    raise PlanningError(
        "carried by two cranes, it swings too far however slowly it is moved",
        hint="give its way more room, or store it nearer to its place ([[component]] start)",
    )


def _hangs_still(one: RiggedCrane, space: CollisionSpace, course: _Course) -> bool:
    """Return whether a load swings into nothing on its course, and is at rest in the end if it is a little off too."""
    assert one.pendulum is not None
    end_s = float(course.time_ns[-1]) / NS_PER_S
    even_s = np.linspace(0.0, end_s, int(np.ceil(end_s / STEP_S)) + 1)
    step_s, axes = float(even_s[1]), _trajectory(one, course, 0.0).axes
    time_s = course.time_ns / NS_PER_S
    axes = np.stack([np.interp(even_s, time_s, axis) for axis in axes.T], axis=1)
    for pendulums, most_m in (((one.pendulum,), PLANNED_RESIDUAL_M), (one.pendulum.off, PLANNED_OFF_RESIDUAL_M)):
        for way in left_m(one.crane, axes, step_s, pendulums) if pendulums else ():
            if float(np.hypot(*way[:2]) + np.hypot(*way[2:4]) + np.hypot(*way[4:6]) + np.hypot(*way[6:])) > most_m:
                return False
    return bool(sways_free(space, one.load, axes, hanging_on(one.crane, one.pendulum), step_s))


def _course(both: Sequence[RiggedCrane], corners: NDArray[np.float64], longer: float) -> _Course:
    """Return the course along corners that both cranes can drive, slower than they could by a factor."""
    size_m, period_s = both[0].load.voxel_size_m, both[0].sample_period_s
    times, cells, corner = [np.zeros(1, np.int64)], [corners[:1]], [0]
    flat_ns: int | None = None
    lowers_ns: int | None = None
    for start, end in pairwise(corners):
        begins_ns = int(times[-1][-1])
        length_ns = int(np.ceil(longer * max(_least_s(one, start, end) for one in both) * NS_PER_S))
        way_vox = float(np.linalg.norm(end - start))
        count = max(4, int(np.ceil(max(_TOP * way_vox / _SPACING_VOX, length_ns / NS_PER_S / period_s))))
        within_ns = np.round(np.linspace(0.0, length_ns, count + 1)[1:]).astype(np.int64)
        times.append(begins_ns + within_ns)
        cells.append(start + _share(within_ns / length_ns)[:, None] * (end - start))
        corner.append(corner[-1] + count)
        is_flat = bool(np.abs(end - start)[:2].max() * size_m > _UNMOVED_M)
        flat_ns = begins_ns if is_flat and flat_ns is None else flat_ns
        lowers = not is_flat and end[2] < start[2]
        lowers_ns = (begins_ns if lowers_ns is None else lowers_ns) if lowers else None
    return _Course(np.concatenate(times), np.concatenate(cells), np.array(corner[1:-1], np.int64), flat_ns, lowers_ns)


def _share(u: NDArray[np.float64]) -> NDArray[np.float64]:
    share: NDArray[np.float64] = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return share


def _least_s(one: RiggedCrane, start: NDArray[np.float64], end: NDArray[np.float64]) -> float:
    """Return how long a crane needs for a line at least, by its joints at fine steps; rates are by 1 / time."""
    crane, u = one.crane, np.linspace(0.0, 1.0, _FINE + 1)
    joints = joints_of(crane, _axes(one, start + _share(u)[:, None] * (end - start)))
    slow, step = min([1.0, *(zone.share for zone in crane.slow_zones)]), 1.0 / _FINE
    needed = 0.0
    for values, limits in zip(joints.T, joint_limits(crane), strict=True):
        rest = values - values[0]
        for order, limit in enumerate((RATE_SHARE * slow * limits.rate, limits.acceleration, limits.jerk), start=1):
            rest = np.diff(rest) / step
            needed = max(needed, (float(np.abs(rest).max()) / (_OF_LIMITS * limit)) ** (1.0 / order))
    return needed


def _axes(one: RiggedCrane, cells: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (N, 3) axes of a crane over reference cells, slewing angles unwrapped."""
    axes = axes_of_cells(one.load, cells)
    still = np.concatenate([[False], (np.diff(cells[:, :2], axis=0) == 0.0).all(axis=1)])
    axes[:, 0] = np.unwrap(axes[:, 0])
    for n in np.flatnonzero(still):  # a vertical move must not slew by rounding noise
        axes[n, :2] = axes[n - 1, :2]
    return axes


def _trajectory(one: RiggedCrane, course: _Course, slew_rad: float) -> Trajectory:
    """Return the samples of one of the two cranes, from the turn nearest to a slewing angle."""
    axes = _axes(one, course.cells)
    axes[:, 0] += nearest_turn(float(axes[0, 0]), slew_rad) - axes[0, 0]
    first, last = (CranePose(*axes[n].tolist()) for n in (0, -1))
    bound_s = point_to_point_s(one.crane, first, last, float(axes[:, 2].max()))
    return trajectory_of(course.time_ns.copy(), axes, course.corner, min(bound_s, course.time_ns[-1] / NS_PER_S))
