"""Moves shaped together, so that the swing that one leaves is cancelled by the others.

Zero-vibration shaping takes one move at a time and assumes that the hook moves along a straight line. Slewing turns the
jib under the load, and a trolley that runs at the same time swings it sideways, so some swing is left in both
directions of the plan. The sizes of the two parts of each move and the time between them are the parameters that cancel
it. A few Gauss-Newton steps on the simulated swing find them; the crane goes no slower.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.motion.shaping import Calm
from bimvox.motion.swing import PLANNED_RESIDUAL_M

_MOVES = 3
"""How many of the last moves are adjusted: enough for both directions of the plan."""
_ROUNDS = 3
_STEP = 0.02
_ENOUGH_M = 0.25 * PLANNED_RESIDUAL_M
_AT_REST_M = 0.75 * PLANNED_RESIDUAL_M
_HOPEFUL_M = 1.5 * PLANNED_RESIDUAL_M
"""No further step is taken if the linear model leaves more than this."""
_DIGITS = 4
"""Decimals of the parameters, so that the last bits of a linear solver do not reach the log."""
_SHARE = (0.1, 0.9)
STRETCH = (0.6, 1.5)
"""Time between the parts of a move, in half periods."""

Residual = Callable[[tuple[Calm, ...]], NDArray[np.float64]]
"""From the shaping of each move to the swing that is left: (4,) float64, m."""


def cancelled(swings: Sequence[bool], residual_m: Residual) -> tuple[Calm, ...] | None:
    """Return how to shape moves so that their load hangs at rest in the end.

    Args:
        swings: For every move, whether it makes the load swing.
        residual_m: The swing that a shaping leaves.

    Returns:
        One shaping per move; None if none was found that leaves the load at rest, or if plain shaping already does.
    """
    adjusted = [n for n, swings_load in enumerate(swings) if swings_load][-_MOVES:]
    if not adjusted:
        return None

    def calms(parameters: NDArray[np.float64]) -> tuple[Calm, ...]:
        given = [Calm()] * len(swings)
        for n, (share, stretch) in zip(adjusted, parameters.reshape(-1, 2).tolist(), strict=True):
            given[n] = Calm((share, round(1.0 - share, _DIGITS)), stretch)
        return tuple(given)

    low, high = (np.tile([_SHARE[side], STRETCH[side]], len(adjusted)) for side in (0, 1))
    parameters = np.tile([0.5, 1.0], len(adjusted))
    left_m = residual_m(calms(parameters))
    if np.linalg.norm(left_m) <= _ENOUGH_M:
        return None
    for _ in range(_ROUNDS):
        steps = _STEP * np.eye(len(parameters))
        slopes = np.array([residual_m(calms(parameters + step)) - left_m for step in steps]).T / _STEP
        step, *_ = np.linalg.lstsq(slopes, -left_m, rcond=1e-3)
        if np.linalg.norm(left_m + slopes @ step) > _HOPEFUL_M:
            return None
        tried = np.round(np.clip(parameters + step, low, high), _DIGITS)
        tried_m = residual_m(calms(tried))
        if np.linalg.norm(tried_m) >= np.linalg.norm(left_m):
            break
        parameters, left_m = tried, tried_m
        if np.linalg.norm(left_m) <= _ENOUGH_M:
            break
    return calms(parameters) if np.linalg.norm(left_m) <= _AT_REST_M else None
