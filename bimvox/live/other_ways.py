"""Other ways of the lifts of a plan: each passes the planned one at a distance, and is proven in its place."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of, pose_of
from bimvox.crane.reach import HOOK_FORBIDDEN
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import MotionError
from bimvox.motion.time_lift import Begins, time_lift
from bimvox.planning.assembly import replay
from bimvox.planning.preparation import Preparation
from bimvox.planning.search import all_free
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Lift, LiftPlan, Method
from bimvox.records.motion import LiftMotion
from bimvox.site.collision import CollisionSpace
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.units import NS_PER_S

_APART_M = 12.0
"""The hook passes the middle of the planned way at least this far, or ..."""
_APART_SHARE = 0.25
"""... at this share of the distance from pick to place, if that is less: around these it is free."""
_LEAST_M = 2.0
"""Ways that would pass each other nearer than this are not made: whoever is below one is below the other."""
_ASIDE = 2.0
"""The middle of another way is aside by this multiple, so that the crane can move straight to it."""
_LONGER_S = 60.0
"""A way that takes this much longer than the planned one is not offered: waiting costs less."""


class LiftWay(NamedTuple):
    """A way of a lift: the lift with its path, and its motion in the plan's order."""

    lift: Lift
    motion: LiftMotion


def lift_ways(
    plan: LiftPlan, preparation: Preparation, motions: Sequence[LiftMotion], wanted: Collection[int], most: int
) -> dict[int, tuple[LiftWay, ...]]:
    """Return the ways of some lifts, the planned one first.

    The others lead around the middle of the planned one, on either side. Each is proven as a lift of the plan, with all
    other parts where the plan has them.

    Args:
        plan: A proven plan of one crane.
        preparation: What it was made from.
        motions: The motions of its planned lifts, in order.
        wanted: Orders of the planned lifts.
        most: Ways of a lift, at most: up to 3 exist; the shorter one first.

    Returns:
        By order, one or more ways.
    """
    lifts, driven = {lift.order: lift for lift in plan.lifts}, {motion.order: motion for motion in motions}
    result: dict[int, tuple[LiftWay, ...]] = {
        order: (LiftWay(lifts[order], driven[order]),) for order in sorted(wanted)
    }
    if most < 2:
        return result
    before: Lift | None = None
    for lift, rule in replay(plan.site, preparation, plan):
        if lift.order in result and not lift.with_jib:
            start_rad = 0.0 if before is None else float(driven[before.order].loaded.slew_rad[-1])
            others = (_around(plan.site, result[lift.order][0], before, rule, start_rad, side) for side in (1.0, -1.0))
            made = sorted((way for way in others if way is not None), key=lambda way: way.motion.end_ns)
            proven = (way for way in made if _is_proven(plan, way))
            result[lift.order] += tuple(islice(proven, most - 1))
        before = lift
    return result


def _around(
    site: Site, planned: LiftWay, before: Lift | None, rule: CollisionSpace, start_rad: float, side: float
) -> LiftWay | None:
    """Return a way of a lift around the middle of the planned one; None if there is none that the crane can drive.

    ``before``: the planned lift before it; ``rule``: the collision rule of its motion; ``start_rad``: slewing angle at
    the end of the lift before; ``side``: 1.0: left of the planned way; -1.0: right of it.
    """
    (lift, motion), last_vox = planned, planned.lift.last_moves_vox
    assert lift.path_vox is not None
    crane = crane_for(site, site.cranes[motion.crane], site.components[lift.component])
    hook_m = hook_of(crane, *motion.loaded.axes.T)[:, :2]
    chord_m = hook_m[-1] - hook_m[0]
    length_m = float(np.hypot(*chord_m))
    apart_m = min(_APART_M, _APART_SHARE * length_m)
    if apart_m < _LEAST_M:
        return None
    along_m = np.r_[0.0, np.cumsum(np.hypot(*np.diff(hook_m, axis=0).T))]
    middle_m = hook_m[int(np.searchsorted(along_m, 0.5 * along_m[-1]))]
    barred = _barred(site, rule, middle_m, apart_m)
    aside_m = middle_m + side * _ASIDE * apart_m / length_m * np.array([-chord_m[1], chord_m[0]])
    path_vox = _path_over(site, crane, barred, lift, aside_m)
    if path_vox is None:
        return None
    whole_vox: NDArray[np.int32] = np.concatenate([path_vox, last_vox[1:]]).astype(np.int32)
    whole_vox.flags.writeable = False
    other = replace(lift, path_vox=whole_vox, method=Method.SEARCH, planner=None)
    try:
        begins = Begins(before, motion.start_ns, start_rad)
        made = time_lift(site, site.cranes[motion.crane], other, rule, begins, barred)
    except MotionError:
        return None
    return LiftWay(other, made) if made.end_ns - motion.end_ns <= _LONGER_S * NS_PER_S else None


