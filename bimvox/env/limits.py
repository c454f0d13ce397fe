"""How many actions an episode may take."""

from __future__ import annotations

from typing import NamedTuple

from bimvox.compiled import leaf_kernel


class StepLimit(NamedTuple):
    """``factor`` times the fewest possible moves, plus ``slack``; a plain tuple, so that kernels take it."""

    factor: float = 2.0
    slack: int = 20


@leaf_kernel
def steps_allowed(limit: StepLimit, moves: int) -> int:
    """Return the actions allowed for a lift of at least ``moves`` moves."""
    return int(limit.factor * moves) + int(limit.slack)
