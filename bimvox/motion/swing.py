"""A crane with its load on the rope: the pendulum's length and period, and how it swings while the crane moves.

A load is a double pendulum: the hook block on a rope of changing length l, the load below it on slings of length s. The
empty hook is a point on its rope. Angles are small, and nothing damps (real damping only helps). With p the point of
the jib that it hangs from, b the block and q the load, all on the plan in the site's frame, which does not turn (so
that slewing needs no extra terms), and m the mass of the load by that of the block:
b'' = (g - l'') ((1 + m) / l (p - b) + m / s (q - b)), q'' = (g - l'') / s (b - q).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.crane.load_chart import wind_force_n
from bimvox.crane.tower_crane import TowerCrane, tip_height_m
from bimvox.motion.swept import LoadFrame, load_frame, swaying_is_free
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, PhaseName, WindLimit
from bimvox.site.collision import CollisionSpace
from bimvox.site.component import Component
from bimvox.site.lifting import asked_wind_m_s, crane_for, masses_on_rope_kg, permitted_for
from bimvox.site.site import Site, SwingRule

GRAVITY_M_S2 = 9.80665
SHORTEST_M = 0.5
"""No pendulum is shorter."""


def pendulum_length_m(crane: TowerCrane, height_m: float, below_hook_m: float, radius_m: float | None = None) -> float:
    """Return the distance from the rope exit down to the middle of the load, at least 0.5 m.

    Args:
        crane: The crane.
        height_m: Height of the hook above the site's z = 0.
        below_hook_m: From the hook down to the middle of the load.
        radius_m: Radius of the hook, which determines the height of a luffing jib's tip; None: the highest tip.
    """
    exit_m = crane.jib_height_m
    if crane.luffing is not None and radius_m is not None:
        exit_m = float(tip_height_m(crane.luffing, np.array([radius_m]))[0])
    return max(SHORTEST_M, exit_m - height_m + below_hook_m)


def pendulum_lengths_m(crane: TowerCrane, axes: NDArray[np.float64], below_hook_m: float) -> NDArray[np.float64]:
    """Return the (N,) pendulum lengths at (N, 3) hook poses (slew, radius, height); see :func:`pendulum_length_m`."""
    exit_m = crane.jib_height_m if crane.luffing is None else tip_height_m(crane.luffing, axes[:, 1])
    lengths: NDArray[np.float64] = np.maximum(SHORTEST_M, exit_m - axes[:, 2] + below_hook_m)
    return lengths


def half_period_s(length_m: float) -> float:
    """Return half the period of a pendulum, for small angles."""
    return pi * sqrt(length_m / GRAVITY_M_S2)


PLANNED_RESIDUAL_M = 0.04
"""A planned load that swings no further than this to a side is at rest. The proof, which integrates the samples of the
log with a pendulum of its own, allows 0.05 m."""

OFF = 0.1
"""How far rope, slings and the mass of a load may be from what is planned, as a share."""
PLANNED_OFF_RESIDUAL_M = 0.08
"""How far such a load may swing to a side at the end of its motion. The proof allows 0.10 m."""

STEP_S = 0.05
"""Largest step of the integration."""


class Pendulum(NamedTuple):
    """The load on the hook.

    Attributes:
        below_hook_m: Distance from the hook down to the middle of the load.
        load_ratio: Mass of the load by that of the hook block; 0 for a point on a rope.
        rope_share: The rope's length, from its exit to the hook, as a share of what the hook's height says.
    """

    below_hook_m: float
    load_ratio: float = 0.0
    rope_share: float = 1.0

    @property
    def off(self) -> tuple[Pendulum, ...]:
        """The same with rope and load, and with slings too, off by ``OFF`` each way; none for a point."""
        if self.load_ratio == 0.0:
            return ()
        ends = 1.0 - OFF, 1.0 + OFF
        return tuple(
            Pendulum(self.below_hook_m * slings, self.load_ratio * load, rope)
            for rope in ends
            for slings in (1.0, rope)
            for load in ends
        )


def half_periods_s(crane: TowerCrane, pendulum: Pendulum, height_m: float, radius_m: float) -> tuple[float, float]:
    """Return half the periods of the slow and the fast swing of what hangs on the hook; 0 for the fast one of a point.

    ``height_m``, ``radius_m``: of the hook, as in :func:`pendulum_length_m`.
    """
    if pendulum.load_ratio == 0.0:
        return half_period_s(pendulum_length_m(crane, height_m, pendulum.below_hook_m, radius_m)), 0.0
    rope_m = pendulum_length_m(crane, height_m, 0.0, radius_m)
    slow, fast = _squared_rates(rope_m, pendulum.below_hook_m, pendulum.load_ratio, GRAVITY_M_S2)
    return pi / sqrt(slow), pi / sqrt(fast)


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """A load's offset from its rest position.

    Attributes:
        offset_m: (N, 2) float64 on the plan, in the site's frame.
        amplitude_m: (N,) float64 its amplitude if the crane stood still from then on.
    """

    offset_m: NDArray[np.float64]
    amplitude_m: NDArray[np.float64]

    def beyond_m(self, rest_m: float) -> NDArray[np.float64]:
        """Return (N, 2) the offsets minus what counts as rest; 0 if the load swings less than that."""
        beyond: NDArray[np.float64] = _beyond(self.offset_m, rest_m)
        return beyond


def pendulum_of(site: Site, crane: TowerCrane, component: Component | None) -> Pendulum | None:
    """Return a load (None for the empty hook) on a crane's hook as a pendulum; None if swing is off."""
    return pendulum_on(site, crane_for(site, crane, component), component)


