"""The parts that are set by other means than the crane: which, and when they must be in place."""

from __future__ import annotations

from collections.abc import Iterable

from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion


def by_other_means(lifts: Iterable[Lift]) -> tuple[Lift, ...]:
    """Return the lifts whose parts are set by other means, in order."""
    return tuple(sorted((lift for lift in lifts if lift.by_other_means), key=lambda lift: lift.order))


def needed_by_ns(lifts: Iterable[Lift], motions: Iterable[LiftMotion]) -> dict[int, int | None]:
    """Return when each part that the crane does not set is needed, by order: when the next part is set.

    Those are the parts that are set by other means or by hand, or cast in place. None of them may be there before all
    earlier parts of the sequence are set. None if no later part has a time.

    Args:
        lifts: All lifts of a plan.
        motions: Those of its motions whose time is known.
    """
    otherwise = [lift for lift in lifts if lift.is_set_otherwise]
    set_ns = {motion.order: motion.set_ns for motion in motions} if otherwise else {}
    return {
        lift.order: min((at_ns for order, at_ns in set_ns.items() if order > lift.order), default=None)
        for lift in otherwise
    }


def proven_in_words(count: int, claims: int = 0) -> str:
    """Return the verdict about a proven plan.

    Args:
        count: How many parts are set by other means.
        claims: How many claims of its log the proof has taken as true.
    """
    words = "proven"
    if claims:
        words += f", with {'1 claim' if claims == 1 else f'{claims:,} claims'} of the log"
    if count:
        words += f", provided that {'1 part is' if count == 1 else f'{count:,} parts are'} set by other means"
    return words
