"""The legs of the empty hooks of several cranes to their next parts, for a plan that is being carried out.

A crane whose last part is set moves to its next one as in a plan. If its hook is elsewhere, stopped between two parts
or waiting, it continues from there: *early*, while no more parts are set than now; or *late*, when all parts that come
before the next lift in the sequence may be in place or still in the yard.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.tower_crane import CranePose
from bimvox.cranes.legs import LegMaker, legs_of
from bimvox.cranes.lift import REST_NS, HookError, Leg, Legs, Parking
from bimvox.errors import PlanningError
from bimvox.motion.swept import HookEnd, cells_of_axes
from bimvox.motion.time_lift import hook_on_at
from bimvox.motion.timeline import in_sequence, sampled
from bimvox.motion.trajectories import delayed, one_after_another
from bimvox.planning.occupancy import target_cells
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.trajectory import Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.stop.resume import move_to_cell, resume_cells

_THERE_VOX = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class CraneStart:
    """The position from which a crane continues.

    Attributes:
        motions: Motions of its lifts that are hooked on or done, by order.
        axes: (3,) slew (rad), radius (m), height (m) at which its empty hook is, or comes to rest; None if it is where
            its last part was set.
    """

    motions: Mapping[int, LiftMotion]
    axes: NDArray[np.float64] | None


def legs_from_there(
    maker: LegMaker, space: CollisionSpace, axes: NDArray[np.float64], last: tuple[Lift, CollisionSpace] | None
) -> Legs:
    """Return the legs to a crane's next part from any pose of its hook.

    Args:
        maker: Makes the legs to that part.
        space: The collision rule of the stage of its lift.
        axes: (3,) the pose: slew (rad), radius (m), height (m).
        last: The last lift of all cranes that is hooked on, and the rule of its stage; None if there is none.

    Raises:
        HookError: If the hook has no free path to the part.
    """
    site, place, component = maker.site, maker.place, maker.component
    pose = CranePose(*(float(n) for n in axes))
    pick_vox = hook_on_at(component, place, space)
    at_vox = cells_of_axes(maker.empty.load, axes)
    now = maker.hook_rule(space, above=maker.lying())
    there = bool(np.abs(at_vox - pick_vox).max() <= _THERE_VOX)
    early = None
    if last is not None:
        since, rule = last
        above = [
            target_cells(site.components[since.component]),
            *maker.arrived_since(since, [maker.lift]),
            *maker.other_means_since(since, maker.lift),
        ]
        then = maker.hook_rule(rule, above=above)
        early = None if there else _early(maker, then, pose, pick_vox, since.order)
    late = None
    if not there:
        late = _leg(maker, now, pose, pick_vox)
        if late is None:
            late = _leg(maker, maker.hook_rule(space), pose, pick_vox, last=True)

    def parking(parked_vox: NDArray[np.int32]) -> Parking | None:
        back = maker.leg(now, parked_vox, pick_vox, pose.slew_rad)
        aside = _leg(maker, now, pose, parked_vox)
        if aside is None and last is not None:
            aside = _early(maker, then, pose, parked_vox, since.order)
        return Parking(aside, back) if back is not None and aside is not None else None

    parkings = maker.parkings(now, [pick_vox, at_vox], parking, pose.slew_rad)
    if not there and early is None and late is None and not parkings:
        raise HookError(component.id, "the empty hook has no free path to it from where it is")
    legs = legs_of(early, late, parkings, pose.slew_rad)
    return replace(legs, hooked_rad=nearest_turn(legs.hooked_rad, pose.slew_rad)) if there else legs


def _early(maker: LegMaker, rule: CollisionSpace, pose: CranePose, end_vox: HookEnd, since: int) -> Leg | None:
    """Return a leg that passes the places of later lifts before their parts are set; None if there is none."""
    leg = _leg(maker, rule, pose, end_vox)
    if leg is None:
        return None
    return replace(leg, before=frozenset(n for n in maker.crossed(leg.trajectory) if n > since))


def _leg(maker: LegMaker, rule: CollisionSpace, pose: CranePose, end_vox: HookEnd, *, last: bool = False) -> Leg | None:
    """Return a leg of the empty hook from rest at any pose to a cell; None if there is none."""
    empty = maker.empty
    hook = empty.load
    for cell in resume_cells(rule, hook, pose):
        start_vox = np.array(cell, np.int32)
        first = move_to_cell(hook, pose, cell)
        moves = any(abs(part) > _THERE_VOX * hook.voxel_size_m for part in first.difference)
        onward = maker.leg(rule, start_vox, end_vox, first.end.slew_rad, last=last)
        if onward is None and (start_vox != end_vox).any():
            continue
        parts: list[Trajectory] = []
        if moves:
            try:
                timeline = in_sequence(empty.crane, [first], empty.pendulum)
            except PlanningError:
                continue
            parts.append(sampled(timeline, max(first.start.height_m, first.end.height_m), empty))
        if onward is not None:
            later = onward.trajectory
            parts.append(delayed(later, int(parts[0].time_ns[-1]) + REST_NS) if parts else later)
        if parts:
            return Leg(one_after_another(parts), last=last)
    return None
