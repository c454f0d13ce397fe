"""The interface between planner and policy: transits to be found, in batches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.site.collision import CollisionSpace
from bimvox.site.component import IntVec


@dataclass(frozen=True, slots=True, eq=False)
class Transit:
    """A transit to be found.

    Attributes:
        space: The collision rule at its stage.
        start_vox: Reference cell of the transit start.
        goal_vox: Reference cell of the gate.
        least_moves: The fewest moves possible, if known. A policy may stop at a path of that length; otherwise its
            proposal must not depend on it.
    """

    space: CollisionSpace
    start_vox: IntVec
    goal_vox: IntVec
    least_moves: int | None = None


Propose = Callable[[Sequence[Transit]], Sequence["NDArray[np.int32] | None"]]
"""A policy: per transit an (N, 3) int32 path from start to goal, or None if it did not arrive."""
