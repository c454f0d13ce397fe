"""How a crane goes faster and slower along a way: the way's own clock runs at a pace from 0 to 1 (time scaling).

At a pace f, an axis that is planned with rate q' and acceleration q'' has the rate q' f and the acceleration
q'' f^2 + q' f', which stays within the axis's limit. The jerk limit is kept by the delay before braking, during which
the crane continues: acting at once with full force after the time in which the force builds up leads further than
building it up at once.

Source: Bobrow, Dubowsky, Gibson, "Time-optimal control of robotic manipulators along specified paths", 1985.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.live.way import TICK_S, Way

_ANY = 1e9
_HAIR = 1e-6


@leaf_kernel
def resting(way: Way, at: float) -> bool:
    """Return whether the load rests at a place of a way, in rows, whatever the pace."""
    low = int(at)
    high = min(low + 1, way.rests.shape[0] - 1)
    return bool(way.rests[low] and (way.rests[high] or at - low < _HAIR))


@leaf_kernel
def quicker(way: Way, at: float, pace: float) -> float:
    """Return the pace a tick later, if the crane gains speed as fast as every axis can."""
    low, after = int(at), 1.0
    for axis in range(3):
        rate, bend = _around(way, low, axis)
        if rate > 1e-12:
            # The largest pace f after the tick with bend f^2 + rate (f - pace) / tick at the limit.
            per, most = rate / TICK_S, way.limits[axis] + rate / TICK_S * pace
            after = min(after, 2.0 * most / (per + np.sqrt(per * per + 4.0 * bend * most)))
    return max(pace, after)


@leaf_kernel
def slower(way: Way, at: float, pace: float) -> float:
    """Return the pace a tick later, if the crane brakes as hard as every axis can."""
    loss = _ANY
    low = int(at)
    for axis in range(3):
        rate, bend = _around(way, low, axis)
        if rate > 1e-12:
            gains = True
            for row in range(low, min(low + 3, way.rests.shape[0])):
                gains &= way.bend[row, axis] * way.rate[row, axis] > 0.0
            spare = way.limits[axis] if gains else max(0.0, way.limits[axis] - bend * pace * pace)
            loss = min(loss, spare / rate)
    after = pace - loss * TICK_S
    return after if after > _HAIR else 0.0


@leaf_kernel
def _around(way: Way, low: int, axis: int) -> tuple[float, float]:
    """Return the largest rate and the largest acceleration of an axis on the rows that a tick may touch."""
    rate, bend = 0.0, 0.0
    for row in range(low, min(low + 3, way.rests.shape[0])):
        rate = max(rate, abs(way.rate[row, axis]))
        bend = max(bend, abs(way.bend[row, axis]))
    return rate, bend


@leaf_kernel
def ahead(way: Way, at: float, before: float, after: float) -> float:
    """Return the place, in rows, a tick later, for the pace before and after; at most the end of the way."""
    return min(at + 0.5 * (before + after), float(way.rests.shape[0] - 1))


@leaf_kernel
def placed(way: Way, at: float, used: float, out: NDArray[np.float64]) -> None:
    """Write where the load is at a place in rows: hook x, y; cosine, sine; x0, y0, x1, y1; swing.

    The swing is the planned one, and that of two changes of speed, up to the highest pace ``used`` since the load last
    hung still.
    """
    low = int(at)
    high = min(low + 1, way.rests.shape[0] - 1)
    share = at - low
    for n in range(2):
        out[n] = way.hook_m[low, n] + share * (way.hook_m[high, n] - way.hook_m[low, n])
        out[2 + n] = way.heading[low, n] + share * (way.heading[high, n] - way.heading[low, n])
        out[4 + n] = min(way.box_m[low, n], way.box_m[high, n])
        out[6 + n] = max(way.box_m[low, 2 + n], way.box_m[high, 2 + n])
    length = np.hypot(out[2], out[3])
    out[2] /= length
    out[3] /= length
    fast = used * max(way.fast_m[low], way.fast_m[high])
    out[8] = used * max(way.own_m[low], way.own_m[high]) + 2.0 * min(fast, max(way.most_m[low], way.most_m[high]))


@leaf_kernel
def gap_m(load: NDArray[np.float64], x: float, y: float) -> float:
    """Return the distance on plan from a load (``placed``) at rest on its rope to a point; 0 under it."""
    dx, dy = x - load[0], y - load[1]
    along, across = load[2] * dx + load[3] * dy, load[2] * dy - load[3] * dx
    out_x = max(load[4] - along, 0.0, along - load[6])
    out_y = max(load[5] - across, 0.0, across - load[7])
    return float(np.sqrt(out_x * out_x + out_y * out_y))
