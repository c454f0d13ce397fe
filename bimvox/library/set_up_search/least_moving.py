"""A time in which no hammerhead moves less, from any place that is looked at, whatever the order and the paths.

Each part comes from the best place of the yard in which it fits, and the empty hook returns to the nearest one. What
every motion of a plan takes is counted: a load is raised by a cell by itself, a move across is shaped by at least
``STRETCH[0]`` of half a period, which is shorter only if the hook climbs meanwhile, up and down take turns. Below the
transit clearance, a load only goes straight up and straight down (``last_moves.py``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.crane.kinematics import hoist_limits
from bimvox.crane.reach import distances_m, radii_for_m
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.crane.travel import Travel, rest_to_rest_s
from bimvox.motion.steady import STRETCH
from bimvox.motion.swing import GRAVITY_M_S2
from bimvox.planning.occupancy import target_cells
from bimvox.site.collision import margin_vox
from bimvox.site.component import Component
from bimvox.site.config.site_config import Polygon
from bimvox.site.set_ups import LiftWork, slews, winches
from bimvox.site.site import HeadingRule, Site

# How far the plan lowers parts straight down at least, whatever the order.
#
# In transit a part keeps the clearance from everything that is there. So it comes straight down, as the plan tries
# first, from that clearance above what it is set on, which is there before it; and of two parts next to each other, the
# later one from that clearance above the earlier one.


@dataclass(frozen=True, slots=True, eq=False)
class Lowered:
    """How far parts are lowered straight down at last.

    Attributes:
        always_m: (N,) at least, whatever is there.
        beside_m: (N,) if the other part of its pair is there before it.
        pairs: (K, 2) parts next to each other; each part is in one pair at most.
    """

    always_m: NDArray[np.float64]
    beside_m: NDArray[np.float64]
    pairs: NDArray[np.int64]


def _not_lowered(count: int) -> Lowered:
    """Return that no part is lowered straight down."""
    return Lowered(np.zeros(count), np.zeros(count), np.zeros((0, 2), np.int64))


def lowered(site: Site, components: Sequence[Component]) -> Lowered:
    """Return how far parts are lowered; not at all where loads turn with the jib: their last moves differ."""
    margin, cell_m = margin_vox(site), site.frame.voxel_size_m
    if site.rules.heading is HeadingRule.WITH_JIB or not margin:
        return _not_lowered(len(components))
    own = [_columns_of(part) for part in components]
    always = _above_what_is_below(site, own, margin)
    beside = _beside(own, always, margin)
    # Any pairs are a bound; those first that lower furthest.
    found, pairs, left = always.copy(), [], set(range(len(own)))
    for a, b in sorted(beside, key=lambda pair: (-min(beside[pair]), pair)):
        if a in left and b in left:
            left -= {a, b}
            pairs.append((a, b))
            found[a], found[b] = beside[a, b]
    always_m, beside_m = always.astype(np.float64) * cell_m, found.astype(np.float64) * cell_m
    return Lowered(always_m, beside_m, np.array(pairs, np.int64).reshape(-1, 2))


class _Columns(NamedTuple):
    """The columns of a part at its place: (C, 2) on plan, and (C,) its lowest cells, and one above its highest."""

    on_plan: NDArray[np.int64]
    bottoms: NDArray[np.int64]
    tops: NDArray[np.int64]


def _columns_of(part: Component) -> _Columns:
    cells = target_cells(part).astype(np.int64)
    on_plan, which = np.unique(cells[:, :2], axis=0, return_inverse=True)
    bottoms, tops = np.full(len(on_plan), np.iinfo(np.int64).max), np.zeros(len(on_plan), np.int64)
    np.minimum.at(bottoms, which.ravel(), cells[:, 2])
    np.maximum.at(tops, which.ravel(), cells[:, 2] + 1)
    return _Columns(on_plan, bottoms, tops)


def _above_what_is_below(site: Site, own: Sequence[_Columns], margin: int) -> NDArray[np.int64]:
    """Return (N,) cells by which each part is lowered onto the ground, what exists already, or another part."""
    taken = np.arange(site.shape[2]) <= site.ground_vox[:, :, None]
    existing = [blocker.cells for blocker in site.blockers if blocker.kind == "structure"]
    placed = [target_cells(part) for part in site.components]
    for cells in (*existing, *placed):
        taken[tuple(cells.T)] = True
    result = np.zeros(len(own), np.int64)
    for n, (on_plan, bottoms, _) in enumerate(own):
        for gap in range(margin):
            below = bottoms - 1 - gap
            if taken[(*on_plan[below >= 0].T, below[below >= 0])].any():
                result[n] = margin - gap
                break
    return result


def _beside(own: Sequence[_Columns], always: NDArray[np.int64], margin: int) -> dict[tuple[int, int], tuple[int, int]]:
    """Return by how many cells each of two parts next to each other is lowered if it is the later one.

    Only where either would be lowered further than always.
    """
    corners = np.array([[one.on_plan.min(axis=0), one.on_plan.max(axis=0)] for one in own]).reshape(-1, 2, 2)
    over = [_tops_around(one, margin) for one in own]
    result: dict[tuple[int, int], tuple[int, int]] = {}
    for a, (low, high) in enumerate(corners):
        near = ((low <= corners[:, 1] + margin) & (corners[:, 0] <= high + margin)).all(axis=1)
        for b in (np.flatnonzero(near[a + 1 :]) + a + 1).tolist():
            ways = _onto(own[a], over[b], margin), _onto(own[b], over[a], margin)
            if ways[0] > always[a] and ways[1] > always[b]:
                result[a, b] = ways
    return result


def _tops_around(one: _Columns, margin: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest column within a margin of a part, and (X, Y) from there the highest of its tops that near."""
    from scipy.ndimage import maximum_filter

    low = one.on_plan.min(axis=0) - margin
    tops = np.zeros(one.on_plan.max(axis=0) + margin + 1 - low, np.int64)
    tops[tuple((one.on_plan - low).T)] = one.tops
    return low, maximum_filter(tops, 2 * margin + 1, mode="constant")


