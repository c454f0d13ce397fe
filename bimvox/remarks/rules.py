"""Rules of the site that are looser than usual, and proofs that it switches off."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.records.lift import Status
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about
from bimvox.site.crew_times import crew_times
from bimvox.site.governing_wind import needs_less_wind, permitted_for
from bimvox.site.site import HeadingRule, Rules, SwingRule

WIND = "wind"
LOW_WIND = "low_wind"
SMALL_CLEARANCE = "small_clearance"
KEPT_HEADING = "kept_heading"
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
        yield from _kept_less(subject)
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


def _kept_less(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that keeps less than the rules, which give way, or has no room to turn."""
    site, own = subject.site, subject.site.rules
    planned = [lift for lift in subject.plan.lifts if lift.status is Status.PLANNED]
    clearances = {lift.component: lift.clearance_m for lift in planned}
    kept_headings = {lift.component for lift in planned if not lift.ever_with_jib}
    for component in subject.lifted:
        kept_m = clearances.get(component.index)
        if kept_m is not None:
            wanted_m = max(own.transit_clearance_m, own.rope_clearance_m)
            said = f"keeps a clearance of {kept_m:g} m in transit, not {wanted_m:g} m: there is no way with more"
            yield about(component, SMALL_CLEARANCE, Severity.MINOR, said)
        if own.heading is HeadingRule.WITH_JIB and component.index in kept_headings:
            said = "keeps its heading by tag line: it has no room to turn with the jib"
            yield about(component, KEPT_HEADING, Severity.MINOR, said)
        crane = site.crane_of(component)
        if crane is not None and needs_less_wind(site, component):
            most, sail_m2 = permitted_for(site, crane, component), component.sail_area_m2
            said = f"may be lifted in wind up to {most:.1f} m/s only: its sail area is {sail_m2:.1f} m2"
            yield about(component, LOW_WIND, Severity.MINOR, f"{said}; other lifts up to {own.wind_speed_m_s:g} m/s")


def _of_crews(subject: Subject) -> Iterator[Remark]:
    for crew in sorted({crew_times(subject.site.rules, component) for component in subject.lifted}):
        if crew.brace_s < LEAST_BRACING_S or crew.release_s < LEAST_RELEASE_S:
            said = f"{crew.brace_s:g} s to align and brace a part and {crew.release_s:g} s to take its slings off"
            yield Remark(CREW_TIMES, Severity.MINOR, f"{said} are too short for a crew")
