"""The proof that the crew gets the time that the rules give it."""

from __future__ import annotations

from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import HeadingRule, Rules
from bimvox.site.work import work_of

_TRIAL_LIFT_S = 10.0


def least_ns(rules: Rules, component: Component) -> int:
    """Return the least time of a lift: that of the crew, without any motion of the crane."""
    tag_lines = rules.heading is HeadingRule.KEPT
    return round((_TRIAL_LIFT_S + sum(_asked_s(rules, component, tag_lines=tag_lines))) * 1e9)


def check_durations(
    check: Check, name: str, rules: Rules, component: Component, motion: LiftMotion, *, tag_lines: bool = True
) -> None:
    """Check that the crew has the time of the rules to hook on, check the raised part, set it and release it.

    The rules give these times by the part's class of work, or one value for all classes. A load without tag lines turns
    with the jib.
    """
    hook_on_s, brace_s, hook_off_s = _asked_s(rules, component, tag_lines=tag_lines)
    given_ns = {
        phase: sum(p.end_ns - p.start_ns for p in motion.phases if p.name is phase)
        for phase in (PhaseName.HOOK_ON, PhaseName.RAISE, PhaseName.SET, PhaseName.RELEASE)
    }
    given_ns[PhaseName.RAISE] -= int(motion.raising.time_ns[-1] - motion.raising.time_ns[0])
    for phase, act, wanted_s in (
        (PhaseName.HOOK_ON, "hooking on", hook_on_s),
        (PhaseName.RAISE, "the trial lift", _TRIAL_LIFT_S),
        (PhaseName.SET, "setting", brace_s),
        (PhaseName.RELEASE, "releasing", hook_off_s),
    ):
        check.look(
            given_ns[phase] >= round(wanted_s * 1e9),
            f"{name}: {act} takes {given_ns[phase] / 1e9:.6g} s; the rules ask for {wanted_s:g} s "
            f"({work_of(component)})",
        )


def _asked_s(rules: Rules, component: Component, *, tag_lines: bool) -> tuple[float, float, float]:
    """Return what the rules ask for hooking on, setting and releasing a part, seconds.

    Tag lines are fixed while the part is hooked on, and taken off with the slings.
    """
    own = getattr(rules.times, work_of(component))
    brace_s = own.brace_s if rules.bracing_s is None else rules.bracing_s
    release_s = own.release_s if rules.release_s is None else rules.release_s
    tag_line_s = own.tag_line_s if tag_lines else 0.0
    return own.sling_s + tag_line_s, brace_s, release_s + tag_line_s
