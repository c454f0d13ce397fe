"""How a load swings on its rope while the crane moves, computed from the samples of a motion alone.

The load hangs on its slings below the hook block, the block on the rope below its exit; both are points and swing by
small angles, undamped. The empty hook is one point. Two samples are joined by a cubic. During a step of at most 40 ms,
the exit moves straight and the rope keeps its mean length. Over a step, each of the two swings of which that of a load
is made is an exact rotation in phase space: it adds no damping and no energy.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.rigging import rigging_kg
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site, SwingRule

GRAVITY_M_S2 = 9.80665
STEP_NS = 40_000_000
"""Longest step of the pendulum."""
_SHORTEST_ROPE_M = 0.5
_OFF = (0.9, 1.1)
"""Rope, slings and mass of a load that may hang on site, as shares of what the plan says."""
_BLOCK_OF_LARGEST = 0.03
"""A hook block whose mass is not given weighs this share of the crane's largest capacity."""
_PERIODS = 2
"""Periods of the slow swing after which a load below a block has swung out, nearly, as far as it can."""


class Hung(NamedTuple):
    """What hangs on a hook.

    Attributes:
        below_hook_m: From the hook down to its middle.
        block_kg: What swings at the hook; 0 for the empty hook, which is one point.
        load_kg: What swings below it.
        rope: Length of the rope as a share of what the plan says.
    """

    below_hook_m: float
    block_kg: float = 0.0
    load_kg: float = 0.0
    rope: float = 1.0


class Swung(NamedTuple):
    """A swinging load.

    Attributes:
        time_s: (N,) float64 since the start of the lift.
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        offset_m: (N, 2) float64 offset of the load from its rest position.
        amplitude_m: (N,) float64 how far it would swing out if the crane stopped moving at that time.
        hook_m: (N, 3) float64 position of the hook.
    """

    time_s: NDArray[np.float64]
    axes: NDArray[np.float64]
    offset_m: NDArray[np.float64]
    amplitude_m: NDArray[np.float64]
    hook_m: NDArray[np.float64]


def hung_on(site: Site, crane: TowerCrane, component: Component | None) -> Hung | None:
    """Return what hangs on a hook with a component; None if the site's rules do not include swing.

    The middle of the empty hook (no component) is at the end of its slings. Half of a load's gear swings at the hook,
    the other half with the load.
    """
    if site.rules.swing is SwingRule.OFF:
        return None
    sling_m = crane_for(site, crane, component).sling_m
    if component is None:
        return Hung(sling_m)
    cells = component.shape.cells[:, 2]
    below_m = sling_m + float(cells.max() - cells.min() + 1) * site.frame.voxel_size_m / 2.0
    gear_kg, block_kg = rigging_kg(crane, component), crane.hook_block_kg
    if block_kg == 0.0:
        block_kg = _BLOCK_OF_LARGEST * max(crane.chart.capacity_kg)
    return Hung(max(below_m, _SHORTEST_ROPE_M), block_kg + gear_kg / 2.0, component.mass_kg + gear_kg / 2.0)


def _ropes_m(crane: TowerCrane, axes: NDArray[np.float64], below_hook_m: float) -> NDArray[np.float64]:
    """Return (N,) from the rope's exit to this far below hook poses ((N, 3) slew, radius, height): at least 0.5 m.

    A luffing jib of length L with its pivot at radius o and height h has its tip at ``h + sqrt(L^2 - (r - o)^2)``.
    """
    exit_m = np.full(len(axes), crane.jib_height_m)
    jib = crane.luffing
    if jib is not None:
        out_m = axes[:, 1] - jib.pivot_offset_m
        exit_m = jib.pivot_height_m + np.sqrt(np.maximum(jib.length_m**2 - out_m**2, 0.0))
    return np.asarray(np.maximum(exit_m - axes[:, 2] + below_hook_m, _SHORTEST_ROPE_M), np.float64)


@lru_cache(maxsize=64)  # as ``positions_of``
def swung_parts(crane: TowerCrane, motion: LiftMotion, way: Trajectory, hung: Hung) -> tuple[Swung, ...]:
    """Return the swing of a load in pieces: a piece ends after each stop and its hold; the next one starts at rest."""
    stops = [(begin_ns - motion.start_ns, end_ns - motion.start_ns) for begin_ns, end_ns in motion.stops_ns]
    rests = [end for begin, end in stops if begin < way.time_ns[-1] and end > way.time_ns[0]]
    axes, found = way.axes, []
    for low_ns, high_ns in pairwise([int(way.time_ns[0]), *rests, int(way.time_ns[-1])]):
        part = (way.time_ns >= low_ns) & (way.time_ns <= high_ns)
        if part.sum() < 2:
            continue
        time_ns = way.time_ns[part]
        if high_ns in rests:
            # The swing of an undamped point repeats after one period: a longer hold adds nothing.
            period_s = 2.0 * np.pi * np.sqrt(_ropes_m(crane, axes[part][-1:], hung.below_hook_m)[0] / GRAVITY_M_S2)
            time_ns[-1] = min(time_ns[-1], time_ns[-2] + round(1e9 * period_s * (_PERIODS if hung.load_kg else 1)))
        found.append(swung_on(crane, time_ns, axes[part], hung))
    return tuple(found)