def pendulum_on(site: Site, rigged: TowerCrane, component: Component | None) -> Pendulum | None:
    """Return what ``pendulum_of`` does, on the crane as rigged for the load."""
    if site.rules.swing is SwingRule.OFF:
        return None
    if component is None:
        return Pendulum(rigged.sling_m)
    half_m = 0.5 * component.shape.size_vox[2] * site.frame.voxel_size_m
    block_kg, load_kg = masses_on_rope_kg(rigged, component)
    return Pendulum(max(SHORTEST_M, rigged.sling_m + half_m), load_kg / block_kg)


_SUDDEN = 2.0
"""A load that a gust meets at rest swings out to twice where it would hang in a steady wind."""


def gust_swing_m(site: Site, rigged: TowerCrane, component: Component, rope_m: float, speed_m_s: float) -> float:
    """Return how far a load swings out of the vertical in a sudden gust, at most.

    The force is that on its largest sail area; it leans the slings by the weight of the load, and the rope by that of
    load and hook block.

    Args:
        site: The site.
        rigged: The crane as rigged for the load.
        component: The load.
        rope_m: From the rope's exit to the hook.
        speed_m_s: Speed of the gust.
    """
    pendulum = pendulum_on(site, rigged, component)
    below_m = rigged.sling_m if pendulum is None else pendulum.below_hook_m
    block_kg, load_kg = masses_on_rope_kg(rigged, component)
    force_n = wind_force_n(speed_m_s, component.sail_area_m2, site.rules.drag_coefficient)
    return _SUDDEN * force_n / GRAVITY_M_S2 * (rope_m / (block_kg + load_kg) + below_m / load_kg)


def with_wind(site: Site, lift: Lift, motion: LiftMotion) -> LiftMotion:
    """Return the motion of a lift with the wind in which it is permitted, if the rules ask for wind and swing.

    In transit the load swings no further, in a sudden gust of that wind, than it keeps clear there. On the last moves
    people guide it. Rules without a clearance in transit limit nothing.
    """
    rules, component, crane = site.rules, site.components[motion.component], site.cranes[motion.crane]
    if rules.swing is SwingRule.OFF or not max(rules.wind_speed_m_s, asked_wind_m_s(rules)):
        return motion
    rigged, speed_m_s = crane_for(site, crane, component), permitted_for(site, crane, component)
    rope_m = float(pendulum_lengths_m(rigged, motion.loaded.axes[_in_transit(site, lift, motion)], 0.0).max())
    swing_m = gust_swing_m(site, rigged, component, rope_m, speed_m_s)
    kept_m = rules.kept_m("transit_clearance_m", lift.kept) if rules.transit_clearance_m > 0.0 else swing_m
    if swing_m > kept_m:
        speed_m_s *= sqrt(kept_m / swing_m)  # a gust's force grows with the square of its speed
        swing_m = kept_m
    return replace(motion, wind=WindLimit(speed_m_s, swing_m))


