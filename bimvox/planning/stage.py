"""A stage: what the planner knows when it plans a lift, or why the lift cannot be planned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.planning.insertion import Insertion
from bimvox.planning.propose import Transit
from bimvox.records.lift import YardPlace
from bimvox.site.collision import CollisionSpace
from bimvox.site.component import Component, IntVec
from bimvox.site.default_rules import ALL_KEPT, Kept


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Why a lift cannot be planned.

    Attributes:
        reason: One sentence; "it" is the part.
        blocked_by: Ids of what blocks the lift.
        cut_off: Whether the search for its last moves was ended by its limit, so there may be a way.
        on_the_way: Whether something is in the way of its transit or its last moves: less clearance may help.
        is_unsupported: Whether what it would stand on is missing: until that is set, no other means can set it either.
    """

    reason: str
    blocked_by: tuple[str, ...] = ()
    cut_off: bool = False
    on_the_way: bool = False
    is_unsupported: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """The state of the site just before a lift.

    Attributes:
        component: The part.
        place: Its place in the yard.
        space: The collision rule for its transit; the placements of its departure are cleared.
        start_vox: Start of its transit.
        insertion: Its last moves.
        free: The collision rule without any clearance, for a load that must be stopped.
        kept: What it keeps of the clearances that give way.
        turning: The rule for the transit of a load that turns with the jib; None if tag lines keep its heading.
    """

    component: Component
    place: YardPlace
    space: CollisionSpace
    start_vox: IntVec
    insertion: Insertion
    free: CollisionSpace
    kept: Kept = ALL_KEPT
    turning: CollisionSpace | None = None

    @property
    def is_turning(self) -> bool:
        """Whether the load turns with the jib."""
        return self.turning is not None

    @property
    def transit(self) -> Transit:
        """What is to be found: the way from the start to the gate."""
        return Transit(self.space if self.turning is None else self.turning, self.start_vox, self.insertion.gate_vox)

    @property
    def clearance_with_insertion(self) -> CollisionSpace:
        """The collision rule for the crane's motion: the placements of the last moves are cleared too."""
        return with_cleared(self.space, self.insertion.path_vox)

    @property
    def free_with_insertion(self) -> CollisionSpace:
        """The rule for a load that must be stopped: without clearances, the placements of the last moves cleared."""
        return with_cleared(self.free, self.insertion.path_vox)


def with_cleared(space: CollisionSpace, path_vox: NDArray[np.int32]) -> CollisionSpace:
    """Return a collision rule with (N, 3) more placements cleared."""
    if not len(path_vox):
        return space
    low, high = path_vox.min(axis=0), path_vox.max(axis=0) + 1
    if space.cleared.size:
        low = np.minimum(low, space.cleared_low)
        high = np.maximum(high, space.cleared_low + space.cleared.shape)
    cleared = np.zeros(high - low, np.bool_)
    cleared[tuple((path_vox - low).T)] = True
    before = np.argwhere(space.cleared) + space.cleared_low - low
    cleared[tuple(before.T)] = True
    return space._replace(cleared_low=low.astype(np.int32), cleared=cleared)
