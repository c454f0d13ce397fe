"""Whether two cranes may come too near each other within the bounds of a span each (EN 17076: anti-collision).

A span is not a point in time: everything that a part sweeps between the bounds counts. For two strips that turn about
two axes, the least distance is found by halving the ranges of their angles; a half is discarded when no pose in it can
be near. Nothing is sampled.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.outline import CraneOutline

PARTS = ("jib", "counter-jib", "mast", "load", "rope")
SLEW_LOW, SLEW_HIGH, RADIUS_LOW, RADIUS_HIGH, LOWEST, HOOK_LOW, HOOK_HIGH, LOAD_HALF, ROPE_HALF = range(9)
"""Columns of a span: angles (rad), radii of the hook (m), lowest point of the load, heights of the hook, and radii of
the discs that contain the load and the rope on plan, including swing (m)."""
COLUMNS = 9

TOLERANCE_M = 0.05
"""Poses may count as too near if their distance is above the limit by no more than this."""


def numbers_of(outline: CraneOutline) -> NDArray[np.float64]:
    """Return the outline as an array for kernels."""
    return np.array([*outline.solids_m, float(outline.luffs)])


@kernel
def meet(
    outline_a: NDArray[np.float64],
    row_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    row_b: NDArray[np.float64],
    separation_m: float,
) -> bool:
    """Return whether two cranes may come too near each other within the bounds of a row each; see ``numbers_of``."""
    parts_a, parts_b = np.empty((5, 5)), np.empty((5, 5))
    parts_of(outline_a, row_a, parts_a)
    parts_of(outline_b, row_b, parts_b)
    one = pair_too_near(outline_a, row_a, parts_a, outline_b, row_b, parts_b, separation_m, TOLERANCE_M)[0]
    return bool(one >= 0)


@kernel
def clear_of_one(
    outline_a: NDArray[np.float64],
    rows_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    separation_m: float,
) -> NDArray[np.bool_]:
    """Return (N,) whether a crane in each of (N, 9) rows is clear of another one in at least one of (M, 9) rows."""
    clear = np.zeros(rows_a.shape[0], np.bool_)
    for i in range(rows_a.shape[0]):
        for j in range(rows_b.shape[0]):
            if not meet(outline_a, rows_a[i], outline_b, rows_b[j], separation_m):
                clear[i] = True
                break
    return clear


@kernel
def parts_of(outline: NDArray[np.float64], row: NDArray[np.float64], parts: NDArray[np.float64]) -> None:
    """Write the five parts in one span: inner and outer radius, half width, lowest, highest."""
    luffs = outline[14] > 0.0
    end = min(outline[2], row[RADIUS_HIGH]) if luffs else outline[2]
    parts[0] = 0.0, end, outline[3], outline[4], outline[5]
    parts[1] = -outline[6], 0.0, outline[7], outline[8], outline[9]
    parts[2] = 0.0, 0.0, outline[10], outline[11], outline[12]
    parts[3] = row[RADIUS_LOW], row[RADIUS_HIGH], row[LOAD_HALF], row[LOWEST], row[HOOK_HIGH]
    parts[4] = row[RADIUS_LOW], row[RADIUS_HIGH], row[ROPE_HALF], row[HOOK_LOW], outline[13]


@kernel
def pair_too_near(
    outline_a: NDArray[np.float64],
    row_a: NDArray[np.float64],
    parts_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    row_b: NDArray[np.float64],
    parts_b: NDArray[np.float64],
    separation_m: float,
    tolerance_m: float,
) -> tuple[int, int, float, float]:
    """Return the first pair of parts that is too near in a pair of spans, its distance and the required distance."""
    dx, dy = outline_b[0] - outline_a[0], outline_b[1] - outline_a[1]
    apart = np.sqrt(dx * dx + dy * dy)
    for one in range(5):
        for other in range(5):
            if (one == 2 and other > 1) or (other == 2 and one > 1):
                continue  # masts do not move; the collision rule keeps loads and ropes away from them
            if (
                parts_a[one, 3] - parts_b[other, 4] >= separation_m
                or parts_b[other, 3] - parts_a[one, 4] >= separation_m
            ):
                continue
            needed = separation_m + parts_a[one, 2] + parts_b[other, 2]
            reach_a = max(abs(parts_a[one, 0]), abs(parts_a[one, 1]))
            reach_b = max(abs(parts_b[other, 0]), abs(parts_b[other, 1]))
            if apart - reach_a - reach_b >= needed:
                continue
            distance = _nearest(row_a, parts_a[one], row_b, parts_b[other], dx, dy, needed, tolerance_m)
            if distance < needed:
                return one, other, max(0.0, distance - parts_a[one, 2] - parts_b[other, 2]), separation_m
    return -1, -1, 0.0, 0.0


@kernel
def _nearest(
    row_a: NDArray[np.float64],
    part_a: NDArray[np.float64],
    row_b: NDArray[np.float64],
    part_b: NDArray[np.float64],
    dx: float,
    dy: float,
    needed: float,
    tolerance: float,
) -> float:
    """Return a distance of two turning strips below ``needed``; infinite if they never get so near.

    Branch and bound over the rectangle of both angles: no point moves further from the middle pose than its radius
    times half the range.
    """
    reach_a = max(abs(part_a[0]), abs(part_a[1]))
    reach_b = max(abs(part_b[0]), abs(part_b[1]))
    stack = np.empty((128, 4))
    stack[0] = row_a[SLEW_LOW], row_a[SLEW_HIGH], row_b[SLEW_LOW], row_b[SLEW_HIGH]
    count = 1
    while count > 0:
        count -= 1
        low_a, high_a, low_b, high_b = stack[count]
        mid_a, mid_b = 0.5 * (low_a + high_a), 0.5 * (low_b + high_b)
        ca, sa, cb, sb = np.cos(mid_a), np.sin(mid_a), np.cos(mid_b), np.sin(mid_b)
        distance = _segments_apart(
            part_a[0] * ca,
            part_a[0] * sa,
            part_a[1] * ca,
            part_a[1] * sa,
            dx + part_b[0] * cb,
            dy + part_b[0] * sb,
            dx + part_b[1] * cb,
            dy + part_b[1] * sb,
        )
        if distance < needed:
            return distance
        sweep_a, sweep_b = 0.5 * reach_a * (high_a - low_a), 0.5 * reach_b * (high_b - low_b)
        if distance - sweep_a - sweep_b >= needed:
            continue
        if sweep_a + sweep_b < tolerance or count + 2 > 128:
            return needed - 1e-9
        if sweep_a >= sweep_b:
            stack[count] = low_a, mid_a, low_b, high_b
            stack[count + 1] = mid_a, high_a, low_b, high_b
        else:
            stack[count] = low_a, high_a, low_b, mid_b
            stack[count + 1] = low_a, high_a, mid_b, high_b
        count += 2
    return np.inf


@kernel
def _segments_apart(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> float:
    """Return the distance of the segments a-b and c-d on plan."""
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    cross = ux * vy - uy * vx
    if abs(cross) > 1e-12:
        s = ((cx - ax) * vy - (cy - ay) * vx) / cross
        t = ((cx - ax) * uy - (cy - ay) * ux) / cross
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return 0.0
    least = _point_apart(ax, ay, cx, cy, vx, vy)
    least = min(least, _point_apart(bx, by, cx, cy, vx, vy))
    least = min(least, _point_apart(cx, cy, ax, ay, ux, uy))
    least = min(least, _point_apart(dx, dy, ax, ay, ux, uy))
    return float(np.sqrt(least))


@kernel
def _point_apart(px: float, py: float, ax: float, ay: float, ux: float, uy: float) -> float:
    """Return the squared distance of a point from the segment that starts at a along u."""
    length = ux * ux + uy * uy
    along = 0.0 if length <= 0.0 else min(max(((px - ax) * ux + (py - ay) * uy) / length, 0.0), 1.0)
    x, y = px - ax - along * ux, py - ay - along * uy
    return x * x + y * y
