"""How a load swings on its rope while the crane moves, computed from the samples of a motion alone.

The load is a point that hangs below the rope's exit and swings by small angles, undamped. Two samples are joined by a
cubic. During a step of at most 40 ms, the exit moves straight and the rope keeps its mean length. Over a step, the
swing is an exact rotation in phase space: it adds no damping and no energy.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site, SwingRule

GRAVITY_M_S2 = 9.80665
STEP_NS = 40_000_000
"""Longest step of the pendulum."""
_SHORTEST_ROPE_M = 0.5


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


def hanging_m(site: Site, crane: TowerCrane, component: Component | None) -> float | None:
    """Return how far below the hook the middle of a load is; None if the site's rules do not include swing.

    The middle of the empty hook (no component) is at the end of its slings.
    """
    if site.rules.swing is SwingRule.OFF:
        return None
    sling_m = crane_for(site, crane, component).sling_m
    if component is None:
        return sling_m
    cells = component.shape.cells[:, 2]
    return sling_m + float(cells.max() - cells.min() + 1) * site.frame.voxel_size_m / 2.0


def _ropes_m(crane: TowerCrane, axes: NDArray[np.float64], below_hook_m: float) -> NDArray[np.float64]:
    """Return (N,) the length of the pendulum at hook poses ((N, 3) slew, radius, height): at least 0.5 m.

    A luffing jib of length L with its pivot at radius o and height h has its tip at ``h + sqrt(L^2 - (r - o)^2)``.
    """
    exit_m = np.full(len(axes), crane.jib_height_m)
    jib = crane.luffing
    if jib is not None:
        out_m = axes[:, 1] - jib.pivot_offset_m
        exit_m = jib.pivot_height_m + np.sqrt(np.maximum(jib.length_m**2 - out_m**2, 0.0))
    return np.asarray(np.maximum(exit_m - axes[:, 2] + below_hook_m, _SHORTEST_ROPE_M), np.float64)


@lru_cache(maxsize=64)  # as ``positions_of``
def swung_parts(crane: TowerCrane, motion: LiftMotion, way: Trajectory, below_hook_m: float) -> tuple[Swung, ...]:
    """Return the swing of a load in pieces: a piece ends after each stop and its hold; the next one starts at rest.

    ``below_hook_m`` is the distance from the hook down to the middle of the load.
    """
    stops = [(begin_ns - motion.start_ns, end_ns - motion.start_ns) for begin_ns, end_ns in motion.stops_ns]
    rests = [end for begin, end in stops if begin < way.time_ns[-1] and end > way.time_ns[0]]
    axes, found = way.axes, []
    for low_ns, high_ns in pairwise([int(way.time_ns[0]), *rests, int(way.time_ns[-1])]):
        part = (way.time_ns >= low_ns) & (way.time_ns <= high_ns)
        if part.sum() < 2:
            continue
        time_ns = way.time_ns[part]
        if high_ns in rests:
            # The swing of an undamped load repeats after one period: a longer hold adds nothing.
            period_s = 2.0 * np.pi * np.sqrt(_ropes_m(crane, axes[part][-1:], below_hook_m)[0] / GRAVITY_M_S2)
            time_ns[-1] = min(time_ns[-1], time_ns[-2] + round(1e9 * period_s))
        found.append(swung_on(crane, time_ns, axes[part], below_hook_m))
    return tuple(found)


def swung_on(crane: TowerCrane, time_ns: NDArray[np.int64], samples: NDArray[np.float64], below_hook_m: float) -> Swung:
    """Return the swing at the samples and at times between them, at most a step apart; it begins at rest.

    Args:
        crane: The crane as rigged for the load.
        time_ns: (N,) times of the samples, ascending.
        samples: (N, 3) slew (rad), radius (m) and height (m).
        below_hook_m: Distance from the hook down to the middle of the load.
    """
    axes, since_s = _between(np.ascontiguousarray(samples), np.ascontiguousarray(time_ns))
    length_m = _ropes_m(crane, axes, below_hook_m)
    bend = _gradient(_gradient(length_m, since_s), since_s)
    bend = np.clip(bend, -crane.hoist.acceleration, crane.hoist.acceleration)
    stiffness = (GRAVITY_M_S2 - bend) / length_m
    hook_m = hook_of(crane, *axes.T)
    offset, amplitude = _turned(hook_m, np.sqrt(stiffness), np.diff(since_s))
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