def _in_transit(site: Site, lift: Lift, motion: LiftMotion) -> NDArray[np.bool_]:
    """Return (N,) which samples of the loaded motion are in transit: until it is lowered below the last moves."""
    assert lift.path_vox is not None
    loaded, last = motion.loaded, lift.last_moves_vox
    gate_m = float(loaded.height_m[-1]) + int(last[0, 2] - last[-1, 2]) * site.frame.voxel_size_m
    inside = loaded.height_m >= gate_m - _SAME_HEIGHT_M
    time_ns = loaded.time_ns + np.int64(motion.start_ns)
    for phase in motion.phases:
        if phase.name in (PhaseName.HOIST, PhaseName.TRAVERSE):
            inside |= (time_ns >= phase.start_ns) & (time_ns <= phase.end_ns)
    return inside


_SAME_HEIGHT_M = 1e-6


class Hanging(NamedTuple):
    """A load on the rope of a crane as kernels take it.

    Attributes:
        swings: Whether its swing counts.
        x_m: The slewing axis.
        y_m: The slewing axis.
        exit_m: Height of the rope's exit; of a luffing jib's pivot.
        pivot_m: Radius of that pivot.
        jib_m: Length of a luffing jib; 0 for a horizontal one.
        below_hook_m: As in ``Pendulum``.
        gravity_m_s2: Gravity.
        load_ratio: As in ``Pendulum``.
        rope_share: As in ``Pendulum``.
    """

    swings: bool
    x_m: float
    y_m: float
    exit_m: float
    pivot_m: float
    jib_m: float
    below_hook_m: float
    gravity_m_s2: float
    load_ratio: float
    rope_share: float


def hanging_on(crane: TowerCrane, pendulum: Pendulum | None) -> Hanging:
    """Return a load on a crane's rope as kernels take it; with None it does not swing."""
    x_m, y_m, jib = *crane.base_m[:2], crane.luffing
    below_hook_m, ratio, share = (0.0, 0.0, 1.0) if pendulum is None else pendulum
    exits = (crane.jib_height_m, 0.0, 0.0) if jib is None else (jib.pivot_height_m, jib.pivot_offset_m, jib.length_m)
    return Hanging(pendulum is not None, x_m, y_m, *exits, below_hook_m, GRAVITY_M_S2, ratio, share)


def swing_of(
    crane: TowerCrane,
    axes: NDArray[np.float64],
    step_s: float,
    pendulum: Pendulum,
    wanted: NDArray[np.bool_] | None = None,
) -> Swing:
    """Return the swing of a load that is at rest at the start, for (N, 3) axes ``step_s`` apart, ``STEP_S`` at most.

    ``wanted``: (N,) at which samples the amplitude is; it is NaN at the others. None: at all.
    """
    wanted = np.ones(len(axes), np.bool_) if wanted is None else wanted
    return Swing(*_swung(axes, hanging_on(crane, pendulum), step_s, wanted))


def left_m(
    crane: TowerCrane, axes: NDArray[np.float64], step_s: float, pendulums: Sequence[Pendulum]
) -> NDArray[np.float64]:
    """Return (N, 8) what is left of the swing of each of N pendulums in the end, as amplitudes in m.

    That is position and speed of the load in its slow and in its fast swing. The pendulums are loads of ``swing_of``,
    or one point on a rope, which has no fast swing.
    """
    hanging = hanging_on(crane, pendulums[0])
    if hanging.load_ratio > 0.0:
        return _left_m(axes, hanging._replace(rope_share=1.0), step_s, np.array(pendulums))
    return _left_of_point_m(axes, hanging, step_s)[None]


@kernel
def _left_of_point_m(axes: NDArray[np.float64], hanging: Hanging, step_s: float) -> NDArray[np.float64]:
    left = np.zeros(8)
    offset_m, _ = _swing(axes, hanging, step_s, np.zeros(0, np.bool_))
    per_s = np.sqrt(hanging.gravity_m_s2 / _length_m(hanging, axes[-1, 1], axes[-1, 2]))
    left[:2] = offset_m[-1]
    left[2:4] = (offset_m[-1] - offset_m[-2]) / step_s / per_s
    return left


@kernel
def sways_free(
    space: CollisionSpace, load: LoadFrame, axes: NDArray[np.float64], hanging: Hanging, step_s: float
) -> bool:
    """Return whether a load that is at rest at the start swings into nothing, to either side, in a planned motion.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        axes: (N, 3) slew, radius, height, ``step_s`` apart.
        hanging: The load on its rope.
        step_s: As for ``swing_of``.
    """
    beyond_m = _beyond(_swung(axes, hanging, step_s, np.zeros(0, np.bool_))[0], PLANNED_RESIDUAL_M)
    swings = (beyond_m[:, 0] != 0.0) | (beyond_m[:, 1] != 0.0)
    return swaying_is_free(space, load, axes, beyond_m / load.voxel_size_m, swings, True) < 0


