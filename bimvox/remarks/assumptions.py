"""What a plan assumes: nobody has to decide about it, but a reader must know it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from math import degrees

import numpy as np

from bimvox.bim.kinds.kind import Confidence, Kind
from bimvox.bim.placed_twice import is_about_place
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import enumerated
from bimvox.records.remark import ASSUMED_KIND, Remark, Severity
from bimvox.remarks.subject import Subject, metres
from bimvox.site.component import Component
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times
from bimvox.site.part_names import names_by_id, with_names
from bimvox.site.site import HeadingRule, SwingRule
from bimvox.site.work import work_of

ASSUMED_MASS = "assumed_mass"
ASSUMED_CONTACT = "assumed_contact"
ASSUMED_TACKLE = "assumed_tackle"
ASSUMED_TIMES = "assumed_times"
ASSUMED_SWING = "assumed_swing"
ASSUMED_HEADING = "assumed_heading"
ASSUMED_GROUND = "assumed_ground"
PLAN_NOTE = "plan_note"
PLACED_TWICE = "placed_twice"

_MOST_REASONS = 4
_MASSES = {
    "default": "no mass and no known material: volume times the density of their kind, otherwise 2,400 kg/m3",
    "density": "no mass in the model: volume times a density of the material",
    "": "a mass of unknown origin",
}


def assumptions(subject: Subject) -> Iterator[Remark]:
    """Yield notes about what is assumed."""
    site, own = subject.site, subject.site.rules
    yield from _kinds(subject)
    for source, said in _MASSES.items():
        count = sum(component.mass_source == source for component in subject.lifted)
        if count:
            yield _note(ASSUMED_MASS, f"{count:,} of {len(subject.lifted):,} parts have {said}")
    yield _note(
        ASSUMED_CONTACT,
        f"neighbours may overlap by {own.contact_tolerance_m * 1000.0:g} mm, and a part rests on what is up to "
        f"{own.support_gap_m * 1000.0:g} mm below it",
    )
    yield _note(ASSUMED_GROUND, _ground(subject))
    if site.cranes:
        yield from _of_cranes(subject)
    yaw_rad = float(np.arctan2(site.site_to_ifc[1, 0], site.site_to_ifc[0, 0]))
    if abs(yaw_rad) > 1e-9:
        yield _note(ASSUMED_HEADING, f"the site frame is the model turned by {degrees(yaw_rad):.2f} degrees")
    names = names_by_id(site)
    for note in (*site.notes, *subject.plan.notes):
        if is_about_place(note):
            yield Remark(PLACED_TWICE, Severity.MINOR, note)
        else:
            yield _note(PLAN_NOTE, with_names(note, names))


def _kinds(subject: Subject) -> Iterator[Remark]:
    """Yield a note about the parts of which the model does not say what they are: what is assumed, and by what."""
    reasons = Counter(
        (part.judgement.kind, part.judgement.why)
        for part in subject.site.components
        if part.judgement.confidence is Confidence.ASSUMED and part.stated_means is None
    )
    if not reasons:
        return
    said = [
        f"{count:,} {'of unknown kind' if kind is Kind.OTHER else f'taken as {kind.value}'} ({why})"
        for (kind, why), count in reasons.most_common(_MOST_REASONS)
    ]
    rest = reasons.total() - sum(count for _, count in reasons.most_common(_MOST_REASONS))
    yield _note(
        ASSUMED_KIND,
        f"what {reasons.total():,} of {len(subject.site.components):,} parts are is an assumption: "
        + enumerated([*said, f"{rest:,} others"] if rest else said),
    )


def _ground(subject: Subject) -> str:
    site = subject.site
    said = "the ground is flat, at z = 0" if site.natural_ground_m is None else "the ground is the terrain of the model"
    said += f" ({metres(float(site.site_to_ifc[2, 3]))} in the model), and carries the crane and the parts in the yard"
    feet_m = [float(component.mesh.bounds_m[0, 2]) for component in subject.in_place]
    above_m = min((foot for foot in feet_m if foot > 0.0), default=0.0)
    lowest_m = min(feet_m, default=0.0)
    if 0.0 < lowest_m == above_m <= subject.site.frame.voxel_size_m:
        said += f"; the lowest part, {lowest_m * 1000.0:.0f} mm above it, stands on it"
    return said


def _of_cranes(subject: Subject) -> Iterator[Remark]:
    site, own = subject.site, subject.site.rules
    for number, crane in enumerate(site.cranes):
        if any(part.lifting.rig is not None for part in subject.lifted if part.crane == number):
            yield _note(ASSUMED_TACKLE, _gear(subject, crane, number))
            continue
        yield _note(
            ASSUMED_TACKLE,
            f"crane {crane.name!r}: every part hangs on the same rigging of {crane.rigging_mass_kg:g} kg, "
            f"{metres(crane.sling_m)} high, and every lifting point holds",
        )
    yield from _crew_times(subject)
    if own.heading is HeadingRule.WITH_JIB:
        yield _note(
            ASSUMED_HEADING,
            "a load turns with the jib as if it were fixed to it, and a crew turns it to its final heading above its "
            "place; a load without room for that keeps its heading by tag line",
        )
    else:
        yield _note(ASSUMED_HEADING, "tag lines keep the heading of a load while the jib turns")
    if own.swing is SwingRule.SHAPED:
        yield _note(ASSUMED_SWING, "a load swings like a point on its rope, without wind and without damping")


def _gear(subject: Subject, crane: TowerCrane, number: int) -> str:
    """Return what is assumed about gear that was chosen for the parts of a crane."""
    own = [part.lifting for part in subject.lifted if part.crane == number and part.lifting.rig is not None]
    assumed = sum(lifting.source != "anchors" for lifting in own)
    points = "every lifting point holds"
    if assumed:
        points = f"the lifting points of {assumed:,} of {len(own):,} parts are assumed, and each holds"
    return (
        f"crane {crane.name!r}: gear is chosen for each part from a catalogue, whose fittings and lengths are partly "
        f"assumed; {points}; the empty hook carries {crane.rigging_mass_kg:g} kg of gear, {metres(crane.sling_m)} high"
    )


def _crew_times(subject: Subject) -> Iterator[Remark]:
    own = subject.site.rules
    by_work: dict[str, list[Component]] = {}
    for component in subject.lifted:
        by_work.setdefault(work_of(component), []).append(component)
    for work in sorted(by_work):
        crew = crew_times(own, by_work[work][0])
        tags = f"twice {crew.tag_line_s:g} s for tag lines, " if crew.tag_line_s else ""
        yield _note(
            ASSUMED_TIMES,
            f"each lift ({work}) takes a crew {crew.sling_s:g} s to sling, {tags}{TRIAL_LIFT_S:g} s of trial lift, "
            f"{crew.brace_s:g} s to align and brace, and {crew.release_s:g} s to take the slings off: nominal values, "
            "not measured",
        )


def _note(kind: str, said: str) -> Remark:
    return Remark(kind, Severity.NOTE, said)
