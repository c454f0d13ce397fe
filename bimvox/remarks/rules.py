"""Rules that are looser than usual, proofs switched off, obstructions outside the site, what ends too late."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from math import degrees, pi, radians

from bimvox.errors import listed
from bimvox.motion.figures import wind_limits
from bimvox.proof.over_time import not_current
from bimvox.records.lift import Status
from bimvox.records.programme import TaskDates
from bimvox.records.proof import Remark
from bimvox.records.tandem import SharedLoad
from bimvox.remarks import table
from bimvox.remarks.near_rest import near_rest
from bimvox.remarks.subject import Subject, tonnes
from bimvox.site.component import Component
from bimvox.site.crew_times import crew_times
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.lifting import edge_on_deg, is_below_least_wind, needs_less_wind, permitted_for
from bimvox.site.means import Means
from bimvox.site.obstructions.coordinates import is_about_coordinates
from bimvox.site.site import HeadingRule, Rules, Site, SwingRule
from bimvox.site.work import Work, work_of
from bimvox.units import clock

MOST_TOLERANCE_M = 0.025
"""Largest tolerance on place and size of a precast part (EN 13670, class 1; EN 13369)."""
MOST_GAP_M = 0.1
"""Higher than any bearing or grout joint (professional judgement)."""
LEAST_SLING_S, LEAST_BRACING_S, LEAST_RELEASE_S = 30.0, 60.0, 15.0
"""No crew attaches slings, aligns and braces a part, or takes its slings off, in less (professional judgement)."""
LEAST_HOURS_M3, LEAST_WAIT_H, MOST_PEOPLE = 1.0, 12.0, 50.0
"""Nobody casts a cubic metre in less, concrete carries nothing sooner, and more people do not cast one part together
(professional judgement)."""
MOST_SLING_ANGLE_RAD = pi / 2.0
"""Two legs of a sling that spread by more carry, together, more than 1.4 times the weight."""
MOST_LEAN_RAD = radians(4.0)
"""Usual largest angle at which a rope runs onto a sheave (professional judgement)."""
LEAST_DRAG = 1.1
"""Of a cube; long parts and plates have more."""


def rules(subject: Subject) -> Iterator[Remark]:
    """Yield remarks about rules under which "proven" means less than usual."""
    own = subject.site.rules
    if subject.site.cranes:
        yield from _of_cranes(own)
        yield from _of_crews(subject)
        yield from _kept_less(subject)
        yield from near_rest(subject)
    if own.contact_tolerance_m > MOST_TOLERANCE_M:
        yield table.CONTACT_TOLERANCE(tolerance=own.contact_tolerance_m * 1000.0, most=MOST_TOLERANCE_M * 1000.0)
    yield from _of_casting(subject)
    if own.support_gap_m > MOST_GAP_M:
        yield table.SUPPORT_GAP(gap=own.support_gap_m * 1000.0)


def _of_cranes(own: Rules) -> Iterator[Remark]:
    if not own.wind_speed_m_s:
        yield table.NO_WIND()
    elif own.drag_coefficient < LEAST_DRAG:
        yield table.LITTLE_DRAG(drag=own.drag_coefficient)
    if own.sling_angle_rad > MOST_SLING_ANGLE_RAD:
        yield table.SLING_ANGLE(angle=degrees(own.sling_angle_rad), most=degrees(MOST_SLING_ANGLE_RAD))
    if own.swing is SwingRule.OFF:
        yield table.NO_SWING()
    if not own.rope:
        yield table.NO_ROPE()


_IN_TRANSIT = (("its load keeps", "transit_clearance_m"), ("its hook and rope keep", "rope_clearance_m"))


def _kept_less(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that keeps less than the rules, which give way, or has no room to turn."""
    site, own = subject.site, subject.site.rules
    planned = [lift for lift in subject.plan.lifts if lift.status is Status.PLANNED]
    kept, flips, tandems = (
        {lift.component: getattr(lift, key) for lift in planned} for key in ("kept", "flip", "tandem")
    )
    limits = wind_limits(subject.motions)
    kept_headings = {lift.component for lift in planned if not lift.ever_with_jib}
    for component in subject.lifted:
        less = kept.get(component.index, ALL_KEPT)
        said = " and ".join(
            f"{what} {getattr(less, rule):g} m, not {getattr(own, rule):g} m"
            for what, rule in _IN_TRANSIT
            if getattr(less, rule) is not None
        )
        if said:
            row = table.SMALL_ROPE_CLEARANCE if less.transit_clearance_m is None else table.SMALL_CLEARANCE
            yield row(component, kept=said)
        if own.heading is HeadingRule.WITH_JIB and component.index in kept_headings:
            yield table.KEPT_HEADING(component)
        flip = flips.get(component.index)
        if flip is not None and flip.lean_rad > MOST_LEAN_RAD:
            yield table.FLIP_LEANS(component, lean=degrees(flip.lean_rad))
        shared = tandems.get(component.index)
        if shared is not None:
            yield _by_two(site, component, shared)
        kept_m = own.kept_m("transit_clearance_m", less)
        yield from _less_wind(site, component, kept_m, limits.get(component.index))


def _by_two(site: Site, component: Component, shared: SharedLoad) -> Remark:
    """Return the remark about a part that two cranes carry together, with the share of each."""
    first, second = (site.cranes[number].name for number in shared.cranes)
    return table.BY_TWO_CRANES(
        component,
        first=first,
        second=second,
        level=shared.load_kg[0] / 1000.0,
        also=shared.load_kg[1] / 1000.0,
        most=shared.most_kg[0] / 1000.0,
        most_also=shared.most_kg[1] / 1000.0,
        angle=round(degrees(shared.off_level_rad), 3),
        used=100.0 * shared.used[0],
        used_also=100.0 * shared.used[1],
        apart=shared.apart_m,
    )


