"""One lift of one of several cranes before it is scheduled: its carry, and the legs of the empty hook."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bimvox.crane.conflict import CraneTrack
from bimvox.errors import MotionError
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.units import NS_PER_S

REST_NS = NS_PER_S
"""Between two legs of an empty hook."""


class HookError(MotionError):
    """The empty hook has no free path to a part."""


class NoFreeTimeError(MotionError):
    """A crane has no free time for a lift alongside the others, or for several lifts.

    Args:
        component: The part of the first one.
        message: Why it has none.
        hint: What to do about it.
        more: Messages for the other parts, by component.
    """

    def __init__(
        self, component: str, message: str, *, hint: str | None = None, more: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(component, message, hint=hint)
        self._more = {} if more is None else {part: f"{part}: {why}" for part, why in more.items()}

    @property
    def reasons(self) -> Mapping[str, str]:
        """The message by component."""
        return {**super().reasons, **self._more}


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A leg of the empty hook: a move from rest to rest.

    Attributes:
        trajectory: Its samples, from 0.
        before: Orders of the lifts of other cranes that must not be set before the hook has passed.
        last: Whether it starts only after every earlier lift of the sequence has ended.
    """

    trajectory: Trajectory
    before: frozenset[int] = frozenset()
    last: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Parking:
    """A place where the empty hook waits.

    Attributes:
        aside: The leg to it; None if the crane starts there.
        back: The leg from it to the part.
        across: Legs from it to each of the lift's parking places, in their order, the fastest first.
    """

    aside: Leg | None
    back: Leg
    across: tuple[tuple[Leg, ...], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """A lift of one of several cranes, as far as the empty hooks depend on it.

    Attributes:
        lift: The lift.
        crane: Number of its crane.
        track: Where the crane may be during the carry.
        hooked_rad: Slewing angle at which its part is hooked on.
        left_rad: Slewing angle at which its slings are off.
    """

    lift: Lift
    crane: int
    track: CraneTrack
    hooked_rad: float
    left_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """The legs of the empty hook to a part, and after a crane's last lift from it.

    Attributes:
        early: See ``CraneLift``.
        late: See ``CraneLift``.
        parkings: See ``CraneLift``.
        hooked_rad: Slewing angle at which they end, and the part is hooked on.
        starts_there: See ``CraneLift``.
        leaves: See ``CraneLift``; from where the carry ends if its part is hooked on as in ``Carried``.
    """

    early: Leg | None
    late: Leg | None
    parkings: tuple[Parking, ...]
    hooked_rad: float
    starts_there: bool = True
    leaves: tuple[Leg, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class CraneLift:
    """One lift of one crane before it is scheduled.

    Attributes:
        lift: The lift.
        crane: Number of its crane.
        carry: From hook on to slings off, from 0.
        early: The early leg (see ``lifts``); None if there is none, or the crane has no earlier lift.
        late: The late leg; None likewise.
        parkings: Legs to a parking place and back, best first.
        track: Where the crane may be during the carry.
        leaves: Legs to a parking place after the crane's last lift.
        starts_there: Whether the crane can wait over the part from the start of the clock.
        every_parking: Makes all parking places that can be found, these first, with legs between them.
    """

    lift: Lift
    crane: int
    carry: LiftMotion
    early: Leg | None
    late: Leg | None
    parkings: tuple[Parking, ...]
    track: CraneTrack
    leaves: tuple[Leg, ...] = ()
    starts_there: bool = True
    every_parking: Callable[[], tuple[Parking, ...]] | None = None
