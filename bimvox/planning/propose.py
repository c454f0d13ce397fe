"""The interface between planner and policy: a transit to be found."""

from __future__ import annotations

from collections.abc import Callable
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
    """

    space: CollisionSpace
    start_vox: IntVec
    goal_vox: IntVec


Propose = Callable[[Transit], "NDArray[np.int32] | None"]
"""Proposes a path: (N, 3) int32 from start to goal, or None if it did not arrive."""


@dataclass(frozen=True, slots=True)
class ProposedGreedily:
    """Proposes paths by greedy values, without a policy; a plan says so of each lift found by it.

    Attributes:
        ask: What proposes.
    """

    ask: Propose

    def __call__(self, transit: Transit) -> NDArray[np.int32] | None:
        """Return the path from start to goal, or None."""
        return self.ask(transit)
