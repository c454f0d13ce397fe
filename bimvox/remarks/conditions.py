"""What a verdict takes as given, and what a plan assumes, in short sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from math import degrees
from typing import TypeAlias

import numpy as np

from bimvox.bim.kinds.kind import Confidence, Kind
from bimvox.bim.site_frame import is_about_place
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import enumerated, listed
from bimvox.motion.figures import capacity_used, wind_limits
from bimvox.motion.swing import OFF
from bimvox.proof.over_time import not_current
from bimvox.records.lift import NOT_ITS_CELLS, Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Remark
from bimvox.remarks import table
from bimvox.remarks.subject import Subject, metres, name_of
from bimvox.site.component import Component
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.ground import WORKING_SPACE_M
from bimvox.site.lifting import HOOK_BLOCK_SHARE, needs_less_wind
from bimvox.site.means import Means, is_way_assumed
from bimvox.site.site import HeadingRule, Site, SwingRule, names_by_id, with_names
from bimvox.site.work import work_of

Condition: TypeAlias = tuple[Sequence[str] | None, str]
"""What it is about, ids of parts or words, and its text; None: about the whole plan. Of nothing, it does not count."""

_NAMED = 3
_TURN = "when it is their turn: after the hook has left the part before, and before the next part is set"


def conditions_of(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()) -> tuple[str, ...]:
    """Return the conditions under which a plan that is proven can be relied on.

    ``context``: lifts of the same plan that it does not contain.
    """
    labels = {component.id: name_of(component) for component in plan.site.components}
    lifts = plan.lifts_with(context)
    earlier = (
        "lifts are proven against earlier obstructions only, because their parts were set before the current ones came"
    )
    every: list[Condition] = [(not_current(plan, motions), earlier), *_of_the_ground(plan.site)]
    every += _of_the_parts(plan, lifts, labels)
    if plan.site.cranes:
        every += _of_the_lifts(plan, motions)
    return tuple(
        text if about is None else f"{text}: {listed((labels.get(one, one) for one in about), _NAMED)}"
        for about, text in every
        if about is None or about
    )


def _of_the_ground(site: Site) -> Iterator[Condition]:
    """Yield what is taken of terrain and excavation."""
    size_m, natural_m = site.frame.voxel_size_m, site.natural_ground_m
    deepest_m = float(site.dug_m.max(initial=0.0))
    if deepest_m > 1e-6:
        yield (
            None,
            f"the ground is dug out to the parts below it, {deepest_m:.1f} m deep at most and {WORKING_SPACE_M:g} m "
            "wider than they are, with upright sides that hold, and stays open until the last lift",
        )
    if natural_m is not None:
        level_m = site.frame.origin_m[2] + size_m * site.yard_floor_vox
        yield (
            None,
            f"the ground is as the terrain of the model, {natural_m.min():.1f} to {natural_m.max():.1f} m high; "
            f"the yard and the access are level, at {level_m:.1f} m",
        )


def _of_the_parts(plan: LiftPlan, lifts: Sequence[Lift], labels: Mapping[str, str]) -> Iterator[Condition]:
    """Yield what is taken of parts that the crane does not lift, that nothing holds, or that overlap."""
    components = plan.site.components

    def where(holds: Callable[[Lift], bool]) -> list[str]:
        return [components[lift.component].id for lift in lifts if holds(lift)]

    yield where(lambda lift: lift.by_other_means), f"parts are set by other means {_TURN}"
    yield where(lambda lift: lift.status is Status.IN_SITU), f"parts are cast in place {_TURN}"
    yield where(lambda lift: lift.status is Status.BUILT), f"parts are built in place by their trade {_TURN}"
    yield where(lambda lift: lift.status is Status.BY_HAND), f"parts are set by hand {_TURN}"
    yield (
        where(lambda lift: not lift.is_set),
        "infeasible parts are not there while the others are lifted, or are set by other means out of their way",
    )
    yield (
        where(lambda lift: (lift.reason or "").startswith(NOT_ITS_CELLS)),
        "parts that are not lifted are where their cells are, although these do not fit their surfaces",
    )
    yield plan.unheld, "parts are held by something that is not in the model until their neighbours are set"
    pairs = [f"{labels.get(one.first, one.first)} and {labels.get(one.second, one.second)}" for one in plan.clashes]
    yield pairs, "parts may overlap as deep as they are drawn into each other"


def _of_the_lifts(plan: LiftPlan, motions: Sequence[LiftMotion]) -> Iterator[Condition]:
    """Yield what is taken of headings, wind, clearances, swing and rope of the lifts."""
    site, own = plan.site, plan.site.rules
    yield from ((None, said) for said in _turned(site, plan.lifts, motions))
    if not own.wind_speed_m_s:
        yield None, "there is no wind"
    planned = [(lift, site.components[lift.component]) for lift in plan.lifts if lift.status is Status.PLANNED]
    limits = wind_limits(motions)
    yield (
        [part.id for _, part in planned if needs_less_wind(site, part, limits.get(part.index))],
        f"lifts wait for less wind than {own.wind_speed_m_s:g} m/s, each for its own limit",
    )
    yield (
        [part.id for lift, part in planned if lift.kept != ALL_KEPT],
        "lifts keep less than the clearances that the rules ask for",
    )
    if "highest_utilisation" in own.gives_way:
        most = own.highest_utilisation
        used = {motion.component: capacity_used(site, motion) or 0.0 for motion in motions}
        yield (
            [part.id for _, part in planned if used.get(part.index, 0.0) > most + 1e-6],
            f"lifts use more than {100.0 * most:g} % of the load chart",
        )
    if own.swing is SwingRule.OFF:
        yield None, "loads do not swing"
    if not own.rope:
        yield None, "the hoist rope touches nothing"


def _turned(site: Site, lifts: Iterable[Lift], motions: Sequence[LiftMotion]) -> list[str]:
    """Return that tag lines keep the heading of loads, that others turn with the jib, and how far the jib turns."""
    with_jib = {lift.order for lift in lifts if lift.ever_with_jib}
    kept = _degrees(motion for motion in motions if motion.order not in with_jib)
    turned = _degrees(motion for motion in motions if motion.order in with_jib)
    result = []
    if turned:
        result.append(
            f"{len(turned):,} of {len(motions):,} loads turn with the jib: by {_middle(turned):.0f} degrees in the "
            f"median lift, by {turned[-1]:.0f} degrees at most; people turn them to their final heading by tag line "
            f"above their places, {site.rules.turn_s:g} s a quarter"
        )
    if kept:
        whose = "every load" if not with_jib else f"{len(kept):,} loads without room to turn"
        result.append(
            f"people keep the heading of {whose} by tag line while the jib turns: by {_middle(kept):.0f} degrees in "
            f"the median lift, by {kept[-1]:.0f} degrees at most"
        )
    return result


def _degrees(motions: Iterable[LiftMotion]) -> list[float]:
    """Return by how much the jib turns in each loaded motion, degrees, ascending."""
    return sorted(float(np.degrees(np.abs(np.diff(motion.loaded.slew_rad)).sum())) for motion in motions)


def _middle(ascending: Sequence[float]) -> float:
    return ascending[len(ascending) // 2]


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
            yield table.ASSUMED_MASS(count=count, lifted=len(subject.lifted), said=said)
    yield table.ASSUMED_CONTACT(tolerance=own.contact_tolerance_m * 1000.0, gap=own.support_gap_m * 1000.0)
    yield table.ASSUMED_GROUND(said=_ground(subject))
    if site.cranes:
        yield from _of_cranes(subject)
    yaw_rad = float(np.arctan2(site.site_to_ifc[1, 0], site.site_to_ifc[0, 0]))
    if abs(yaw_rad) > 1e-9:
        yield table.TURNED_SITE(yaw=degrees(yaw_rad))
    names = names_by_id(site)
    for note in (*site.notes, *subject.plan.notes):
        about_place = is_about_place(note)
        yield table.PLACED_TWICE(note=note) if about_place else table.PLAN_NOTE(note=with_names(note, names))
    left = [lift for lift in subject.plan.lifts if lift.planner is None and lift.planner_note]
    if left:
        yield table.PLANNER(count=len(left), number=left[0].number, note=left[0].planner_note)


def _kinds(subject: Subject) -> Iterator[Remark]:
    """Yield a note about the parts of which the model does not say what they are, or that the crane lifts them."""
    reasons = Counter(
        (part.judgement.kind, part.judgement.why)
        for part in subject.site.components
        if part.judgement.confidence is Confidence.ASSUMED and part.stated_means is None
    )
    lifted = sum(part.means is Means.CRANE and is_way_assumed(part) for part in subject.site.components)
    of = f"of {len(subject.site.components):,} parts"
    way = f"that {lifted:,} {of} come by crane is an assumption: concrete that is not said to be precast"
    if not reasons:
        yield from [table.ASSUMED_KINDS(said=way)] * bool(lifted)
        return
    said = [
        f"{count:,} {'of unknown kind' if kind is Kind.OTHER else f'taken as {kind.value}'} ({why})"
        for (kind, why), count in reasons.most_common(_MOST_REASONS)
    ]
    rest = reasons.total() - sum(count for _, count in reasons.most_common(_MOST_REASONS))
    listed = enumerated([*said, f"{rest:,} others"] if rest else said) + f"; {way}" * bool(lifted)
    yield table.ASSUMED_KINDS(said=f"what {reasons.total():,} {of} are is an assumption: {listed}")


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
            yield _gear(subject, crane, number)
        else:
            high = metres(crane.sling_m)
            yield table.ASSUMED_RIGGING(crane=crane.name, mass=crane.rigging_mass_kg, high=high)
    yield from _crew_times(subject)
    yield table.TURNS_WITH_JIB() if own.heading is HeadingRule.WITH_JIB else table.HEADING_KEPT()
    if own.swing is SwingRule.SHAPED:
        yield table.ASSUMED_SWING(off=100.0 * OFF, share=100.0 * HOOK_BLOCK_SHARE)


def _gear(subject: Subject, crane: TowerCrane, number: int) -> Remark:
    """Return the note about gear that was chosen for the parts of a crane."""
    own = [part.lifting for part in subject.lifted if part.crane == number and part.lifting.rig is not None]
    assumed = sum(lifting.source != "anchors" for lifting in own)
    points = "every lifting point holds"
    if assumed:
        points = f"the lifting points of {assumed:,} of {len(own):,} parts are assumed, and each holds"
    mass_kg, high = crane.rigging_mass_kg, metres(crane.sling_m)
    return table.ASSUMED_GEAR(crane=crane.name, points=points, mass=mass_kg, high=high)


def _crew_times(subject: Subject) -> Iterator[Remark]:
    own = subject.site.rules
    by_work: dict[str, list[Component]] = {}
    for component in subject.lifted:
        by_work.setdefault(work_of(component), []).append(component)
    for work in sorted(by_work):
        crew = crew_times(own, by_work[work][0])
        tags = f"twice {crew.tag_line_s:g} s for tag lines, " if crew.tag_line_s else ""
        sling, brace, release = crew.sling_s, crew.brace_s, crew.release_s
        yield table.ASSUMED_TIMES(work=work, tags=tags, trial=TRIAL_LIFT_S, sling=sling, brace=brace, release=release)
