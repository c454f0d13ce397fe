"""Plans made by hand, for pictures, without the planner."""

from __future__ import annotations

import numpy as np
from box_sites import box_site, test_crane

from bimvox.motion.swept import axes_of_cells, load_frame
from bimvox.records.lift import Lift, LiftPlan, Method, Status, YardPlace
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.site.component import StoredPose

PARTS = [
    ("beam-a", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0)),
    ("beam-b", (1.0, 3.0, 0.0), (4.0, 4.0, 1.0)),
    ("roof", (1.0, 1.0, 1.0), (4.0, 4.0, 1.5)),
]


def plan_by_hand(*, crane: bool = False, infeasible: tuple[str, ...] = ()) -> LiftPlan:
    """Return a plan of three parts, carried up, across and down."""
    site = box_site(
        PARTS,
        shape=(24, 12, 10),
        yard=((14, 0), (24, 12)),
        structure=[("wall", (5.0, 0.5, 0.0), (5.5, 5.5, 1.5))],
        obstructions=[("silo", (6.0, 4.0, 0.0), (6.5, 4.5, 3.0))],
        crane=test_crane(base=(6.25, 2.25, 0.0), jib=21.0, height=7.0) if crane else None,
    )
    starts = {"beam-a": (15, 1, 1), "beam-b": (15, 4, 1), "roof": (15, 5, 1)}
    lifts = []
    for order, component in enumerate(site.components):
        delivery = 0 if order < 2 else 1
        place = YardPlace(delivery, StoredPose.AS_BUILT, component.shape, starts[component.id])
        if component.id in infeasible:
            lifts.append(Lift(order, order, place, Status.INFEASIBLE, reason="it is blocked", blocked_by=("silo",)))
            continue
        path = _over(place.transit_start_vox, component.target_vox, 6)
        lifts.append(Lift(order, order, place, Status.PLANNED, Method.SEARCH, path, len(path) - 1))
    return LiftPlan(site, tuple(lifts))


def motions_by_hand(plan: LiftPlan) -> tuple[LiftMotion, ...]:
    """Return the motion of each planned lift along its cells, ten minutes per lift."""
    site = plan.site
    assert site.cranes
    motions = []
    for lift in plan.lifts:
        if lift.path_vox is None:
            continue
        load = load_frame(site.cranes[0], site.frame, site.components[lift.component].hook_line_vox)
        axes = axes_of_cells(load, lift.path_vox)
        start_ns = lift.order * 600 * 10**9
        raising, loaded = _trajectory(axes[:1].repeat(2, axis=0), 0), _trajectory(axes, 2)
        phases = (Phase(PhaseName.TRAVERSE, start_ns, start_ns + 600 * 10**9),)
        motions.append(
            LiftMotion(lift.order, lift.component, None, raising, loaded, phases, start_ns, start_ns + 600 * 10**9)
        )
    return tuple(motions)


def _trajectory(axes: np.ndarray, start_s: int) -> Trajectory:
    time_ns = (start_s + np.arange(len(axes), dtype=np.int64)) * 10**9
    return Trajectory(time_ns, np.unwrap(axes[:, 0]), axes[:, 1], axes[:, 2], np.array([], np.int64), 1.0)


def _over(start, target, height: int) -> np.ndarray:
    at, cells = list(start), [tuple(start)]
    for axis, goal in ((2, height), (1, target[1]), (0, target[0]), (2, target[2])):
        while at[axis] != goal:
            at[axis] += 1 if goal > at[axis] else -1
            cells.append(tuple(at))
    return np.array(cells, np.int32)
