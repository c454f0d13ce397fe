"""The conditions under which a verdict holds: what the proof took as given, in short sentences."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from bimvox.proof.over_time import not_current
from bimvox.records.lift import NOT_LIFTED, Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.reasons import NOT_ITS_CELLS
from bimvox.remarks.subject import name_of
from bimvox.site.crew_times import crew_times
from bimvox.site.governing_wind import needs_less_wind
from bimvox.site.site import SwingRule

_NAMED = 3
_TURN = "when it is their turn: after the hook has left the part before, and before the next part is set"


def conditions_of(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()) -> tuple[str, ...]:
    """Return the conditions under which a plan that is proven can be relied on.

    Args:
        plan: The plan.
        motions: The timed motions of its lifts.
        context: Lifts of the same plan that it does not contain.
    """
    site, own, found = plan.site, plan.site.rules, []
    labels = {component.id: name_of(component) for component in site.components}

    def say(count: Sequence[str], text: str) -> None:
        if count:
            found.append(f"{text}: {_names([labels.get(one, one) for one in count])}")

    say(
        not_current(plan, motions),
        "lifts are proven against earlier obstructions only, because they had ended before the current ones came",
    )
    if context:
        found.append(
            f"{len(context):,} of {len(plan.lifts) + len(context):,} lifts are not in this log: they are carried out "
            "as its plan says, and were not proven"
        )
    lifts = sorted((*plan.lifts, *context), key=lambda lift: lift.order)
    say(
        [site.components[lift.component].id for lift in lifts if lift.by_other_means],
        f"parts are set by other means {_TURN}",
    )
    for status, done in ((Status.IN_SITU, "cast in place"), (Status.BY_HAND, "set by hand")):
        say(
            [site.components[lift.component].id for lift in lifts if lift.status is status],
            f"parts are {done} {_TURN}",
        )
    say(
        [site.components[lift.component].id for lift in lifts if not lift.is_set],
        "infeasible parts are not there while the others are lifted, or are set by other means out of their way",
    )
    say(
        [site.components[lift.component].id for lift in lifts if (lift.reason or "").startswith(NOT_ITS_CELLS)],
        "parts that are not lifted are where their cells are, although these do not fit their surfaces",
    )
    say(plan.unheld, "parts are held by something that is not in the model until their neighbours are set")
    if plan.clashes:
        pairs = [f"{labels.get(one.first, one.first)} and {labels.get(one.second, one.second)}" for one in plan.clashes]
        found.append(f"parts may overlap as deep as they are drawn into each other: {_names(pairs)}")
    if site.cranes:
        if not site.exact_hook:
            size_m = site.frame.voxel_size_m
            found.append(
                f"hooks are up to {size_m / 2**0.5:.2f} m away from the centre of mass: in the middle of a cell"
            )
        if own.times is None:
            crew = crew_times(own, site.components[0])
            found.append(
                f"every part takes {crew.sling_s:g} s to sling, {crew.brace_s:g} s to set and {crew.release_s:g} s to "
                "release: the rules of this log give no times by class of work"
            )
        if own.casting is None and any(lift.status in NOT_LIFTED for lift in lifts):
            found.append("work cast in place and set by hand takes no time: the rules of this log give no times for it")
        if (turned := _turned(motions)) is not None:
            found.append(turned)
        if not own.wind_speed_m_s:
            found.append("there is no wind")
        planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
        say(
            [site.components[i.component].id for i in planned if needs_less_wind(site, site.components[i.component])],
            f"lifts wait for less wind than {own.wind_speed_m_s:g} m/s, each for its own limit",
        )
        say(
            [site.components[lift.component].id for lift in planned if lift.clearance_m is not None],
            "lifts keep less than the clearance in transit that the rules ask for",
        )
        if own.swing is SwingRule.OFF:
            found.append("loads do not swing")
        if not own.rope:
            found.append("the hoist rope touches nothing")
    return tuple(found)


def _turned(motions: Sequence[LiftMotion]) -> str | None:
    """Return that tag lines keep the heading of the loads, and how far the jib turns while they hang on the hook."""
    turns = sorted(float(np.degrees(np.abs(np.diff(motion.loaded.slew_rad)).sum())) for motion in motions)
    if not turns:
        return None
    middle = turns[len(turns) // 2]
    return (
        f"people keep the heading of every load by tag line while the jib turns: by {middle:.0f} degrees in the median "
        f"lift, by {turns[-1]:.0f} degrees at most"
    )


def _names(labels: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are."""
    more = f" and {len(labels) - _NAMED:,} more" if len(labels) > _NAMED else ""
    return ", ".join(labels[:_NAMED]) + more
