"""A way of a lift as a table over its own time, and how a crane goes faster and slower along it.

The way's own clock runs at a pace from 0 to 1 (time scaling). At a pace f, an axis that is planned with rate q' and
acceleration q'' has the rate q' f and the acceleration q'' f^2 + q' f', which stays within the axis's limit. The jerk
limit is kept by the delay before braking, during which the crane continues: acting at once with full force after the
time in which the force builds up leads further than building it up at once.

Source: Bobrow, Dubowsky, Gibson, "Time-optimal control of robotic manipulators along specified paths", 1985.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.crane.kinematics import hook_of, joint_limits, joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.lift import REACTION_S
from bimvox.motion.swing import GRAVITY_M_S2, STEP_S, Pendulum, pendulum_lengths_m, swing_of

TICK_S = 0.5
"""Length of a step of the simulation, and distance of the rows of a way on its own clock."""

_STILL_M_S = 1e-3
"""A hook slower than this rests."""


class Way(NamedTuple):
    """A way of a load from its pick to its place.

    Row k is ``k * TICK_S`` after the way begins, if the crane executes it as planned.

    Attributes:
        rate: (N, 3) float64 rates of the crane's joints as planned, the highest of each around the row.
        bend: (N, 3) float64 their accelerations as planned, the highest of each around the row.
        limits: (3,) float64 highest accelerations of the joints.
        hook_m: (N, 2) float64 the hook on plan.
        heading: (N, 2) float64 cosine and sine of the load's heading.
        box_m: (N, 4) float64 the load on plan relative to the hook, before it is turned: x0, y0, x1, y1.
        own_m: (N,) float64 how far the load swings to any side as planned.
        fast_m: (N,) float64 by how much more if the speed as planned was gained or lost at once.
        most_m: (N,) float64 by how much more at most, for the accelerations of the axes.
        rests: (N,) bool whether the hook rests.
        delay: Ticks from the order to brake until the brakes act with their full force; until then the crane continues.
    """

    rate: NDArray[np.float64]
    bend: NDArray[np.float64]
    limits: NDArray[np.float64]
    hook_m: NDArray[np.float64]
    heading: NDArray[np.float64]
    box_m: NDArray[np.float64]
    own_m: NDArray[np.float64]
    fast_m: NDArray[np.float64]
    most_m: NDArray[np.float64]
    rests: NDArray[np.bool_]
    delay: int


class Hanging(NamedTuple):
    """How a load hangs over time, one row a time at which its way is known.

    Attributes:
        heading_rad: (N,) float64 its heading.
        box_m: (N, 4) float64 x0, y0, x1, y1 relative to the hook at heading 0.
        pendulum: How it swings; None if swing is ignored.
    """

    heading_rad: NDArray[np.float64]
    box_m: NDArray[np.float64]
    pendulum: Pendulum | None


def seconds_of(way: Way) -> float:
    """Return how long a way takes if the crane need not yield."""
    return (len(way.rests) - 1) * TICK_S


def way_of(crane: TowerCrane, time_s: NDArray[np.float64], axes: NDArray[np.float64], hanging: Hanging) -> Way:
    """Return the table of a way.

    Args:
        crane: The crane as rigged for the load.
        time_s: (N,) ascending times of the samples, from 0.
        axes: (N, 3) slew (rad), radius (m) and height (m) at them; at rest at both ends.
        hanging: How the load hangs at these times.
    """
    from scipy.interpolate import PchipInterpolator  # takes long to import, and few plans need it

    count = int(np.ceil(time_s[-1] / TICK_S)) + 1
    at_s = np.minimum(np.arange(count) * TICK_S, time_s[-1])
    curve = PchipInterpolator(time_s, axes)
    half = 0.5 * TICK_S
    before, here, after = (curve(np.clip(at_s + step, 0.0, time_s[-1])) for step in (-half, 0.0, half))
    limits = np.array([joint.acceleration for joint in joint_limits(crane)])
    jerks = np.array([joint.jerk for joint in joint_limits(crane)])
    rate = (after - before) / TICK_S
    rate[0] = rate[-1] = 0.0
    speed = np.abs(rate) * np.stack([here[:, 1], np.ones(count), np.ones(count)], axis=1)
    row = np.minimum(np.searchsorted(time_s, at_s, side="right") - 1, len(time_s) - 1)
    heading_rad = np.interp(at_s, time_s, hanging.heading_rad)
    own_m, fast_m, most_m = _sway_m(crane, hanging.pendulum, (time_s, axes), (at_s, here, rate))
    rates, bends = _highest(time_s, joints_of(crane, axes), at_s)
    return Way(
        rate=rates,
        bend=bends,
        limits=limits,
        hook_m=np.ascontiguousarray(hook_of(crane, *here.T)[:, :2]),
        heading=np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1),
        box_m=np.ascontiguousarray(hanging.box_m[row]),
        own_m=own_m,
        fast_m=fast_m,
        most_m=most_m,
        rests=(speed < _STILL_M_S).all(axis=1),
        delay=int(np.ceil((REACTION_S + float((limits / jerks).max())) / TICK_S)),
    )


def _highest(
    time_s: NDArray[np.float64], joints: NDArray[np.float64], at_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (N, 3) the rate and the acceleration of largest size of each joint within half a tick of each row.

    They are divided differences of the samples, up to the ones next to that time: between samples 0.5 s apart, the
    acceleration may be higher than its mean over a tick.
    """
    rates = np.diff(joints, axis=0) / np.diff(time_s)[:, None]
    middle_s = 0.5 * (time_s[1:] + time_s[:-1])
    bends = np.zeros_like(joints)
    bends[1:-1] = np.diff(rates, axis=0) / np.diff(middle_s)[:, None]
    half = 0.5 * TICK_S
    return _largest(middle_s, rates, at_s, half), _largest(time_s, bends, at_s, half)


