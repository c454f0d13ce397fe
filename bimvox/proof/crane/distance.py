"""The distance between two cranes in given poses: points along each crane against the solids of the other.

For proofs: it shares no code with the bounds-based conflict search (``crane.conflict``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.proof.crane.pendulum import GRAVITY_M_S2

POSE_COLUMNS = 9
"""The numbers of a pose: slew (rad), radius, height of the hook; box of the load about the hook (low x, high x, low y,
high y), how far below the hook it reaches, how far it swings (m)."""

_POINT_M = 0.5


@kernel
def least_distances(
    shape_a: NDArray[np.float64],
    rows_a: NDArray[np.float64],
    shape_b: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    separation_m: float,
) -> NDArray[np.float64]:
    """Return (M,) the least distance in plan between crane parts whose heights differ by less than a separation.

    Infinite if no heights are that close, or if the cranes are more than twice the separation apart.

    Args:
        shape_a: (18,) base x, y; jib's end, half width, lowest, highest; the same of the counter-jib, its length first;
            mast's circle, lowest, highest; rope's top; of a luffing jib pivot's radius and height, length, and 1.
        rows_a: (M, 9) poses of the first crane.
        shape_b: The second crane.
        rows_b: (M, 9) its poses at the same moments.
        separation_m: In height.
    """
    least = np.empty(rows_a.shape[0])
    points = np.empty((2048, 6))
    for n in range(rows_a.shape[0]):
        least[n] = np.inf
        if n > 0 and _is_still(rows_a, n) and _is_still(rows_b, n):
            least[n] = least[n - 1]
            continue
        if _are_far(shape_a, rows_a[n], shape_b, rows_b[n], separation_m):
            continue
        count = _points(shape_a, rows_a[n], points)
        least[n] = _to_solids(points[:count], shape_b, rows_b[n], separation_m)
        count = _points(shape_b, rows_b[n], points)
        least[n] = min(least[n], _to_solids(points[:count], shape_a, rows_a[n], separation_m))
    return least


@kernel
def _is_still(rows: NDArray[np.float64], n: int) -> bool:
    """Return whether a pose is the one before it."""
    moved = 0
    for k in range(rows.shape[1]):
        moved += rows[n, k] != rows[n - 1, k]
    return moved == 0


@kernel
def stopping_swing(
    axes: NDArray[np.float64], rates: NDArray[np.float64], rope_m: float, step_s: float
) -> NDArray[np.float64]:
    """Return (K,) how far a load, initially at rest, swings out up to each pose of a stop.

    Symplectic steps of ``q'' = g / l (p - q)``, p the suspension point.

    Args:
        axes: (K, 3) slew (rad), radius (m), height of the hook (m), ``step_s`` apart.
        rates: (3,) their initial rates: the load moves with the hook.
        rope_m: Height of the rope's top above the middle of a load whose hook is at height 0.
        step_s: Time between the poses.
    """
    swing = np.zeros(axes.shape[0])
    slew, radius = axes[0, 0], axes[0, 1]
    x, y = radius * np.cos(slew), radius * np.sin(slew)
    u = rates[1] * np.cos(slew) - rates[0] * y
    v = rates[1] * np.sin(slew) + rates[0] * x
    parts = 5
    h = step_s / parts
    furthest = 0.0
    for k in range(1, axes.shape[0]):
        for part in range(parts):
            share = (part + 1.0) / parts
            s = axes[k - 1, 0] + share * (axes[k, 0] - axes[k - 1, 0])
            r = axes[k - 1, 1] + share * (axes[k, 1] - axes[k - 1, 1])
            z = axes[k - 1, 2] + share * (axes[k, 2] - axes[k - 1, 2])
            stiffness = GRAVITY_M_S2 / max(rope_m - z, 0.5)
            px, py = r * np.cos(s), r * np.sin(s)
            u += h * stiffness * (px - x)
            v += h * stiffness * (py - y)
            x += h * u
            y += h * v
            furthest = max(furthest, np.sqrt((px - x) ** 2 + (py - y) ** 2))
        swing[k] = furthest
    return swing


@kernel
def _are_far(
    shape_a: NDArray[np.float64],
    row_a: NDArray[np.float64],
    shape_b: NDArray[np.float64],
    row_b: NDArray[np.float64],
    separation: float,
) -> bool:
    """Return whether the lines from counter-jib end to jib end, with everything around them, are far apart."""
    ends = np.empty((2, 4))
    about = 0.0
    for k in range(2):
        shape, row = (shape_a, row_a) if k == 0 else (shape_b, row_b)
        c, s = np.cos(row[0]), np.sin(row[0])
        out = max(shape[2], row[1])
        ends[k] = shape[0] - shape[6] * c, shape[1] - shape[6] * s, shape[0] + out * c, shape[1] + out * s
        load = np.sqrt(max(abs(row[3]), abs(row[4])) ** 2 + max(abs(row[5]), abs(row[6])) ** 2) + row[8]
        about += max(load, shape[3], shape[7], shape[10])
    ax, ay, bx, by = ends[0]
    cx, cy, dx, dy = ends[1]
    cross = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx)
    if abs(cross) > 1e-9:
        t = ((cx - ax) * (dy - cy) - (cy - ay) * (dx - cx)) / cross
        u = ((cx - ax) * (by - ay) - (cy - ay) * (bx - ax)) / cross
        if 0.0 <= t <= 1.0 and 0.0 <= u <= 1.0:
            return False
    least = min(
        min(_off_line(ax, ay, cx, cy, dx, dy), _off_line(bx, by, cx, cy, dx, dy)),
        min(_off_line(cx, cy, ax, ay, bx, by), _off_line(dx, dy, ax, ay, bx, by)),
    )
    return bool(least > about + 2.0 * separation)


@kernel
def _off_line(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance of a point from the line from a to b."""
    ux, uy = bx - ax, by - ay
    along = min(max(((x - ax) * ux + (y - ay) * uy) / max(ux * ux + uy * uy, 1e-12), 0.0), 1.0)
    return float(np.hypot(x - ax - along * ux, y - ay - along * uy))