def _onto(later: _Columns, around: tuple[NDArray[np.int64], NDArray[np.int64]], margin: int) -> int:
    """Return by how many cells a part is lowered next to an earlier one, given its tops; 0 if it is not near it."""
    low, tops = around
    at = later.on_plan - low
    inside = ((at >= 0) & (at < tops.shape)).all(axis=1)
    top, bottom = tops[tuple(at[inside].T)], later.bottoms[inside]
    return max(0, int((top - bottom + margin)[top > 0].max(initial=0)))


_CLIMBS_M = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 1000.0)
"""How far the hook climbs above the higher end of a move; each step of the table is bounded by its ends."""
_SHORTEST_M = 0.5
_COARSE, _FINE = 150, 2500
"""Squares that cover the yard: for all places of the mast, and for the best ones."""
_AT_ONCE, _FEW = 100, 8
"""Places of a mast that are in memory at once, with the coarse and with the fine squares."""
_MOST_FINE = 1200
"""Places of a mast that are looked at with the fine squares."""


@dataclass(frozen=True, slots=True, eq=False)
class Loose:
    """What is not known exactly of a plan, and what it takes in any case.

    Attributes:
        places_m: How far the hook may be from the place that is given for a part, on plan.
        yard_m: The same from some place of the yard.
        lies_m: (N,) how high each part may lie in the yard.
        raised_m: How far a load is raised before anything else.
        clearance_m: Height of a load above the ground below which it goes straight up.
        lowered: How far each part is lowered straight down at last; None: not at all.
        swings: Whether moves are shaped against the swing of loads.
        turn_s: What it takes at least if a part lies turned by a quarter.
    """

    places_m: float = 0.0
    yard_m: float = 0.0
    lies_m: NDArray[np.float64] | float = 0.0
    raised_m: float = 0.0
    clearance_m: float = 0.0
    lowered: Lowered | None = None
    swings: bool = False
    turn_s: float = 0.0


Fits = Callable[[NDArray[np.float64], float], NDArray[np.bool_]]
"""(2, N, P) whether each part lies in the yard, hook within a distance of (P, 2) points: as built, and turned."""


