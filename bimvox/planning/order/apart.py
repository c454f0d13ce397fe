"""The separation of several cranes as the estimate of an order sees it (rule R4 of ``cranes.schedule``).

While slings are taken off one part, another crane picks the next one and brings it. Both stay apart if it meets the
first crane, which stands over the part that it has set, at no time of its lift. Otherwise it has to wait until the
first crane has left. The solids are those of the schedule; the lift goes straight up, across and down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOAD_HALF,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    ROPE_HALF,
    SLEW_HIGH,
    SLEW_LOW,
    meet,
    numbers_of,
)
from bimvox.crane.kinematics import Axes
from bimvox.crane.outline import outline_of
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

_ACROSS = 7
_STEPS = _ACROSS + 3
"""Steps of a lift: hooking on, up, across, down."""
_SWING_M = 0.2
_LEAVES_S = 20.0
"""How long a crane needs to make room after the slings of its part are off."""


class Apart(NamedTuple):
    """What decides whether cranes come too near each other.

    Attributes:
        outlines: (K, 15) the cranes.
        stands: (K, N, 9) each crane over the place of each part; columns as in ``crane.meeting``.
        ways: (K, N, S, 9) each step of a lift.
        begins_s: (K, N, S) when it begins, from hooking on.
        separation_m: The distance that they keep.
        meets_s: (K, K - 1, N, N) float32 when the lift of part j by another crane than a first meets crane a over part
            i; infinite if it never does, NaN if nobody has asked yet. Most pairs never are next to each other.
    """

    outlines: NDArray[np.float64]
    stands: NDArray[np.float64]
    ways: NDArray[np.float64]
    begins_s: NDArray[np.float64]
    separation_m: float
    meets_s: NDArray[np.float32]


NOTHING_APART = Apart(
    np.zeros((0, 15)), np.zeros((0, 0, COLUMNS)), np.zeros((0, 0, 0, COLUMNS)), np.zeros((0, 0, 0)), 0.0,
    np.zeros((0, 0, 0, 0), np.float32),
)  # fmt: skip
"""Of cranes that nobody keeps apart."""


def apart_of(
    site: Site, axes: Sequence[tuple[Axes, Axes]], over_m: NDArray[np.float64], spans_s: NDArray[np.float64]
) -> Apart:
    """Return what keeps the cranes of a site apart; for one crane without parts.

    Args:
        site: The site.
        axes: Per crane the hook's axes at the places of all parts, and at the picks.
        over_m: (N,) how high the hook must go on the way.
        spans_s: (K, 4, N) how long hooking on, up, across and down take.
    """
    cranes, count = len(site.cranes), len(site.components) if site.has_several_cranes else 0
    stands, ways = np.zeros((cranes, count, COLUMNS)), np.zeros((cranes, count, _STEPS, COLUMNS))
    begins_s = np.zeros((cranes, count, _STEPS))
    for k in range(cranes) if count else ():
        stands[k], ways[k] = _rows(site, k, axes[k], over_m)
        on_s, up_s, across_s, _ = spans_s[k]
        begins_s[k, :, 1:] = on_s[:, None]
        begins_s[k, :, 2:] += up_s[:, None] + across_s[:, None] * np.arange(_ACROSS + 1) / _ACROSS
    outlines = np.array([numbers_of(outline_of(crane)) for crane in site.cranes])
    meets_s = np.full((cranes, cranes - 1, count, count), np.nan, np.float32)
    return Apart(outlines, stands, ways, begins_s, site.rules.crane_separation_m, meets_s)


def _rows(
    site: Site, number: int, axes: tuple[Axes, Axes], over_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (N, 9) a crane over the places of parts, and (N, S, 9) the steps of their lifts."""
    (slew, radius, at_m), (pick_slew, pick_radius, pick_m) = axes
    parts, cell_m = site.components, site.frame.voxel_size_m
    size_m = cell_m * np.array([part.shape.size_vox for part in parts])
    sling_m = np.array([crane_for(site, site.cranes[number], part).sling_m for part in parts])
    hook_m = cell_m * (np.array([part.hook_line_vox[:2] for part in parts]) + 0.5)
    half_m = np.hypot(*np.maximum(hook_m, size_m[:, :2] - hook_m).T)
    top_m = np.maximum(over_m, np.maximum(at_m, pick_m))
    turn = np.remainder(slew - pick_slew + np.pi, 2.0 * np.pi) - np.pi
    rows = np.zeros((len(parts), _STEPS + 1, COLUMNS))  # the last one is over its place
    for step in range(_STEPS + 1):
        ends = [min(max(step - 2 + more, 0), _ACROSS) / _ACROSS for more in (0, 1)] if step > 1 else [0.0, 0.0]
        slews = np.stack([pick_slew + turn * end for end in ends])
        radii = np.stack([pick_radius + (radius - pick_radius) * end for end in ends])
        low_m = pick_m if step < 2 else at_m if step >= _STEPS - 1 else top_m
        rows[:, step, SLEW_LOW], rows[:, step, SLEW_HIGH] = slews.min(axis=0), slews.max(axis=0)
        rows[:, step, RADIUS_LOW], rows[:, step, RADIUS_HIGH] = radii.min(axis=0), radii.max(axis=0)
        rows[:, step, HOOK_LOW] = sling_m + low_m
        rows[:, step, HOOK_HIGH] = sling_m + (top_m if 0 < step < _STEPS else low_m)
        rows[:, step, LOWEST] = low_m - size_m[:, 2]
        rows[:, step, LOAD_HALF] = np.hypot(half_m, size_m[:, 2]) if step == 0 else half_m  # upended
        rows[:, step, ROPE_HALF] = _SWING_M
    return rows[:, _STEPS].copy(), rows[:, :_STEPS].copy()


@kernel
def waits_s(apart: Apart, one: tuple[int, int], other: tuple[int, int]) -> float:
    """Return how much later than the slings of a part are off the lift of another part may begin, by another crane.

    Args:
        apart: What keeps them apart.
        one: The crane that has set a part, and the part.
        other: The crane that lifts another part, and that part.
    """
    a, i = one
    b, j = other
    if apart.meets_s.size == 0:
        return -np.inf
    which = b - 1 if b > a else b
    meets_s = apart.meets_s[a, which, i, j]
    if np.isnan(meets_s):
        meets_s = np.inf
        for step in range(_STEPS):
            way = apart.ways[b, j, step]
            if meet(apart.outlines[a], apart.stands[a, i], apart.outlines[b], way, apart.separation_m):
                meets_s = apart.begins_s[b, j, step]
                break
        apart.meets_s[a, which, i, j] = meets_s
    return float(_LEAVES_S - meets_s)
