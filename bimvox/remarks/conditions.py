"""The conditions under which a verdict holds: what the proof took as given, in short sentences."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from bimvox.proof.over_time import not_current
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.reasons import NOT_ITS_CELLS
from bimvox.remarks.subject import name_of
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.governing_wind import needs_less_wind
from bimvox.site.ground import WORKING_SPACE_M
from bimvox.site.site import Site, SwingRule

Condition: TypeAlias = tuple[Sequence[str] | None, str]
"""What it is about, ids of parts or words, and its text; None: about the whole plan. Of nothing, it does not count."""

_NAMED = 3
_TURN = "when it is their turn: after the hook has left the part before, and before the next part is set"


def conditions_of(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()) -> tuple[str, ...]:
    """Return the conditions under which a plan that is proven can be relied on.

    Args:
        plan: The plan.
        motions: The timed motions of its lifts.
        context: Lifts of the same plan that it does not contain.
    """
    labels = {component.id: name_of(component) for component in plan.site.components}
    lifts = plan.lifts_with(context)
    every = [*_of_the_obstructions(plan, motions), *_of_the_ground(plan.site), *_of_the_parts(plan, lifts, labels)]
    if plan.site.cranes:
        every += _of_the_lifts(plan, motions)
    return tuple(
        text if about is None else f"{text}: {_names([labels.get(one, one) for one in about])}"
        for about, text in every
        if about is None or about
    )


def _of_the_obstructions(plan: LiftPlan, motions: Sequence[LiftMotion]) -> Iterator[Condition]:
    """Yield which lifts are proven against the obstructions before the current ones."""
    yield (
        not_current(plan, motions),
        "lifts are proven against earlier obstructions only, because their parts were set before the current ones came",
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
    yield (
        [part.id for _, part in planned if needs_less_wind(site, part)],
        f"lifts wait for less wind than {own.wind_speed_m_s:g} m/s, each for its own limit",
    )
    yield (
        [part.id for lift, part in planned if lift.kept != ALL_KEPT],
        "lifts keep less than the clearance in transit that the rules ask for",
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
    found = []
    if turned:
        found.append(
            f"{len(turned):,} of {len(motions):,} loads turn with the jib: by {_middle(turned):.0f} degrees in the "
            f"median lift, by {turned[-1]:.0f} degrees at most; people turn them to their final heading by tag line "
            f"above their places, {site.rules.turn_s:g} s a quarter"
        )
    if kept:
        whose = "every load" if not with_jib else f"{len(kept):,} loads without room to turn"
        found.append(
            f"people keep the heading of {whose} by tag line while the jib turns: by {_middle(kept):.0f} degrees in "
            f"the median lift, by {kept[-1]:.0f} degrees at most"
        )
    return found


def _degrees(motions: Iterable[LiftMotion]) -> list[float]:
    """Return by how much the jib turns in each loaded motion, degrees, ascending."""
    return sorted(float(np.degrees(np.abs(np.diff(motion.loaded.slew_rad)).sum())) for motion in motions)


def _middle(ascending: Sequence[float]) -> float:
    return ascending[len(ascending) // 2]


def _names(labels: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are."""
    more = f" and {len(labels) - _NAMED:,} more" if len(labels) > _NAMED else ""
    return ", ".join(labels[:_NAMED]) + more
