"""How far the plan lowers parts straight down at least, whatever the order.

In transit a part keeps the clearance from everything that is there. So it comes straight down, as the plan tries first,
from that clearance above what it is set on, which is there before it; and of two parts next to each other, the later
one from that clearance above the earlier one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.planning.occupancy import target_cells
from bimvox.site.component import Component
from bimvox.site.site import HeadingRule, Site
from bimvox.site.transit_clearance import margin_vox


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


def not_lowered(count: int) -> Lowered:
    """Return that no part is lowered straight down."""
    return Lowered(np.zeros(count), np.zeros(count), np.zeros((0, 2), np.int64))


def lowered(site: Site, components: Sequence[Component]) -> Lowered:
    """Return how far parts are lowered; not at all where loads turn with the jib: their last moves differ."""
    margin, cell_m = margin_vox(site), site.frame.voxel_size_m
    if site.rules.heading is HeadingRule.WITH_JIB or not margin:
        return not_lowered(len(components))
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
    found = np.zeros(len(own), np.int64)
    for n, (on_plan, bottoms, _) in enumerate(own):
        for gap in range(margin):
            below = bottoms - 1 - gap
            if taken[(*on_plan[below >= 0].T, below[below >= 0])].any():
                found[n] = margin - gap
                break
    return found


def _beside(own: Sequence[_Columns], always: NDArray[np.int64], margin: int) -> dict[tuple[int, int], tuple[int, int]]:
    """Return by how many cells each of two parts next to each other is lowered if it is the later one.

    Only where either would be lowered further than always.
    """
    corners = np.array([[one.on_plan.min(axis=0), one.on_plan.max(axis=0)] for one in own]).reshape(-1, 2, 2)
    over = [_tops_around(one, margin) for one in own]
    found: dict[tuple[int, int], tuple[int, int]] = {}
    for a, (low, high) in enumerate(corners):
        near = ((low <= corners[:, 1] + margin) & (corners[:, 0] <= high + margin)).all(axis=1)
        for b in (np.flatnonzero(near[a + 1 :]) + a + 1).tolist():
            ways = _onto(own[a], over[b], margin), _onto(own[b], over[a], margin)
            if ways[0] > always[a] and ways[1] > always[b]:
                found[a, b] = ways
    return found


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