def left_off_m(crane: TowerCrane, time_ns: NDArray[np.int64], samples: NDArray[np.float64], hung: Hung) -> float:
    """Return how far a load swings after the samples, at most, if its rope, slings and mass are off by a tenth.

    Rope and load are longer and shorter, heavier and lighter; the slings are as planned, or off as the rope is. As
    ``swung_on``, at rest at the start.
    """
    left_m = 0.0
    for rope, slings, load in product(_OFF, (False, True), _OFF):
        below_m = hung.below_hook_m * (rope if slings else 1.0)
        other = hung._replace(below_hook_m=below_m, load_kg=hung.load_kg * load, rope=rope)
        left_m = max(left_m, float(swung_on(crane, time_ns, samples, other).amplitude_m[-1]))
    return left_m


def blown_m(crane: TowerCrane, samples: NDArray[np.float64], hung: Hung, force_n: float) -> float:
    """Return how far a force that comes at once, and stays, swings a load out at most, on the longest rope of samples.

    Each of the two ways in which load and hook block swing is a pendulum of its own with a share of the force. From
    rest it swings out to twice where it would stand still. At worst both are furthest out at the same moment.

    Args:
        crane: The crane as rigged for the load.
        samples: (N, 3) slew (rad), radius (m) and height (m).
        hung: The load.
        force_n: The force, horizontal, on the load.
    """
    rope_m, below_m = float(_ropes_m(crane, samples, 0.0).max()), hung.below_hook_m
    on_rope, on_slings = (hung.block_kg + hung.load_kg) / rope_m, hung.load_kg / below_m
    pull = GRAVITY_M_S2 * np.array([[on_rope + on_slings, -on_slings], [-on_slings, on_slings]])
    each_kg = np.sqrt([hung.block_kg, hung.load_kg])
    squared_rates, ways = np.linalg.eigh(pull / np.outer(each_kg, each_kg))
    return float(2.0 * (force_n * (ways[1] / each_kg[1]) ** 2 / squared_rates).sum())


def swung_on(crane: TowerCrane, time_ns: NDArray[np.int64], samples: NDArray[np.float64], hung: Hung) -> Swung:
    """Return the swing at the samples and at times between them, at most a step apart; it begins at rest.

    Args:
        crane: The crane as rigged for the load.
        time_ns: (N,) times of the samples, ascending.
        samples: (N, 3) slew (rad), radius (m) and height (m).
        hung: What hangs on the hook.
    """
    axes, since_s = _between(np.ascontiguousarray(samples), np.ascontiguousarray(time_ns))
    is_load = hung.load_kg > 0.0
    length_m = hung.rope * _ropes_m(crane, axes, 0.0 if is_load else hung.below_hook_m)
    bend = _gradient(_gradient(length_m, since_s), since_s)
    bend = np.clip(bend, -crane.hoist.acceleration, crane.hoist.acceleration)
    hook_m = hook_of(crane, *axes.T)
    if is_load:
        rope = np.column_stack([length_m, GRAVITY_M_S2 - bend])
        offset, amplitude = _both_turned(
            hook_m, rope, np.diff(since_s), hung.below_hook_m, hung.load_kg / hung.block_kg
        )
    else:
        offset, amplitude = _turned(hook_m, np.sqrt((GRAVITY_M_S2 - bend) / length_m), np.diff(since_s))
    return Swung(since_s + time_ns[0] / 1e9, axes, offset, amplitude, hook_m)


