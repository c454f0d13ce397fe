"""The motions of a part: missing ones are made, each at its own stage, and all are put on the clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bimvox.errors import MotionError
from bimvox.motion.time_plan import KnownLegs, MotionMaking
from bimvox.motion.trajectories import joined_on, waiting
from bimvox.planning.rounds import Refused
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.reasons import NOT_DRIVEN
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.request import RevisionRequest
from bimvox.units import NS_PER_S
from bimvox.workers import Begun

_AT_ONCE = 3
"""So many motions are begun at once: few, so that the workers begin early and end together."""


class MotionsInTheMaking:
    """The motions that a round leaves open: workers make them while later lifts are still planned.

    Each is timed at its own stage, from time 0 and slew angle 0.

    Args:
        request: What to revise the plan for.
    """

    def __init__(self, request: RevisionRequest) -> None:
        self._request = request
        self._begun: list[tuple[list[KnownLegs], Begun[list[LiftMotion | MotionError]]]] = []
        self._waiting: list[KnownLegs] = []
        self._lifts: Sequence[Lift] = ()

    def add(self, known: KnownLegs, lifts: Sequence[Lift]) -> None:
        """Have the motion of a lift made; ``lifts`` are all up to this one."""
        self._waiting.append(known)
        self._lifts = lifts
        if len(self._waiting) == _AT_ONCE:
            self._begin()

    def finished(self) -> dict[int, LiftMotion | MotionError]:
        """Return the motions by order; an error for each that cannot be driven."""
        if self._waiting:
            self._begin()
        for _, begun in self._begun:
            begun.help()
        found = dict[int, LiftMotion | MotionError]()
        for known, begun in self._begun:
            (motions,) = begun.finished()
            found.update(zip([one.order for one in known], motions, strict=True))
        return found

    def _begin(self) -> None:
        making = MotionMaking(self._request.site, self._request.preparation, self._lifts)
        task = (making, self._waiting)
        self._begun.append((self._waiting, self._request.workers.begin(MotionMaking.steps, [task])))
        self._waiting = []


def made_in_full(request: RevisionRequest, draft: RevisionDraft, making: MotionsInTheMaking) -> RevisionDraft | Refused:
    """Return a draft with all motions made and put on the clock one after the other.

    Args:
        request: What to revise the plan for.
        draft: The draft.
        making: The motions that it left open.

    Returns:
        The same with every motion; or the lifts that the crane cannot drive, and why.
    """
    made, motions, refused = making.finished(), dict[int, LiftMotion](), dict[str, str]()
    for order, motion in made.items():
        if isinstance(motion, MotionError):
            refused[motion.component] = f"{NOT_DRIVEN}{motion.message}"
        else:
            motions[order] = motion
    if refused:
        return refused
    on_clock, before = dict(draft.motions), None
    for lift in draft.lifts:
        order = lift.order
        if order in draft.laid:
            motion = draft.laid[order] or motions[order]
            on_clock[order] = _in_time(request, joined_on(motion, None if before is None else on_clock.get(before)))
        if lift.status is Status.PLANNED:
            before = order
    return replace(draft, motions={order: on_clock[order] for order in sorted(on_clock)}, laid={})


def _in_time(request: RevisionRequest, motion: LiftMotion) -> LiftMotion:
    """Return a motion that does not start in the past: an idle crane waits until now and for the hold."""
    now_ns = request.now_ns
    if now_ns is None or motion.start_ns >= now_ns:
        return motion
    return waiting(motion, now_ns + round(request.hold_s * NS_PER_S) - motion.start_ns)
