"""The part of a revision that depends on the cranes: what a stop does, and when each lift starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from bimvox.planning.rounds import Refused
from bimvox.records.lift import Lift
from bimvox.revision.part_proof import Proof
from bimvox.revision.walk_result import WalkResult

if TYPE_CHECKING:
    from bimvox.revision.walk import Walk


class CraneWork(Protocol):
    """The work of one crane (or none), or of several, in one round of a revision."""

    def begun(self, walk: Walk, was: Lift) -> Lift | None:
        """Return a lift that is done, was skipped, or is on a hook; None if the walk plans it.

        Args:
            walk: The walk, at this lift.
            was: The lift in the current plan.
        """

    def choose_motion(self, walk: Walk, lift: Lift, was: Lift) -> None:
        """Keep the motion of a lift that has not begun, or note that it is to be made or that it is pending.

        Args:
            walk: The walk, at this lift.
            lift: The lift; it is planned.
            was: The lift in the current plan.
        """

    def timed(self, made: WalkResult) -> WalkResult | Refused:
        """Return the walk's result with all its motions on the clock; or which lifts cannot be driven, and why."""

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts to refuse after a failed proof, and why."""
