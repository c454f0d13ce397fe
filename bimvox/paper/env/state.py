"""The state of a site under construction: numbers that change every step, and arrays that seldom change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.dynamics import LiftState

AIR, GROUND, OBSTRUCTION, FIRST_COMPONENT = 0, 1, 2, 3
"""Values of ``SiteState.cells``; component i (from 0) is ``FIRST_COMPONENT + i``."""

STATE_SIZE = 7


class PaperState(NamedTuple):
    """Which component is in transit, where, and since when, as a tuple for kernels.

    Attributes:
        component: Index of the component in transit, from 0; equal to the number of assembled ones, so n at the end.
        x: Its reference cell; at the end, that of the last one.
        y: Reference cell.
        z: Reference cell.
        last_action: The action taken last with this component, ``NO_ACTION`` before the first.
        steps: Actions taken with this component, blocked ones included.
        total: Actions taken in the episode.
    """

    component: int
    x: int
    y: int
    z: int
    last_action: int
    steps: int
    total: int


class SiteState(NamedTuple):
    """The arrays of one site. They change only when an episode starts and when a component is assembled.

    Attributes:
        cells: (X, Y, Z) int16 what fills each cell, without the component in transit.
        table: (X + 1, Y + 1, Z + 1) int32 summed-area table of the filled cells.
        stored: (n, 3) int64 x, y and axis (0 or 1) of each component's place in the yard.
        target: (n, 3) int32 reference cells.
        obstructions: (M, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1``; unused rows are zeros.
        field: (X, Y, Z) int16 moves to the target of the component in transit, -1 if there is no path; size 0 if
            it is not needed.
    """

    cells: NDArray[np.int16]
    table: NDArray[np.int32]
    stored: NDArray[np.int64]
    target: NDArray[np.int32]
    obstructions: NDArray[np.int32]
    field: NDArray[np.int16]


@leaf_kernel
def lift_state(state: PaperState) -> LiftState:
    """Return a state as the observation of one lift reads it."""
    return LiftState(state.x, state.y, state.z, state.last_action, state.steps)