def _path_over(
    site: Site, crane: TowerCrane, rule: CollisionSpace, lift: Lift, hook_m: NDArray[np.float64]
) -> NDArray[np.int32] | None:
    """Return (N, 3) a transit straight up, by slewing and trolleying over a place on plan, and down to the last moves.

    Its corners are those of the stairs along the crane's own lines, so it is driven in few moves.
    """
    assert lift.path_vox is not None
    start, gate, top = lift.path_vox[0], lift.last_moves_vox[0], int(lift.path_vox[:, 2].max())
    ends_m = site.frame.centre_of(np.array([start, gate]) + rule.hook_offset)
    stops = np.stack([ends_m[0, :2], hook_m, ends_m[1, :2]])
    slew, radius, _ = pose_of(crane, np.pad(stops, ((0, 0), (0, 1))))
    share = np.linspace(0.0, 2.0, 8 * max(site.shape))
    slew, radius = np.interp(share, range(3), np.unwrap(slew)), np.interp(share, range(3), radius)
    on_plan = hook_of(crane, slew, radius, np.zeros_like(slew))
    columns = _without_repeats((site.frame.cell_of(on_plan) - rule.hook_offset)[:, :2])
    square = np.stack([columns[1:, 0], columns[:-1, 1]], axis=1)  # along x, then along y
    columns = np.stack([columns[:-1], square], axis=1).reshape(-1, 2)
    columns = _without_repeats(np.concatenate([columns, gate[None, :2]]))
    for z in range(top, site.shape[2]):
        up = [(*start[:2], k) for k in range(int(start[2]), z)]
        down = [(*gate[:2], k) for k in range(z - 1, int(gate[2]) - 1, -1)]
        path_vox = np.array([*up, *((*column, z) for column in columns), *down], np.int32)
        if all_free(rule, path_vox):
            return path_vox
    return None


def _without_repeats(columns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (M, 2) the columns of a path, those that equal the one before left out."""
    return columns[np.r_[True, (np.diff(columns, axis=0) != 0).any(axis=1)]]


def _barred(site: Site, rule: CollisionSpace, middle_m: NDArray[np.float64], apart_m: float) -> CollisionSpace:
    """Return a collision rule whose hook keeps away from a place on plan."""
    floor = np.array(rule.hook_floor)
    low_m, size_m = site.frame.origin_m, site.frame.voxel_size_m
    x_m, y_m = (low_m[axis] + size_m * (np.arange(floor.shape[axis]) + 0.5) - middle_m[axis] for axis in (0, 1))
    floor[np.hypot(x_m[:, None], y_m[None, :]) < apart_m] = HOOK_FORBIDDEN
    return rule._replace(hook_floor=floor)


def _is_proven(plan: LiftPlan, way: LiftWay) -> bool:
    """Return whether a way is proven, all other lifts being as planned."""
    own = replace(plan, lifts=(way.lift,))
    context = tuple(lift for lift in plan.lifts if lift.order != way.lift.order)
    known = {part.index for part in plan.site.components}
    return (
        verify_plan(own, context, known_shapes=known).verified and verify_motions(own, [way.motion], context).verified
    )
