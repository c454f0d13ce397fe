"""The job of a planned site: its lifts with their real motions, crane and crew times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s
from bimvox.errors import InputError
from bimvox.live.ground import ground_of
from bimvox.live.job import LiveJob, LiveLift
from bimvox.live.order import earlier_lifts
from bimvox.live.other_ways import LiftWay, lift_ways
from bimvox.live.way import Hanging, Way, way_of
from bimvox.motion.swing import pendulum_of
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.site.component import Component, StoredPose
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.units import NS_PER_S


def job_of(
    plan: LiftPlan,
    preparation: Preparation,
    motions: Sequence[LiftMotion],
    first: int = 0,
    count: int = 30,
    ways: int = 1,
) -> LiveJob:
    """Return the job of some planned lifts that follow each other.

    Args:
        plan: A proven plan of a site with one crane.
        preparation: What it was made from.
        motions: The motions of its planned lifts, in order.
        first: Position of the first of them.
        count: How many lifts, at most.
        ways: How many proven ways of each, at most: the planned one, and others that are made (``lift_ways``).

    Raises:
        InputError: If there is no such lift, or the site has several cranes.
    """
    site, chosen = plan.site, motions[first : first + count]
    if len(site.cranes) != 1 or not chosen:
        raise InputError(
            f"simulated traffic needs a site with one crane and a planned lift number {first + 1}",
            hint="plan the site with one crane, and count planned lifts from 1",
        )
    crane = site.cranes[0]
    proven = lift_ways(plan, preparation, motions, [motion.order for motion in chosen], ways)
    earlier = earlier_lifts(site, preparation, list(proven.values()))
    job_lifts = tuple(
        replace(live_lift_of(site, own), earlier=before) for own, before in zip(proven.values(), earlier, strict=True)
    )
    return LiveJob(site.name, job_lifts, _approach_s(crane, chosen), ground_of(site))


def live_lift_of(site: Site, ways: Sequence[LiftWay]) -> LiveLift:
    """Return a lift with its proven ways, the planned one first; nothing need be set before."""
    lift, motion = ways[0]
    return LiveLift(
        lift.number,
        site.components[lift.component].name,
        tuple(way_of_motion(site, *way) for way in ways),
        seconds_in(motion, PhaseName.HOOK_ON),
        seconds_in(motion, PhaseName.SET, PhaseName.RELEASE),
    )


def way_of_motion(site: Site, lift: Lift, motion: LiftMotion) -> Way:
    """Return the way of a motion, from the start of raising until the load is at its place."""
    part, crane = site.components[lift.component], site.cranes[motion.crane]
    time_ns, axes = motion.samples()
    raised_ns = next(phase.start_ns for phase in motion.phases if phase.name is PhaseName.RAISE)
    inside = (time_ns > raised_ns) & (time_ns < motion.set_ns)
    ends = np.array([raised_ns, motion.set_ns], np.int64)
    at_ends = np.stack([np.interp(ends, time_ns, axis) for axis in axes.T], axis=1)
    at_ns = np.concatenate([ends[:1], time_ns[inside], ends[1:]])
    axes = np.concatenate([at_ends[:1], axes[inside], at_ends[1:]])
    upright = _box_m(site, part)
    boxes = np.repeat(upright[None], len(at_ns), axis=0)
    carried_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    if lift.place is not None and (lift.place.turn or lift.place.pose is not StoredPose.AS_BUILT):
        stored_m = site.frame.voxel_size_m * float(np.hypot(*lift.place.shape.size_vox[:2]))
        half_m = max(stored_m, float(np.hypot(*np.abs(upright).reshape(2, 2).max(axis=0))))
        boxes[at_ns < carried_ns] = (-half_m, -half_m, half_m, half_m)
    if lift.ever_with_jib:  # it may have any heading
        half_m = max(float(np.abs(boxes).max()), float(np.hypot(*np.abs(upright).reshape(2, 2).max(axis=0))))
        boxes[:] = (-half_m, -half_m, half_m, half_m)
    hanging = Hanging(np.zeros(len(at_ns)), boxes, pendulum_of(site, crane, part))
    return way_of(crane_for(site, crane, part), (at_ns - raised_ns) / NS_PER_S, axes, hanging)


def _box_m(site: Site, part: Component) -> NDArray[np.float64]:
    """Return the part on plan relative to its hook: x0, y0, x1, y1."""
    size, line = np.array(part.shape.size_vox[:2]), np.array(part.hook_line_vox[:2]) + 0.5
    return site.frame.voxel_size_m * np.concatenate([-line, size - line])


def seconds_in(motion: LiftMotion, *names: PhaseName) -> float:
    """Return how long phases of a motion take together."""
    return sum((phase.end_ns - phase.start_ns) / NS_PER_S for phase in motion.phases if phase.name in names)


def _approach_s(crane: TowerCrane, motions: Sequence[LiftMotion]) -> NDArray[np.float64]:
    """Return how long the empty hook takes from each place to each pick: as planned where it is planned.

    Elsewhere it is the point-to-point time at the height of the higher of the two lifts; it carries nothing.
    """
    picks = [CranePose(*motion.raising.axes[0].tolist()) for motion in motions]
    places = [CranePose(*motion.loaded.axes[-1].tolist()) for motion in motions]
    tops_m = [float(motion.loaded.height_m.max()) for motion in motions]
    count = len(motions)
    found = np.zeros((count + 1, count))
    for to in range(count):
        found[0, to] = point_to_point_s(crane, places[0], picks[to], tops_m[to])
        for n in range(count):
            found[n + 1, to] = point_to_point_s(crane, places[n], picks[to], max(tops_m[n], tops_m[to]))
    for n, (_, motion) in enumerate(pairwise(motions)):
        found[n + 1, n + 1] = seconds_in(motion, PhaseName.APPROACH)
    return found
