"""How far parts are lowered straight down: what no plan does less, and what is known of two next to each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.library.set_up_search.last_moves import lowered
from bimvox.records.lift import Lift
from bimvox.site.component import Component
from bimvox.site.shape import shape_of
from bimvox.site.site import HeadingRule, Site
from bimvox.site.transit_clearance import margin_vox


def straight_down_vox(lift: Lift) -> int:
    """Return the unit moves straight down at the end of a path."""
    assert lift.path_vox is not None
    moves = np.diff(lift.path_vox, axis=0)
    others = np.flatnonzero((moves != (0, 0, -1)).any(axis=1))
    return len(moves) - (int(others[-1]) + 1 if len(others) else 0)


def box(part: Component, index: int, low: tuple[int, int, int], size: tuple[int, int, int]) -> Component:
    """Return a part with the shape of a box at a place, as wide in every cell as said."""
    shape, _ = shape_of(np.argwhere(np.ones(size, np.bool_)))
    return replace(part, index=index, id=f"box {index}", shape=shape, target_vox=low)


def test_no_lift_of_a_plan_is_lowered_less_and_of_each_pair_one_as_far_as_beside_the_other(
    site: Site, lifts: tuple[Lift, ...]
) -> None:
    parts, size_m = [site.components[lift.component] for lift in lifts], site.frame.voxel_size_m
    found = lowered(site, parts)
    down_m = np.array([straight_down_vox(lift) for lift in lifts]) * size_m
    assert (found.always_m > 0.0).all()
    assert (down_m >= found.always_m - 1e-9).all()
    assert len(found.pairs)
    assert len(np.unique(found.pairs)) == found.pairs.size
    assert ((down_m >= found.beside_m - 1e-9)[found.pairs].any(axis=1)).all()


def test_a_part_comes_down_from_the_clearance_above_the_ground_or_a_part_and_the_later_of_two_from_above_the_other(
    site: Site,
) -> None:
    margin, size_m, part = margin_vox(site), site.frame.voxel_size_m, site.components[0]
    assert margin > 1
    # On the ground, on that, high above, and next to the first, half as high; the last one is far from all.
    boxes = [
        box(part, 0, (5, 5, 1), (2, 2, 8)),
        box(part, 1, (5, 5, 9), (2, 2, 1)),
        box(part, 2, (5, 5, 11 + margin), (2, 2, 1)),
        box(part, 3, (6 + margin, 5, 1), (2, 2, 4)),
        box(part, 4, (12 + 2 * margin, 5, 2), (2, 2, 2)),
    ]
    cells = 14 + 2 * margin
    wide = replace(
        site, components=tuple(boxes), blockers=(), labels=np.zeros((cells, 10, 14 + margin), site.labels.dtype)
    )
    found = lowered(wide, boxes)
    assert (found.always_m / size_m).round().tolist() == [margin, margin, 0, margin, margin - 1]
    assert found.pairs.tolist() == [[0, 3]]
    assert (found.beside_m / size_m).round().tolist() == [margin + 4, margin, 0, margin + 8, margin - 1]
    turning = replace(wide, rules=replace(site.rules, heading=HeadingRule.WITH_JIB))
    nothing = lowered(turning, boxes)
    assert not nothing.always_m.any()
    assert not nothing.pairs.size
