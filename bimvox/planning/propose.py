"""What the planner asks a policy: the ways of some lifts, all at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.site.collision import CollisionSpace
from bimvox.site.component import IntVec


@dataclass(frozen=True, slots=True, eq=False)
class Transit:
    """A way to be found.

    Attributes:
        space: The collision rule at its stage of assembly.
        start_vox: Reference cell of the transit start.
        goal_vox: Reference cell of the gate.
        least_moves: The fewest moves possible, where known. A policy may stop looking once it has a way as short; what
            it proposes must not depend on it otherwise.
    """

    space: CollisionSpace
    start_vox: IntVec
    goal_vox: IntVec
    least_moves: int | None = None


Propose = Callable[[Sequence[Transit]], Sequence["NDArray[np.int32] | None"]]
"""A policy: per way an (N, 3) int32 path from start to goal, or None where it did not arrive."""
