"""The motions of a part: those that are missing are made, each at its own stage, and all are laid on the clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from bimvox.errors import MotionError
from bimvox.motion.shift import joined_on, waiting
from bimvox.motion.time_plan import time_lift
from bimvox.motion.timing import NS_PER_S
from bimvox.planning.assembly import Assembly, with_cleared
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.made import Made, Wanted
from bimvox.site.collision import CollisionSpace


class MotionMaker:
    """Makes motions of a part's lifts, in ascending order; not all of them need be asked for.

    Args:
        wanted: What the part is made of.
        made: Its lifts, as far as they are known: those with a motion to be made, and all before them.
    """

    def __init__(self, wanted: Wanted, made: Made) -> None:
        assert wanted.site.crane is not None
        self._site, self._crane, self._made = wanted.site, wanted.site.crane, made
        self._assembly = Assembly(wanted.site, wanted.preparation, one_at_a_time=True)
        self._come_to = 0
        self._before: Lift | None = None

    def motion(self, order: int) -> LiftMotion:
        """Return the motion of a lift; it begins at 0, in the turn nearest to 0.

        Raises:
            MotionError: If the crane cannot drive it.
        """
        lift = self._come(order)
        rule = _with_last_moves(self._assembly.space(lift.component), lift)
        return time_lift(self._site, self._crane, lift, rule, self._before, 0, 0.0)

    def _come(self, order: int) -> Lift:
        """Let everything before a lift happen."""
        assembly, lifts = self._assembly, self._made.lifts
        while lifts[self._come_to].order != order:
            lift = lifts[self._come_to]
            assembly.skip(lift.component)
            is_placed = lift.status is Status.PLANNED
            assembly.finish(lift.component, placed=is_placed)
            self._before = lift if is_placed else self._before
            self._come_to += 1
        assembly.skip(lifts[self._come_to].component)
        return lifts[self._come_to]


def make_motions(
    wanted: Wanted, made: Made, claim: Callable[[], int | None]
) -> tuple[dict[int, LiftMotion], dict[int, str]]:
    """Make some of the motions that are missing.

    Args:
        wanted: What the part is made of.
        made: Its lifts, as far as they are known.
        claim: Says which of ``made.motions_to_make`` is to be made next, ascending; None where nothing is left.

    Returns:
        Motions, and why others cannot be driven; by order.
    """
    to_make, maker = made.motions_to_make, None
    motions: dict[int, LiftMotion] = {}
    untimed: dict[int, str] = {}
    while (number := claim()) is not None:
        maker = maker or MotionMaker(wanted, made)
        order = to_make[number]
        try:
            motions[order] = maker.motion(order)
        except MotionError as error:
            untimed[order] = error.message
    return motions, untimed


def on_the_clock(wanted: Wanted, made: Made, motions: Mapping[int, LiftMotion]) -> Made:
    """Return what a walk made with its motions laid one after the other.

    Args:
        wanted: What it was made of.
        made: The lifts, as far as they are known.
        motions: Those of ``made.motions_to_make``, by order.
    """
    laid, before = dict(made.motions), None
    for lift in made.lifts:
        order = lift.order
        if order in made.laid:
            motion = made.laid[order] or motions[order]
            laid[order] = _in_time(wanted, joined_on(motion, None if before is None else laid.get(before)))
        if lift.status is Status.PLANNED:
            before = order
    return replace(made, motions={order: laid[order] for order in sorted(laid)}, laid={})


def _in_time(wanted: Wanted, motion: LiftMotion) -> LiftMotion:
    """A lift that is not under way does not begin in the past: where the crane stood idle, it waits until now."""
    now_ns = wanted.now_ns
    if now_ns is None or motion.start_ns >= now_ns:
        return motion
    return waiting(motion, now_ns + round(wanted.hold_s * NS_PER_S) - motion.start_ns)


def _with_last_moves(space: CollisionSpace, lift: Lift) -> CollisionSpace:
    """Return the collision rule with a lift's own last moves cleared."""
    assert lift.path_vox is not None
    return with_cleared(space, lift.path_vox[len(lift.path_vox) - 1 - lift.contact_moves :])
