"""The proof that lifts follow each other on the site's clock, also where a log does not carry all of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from bimvox.proof.durations import least_ns
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check

_MOST_NS = 86_400_000_000_000
"""A lift that a log does not carry takes at most this long, in addition to the crew's time and waiting."""


def check_clock(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift]) -> None:
    """Check that each lift of a crane starts when the one before it ends.

    Of lifts that the log does not carry, only bounds are known: each takes at least the crew's time and at most a day
    more, and waits at most for other cranes and until obstructions change.

    Args:
        check: Receives the result.
        plan: The plan.
        motions: Its motions, one per planned lift.
        context: Lifts of the same plan that it does not contain.
    """
    site, by_order = plan.site, {motion.order: motion for motion in motions}
    planned = [lift for lift in (*plan.lifts, *context) if lift.status is Status.PLANNED]
    planned.sort(key=lambda lift: lift.order)
    crew_ns = {
        lift.order: least_ns(site.rules, site.components[lift.component])
        for lift in planned
        if lift.order not in by_order
    }
    changed_ns = plan.history[-1].until_ns if plan.history else 0
    others_ns = max((motion.end_ns for motion in motions), default=0) if site.has_several_cranes else 0
    for crane in range(max(1, len(site.cranes))):
        before_ns, skipped = 0, list[int]()
        for lift in planned:
            part = site.components[lift.component]
            if part.crane != crane:
                continue
            if (motion := by_order.get(lift.order)) is None:
                skipped.append(lift.order)
                continue
            check.about, name = part.id, f"lift {lift.number} ({part.label})"
            least = before_ns + sum(crew_ns[order] for order in skipped)
            waits_ns = sum(crew_ns[order] + _MOST_NS for order in (crew_ns if site.has_several_cranes else skipped))
            most = max(before_ns, changed_ns, others_ns) + waits_ns if skipped else before_ns
            after = (
                f" the {len(skipped)} lifts before it that are not in this log" if skipped else " the lift before it"
            )
            check.look(
                least <= motion.start_ns <= most,
                f"{name}: starts at {motion.start_ns / 1e9:.3f} s; after{after}, it can start "
                + (f"from {least / 1e9:.3f} s to {most / 1e9:.3f} s" if skipped else f"at {least / 1e9:.3f} s"),
            )
            before_ns, skipped = motion.end_ns, []
    check.about = None
