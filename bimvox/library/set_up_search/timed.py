"""How long a crane moves with only its own mast and the swing of its loads in its way: a closer look at a place.

The quick estimate (:mod:`bimvox.site.set_ups`) lets each axis go as fast as it can. What tells the places of one
machine apart is rather where parts are picked (``picks.py``), and the swing: far out, or with the trolley running while
the jib slews, moves are driven slower until the load hangs at rest. So some ways up, across and down are laid over time
as for a plan (:mod:`bimvox.motion.steady`). They keep the plan's clearance: a load goes across only when it is clear of
the yard, wherever it passes it is above all that is built there by then (``across.py``), and it ends straight down.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise, starmap
from math import inf
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element
from bimvox.crane.kinematics import Axes, nearest_turn, pose_of, rigged
from bimvox.crane.reach import radii_for_m
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import Travel, rest_to_rest_s
from bimvox.errors import PlanningError
from bimvox.grid.frame import whole_cells
from bimvox.library.set_up_search.placed import Picks, around_m, taken_m2
from bimvox.motion.drive import SET_DOWN_M
from bimvox.motion.move import Move
from bimvox.motion.shortcut import stops_across
from bimvox.motion.steady import Swaying, SwingRules, steadied
from bimvox.motion.swing import PLANNED_RESIDUAL_M, Pendulum
from bimvox.motion.timeline import Timeline
from bimvox.site.collision import margin_vox
from bimvox.site.component import Component
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.means import Means
from bimvox.site.placement import MARGIN_VOX, site_extent
from bimvox.site.set_ups import LiftWork
from bimvox.site.site import Site, SwingRule


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """What the closer look knows of a site with one yard.

    Attributes:
        work: The parts in their erection sequence.
        picks: Where they are picked.
        around_m: (N, 2, 2) lowest and highest corner of each part on plan, as seen from its hook.
        bounds_m: (2, 2) lowest and highest corner of the site on plan; masts may stand outside.
        clearance_m: Of loads in transit, from everything.
        mast_m: The same from the sides of the mast.
        cell_m: Edge of a cell.
        swings: Whether moves are shaped against the swing of loads.
        turn_s: How long a load is turned by a quarter.
        others_m: (M, 2, 2) lowest and highest corner on plan of what no crane lifts.
        other_tops_m: (M,) its tops.
        others_before: (M,) the part before which it is there.
    """

    work: LiftWork
    picks: Picks
    around_m: NDArray[np.float64]
    bounds_m: NDArray[np.float64]
    clearance_m: float = 0.0
    mast_m: float = 0.0
    cell_m: float = 0.0
    swings: bool = True
    turn_s: float = 0.0
    others_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    other_tops_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    others_before: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def passed_m(self, n: int, hooks_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (S,) how high it is built by then where a part with its clearance passes, with its hook at (S, 2)."""
        there = self.others_before <= n
        lows_m, highs_m = (
            np.concatenate([self.work.places_m[:n] + self.around_m[:n, side], self.others_m[there, side]])
            for side in (0, 1)
        )
        tops_m = np.concatenate([self.work.tops_m[:n], self.other_tops_m[there]])
        low_m, high_m = (
            hooks_m + self.around_m[n, 0] - self.clearance_m,
            hooks_m + self.around_m[n, 1] + self.clearance_m,
        )
        near = ((lows_m < high_m.max(axis=0)) & (highs_m > low_m.min(axis=0))).all(axis=1)
        passed = ((lows_m[near] < high_m[:, None]) & (highs_m[near] > low_m[:, None])).all(axis=2)
        result: NDArray[np.float64] = (passed * tops_m[near]).max(axis=1, initial=0.0)
        return result

    def raised_to_turn_m(self, n: int, at_m: NDArray[np.float64]) -> float:
        """Return how high a part must be raised above (2,) its pick to be turned above all that is built by then."""
        low_m, high_m = (self.work.places_m[:n] + self.around_m[:n, side] for side in (0, 1))
        beyond_m = np.maximum(np.maximum(low_m - at_m, at_m - high_m), 0.0)
        round_m = np.hypot(*np.abs(self.around_m[n]).max(axis=0))
        top_m: float = self.work.tops_m[:n][np.hypot(*beyond_m.T) < round_m].max(initial=0.0)
        return max(self.cell_m, top_m)


