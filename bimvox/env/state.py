"""The state of one lift in transit."""

from __future__ import annotations

from typing import NamedTuple

from bimvox.compiled import leaf_kernel

NO_ACTION = -1
"""``last_action`` before the first move."""


class LiftState(NamedTuple):
    """Where the component is and how it got there; a plain tuple, so that kernels take it.

    Attributes:
        x: Reference cell.
        y: Reference cell.
        z: Reference cell.
        last_action: The action taken last, ``NO_ACTION`` before the first.
        steps: Actions taken since the start, bumps included.
    """

    x: int
    y: int
    z: int
    last_action: int
    steps: int


@leaf_kernel
def initial_state(x: int, y: int, z: int) -> LiftState:
    """Return the state of a component that hangs at reference cell (x, y, z), ready for transit."""
    return LiftState(int(x), int(y), int(z), NO_ACTION, 0)
