"""The motions of a part: those that are missing are made, each at its own stage, and all are laid on the clock."""

from __future__ import annotations

from dataclasses import replace

from bimvox.errors import MotionError
from bimvox.motion.shift import joined_on, waiting
from bimvox.motion.time_plan import time_lift
from bimvox.motion.timing import NS_PER_S
from bimvox.planning.assembly import Assembly, with_cleared
from bimvox.planning.rounds import Refused
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.made import Made, Wanted
from bimvox.site.collision import CollisionSpace


def made_in_full(wanted: Wanted, made: Made) -> Made | Refused:
    """Return what a walk made with all motions made and laid on the clock one after the other.

    Args:
        wanted: What the part is made of.
        made: What the walk made.

    Returns:
        The same with every motion; or the lifts that the crane cannot drive, and why.
    """
    motions, refused = _missing_motions(wanted, made)
    if refused:
        return refused
    on_clock, before = dict(made.motions), None
    for lift in made.lifts:
        order = lift.order
        if order in made.laid:
            motion = made.laid[order] or motions[order]
            on_clock[order] = _in_time(wanted, joined_on(motion, None if before is None else on_clock.get(before)))
        if lift.status is Status.PLANNED:
            before = order
    return replace(made, motions={order: on_clock[order] for order in sorted(on_clock)}, laid={})


def _missing_motions(wanted: Wanted, made: Made) -> tuple[dict[int, LiftMotion], Refused]:
    """Return the motions that the walk left open, each timed at its own stage; they start at 0, in the turn nearest 0.

    Returns:
        Motions by order; and why the crane cannot drive other lifts, by component.
    """
    motions: dict[int, LiftMotion] = {}
    refused: dict[str, str] = {}
    site, missing = wanted.site, set(made.motions_to_make)
    if not missing:
        return motions, refused
    assembly, before = Assembly(site, wanted.preparation, one_at_a_time=True), None
    for lift in made.lifts:
        assembly.skip(lift.component)
        if lift.order in missing:
            rule = _with_last_moves(assembly.space(lift.component), lift)
            try:
                crane = site.cranes[site.components[lift.component].crane]
                motions[lift.order] = time_lift(site, crane, lift, rule, before, 0, 0.0)
            except MotionError as error:
                component = site.components[lift.component].id
                refused[component] = f"the crane cannot drive its path: {error.message}"
            missing.remove(lift.order)
            if not missing:
                break
        is_placed = lift.status is Status.PLANNED
        assembly.finish(lift.component, placed=is_placed)
        before = lift if is_placed else before
    return motions, refused


def _in_time(wanted: Wanted, motion: LiftMotion) -> LiftMotion:
    """A lift that is not under way does not begin in the past: where the crane stood idle, it waits until now."""
    now_ns = wanted.now_ns
    if now_ns is None or motion.start_ns >= now_ns:
        return motion
    return waiting(motion, now_ns + round(wanted.hold_s * NS_PER_S) - motion.start_ns)


def _with_last_moves(space: CollisionSpace, lift: Lift) -> CollisionSpace:
    """Return the collision rule with a lift's own last moves cleared."""
    return with_cleared(space, lift.last_moves_vox)
