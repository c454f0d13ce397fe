"""The level of every part, from the feet of columns and walls.

Columns and walls with feet at about the same height stand on one level. All other parts belong to the level whose
columns and walls carry them: their top is at the feet of the next level, or above the last. So a floor is finished
before what stands on it. What rests on columns or walls, also through other parts, is of no lower level than they. Feet
and tops are those of the bodies: neither a railing nor a bolt changes the level. Without columns and walls, the feet of
all parts make the levels.

The storeys of the file are not asked: some files keep a slab in the storey whose floor it is, others in the storey
below, and some state a wrong one.
"""

from __future__ import annotations

from collections.abc import Sequence
from graphlib import TopologicalSorter

import numpy as np

from bimvox.planning.order.body import body_m
from bimvox.site.component import Component
from bimvox.site.work import Work, kind_of

_STEP_M = 0.5
"""Feet further apart than this are on different levels."""
_SPAN_M = 1.5
"""The feet of one level differ by no more than this."""
_SUNK_M = 0.4
"""A column or wall may stand this much below the top of the floor that it stands on: in a pocket, or past its edge."""
_UPRIGHT = (Work.COLUMN, Work.WALL)


def uprights_of(components: Sequence[Component]) -> list[bool]:
    """Return which parts are columns or walls."""
    return [kind_of(component) in _UPRIGHT for component in components]


def levels_of(components: Sequence[Component], supports: Sequence[Sequence[int]]) -> list[int]:
    """Return the level of every part, from 0; -1 for what the lowest columns and walls stand on.

    Args:
        components: The parts.
        supports: Per part, those that it rests on; without cycles.
    """
    bodies_m, stands = [body_m(component.mesh) for component in components], uprights_of(components)
    if not any(stands):
        stands = [True] * len(components)
    bounds_m = _bounds_m([foot_m for (foot_m, _), is_upright in zip(bodies_m, stands, strict=True) if is_upright])
    lowest_m, highest_m = np.array(bounds_m).T
    levels, carried = [-1] * len(components), [-1] * len(components)
    for i in TopologicalSorter(dict(enumerate(supports))).static_order():
        foot_m, top_m = bodies_m[i]
        if stands[i]:
            levels[i] = carried[i] = int(np.searchsorted(lowest_m, foot_m, side="right")) - 1
        else:
            carried[i] = max((carried[j] for j in supports[i]), default=-1)
            levels[i] = max(int(np.searchsorted(highest_m, top_m - _SUNK_M, side="left")) - 1, carried[i])
    return levels


def _bounds_m(feet_m: Sequence[float]) -> list[tuple[float, float]]:
    """Return the lowest and the highest foot of each level, ascending."""
    found: list[tuple[float, float]] = []
    for foot_m in sorted(feet_m):
        if found and foot_m - found[-1][1] <= _STEP_M and foot_m - found[-1][0] <= _SPAN_M:
            found[-1] = (found[-1][0], foot_m)
        else:
            found.append((foot_m, foot_m))
    return found