def _largest(
    time_s: NDArray[np.float64], values: NDArray[np.float64], at_s: NDArray[np.float64], half_s: float
) -> NDArray[np.float64]:
    """Return (N, 3) the value of largest size of each column within a time of each of N times, and next to it."""
    low = np.maximum(np.searchsorted(time_s, at_s - half_s) - 1, 0)
    high = np.minimum(np.searchsorted(time_s, at_s + half_s) + 1, len(time_s))
    result = np.empty((len(at_s), values.shape[1]))
    for n, (first, after) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        part = values[first:after]
        result[n] = part[np.argmax(np.abs(part), axis=0), np.arange(values.shape[1])]
    return result


def _sway_m(
    crane: TowerCrane,
    pendulum: Pendulum | None,
    planned: tuple[NDArray[np.float64], NDArray[np.float64]],
    rows: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (N,) the swing as planned, and what one change of speed adds: if it is sudden, and at most.

    On a rope of length l, a change of the speed by v adds at most v sqrt(l / g), and one at the deceleration a at most
    2 a l / g.
    """
    (time_s, axes), (at_s, here, rate) = planned, rows
    if pendulum is None or time_s[-1] <= 0.0:
        return np.zeros(len(at_s)), np.zeros(len(at_s)), np.zeros(len(at_s))
    even_s = np.linspace(0.0, time_s[-1], int(np.ceil(time_s[-1] / STEP_S)) + 1)
    even = np.stack([np.interp(even_s, time_s, axis) for axis in axes.T], axis=1)
    own_m = np.interp(at_s, even_s, swing_of(crane, even, float(even_s[1] - even_s[0]), pendulum).amplitude_m)
    per_m_s2 = pendulum_lengths_m(crane, here, pendulum.below_hook_m) / GRAVITY_M_S2
    fast_m = np.hypot(rate[:, 0] * here[:, 1], rate[:, 1]) * np.sqrt(per_m_s2)
    moves = np.abs(rate[:, :2]) > 0.0
    across_m = 2.0 * crane.slewing.acceleration * here[:, 1] * per_m_s2 * moves[:, 0]
    along_m = 2.0 * crane.trolley.acceleration * per_m_s2 * moves[:, 1]
    return own_m, _around(fast_m), _around(np.hypot(across_m, along_m))


def _around(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) the higher value of a row and the one before: a load that has come to a corner still swings."""
    high: NDArray[np.float64] = np.maximum(values, np.r_[values[:1], values[:-1]])
    return high


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
        rate, bend = _highest_near(way, low, axis)
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
        rate, bend = _highest_near(way, low, axis)
        if rate > 1e-12:
            gains = True
            for row in range(low, min(low + 3, way.rests.shape[0])):
                gains &= way.bend[row, axis] * way.rate[row, axis] > 0.0
            spare = way.limits[axis] if gains else max(0.0, way.limits[axis] - bend * pace * pace)
            loss = min(loss, spare / rate)
    after = pace - loss * TICK_S
    return after if after > _HAIR else 0.0


@leaf_kernel
def _highest_near(way: Way, low: int, axis: int) -> tuple[float, float]:
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