def least_of_all_s(
    stands: Sequence[tuple[TowerCrane, NDArray[np.float64]]],
    work: LiftWork,
    yard: Sequence[Polygon],
    loose: Loose,
    fits: Fits | None = None,
) -> float:
    """Return the least time of cranes, each on its (B, 2) places; 0 without any.

    Args:
        stands: The cranes as used; their bases are ignored.
        work: The parts; its places of the yard are ignored.
        yard: The yard.
        loose: What is not known exactly; its ``yard_m`` is what a hook may be outside of the yard.
        fits: Where each part fits; None: anywhere.
    """
    (coarse, near_m), (fine, nearer_m) = (_squares(yard, loose.yard_m, most) for most in (_COARSE, _FINE))
    rough, exact = replace(loose, yard_m=near_m), replace(loose, yard_m=nearer_m)
    anywhere, closely = (
        None if fits is None else fits(points, m) for points, m in ((coarse, near_m), (fine, nearer_m))
    )
    pieces = [
        (crane, bases_m[first : first + _AT_ONCE])
        for crane, bases_m in stands
        for first in range(0, len(bases_m), _AT_ONCE)
    ]
    found = [least_moving_s(crane, bases_m, replace(work, yard_m=coarse), rough, anywhere) for crane, bases_m in pieces]
    if not found:
        return 0.0
    seconds, least_s = np.concatenate(found), np.inf
    which = np.concatenate([np.full(len(bases_m), n) for n, (_, bases_m) in enumerate(pieces)])
    bases_m = np.concatenate([bases_m for _, bases_m in pieces])
    ascending = np.argsort(seconds, kind="stable")
    # The bound of all places is settled by the few whose rough bound is the least.
    for first in range(0, len(ascending), _FEW):
        some = ascending[first : first + _FEW]
        if seconds[some[0]] >= least_s or first >= _MOST_FINE:
            return float(min(least_s, seconds[some[0]]))
        for n in np.unique(which[some]).tolist():
            own = bases_m[some[which[some] == n]]
            closer_s = least_moving_s(pieces[n][0], own, replace(work, yard_m=fine), exact, closely)
            least_s = min(least_s, float(closer_s.min()))
    return float(least_s)


