"""The part of a revision that depends on the cranes: what a stop does, and when each lift starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from bimvox.planning.rounds import Refused
from bimvox.records.lift import Lift
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.part_proof import Proof

if TYPE_CHECKING:
    from bimvox.revision.keep_or_replan import Replanning


class CraneWork(Protocol):
    """The work of one crane (or none), or of several, in one round of a revision."""

    def begun(self, replanning: Replanning, was: Lift) -> Lift | None:
        """Return a lift that is done, was skipped, or is on a hook; None if it is to be planned.

        Args:
            replanning: The replanning, at this lift.
            was: The lift in the current plan.
        """

    def choose_motion(self, replanning: Replanning, lift: Lift, was: Lift) -> None:
        """Keep the motion of a lift that has not begun, or note that it is to be made or that it is pending.

        Args:
            replanning: The replanning, at this lift.
            lift: The lift; it is planned.
            was: The lift in the current plan.
        """

    def timed(self, draft: RevisionDraft) -> RevisionDraft | Refused:
        """Return the draft with all its motions on the clock; or which lifts cannot be driven, and why."""

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts to refuse after a failed proof, and why."""
