"""The job of a planned site: its lifts with their real motions, crane and crew times, and where others go.

The site file does not say where others go: crews work all over the building, in the yard and on the sides, and lorries
drive straight to the side of the site that is nearest to the yard.

Lifts may change places where the proof of the plan says so. It proves each lift with the parts before it in their
places and the others in the yard. In another order, a lift meets a part that the plan had elsewhere. It stays proven if
its footprint (all cells that its proof checked) has no cell of that part, wherever it is then. Otherwise the two keep
the plan's order, and so do lifts of which one must come before the other, or which come with different deliveries.
Clearances in transit that give way, give way here too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s
from bimvox.errors import InputError
from bimvox.live.episode import LiveJob, LiveLift
from bimvox.live.other_ways import LiftWay, lift_ways
from bimvox.live.traffic import NO_TRACK, Ground
from bimvox.live.way import Hanging, Way, way_of
from bimvox.motion.swing import pendulum_of
from bimvox.planning.order.relations import order_graph
from bimvox.planning.preparation import Preparation
from bimvox.proof.footprint import CellMask, Footprint, MotionFootprint, motion_footprint, path_footprint
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.site.collision import CLEARANCES
from bimvox.site.component import Component, StoredPose
from bimvox.site.default_rules import NOTHING_KEPT
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.units import NS_PER_S

_AREAS, _PLACES = 7, 12
"""Number of areas, and of work places in each: the building in two halves, the yard, and the site's four sides."""
_AROUND_M = (2.0, 15.0)
"""How far outside the grid the work places of its sides are."""
_OUTSIDE_M = 30.0


def ground_of(site: Site) -> Ground:
    """Return where others go on a site; the same for every call."""
    draw, size, origin = np.random.default_rng(0), site.frame.voxel_size_m, np.array(site.frame.origin_m[:2])
    built = np.zeros(site.shape[:2], np.bool_)
    for part in site.components:
        columns = part.shape.cells[:, :2] + np.array(part.target_vox[:2])
        built[tuple(columns.T)] = True
    columns = np.argwhere(built)
    low, high = columns.min(axis=0), columns.max(axis=0) + 1
    box = np.stack(np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
    inside = box.reshape(-1, 2)
    longer = int(np.argmax(high - low))
    first_half = inside[:, longer] < (low + high)[longer] // 2
    groups = (inside[first_half], inside[~first_half], np.argwhere(site.yard), *_around(site))
    chosen = [group[draw.integers(len(group), size=_PLACES)] for group in groups]
    places_m = (np.concatenate(chosen) + 0.5) * size + origin
    return Ground(places_m, np.arange(_AREAS + 1) * _PLACES, _road_m(site), *NO_TRACK)


def _around(site: Site) -> list[NDArray[np.int64]]:
    """Return the columns outside the grid, side by side."""
    near, far = (round(away_m / site.frame.voxel_size_m) for away_m in _AROUND_M)
    nx, ny = site.shape[:2]
    x, y = np.arange(nx), np.arange(ny)
    out = np.arange(near, far)
    pairs = ((-out, y), (nx + out, y), (x, -out), (x, ny + out))
    return [np.stack(np.meshgrid(a, b, indexing="ij"), -1).reshape(-1, 2) for a, b in pairs]


def _road_m(site: Site) -> NDArray[np.float64]:
    """Return a road from outside to the side of the site that is nearest to the yard: lorries stand there."""
    size, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m[:2])
    low, high = origin, origin + np.array(site.shape[:2]) * size
    stand = (np.argwhere(site.yard).mean(axis=0) + 0.5) * size + origin
    sides = [(stand[axis] - low[axis], axis, -1.0) for axis in (0, 1)]
    sides += [(high[axis] - stand[axis], axis, 1.0) for axis in (0, 1)]
    away_m, axis, way = min(sides)
    edge, gate = stand.copy(), stand.copy()
    edge[axis] += way * away_m
    gate[axis] += way * (away_m + _OUTSIDE_M)
    return np.array([gate, 0.5 * (gate + edge), edge])


def _earlier_lifts(
    site: Site, preparation: Preparation, lifts: Sequence[Sequence[LiftWay]]
) -> tuple[frozenset[int], ...]:
    """Return for each of some lifts those of them that must be set before.

    ``preparation``: what its plan was made from; ``lifts``: the proven ways of planned lifts that follow each other in
    the plan.
    """
    graph = order_graph(site, preparation.relations, preparation.contacts)
    kept_m = {rule: site.rules.kept_m(rule, NOTHING_KEPT) for rule in CLEARANCES}
    site = replace(site, rules=replace(site.rules, **kept_m))  # type: ignore[arg-type]
    swept = [[footprint for way in ways for footprint in _swept(site, way)] for ways in lifts]
    planned = [ways[0].lift for ways in lifts]
    lying = [_lying(site, lift) for lift in planned]
    placed = [_placed(site, lift) for lift in planned]
    unheld = frozenset(preparation.sequence.unheld)
    found: list[frozenset[int]] = []
    for b, later in enumerate(planned):
        earlier = set()
        for a, first in enumerate(planned[:b]):
            assert first.place is not None
            assert later.place is not None
            kept = (
                first.component in graph.earlier[later.component]
                or first.place.delivery != later.place.delivery
                or not unheld.isdisjoint((first.component, later.component))
                or any(lying[a].meets(footprint) for footprint in swept[b])
                or any(placed[b].meets(footprint) for footprint in swept[a])
            )
            if kept:
                earlier.add(a)
        found.append(frozenset(earlier))
    return tuple(found)


def _swept(site: Site, way: LiftWay) -> tuple[Footprint, MotionFootprint]:
    return path_footprint(site, way.lift), motion_footprint(site, way.lift, way.motion)


def _lying(site: Site, lift: Lift) -> CellMask:
    assert lift.place is not None
    return _mask(site, lift.place.shape.cells + np.array(lift.place.cell_vox, np.int32))


def _placed(site: Site, lift: Lift) -> CellMask:
    part = site.components[lift.component]
    return _mask(site, part.shape.cells + np.array(part.target_vox, np.int32))


def _mask(site: Site, cells: NDArray[np.int32]) -> CellMask:
    mask = CellMask(site.shape)
    mask.add(cells.astype(np.int32))
    return mask


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
    earlier = _earlier_lifts(site, preparation, list(proven.values()))
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
        tuple(_way_of_motion(site, *way) for way in ways),
        seconds_in(motion, PhaseName.HOOK_ON),
        seconds_in(motion, PhaseName.SET, PhaseName.RELEASE),
    )


def _way_of_motion(site: Site, lift: Lift, motion: LiftMotion) -> Way:
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
        stored_m = site.frame.voxel_size_m * lift.place.reach_vox(part)
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
    result = np.zeros((count + 1, count))
    for to in range(count):
        result[0, to] = point_to_point_s(crane, places[0], picks[to], tops_m[to])
        for n in range(count):
            result[n + 1, to] = point_to_point_s(crane, places[n], picks[to], max(tops_m[n], tops_m[to]))
    for n, (_, motion) in enumerate(pairwise(motions)):
        result[n + 1, n + 1] = seconds_in(motion, PhaseName.APPROACH)
    return result