@kernel
def _between(
    samples: NDArray[np.float64], time_ns: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the samples and points at most a step apart on the cubics between them."""
    count = samples.shape[0]
    since_s = (time_ns - time_ns[0]) / 1e9
    total = 1
    for n in range(count - 1):
        total += max(1, -(-(time_ns[n + 1] - time_ns[n]) // STEP_NS))
    axes, time_s = np.empty((total, 3)), np.empty(total)
    at = 0
    for n in range(count - 1):
        parts = max(1, -(-(time_ns[n + 1] - time_ns[n]) // STEP_NS))
        h = since_s[n + 1] - since_s[n]
        for k in range(3):
            from_slope, to_slope = _slope(since_s, samples, n, k), _slope(since_s, samples, n + 1, k)
            for part in range(parts):
                u = part / parts
                bent = u * (1 - u) ** 2 * from_slope - u**2 * (1 - u) * to_slope
                chord = (1 + 2 * u) * (1 - u) ** 2 * samples[n, k] + u**2 * (3 - 2 * u) * samples[n + 1, k]
                axes[at + part, k] = chord + h * bent
        for part in range(parts):
            time_s[at] = since_s[n] + part / parts * h
            at += 1
    axes[at], time_s[at] = samples[count - 1], since_s[count - 1]
    return axes, time_s


@kernel
def _slope(time_s: NDArray[np.float64], values: NDArray[np.float64], n: int, k: int) -> float:
    """Return the slope at a sample: of the parabola through three; 0 if an axis rests or reverses, or at an end."""
    if n == 0 or n == values.shape[0] - 1:
        return 0.0
    before, after = time_s[n] - time_s[n - 1], time_s[n + 1] - time_s[n]
    rise, then = (values[n, k] - values[n - 1, k]) / before, (values[n + 1, k] - values[n, k]) / after
    return (after * rise + before * then) / (after + before) if rise * then > 0.0 else 0.0


@kernel
def _gradient(values: NDArray[np.float64], time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) slopes of parabolas through three values, of the line through two at the ends; 0 for two values."""
    count = values.shape[0]
    slopes = np.zeros(count)
    if count > 2:
        slopes[0] = (values[1] - values[0]) / (time_s[1] - time_s[0])
        slopes[-1] = (values[-1] - values[-2]) / (time_s[-1] - time_s[-2])
    for n in range(1, count - 1):
        before, after = time_s[n] - time_s[n - 1], time_s[n + 1] - time_s[n]
        slopes[n] = (
            -after / (before * (before + after)) * values[n - 1]
            + (after - before) / (before * after) * values[n]
            + before / (after * (before + after)) * values[n + 1]
        )
    return slopes


@kernel
def _turned(
    point_m: NDArray[np.float64], pulse: NDArray[np.float64], step_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the swing of a load under a point that moves straight in each step: an exact rotation in phase space."""
    n = point_m.shape[0]
    offset, amplitude = np.zeros((n, 2)), np.zeros(n)
    rate = np.zeros(2)
    for i in range(1, n):
        h, w = step_s[i - 1], 0.5 * (pulse[i - 1] + pulse[i])
        c, s = np.cos(w * h), np.sin(w * h)
        squared = 0.0
        for k in range(2):
            moves = (point_m[i, k] - point_m[i - 1, k]) / h
            e, v = offset[i - 1, k], rate[k] - moves
            offset[i, k] = e * c + v / w * s
            v = v * c - e * w * s
            rate[k] = v + moves
            squared += offset[i, k] ** 2 + (v / w) ** 2
        amplitude[i] = np.sqrt(squared)
    return offset, amplitude


@kernel
def _both_turned(
    point_m: NDArray[np.float64],
    rope: NDArray[np.float64],
    step_s: NDArray[np.float64],
    slings_m: float,
    ratio: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what ``_turned`` does for a load below a hook block.

    With u and d how far the block is from below the exit and the load from below the block, u'' = a d - b u and
    d'' = b u - c d. Along the eigenvectors (a, b - r) of these, each swings by itself at the squared rate r.

    ``rope``: (N, 2) its length and the pull on each kilogram of what hangs; ``ratio``: mass of the load by the block's.
    """
    n = point_m.shape[0]
    offset, amplitude = np.zeros((n, 2)), np.zeros(n)
    lag, rate = np.zeros((2, 2)), np.zeros((2, 2))  # of block and load: their lags, and how fast they grow
    for i in range(1, n):
        h, pull = step_s[i - 1], 0.5 * (rope[i - 1, 1] + rope[i, 1])
        length_m = 0.5 * (rope[i - 1, 0] + rope[i, 0])
        a, b, c = ratio * pull / slings_m, (1.0 + ratio) * pull / length_m, (1.0 + ratio) * pull / slings_m
        middle, apart = 0.5 * (b + c), np.sqrt(0.25 * (b - c) ** 2 + a * b)
        w0, w1 = np.sqrt(b * c - a * b) / np.sqrt(middle + apart), np.sqrt(middle + apart)
        f0, f1 = (b - w0 * w0) / a, (b - w1 * w1) / a  # the eigenvectors, with u = 1
        c0, s0, c1, s1 = np.cos(w0 * h), np.sin(w0 * h), np.cos(w1 * h), np.sin(w1 * h)
        squared0, squared1 = 0.0, 0.0
        for k in range(2):
            moves = (point_m[i, k] - point_m[i - 1, k]) / h
            u, d, u_v, d_v = lag[0, k], lag[1, k], rate[0, k] - moves, rate[1, k]
            e0, v0 = (d - f1 * u) / (f0 - f1), (d_v - f1 * u_v) / (f0 - f1)
            e1, v1 = u - e0, u_v - v0
            e0, v0 = e0 * c0 + v0 / w0 * s0, v0 * c0 - e0 * w0 * s0
            e1, v1 = e1 * c1 + v1 / w1 * s1, v1 * c1 - e1 * w1 * s1
            lag[0, k], lag[1, k] = e0 + e1, f0 * e0 + f1 * e1
            rate[0, k], rate[1, k] = v0 + v1 + moves, f0 * v0 + f1 * v1
            offset[i, k] = lag[0, k] + lag[1, k]
            squared0 += (1.0 + f0) ** 2 * (e0 * e0 + (v0 / w0) ** 2)
            squared1 += (1.0 + f1) ** 2 * (e1 * e1 + (v1 / w1) ** 2)
        amplitude[i] = np.sqrt(squared0) + np.sqrt(squared1)
    return offset, amplitude
