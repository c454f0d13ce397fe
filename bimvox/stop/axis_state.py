"""Position, rate and acceleration of the axes during a lift, from its samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.records.motion import LiftMotion
from bimvox.units import NS_PER_S

_WINDOW = 5
"""Samples from which the state is taken: four give a cubic, the fifth checks it."""
_WAIT_NS = 2 * NS_PER_S
_SAME = 1e-9
_FROM_REST = 2
"""Samples after a rest from which the state is taken: one gives the jerk, the other checks it."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisState:
    """Position, rate and acceleration of the axes.

    Attributes:
        position: (3,) float64 slew (rad), radius (m), height (m).
        rate: (3,) float64 per second.
        acceleration: (3,) float64 per second squared.
    """

    position: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]


def state_at(motion: LiftMotion, time_ns: int) -> tuple[int, AxisState]:
    """Return the state of the axes at the first sample from a time on at which it is known exactly.

    Returns:
        The time of that sample on the site's clock, and the state there.

    Raises:
        InputError: If the lift is not under way then.
    """
    if not motion.start_ns <= time_ns <= motion.end_ns:
        raise InputError(
            f"lift {motion.number} is not under way at {time_ns / NS_PER_S:g} s",
            hint=f"it runs from {motion.start_ns / NS_PER_S:g} to {motion.end_ns / NS_PER_S:g} s",
        )
    for part in motion.trajectories:
        part_ns = part.time_ns + np.int64(motion.start_ns)
        if part_ns[0] < time_ns < part_ns[-1]:
            return _state_within(part_ns, part.axes, part.corner, time_ns)
    times, axes = motion.samples()
    still = axes[int(np.searchsorted(times, time_ns))]
    return time_ns, AxisState(still, np.zeros(3), np.zeros(3))


def _state_within(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], corner: NDArray[np.int64], wanted_ns: int
) -> tuple[int, AxisState]:
    """Return the first sample from ``wanted_ns`` on whose predecessors lie on a cubic; the best fit if none does."""
    last = len(time_ns) - 1
    first = min(max(int(np.searchsorted(time_ns, wanted_ns)), _FROM_REST), last)
    best: tuple[float, int, AxisState] | None = None
    for at in range(first, len(time_ns)):
        if best is not None and time_ns[at] > wanted_ns + _WAIT_NS:
            break
        state = _state_from_rest(time_ns, axes, corner, at)
        if state is not None:
            return int(time_ns[at]), state
        if at < min(_WINDOW - 1, last):
            continue
        off, state = _cubic_state(time_ns, axes, at)
        if best is None or off < best[0]:
            best = (off, int(time_ns[at]), state)
        if off <= _SAME:
            break
    assert best is not None
    return best[1], best[2]


def _state_from_rest(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], corner: NDArray[np.int64], at: int
) -> AxisState | None:
    """Return the state soon after a rest; None once an axis has left its first piece of constant jerk."""
    rest = max([0, *(int(n) for n in corner if n <= at)])
    if at - rest < _FROM_REST:
        return None
    since = ((time_ns[rest + 1 : at + 1] - time_ns[rest]) / NS_PER_S)[:, None]
    moved = axes[rest + 1 : at + 1] - axes[rest]
    per_cube = moved[-1] / since[-1] ** 3
    if np.abs(moved - per_cube * since**3).max() > _SAME:
        return None
    return AxisState(axes[at], 3.0 * per_cube * since[-1] ** 2, 6.0 * per_cube * since[-1])


def _cubic_state(time_ns: NDArray[np.int64], axes: NDArray[np.float64], at: int) -> tuple[float, AxisState]:
    """Return the deviation from a cubic of the samples up to ``at``, and the state by the cubic of the last four."""
    if at == len(time_ns) - 1:
        return 0.0, AxisState(axes[at], np.zeros(3), np.zeros(3))  # a trajectory ends at rest
    window = slice(max(0, at - _WINDOW + 1), at + 1)
    since = (time_ns[window] - time_ns[at]) / NS_PER_S
    values = axes[window] - axes[at]
    powers = since[-4:, None] ** np.arange(min(4, len(since)))
    # Column scaling: samples may be a millisecond or half a second apart.
    scale = max(float(-since[-4:][0]), 1e-9) ** np.arange(powers.shape[1])
    coefficients = np.linalg.lstsq(powers / scale, values[-4:], rcond=None)[0] / scale[:, None]
    coefficients = np.concatenate([coefficients, np.zeros((4 - len(coefficients), 3))])
    off = np.abs((since[0] ** np.arange(4)) @ coefficients - values[0]).max() if len(since) == _WINDOW else np.inf
    return float(off), AxisState(axes[at], coefficients[1], 2.0 * coefficients[2])