def least_moving_s(
    crane: TowerCrane,
    bases_m: NDArray[np.float64],
    work: LiftWork,
    loose: Loose = Loose(),
    fits: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Return for (B, 2) bases a time in which no order and no yard place lets the crane move less.

    Parts that it does not carry take none.

    Args:
        crane: The crane as used, on its mast; its base is ignored.
        bases_m: (B, 2) places of its mast.
        work: The parts, with every place of the yard.
        loose: What is not known exactly.
        fits: (2, N, P) at which places of the yard each part may be picked, as built and turned; None: anywhere.
    """
    if fits is None:
        fits = np.ones((2, len(work.places_m), len(work.yard_m)), np.bool_)
    lies_m = np.broadcast_to(np.asarray(loose.lies_m, np.float64), work.tops_m.shape)
    back_m = np.maximum(work.tops_m - (work.heights_m + lies_m).max(initial=0.0), 0.0)
    points_m = np.concatenate([work.places_m, work.yard_m])
    longest_m = float(max(1.0, distances_m(bases_m, points_m).max(initial=0.0), work.tops_m.max(initial=0.0)))
    across_s, nearest_s, carried = _across_s(crane, bases_m, work, loose, fits, longest_m)
    empty, *loaded = winches(crane, work, longest_m)
    back_s = np.full(across_s.shape, np.inf)
    for climb_m, higher_m in pairwise(_CLIMBS_M):
        shaped_s = _shaped_s(crane.jib_height_m - work.tops_m - crane.sling_m - higher_m, loose) * (nearest_s > 0.0)
        hoists_s = empty.hoisting_s(np.array([climb_m])) + empty.hoisting_s(back_m + climb_m)
        back_s = np.minimum(back_s, np.maximum(nearest_s + shaped_s, hoists_s))
    lowered = loose.lowered or _not_lowered(len(lies_m))
    there_s, beside_s = (
        _there_s(crane, work, loose, across_s, loaded, down_m) * carried
        for down_m in (lowered.always_m, lowered.beside_m)
    )
    back_s *= carried
    # Of each pair of parts next to each other, one is the later one.
    later_s = (beside_s - there_s)[:, lowered.pairs].min(axis=2).sum(axis=1)
    total_s: NDArray[np.float64] = there_s.sum(axis=1) + later_s + back_s.sum(axis=1) - back_s.max(axis=1, initial=0.0)
    return total_s


def _there_s(
    crane: TowerCrane,
    work: LiftWork,
    loose: Loose,
    across_s: NDArray[np.float64],
    winches_of: Sequence[Travel],
    down_m: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return (B, N) the least time of each load, lowered straight down at last by (N,) at least."""
    lies_m = np.broadcast_to(np.asarray(loose.lies_m, np.float64), work.tops_m.shape)
    ups_m = np.maximum(work.tops_m - work.heights_m - lies_m, 0.0)
    gears = {kg: hoist_limits(crane, kg) for kg in set(work.masses_kg.tolist())}
    straight_up_m = np.maximum(loose.clearance_m - lies_m - loose.raised_m, 0.0)
    alone_s = np.array(
        [
            rest_to_rest_s(loose.raised_m, gears[kg]) + _from_rest_s(up_m, gears[kg]) + _from_rest_s(last_m, gears[kg])
            for kg, up_m, last_m in zip(work.masses_kg.tolist(), straight_up_m.tolist(), down_m.tolist(), strict=True)
        ]
    )
    hangs_m = crane.jib_height_m - work.tops_m + 0.5 * work.heights_m
    result = np.full(across_s.shape, np.inf)
    for climb_m, higher_m in pairwise(_CLIMBS_M):
        over_m = np.maximum(climb_m, down_m)
        up_m = np.maximum(ups_m + over_m, loose.raised_m)
        hoist_s = [
            one.hoisting_s(np.array(ways_m)).sum() for one, *ways_m in zip(winches_of, up_m, over_m, strict=True)
        ]
        shaped_s = _shaped_s(hangs_m - higher_m, loose) * (across_s > 0.0)
        result = np.minimum(result, np.maximum(across_s + shaped_s + alone_s, np.array(hoist_s)))
    return result


def _across_s(
    crane: TowerCrane,
    bases_m: NDArray[np.float64],
    work: LiftWork,
    loose: Loose,
    fits: NDArray[np.bool_],
    longest_m: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return (B, N) the least time across from where a part may be picked, and from anywhere; and whether it can be."""
    radius_m, yard_radius_m = distances_m(bases_m, work.places_m), distances_m(bases_m, work.yard_m)
    least_m, most_m = radii_for_m(crane, work.masses_kg).T
    travel = Travel(replace(crane, base_m=(0.0, 0.0, 0.0)), longest_m)
    # Moved by so much, a point at a radius turns by no more than this.
    turns, yard_turns = (
        np.arcsin(np.minimum(aside_m / np.maximum(r, 1e-9), 1.0))
        for aside_m, r in ((loose.places_m, radius_m), (loose.yard_m, yard_radius_m))
    )
    yard_slews, place_slews = slews(bases_m, work.yard_m), slews(bases_m, work.places_m)
    across_s, nearest_s = np.zeros(radius_m.shape), np.zeros(radius_m.shape)
    carried = (radius_m >= least_m - loose.places_m) & (radius_m <= most_m + loose.places_m)
    picked = fits.any(axis=(0, 1))
    for n in range(len(work.places_m)):
        turn = np.abs(np.remainder(yard_slews - place_slews[:, n, None] + pi, 2.0 * pi) - pi)
        turn = np.maximum(turn - turns[:, n, None] - yard_turns, 0.0)
        radial_m = np.abs(yard_radius_m - radius_m[:, n, None])
        seconds = travel.across_s(turn, np.maximum(radial_m - loose.places_m - loose.yard_m, 0.0))
        able = (yard_radius_m >= least_m[n] - loose.yard_m) & (yard_radius_m <= most_m[n] + loose.yard_m)
        nearest_s[:, n] = seconds[:, picked].min(axis=1)
        as_built_s, turned_s = (np.where(able & one[n], seconds, np.inf).min(axis=1) for one in fits)
        across_s[:, n] = np.minimum(as_built_s, turned_s + loose.turn_s)
        carried[:, n] &= np.isfinite(across_s[:, n])
    return np.where(np.isfinite(across_s), across_s, 0.0), nearest_s, carried


def _shaped_s(lengths_m: NDArray[np.float64], loose: Loose) -> NDArray[np.float64]:
    """Return what shaping a move takes at least with pendulums that are no shorter than these."""
    if not loose.swings:
        return np.zeros(lengths_m.shape)
    shaped_s: NDArray[np.float64] = STRETCH[0] * pi * np.sqrt(np.maximum(lengths_m, _SHORTEST_M) / GRAVITY_M_S2)
    return shaped_s


def _from_rest_s(distance_m: float, limits: AxisLimits) -> float:
    """Return a time in which a hook goes no further from rest, or to rest; its jerk does not count."""
    speeding_up_m = 0.5 * limits.rate**2 / limits.acceleration
    if distance_m <= speeding_up_m:
        return sqrt(2.0 * distance_m / limits.acceleration)
    return (distance_m - speeding_up_m) / limits.rate + limits.rate / limits.acceleration


def _squares(yard: Sequence[Polygon], around_m: float, most: int) -> tuple[NDArray[np.float64], float]:
    """Return the (P, 2) middles of about so many squares that cover a yard, and how far a point of one may be."""
    area = shapely.union_all([shapely.Polygon(one) for one in yard]).buffer(around_m)
    if area.is_empty:
        return np.zeros((0, 2)), 0.0
    size_m = float(np.sqrt(area.area / most))
    x0, y0, x1, y1 = area.bounds
    x, y = np.meshgrid(*(np.arange(low + 0.5 * size_m, high + size_m, size_m) for low, high in ((x0, x1), (y0, y1))))
    half_m = 0.5 * size_m
    touched = shapely.intersects(area, shapely.box(x - half_m, y - half_m, x + half_m, y + half_m))
    return np.column_stack([x[touched], y[touched]]), half_m * 2.0**0.5
