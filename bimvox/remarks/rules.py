"""Rules of the site that are looser than usual, and proofs that it switches off."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject
from bimvox.site.crew_times import crew_times
from bimvox.site.site import Rules, SwingRule

WIND = "wind"
SWING = "swing"
ROPE = "rope"
TOLERANCE = "tolerance"
CREW_TIMES = "crew_times"

MOST_TOLERANCE_M = 0.025
"""Largest tolerance on place and size of a precast part (EN 13670, class 1; EN 13369)."""
MOST_GAP_M = 0.1
"""Higher than any bearing or grout joint (professional judgement)."""
LEAST_BRACING_S, LEAST_RELEASE_S = 60.0, 15.0
"""No crew aligns and braces a part, or takes its slings off, in less (professional judgement)."""


def rules(subject: Subject) -> Iterator[Remark]:
    """Yield remarks about rules under which "proven" means less than usual."""
    own = subject.site.rules
    if subject.site.cranes:
        yield from _of_cranes(own)
        yield from _of_crews(subject)
    if own.contact_tolerance_m > MOST_TOLERANCE_M:
        said = f"parts may be set {own.contact_tolerance_m * 1000.0:.0f} mm into each other (rules.contact_tolerance_m)"
        yield Remark(TOLERANCE, Severity.MINOR, f"{said}; {MOST_TOLERANCE_M * 1000.0:.0f} mm is a usual limit")
    if own.support_gap_m > MOST_GAP_M:
        said = f"a part counts as carried by what is up to {own.support_gap_m * 1000.0:.0f} mm below it"
        yield Remark(TOLERANCE, Severity.MINOR, f"{said} (rules.support_gap_m)")


def _of_cranes(own: Rules) -> Iterator[Remark]:
    if not own.wind_speed_m_s:
        yield Remark(WIND, Severity.MINOR, "no wind is considered: rules.wind_speed_m_s is 0")
    if own.swing is SwingRule.OFF:
        said = 'the swing of loads is not considered (rules.swing = "off"): they may hit something when they swing'
        yield Remark(SWING, Severity.SERIOUS, said)
    if not own.rope:
        said = "the hoist rope is not considered (rules.rope = false): it may touch what is above a load"
        yield Remark(ROPE, Severity.SERIOUS, said)


def _of_crews(subject: Subject) -> Iterator[Remark]:
    for crew in sorted({crew_times(subject.site.rules, component) for component in subject.lifted}):
        if crew.brace_s < LEAST_BRACING_S or crew.release_s < LEAST_RELEASE_S:
            said = f"{crew.brace_s:g} s to align and brace a part and {crew.release_s:g} s to take its slings off"
            yield Remark(CREW_TIMES, Severity.MINOR, f"{said} are too short for a crew")