@inline_kernel
def _length_m(hanging: Hanging, radius_m: float, height_m: float) -> float:
    """Return what ``pendulum_lengths_m`` does for one hook pose."""
    exit_m, far_m = hanging.exit_m, radius_m - hanging.pivot_m
    if hanging.jib_m > 0.0:
        exit_m += np.sqrt(max(hanging.jib_m * hanging.jib_m - far_m * far_m, 0.0))
    return max(SHORTEST_M, exit_m - height_m + hanging.below_hook_m)


@kernel
def _points(axes: NDArray[np.float64], x_m: float, y_m: float) -> NDArray[np.float64]:
    """Return (N, 2) the hook on the plan, as ``hook_of`` has it."""
    points = np.empty((axes.shape[0], 2))
    cos, sin = 1.0, 0.0
    for i in range(axes.shape[0]):
        if i == 0 or axes[i, 0] != axes[i - 1, 0]:  # most of the time is hoisting
            cos, sin = np.cos(axes[i, 0]), np.sin(axes[i, 0])
        points[i, 0] = x_m + axes[i, 1] * cos
        points[i, 1] = y_m + axes[i, 1] * sin
    return points


@kernel
def _swing(
    axes: NDArray[np.float64], hanging: Hanging, step_s: float, wanted: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Velocity Verlet over evenly spaced samples.

    Returns offsets, and amplitudes at the samples that are ``wanted``, (N,); NaN at the others. (0,): none.
    """
    point_m = _points(axes, hanging.x_m, hanging.y_m)
    n = point_m.shape[0]
    offset, amplitude = np.zeros((n, 2)), np.full(wanted.shape[0], np.nan)
    amplitude[:1] = 0.0
    qx, qy = point_m[0, 0], point_m[0, 1]
    vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0
    half = 0.5 * step_s
    shorter_m = length_m = _length_m(hanging, axes[0, 1], axes[0, 2])
    longer_m = _length_m(hanging, axes[min(1, n - 1), 1], axes[min(1, n - 1), 2])
    for i in range(1, n):
        qx += step_s * (vx + half * ax)
        qy += step_s * (vy + half * ay)
        after = min(i + 1, n - 1)
        shorter_m, length_m = length_m, longer_m
        bend = 0.0
        if after > i:
            longer_m = _length_m(hanging, axes[after, 1], axes[after, 2])
            bend = (longer_m - 2.0 * length_m + shorter_m) / step_s**2
        stiffness = (hanging.gravity_m_s2 - bend) / length_m
        x, y = qx - point_m[i, 0], qy - point_m[i, 1]
        vx += half * (ax - stiffness * x)
        vy += half * (ay - stiffness * y)
        ax, ay = -stiffness * x, -stiffness * y
        offset[i, 0], offset[i, 1] = x, y
        if not (wanted.shape[0] and wanted[i]):
            continue
        span_s = step_s * (after - i + 1)
        ux = vx - (point_m[after, 0] - point_m[i - 1, 0]) / span_s
        uy = vy - (point_m[after, 1] - point_m[i - 1, 1]) / span_s
        amplitude[i] = np.sqrt(x * x + y * y + (ux * ux + uy * uy) / max(stiffness, 1e-9))
    return offset, amplitude


@kernel
def _swung(
    axes: NDArray[np.float64], hanging: Hanging, step_s: float, wanted: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return offsets and amplitudes of a load, or of a point on a rope; see ``_swing``."""
    if hanging.load_ratio > 0.0:
        offset_m, amplitude_m = _double_swing(axes, hanging, step_s, wanted)
        return offset_m, amplitude_m
    return _swing(axes, hanging, step_s, wanted)


@inline_kernel
def _squared_rates(rope_m: float, slings_m: float, ratio: float, g_m_s2: float) -> tuple[float, float]:
    """Return the squared angular rates of the slow and the fast swing of a double pendulum, 1/s^2."""
    half = 0.5 * (1.0 + ratio) * (1.0 / rope_m + 1.0 / slings_m)
    product = (1.0 + ratio) / (rope_m * slings_m)
    fast = half + np.sqrt(max(half * half - product, 0.0))
    return g_m_s2 * product / fast, g_m_s2 * fast


@inline_kernel
def _rope_m(hanging: Hanging, radius_m: float, height_m: float) -> float:
    """Return the length of the rope above the hook."""
    exit_m, far_m = hanging.exit_m, radius_m - hanging.pivot_m
    if hanging.jib_m > 0.0:
        exit_m += np.sqrt(max(hanging.jib_m * hanging.jib_m - far_m * far_m, 0.0))
    return hanging.rope_share * max(SHORTEST_M, exit_m - height_m)


@kernel
def _double_swing(
    axes: NDArray[np.float64], hanging: Hanging, step_s: float, wanted: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return offsets and amplitudes, as ``_swing`` does for a point.

    By the trapezoidal rule, which adds no energy, however fast the block swings below a heavy load.
    """
    point_m = _points(axes, hanging.x_m, hanging.y_m)
    n = point_m.shape[0]
    offset, amplitude, left = np.zeros((n, 2)), np.full(wanted.shape[0], np.nan), np.zeros(8)
    amplitude[:1] = 0.0
    ratio, slings_m = hanging.load_ratio, hanging.below_hook_m
    block, load = point_m[0].copy(), point_m[0].copy()
    block_v, load_v, block_a, load_a = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    quarter, half = 0.25 * step_s * step_s, 0.5 * step_s
    shorter_m = rope_m = _rope_m(hanging, axes[0, 1], axes[0, 2])
    longer_m = _rope_m(hanging, axes[min(1, n - 1), 1], axes[min(1, n - 1), 2])
    for i in range(1, n):
        after = min(i + 1, n - 1)
        shorter_m, rope_m = rope_m, longer_m
        bend = 0.0
        if after > i:
            longer_m = _rope_m(hanging, axes[after, 1], axes[after, 2])
            bend = (longer_m - 2.0 * rope_m + shorter_m) / step_s**2
        pull = hanging.gravity_m_s2 - bend
        up, below, down = (1.0 + ratio) * pull / rope_m, ratio * pull / slings_m, pull / slings_m
        # (1 + q (up + below)) b - q below l = r, -q down b + (1 + q down) l = s
        det = (1.0 + quarter * (up + below)) * (1.0 + quarter * down) - quarter * quarter * below * down
        for k in range(2):
            p = point_m[i, k]
            r = block[k] + step_s * block_v[k] + quarter * (block_a[k] + up * p)
            s = load[k] + step_s * load_v[k] + quarter * load_a[k]
            b = (r * (1.0 + quarter * down) + s * quarter * below) / det
            q = (s * (1.0 + quarter * (up + below)) + r * quarter * down) / det
            b_a, q_a = up * (p - b) + below * (q - b), down * (b - q)
            block_v[k] += half * (block_a[k] + b_a)
            load_v[k] += half * (load_a[k] + q_a)
            block[k], load[k], block_a[k], load_a[k] = b, q, b_a, q_a
            offset[i, k] = q - p
        if not (wanted.shape[0] and wanted[i]):
            continue
        slow, fast = _squared_rates(rope_m, slings_m, ratio, pull)
        span_s = step_s * (after - i + 1)
        for k in range(2):
            moves = (point_m[after, k] - point_m[i - 1, k]) / span_s
            b, q = block[k] - point_m[i, k], load[k] - point_m[i, k]
            left[k::2] = _by_swing(b, q, block_v[k] - moves, load_v[k] - moves, down, slow, fast)
        amplitude[i] = np.sqrt((left[:4] ** 2).sum()) + np.sqrt((left[4:] ** 2).sum())
    return offset, amplitude


@inline_kernel
def _by_swing(
    block: float, load: float, block_v: float, load_v: float, down: float, slow: float, fast: float
) -> tuple[float, float, float, float]:
    """Return position and speed of a load in its slow and in its fast swing, as amplitudes in m.

    They are the spectral projections of the matrix of the system. ``slow, fast``: the squared rates.
    """
    apart = fast - slow
    return (
        ((fast - down) * load + down * block) / apart,
        ((fast - down) * load_v + down * block_v) / apart / np.sqrt(slow),
        ((down - slow) * load - down * block) / apart,
        ((down - slow) * load_v - down * block_v) / apart / np.sqrt(fast),
    )


@kernel
def _left_m(
    axes: NDArray[np.float64], hanging: Hanging, step_s: float, pendulums: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N, 8) what ``_double_swing`` leaves of (N, 3) pendulums, in one pass over the samples.

    The numbers are the same to the last bit. ``hanging``: any of them, on the whole rope.
    """
    point_m = _points(axes, hanging.x_m, hanging.y_m)
    n, count = point_m.shape[0], pendulums.shape[0]
    slings_m, ratio, share = pendulums[:, 0].copy(), pendulums[:, 1].copy(), pendulums[:, 2].copy()
    left = np.zeros((count, 8))
    # The innermost loops go over the pendulums, none of which waits for another.
    up, below, down, det = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    block, rates = np.empty((2, count)), np.zeros((4, 2, count))
    block[0], block[1] = point_m[0, 0], point_m[0, 1]
    load, block_v, load_v, block_a, load_a = block.copy(), rates[0], rates[1], rates[2], rates[3]
    quarter, half = 0.25 * step_s * step_s, 0.5 * step_s
    shorter_m = rope_m = _rope_m(hanging, axes[0, 1], axes[0, 2])
    longer_m = _rope_m(hanging, axes[min(1, n - 1), 1], axes[min(1, n - 1), 2])
    for i in range(1, n):
        after = min(i + 1, n - 1)
        shorter_m, rope_m = rope_m, longer_m
        if after > i:
            longer_m = _rope_m(hanging, axes[after, 1], axes[after, 2])
        for v in range(count):
            bend = (share[v] * longer_m - 2.0 * (share[v] * rope_m) + share[v] * shorter_m) / step_s**2
            pull = hanging.gravity_m_s2 - (bend if after > i else 0.0)
            up[v] = (1.0 + ratio[v]) * pull / (share[v] * rope_m)
            below[v], down[v] = ratio[v] * pull / slings_m[v], pull / slings_m[v]
            det[v] = (1.0 + quarter * (up[v] + below[v])) * (1.0 + quarter * down[v])
            det[v] -= quarter * quarter * below[v] * down[v]
        for k in range(2):
            p = point_m[i, k]
            for v in range(count):
                r = block[k, v] + step_s * block_v[k, v] + quarter * (block_a[k, v] + up[v] * p)
                s = load[k, v] + step_s * load_v[k, v] + quarter * load_a[k, v]
                b = (r * (1.0 + quarter * down[v]) + s * quarter * below[v]) / det[v]
                q = (s * (1.0 + quarter * (up[v] + below[v])) + r * quarter * down[v]) / det[v]
                b_a, q_a = up[v] * (p - b) + below[v] * (q - b), down[v] * (b - q)
                block_v[k, v] += half * (block_a[k, v] + b_a)
                load_v[k, v] += half * (load_a[k, v] + q_a)
                block[k, v], load[k, v], block_a[k, v], load_a[k, v] = b, q, b_a, q_a
    for v in range(count):
        level = hanging.gravity_m_s2 / slings_m[v]
        slow, fast = _squared_rates(share[v] * rope_m, slings_m[v], ratio[v], hanging.gravity_m_s2)
        for k in range(2):
            moves = (point_m[n - 1, k] - point_m[n - 2, k]) / step_s
            b, q = block[k, v] - point_m[n - 1, k], load[k, v] - point_m[n - 1, k]
            left[v, k::2] = _by_swing(b, q, block_v[k, v] - moves, load_v[k, v] - moves, level, slow, fast)
    return left


@kernel
def _beyond(offset_m: NDArray[np.float64], rest_m: float) -> NDArray[np.float64]:
    beyond = np.empty_like(offset_m)
    for i in range(offset_m.shape[0]):
        x, y = offset_m[i, 0], offset_m[i, 1]
        share = max(0.0, 1.0 - rest_m / max(np.sqrt(x * x + y * y), 1e-12))
        beyond[i, 0], beyond[i, 1] = x * share, y * share
    return beyond


HOOK_OFFSET = np.zeros(3, np.int32)
"""The empty hook is one cell at the lower end of its slings."""


class RiggedCrane(NamedTuple):
    """A crane with its load.

    Attributes:
        crane: The crane in the gear of the load, with its slings.
        load: How hook poses and reference cells correspond.
        pendulum: The load as a pendulum; None if its swing is not checked.
        sample_period_s: Largest time between samples of its trajectories.
    """

    crane: TowerCrane
    load: LoadFrame
    pendulum: Pendulum | None
    sample_period_s: float


def rigged_crane(site: Site, crane: TowerCrane, component: Component | None) -> RiggedCrane:
    """Return one of a site's cranes with a component on its hook; with the empty hook (usual slings) if None."""
    rigged = crane_for(site, crane, component)
    line_vox = HOOK_OFFSET if component is None else component.hook_line_vox
    load = load_frame(rigged, site.frame, line_vox)
    return RiggedCrane(rigged, load, pendulum_of(site, crane, component), site.rules.sample_period_s)