def _less_wind(site: Site, component: Component, kept_m: float, stated_m_s: float | None) -> Iterator[Remark]:
    """Yield a remark about a part that waits for less wind; a serious one if no lift should need so little.

    ``kept_m``: what its load keeps in transit; ``stated_m_s``: the wind in which its motion permits it.
    """
    crane, least = site.crane_of(component), site.rules.least_wind_m_s
    if crane is None:
        return
    by_sail_m_s = permitted_for(site, crane, component)
    most = by_sail_m_s if stated_m_s is None else stated_m_s
    by_sail = most >= by_sail_m_s * (1.0 - 1e-9)
    why = f"its sail area is {component.sail_area_m2:.1f} m2 for {tonnes(component.mass_kg)}"
    if not by_sail:
        why = f"a stronger gust swings it further than the {kept_m:g} m that it keeps in transit"
    if is_below_least_wind(site, component, most):
        sector = edge_on_deg(site, component) if by_sail else None
        row = table.EDGE_ON_WIND if sector is not None else table.BELOW_LEAST_WIND
        yield (row if by_sail else table.BELOW_LEAST_CLEAR)(component, most=most, why=why, least=least, sector=sector)
    elif needs_less_wind(site, component, most):
        yield table.LOW_WIND(component, most=most, why=why, other=site.rules.wind_speed_m_s)


def _of_crews(subject: Subject) -> Iterator[Remark]:
    for crew in sorted({crew_times(subject.site.rules, component) for component in subject.lifted}):
        given = (crew.sling_s, crew.brace_s, crew.release_s)
        if any(
            s < least_s for s, least_s in zip(given, (LEAST_SLING_S, LEAST_BRACING_S, LEAST_RELEASE_S), strict=True)
        ):
            yield table.CREW_TIMES(sling=crew.sling_s, brace=crew.brace_s, release=crew.release_s)


def _of_casting(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about each class of concrete work in the plan that takes, or carries after, too short a time."""
    casting = subject.site.rules.casting
    cast = {work_of(component) for component in subject.in_place if component.means is Means.IN_SITU} - {Work.STEEL}
    for work in sorted(cast):
        own = getattr(casting, work.value)
        if own.hours_m3 < LEAST_HOURS_M3 or own.wait_h < LEAST_WAIT_H or casting.people > MOST_PEOPLE:
            people, wait_h = casting.people, own.wait_h
            yield table.CASTING_TIMES(hours=own.hours_m3, people=people, wait=wait_h, work=work.value)


_NAMED = re.compile(r"obstruction .* lies outside the site, which is (.*)", re.DOTALL)
_COUNTED = re.compile(r"more obstructions: .*?([\d,]+) outside the site")


def outside(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about obstructions outside the site, a serious one if none is inside, and how others were read."""
    notes = subject.site.obstruction_notes
    yield from (table.COORDINATES(note=note) for note in notes if is_about_coordinates(note))
    if (said := none_inside(subject.site)) is not None:
        yield table.NONE_INSIDE(said=said)
    elif count := _count(notes):
        lie, them = (" lies", "it") if count == 1 else ("s lie", "them")
        yield table.OUTSIDE(count=count, s=lie, them=them)


def none_inside(site: Site) -> str | None:
    """Return the serious remark about a site outside of which all its obstructions lie; None if that is not so."""
    notes = site.obstruction_notes
    count = _count(notes)
    if not count or any(blocker.kind == "obstruction" for blocker in site.blockers):
        return None
    whole, them = ("the only obstruction lies", "it") if count == 1 else (f"all {count:,} obstructions lie", "them")
    extent = next((f", which is {found[1]}" for note in notes if (found := _NAMED.fullmatch(note))), "")
    check = "check unit and coordinates of the file (bimvox inspect shows them)"
    return f"{whole} outside the site{extent}: nothing is planned around {them}; {check}"


def _count(notes: Sequence[str]) -> int:
    """Return how many obstructions lie outside the site by these notes."""
    counted = (int(found[1].replace(",", "")) for note in notes if (found := _COUNTED.match(note)))
    return sum(_NAMED.fullmatch(note) is not None for note in notes) + sum(counted)


def earlier(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that was set before the obstructions became the current ones, with the times."""
    ids = set(not_current(subject.plan, subject.motions))
    set_ns = {motion.component: motion.set_ns for motion in subject.motions}
    for component in subject.lifted:
        if component.id in ids:
            set_at, since = (clock(ns / 1e9) for ns in (set_ns[component.index], subject.plan.history[-1].until_ns))
            yield table.NOT_CURRENT(component, set_at=set_at, since=since)


_MOST_NAMED = 5


def late(tasks: Iterable[TaskDates]) -> tuple[Remark, ...]:
    """Return one remark about the tasks of a programme that end on a later day than it wants; the latest first."""
    tasks = tuple(tasks)
    found = sorted(
        ((task.late_days or 0, task) for task in tasks if (task.late_days or 0) > 0), key=lambda one: -one[0]
    )
    if not found:
        return ()
    named = listed(
        (f"{task.task.path} ({days:,} working day{'' if days == 1 else 's'})" for days, task in found), _MOST_NAMED
    )
    return (table.LATE(late=len(found), count=len(tasks), named=named),)