@kernel
def _jib_band(shape: NDArray[np.float64], row: NDArray[np.float64], along: float) -> tuple[float, float]:
    """Return the lowest and highest z of the jib at a radius."""
    if shape[17] == 0.0:
        return shape[4], shape[5]
    share = min(max((row[1] - shape[14]) / shape[16], -1.0), 1.0)
    slope = np.sqrt(1.0 - share * share) / max(share, 1e-3)
    middle = shape[15] + max(along - shape[14], 0.0) * slope
    return middle - shape[3], middle + shape[3]


@kernel
def _jib_end(shape: NDArray[np.float64], row: NDArray[np.float64]) -> float:
    return float(row[1] if shape[17] > 0.0 else shape[2])


@kernel
def _rope_top(shape: NDArray[np.float64], row: NDArray[np.float64]) -> float:
    if shape[17] == 0.0:
        return float(shape[13])
    low, high = _jib_band(shape, row, row[1])
    return float(0.5 * (low + high))


@kernel
def _points(shape: NDArray[np.float64], row: NDArray[np.float64], points: NDArray[np.float64]) -> int:
    """Return points along the crane: x, y, half width, lowest, highest, and 1 for what turns with the jib."""
    c, s = np.cos(row[0]), np.sin(row[0])
    end, count = _jib_end(shape, row), 0
    steps = int(np.ceil(end / _POINT_M))
    for k in range(steps + 1):
        along = end * k / steps
        low, high = _jib_band(shape, row, along)
        points[count] = shape[0] + along * c, shape[1] + along * s, shape[3], low, high, 1.0
        count += 1
    steps = int(np.ceil(shape[6] / _POINT_M))
    for k in range(1, steps + 1):
        along = -shape[6] * k / steps
        points[count] = shape[0] + along * c, shape[1] + along * s, shape[7], shape[8], shape[9], 1.0
        count += 1
    x, y = shape[0] + row[1] * c, shape[1] + row[1] * s
    points[count] = x, y, row[8], row[2], _rope_top(shape, row), 0.0
    count += 1
    wide, deep = row[4] - row[3], row[6] - row[5]
    across = max(1, min(int(np.ceil(wide / _POINT_M)), 120))
    along_y = max(1, min(int(np.ceil(deep / _POINT_M)), 120))
    for i in range(across + 1):
        for j in range(along_y + 1):
            if 0 < i < across and 0 < j < along_y:
                continue
            points[count, 0] = x + row[3] + wide * i / across
            points[count, 1] = y + row[5] + deep * j / along_y
            points[count, 2], points[count, 5] = row[8], 0.0
            points[count, 3], points[count, 4] = row[2] - row[7], row[2]
            count += 1
    return count


@kernel
def _to_solids(
    points: NDArray[np.float64], shape: NDArray[np.float64], row: NDArray[np.float64], separation: float
) -> float:
    """Return the least distance of points from the solids of a crane at a similar height."""
    c, s = np.cos(row[0]), np.sin(row[0])
    hook_x, hook_y = shape[0] + row[1] * c, shape[1] + row[1] * s
    end, top = _jib_end(shape, row), _rope_top(shape, row)
    least = np.inf
    for n in range(points.shape[0]):
        x, y, half, low, high, turns = points[n]
        dx, dy = x - shape[0], y - shape[1]
        along, aside = dx * c + dy * s, dy * c - dx * s
        on_jib = min(max(along, 0.0), end)
        jib_low, jib_high = _jib_band(shape, row, on_jib)
        if low - jib_high < separation and jib_low - high < separation:
            least = min(least, np.hypot(along - on_jib, aside) - half - shape[3])
        if low - shape[9] < separation and shape[8] - high < separation:
            on_tail = min(max(along, -shape[6]), 0.0)
            least = min(least, np.hypot(along - on_tail, aside) - half - shape[7])
        if turns > 0.0 and low - shape[12] < separation and shape[11] - high < separation:
            least = min(least, np.hypot(dx, dy) - half - shape[10])
        if low - row[2] < separation and row[2] - row[7] - high < separation:
            out_x = max(row[3] - (x - hook_x), (x - hook_x) - row[4], 0.0)
            out_y = max(row[5] - (y - hook_y), (y - hook_y) - row[6], 0.0)
            least = min(least, np.hypot(out_x, out_y) - half - row[8])
        if low - top < separation and row[2] - high < separation:
            least = min(least, np.hypot(x - hook_x, y - hook_y) - half - row[8])
    return least
