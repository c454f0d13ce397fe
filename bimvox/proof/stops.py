"""The proof that an emergency stop has a cause, and that its load is given time to come to rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check

_HOLD_S = 10.0
"""Tag lines bring a load to rest in this time; nominal."""
_PAUSE_S = 1.0
"""An empty hook is at rest for this long before it moves again."""
_STILL = 1e-6
"""An axis that moves by less, rad or m, is at rest."""


def check_stops(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion]) -> None:
    """Check every phase called stop: the obstructions changed before it, and at its end the crane has held still.

    After it, the proof of the swing takes the load to hang at rest. What is stopped for good may still swing.

    Args:
        check: Receives the result.
        plan: The plan, with its past obstructions.
        motions: Its motions.
    """
    changes_ns = [epoch.until_ns for epoch in plan.history]
    for motion in motions:
        part = plan.site.components[motion.component]
        check.about, name = part.id, f"lift {motion.number} ({part.label})"
        for begins_ns, ends_ns in motion.stops_ns:
            caused = any(change_ns <= begins_ns for change_ns in changes_ns)
            at = f"at {begins_ns / 1e9:.3f} s"
            check.look(caused, f"{name}: it is stopped {at}, but the obstructions do not change before that")
            still_s = _still_s(motion, begins_ns, ends_ns)
            is_empty = ends_ns <= motion.hooked_ns or begins_ns >= motion.released_ns
            least_s = _PAUSE_S if is_empty else _HOLD_S
            check.look(
                still_s >= least_s - 1e-6 or ends_ns == motion.end_ns,
                f"{name}: it is stopped {at}, and held still for {still_s:.3g} s; {least_s:g} s bring it to rest",
            )
    check.about = None


def _still_s(motion: LiftMotion, begins_ns: int, ends_ns: int) -> float:
    """Return for how long no axis has moved at the end of a stop."""
    times_ns, axes = motion.samples()
    rest = np.array([np.interp(ends_ns, times_ns, axis) for axis in axes.T])
    inside = (times_ns >= begins_ns) & (times_ns <= ends_ns)
    moves = inside & (np.abs(axes - rest).max(axis=1) > _STILL)
    if not moves.any():
        return (ends_ns - begins_ns) / 1e9
    after = times_ns[int(np.flatnonzero(moves)[-1]) + 1 :]
    return (ends_ns - int(after[0])) / 1e9 if len(after) and after[0] <= ends_ns else 0.0
