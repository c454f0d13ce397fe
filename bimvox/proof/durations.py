"""The proof that the crew gets the time that the rules give it."""

from __future__ import annotations

from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.site import HOOK_ON_S, TRIAL_LIFT_S, Rules


def least_ns(rules: Rules) -> int:
    """Return the least time of a lift: that of the crew, without any motion of the crane."""
    return round((HOOK_ON_S + TRIAL_LIFT_S + rules.bracing_s + rules.release_s) * 1e9)


def check_durations(check: Check, name: str, rules: Rules, motion: LiftMotion) -> None:
    """Check that the crew has the time of the rules to hook on, check the raised part, set it and release it."""
    given_ns = {
        phase: sum(p.end_ns - p.start_ns for p in motion.phases if p.name is phase)
        for phase in (PhaseName.HOOK_ON, PhaseName.RAISE, PhaseName.SET, PhaseName.RELEASE)
    }
    given_ns[PhaseName.RAISE] -= int(motion.raising.time_ns[-1] - motion.raising.time_ns[0])
    for phase, what, wanted_s in (
        (PhaseName.HOOK_ON, "hooking on", HOOK_ON_S),
        (PhaseName.RAISE, "the trial lift", TRIAL_LIFT_S),
        (PhaseName.SET, "setting", rules.bracing_s),
        (PhaseName.RELEASE, "releasing", rules.release_s),
    ):
        check.look(
            given_ns[phase] >= round(wanted_s * 1e9),
            f"{name}: {what} takes {given_ns[phase] / 1e9:.6g} s; the rules ask for {wanted_s:g} s",
        )