def ways_on(
    site: Site,
    sequence: Sequence[Component],
    work: LiftWork,
    config: SiteConfig,
    building: Building,
) -> Ways:
    """Return the ways of a site.

    Args:
        site: With the rules of the site file.
        sequence: The parts in their sequence, also those that no crane lifts.
        work: Those that cranes lift, with their rooms in the yard.
        config: The site file, with the yard.
        building: In the site frame.
    """
    components = [part for part in sequence if part.means is Means.CRANE]
    cell_m, around = site.frame.voxel_size_m, around_m(components, site.frame.voxel_size_m)
    clearance_m = margin_vox(site) * cell_m
    frame, shape = site_extent(config, building)
    low_m = np.array(frame.origin_m[:2])
    lifts = np.cumsum([part.means is Means.CRANE for part in sequence]).tolist()
    before = {part.id: n for part, n in zip(sequence, lifts, strict=True)}
    others = [one for one in building.elements if _stands(one, {part.id for part in components})]
    yard = shapely.union_all([shapely.Polygon(one) for one in config.areas.yard or ()])
    bounds_m = np.array([one.mesh.bounds_m for one in others]).reshape(-1, 2, 3)
    return Ways(
        work,
        Picks(yard.area, work.yard_m, work.rooms, taken_m2(site, components)),
        around,
        np.stack([low_m + clearance_m, low_m + np.array(shape[:2]) * cell_m - clearance_m]),
        clearance_m,
        clearance_m + whole_cells(site.rules.clearance_m, cell_m) * cell_m,
        cell_m,
        site.rules.swing is SwingRule.SHAPED,
        site.rules.turn_s,
        bounds_m[:, :, :2],
        bounds_m[:, 1, 2],
        np.array([before.get(one.id, 0) for one in others], np.int64),
    )


def _stands(element: Element, lifted: Collection[str]) -> bool:
    """Return whether an element is in the way of loads, but not lifted itself."""
    return element.role in BUILT and element.id not in lifted


SAMPLES = 33
"""Positions of a move that are looked at."""
_DIAGONAL = 2.0**0.5


class _Across(NamedTuple):
    """A way across.

    Attributes:
        stops: Its stops.
        tops_m: For each move between them, (33,) how high it is built where the load passes; empty if it is not free.
    """

    stops: Sequence[CranePose]
    tops_m: Sequence[NDArray[np.float64]] = ()


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
    share = np.linspace(0.0, 1.0, SAMPLES)
    # Slewing passes columns whose middles lie further out.
    most_m = far_m - _DIAGONAL * ways.cell_m

    def tops_m(a: CranePose, b: CranePose) -> NDArray[np.float64] | None:
        slew = a.slew_rad + share * (b.slew_rad - a.slew_rad)
        radius = a.radius_m + share * (b.radius_m - a.radius_m)
        if abs(slew[-1] - slew[0]) * radius.max() > 2.0 * ways.cell_m and radius[1:-1].max() > most_m:
            return None
        x, y = radius * np.cos(slew), radius * np.sin(slew)
        if (x + low_x < west).any() or (x + high_x > east).any():
            return None
        if (y + low_y < south).any() or (y + high_y > north).any():
            return None
        hits = (x + low_x < mast_m) & (x + high_x > -mast_m) & (y + low_y < mast_m) & (y + high_y > -mast_m)
        return None if hits.any() else ways.passed_m(n, base_m + np.column_stack([x, y]))

    first: _Across | None = None
    for stops in stops_across(start, end):
        own = [*stops[:-1], replace(stops[-1], height_m=end.height_m)]
        first = first or _Across(own)
        found = []
        for a, b in pairwise(own):
            tops = tops_m(a, b)
            if tops is None:
                break
            found.append(tops)
        else:
            return first, _Across(own, found)
    assert first is not None
    return first, None


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

    ``ends``: where it is raised to, and its place; ``far_m``: the largest radius that it may have.
    """
    (raised, end), height_m = ends, float(ways.work.heights_m[n])
    hangs = Pendulum(crane.sling_m + 0.5 * height_m) if ways.swings else None
    clear_m, above_m = raised.height_m + ways.clearance_m, height_m + crane.sling_m + ways.clearance_m
    all_m = np.full(SAMPLES, float(ways.work.tops_m[: n + 1].max()))
    plainest, free = _ways_across(crane, ends, ways, n, far_m)
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

    ``stops``: the poses; those between the first and the last at any height; ``needs_m``: how high the hook must be
    along each move across; ``pendulum``: what hangs on the hook; None if its swing does not matter.
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
    result: NDArray[np.float64] = np.interp(shares, (along - along[0]) / move.difference[axis], time_s)
    return result
