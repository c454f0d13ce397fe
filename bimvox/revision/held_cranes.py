"""Cranes that are held because a load on one of their hooks has no free path."""

from __future__ import annotations

from dataclasses import dataclass

from bimvox.records.trajectory import Trajectory
from bimvox.stop.redirect import Held


@dataclass(frozen=True, slots=True, eq=False)
class HookWay:
    """A move of an empty hook that has begun.

    Attributes:
        start_ns: When it began, on the site's clock.
        way: Its samples, from 0, to where the hook is at rest.
        stopped_ns: When the crane began to brake, on the site's clock; None if the hook completes the move.
        is_free: Whether the hook, including its swing, met nothing while it stopped.
    """

    start_ns: int
    way: Trajectory
    stopped_ns: int | None = None
    is_free: bool = True

    @property
    def end_ns(self) -> int:
        """When the hook is at rest."""
        return self.start_ns + int(self.way.time_ns[-1])


@dataclass(frozen=True, slots=True, eq=False)
class HeldHook:
    """The position of a crane.

    Attributes:
        crane: Its number.
        stands: Slew (rad), radius (m) and height (m) at the start of the clock.
        ways: Moves of its empty hook since its last lift was hooked on or done, in order.
    """

    crane: int
    stands: tuple[float, float, float]
    ways: tuple[HookWay, ...]


@dataclass(frozen=True, slots=True, eq=False)
class HeldCranes:
    """The cranes of a site while loads are held; one may still complete an earlier lift.

    Attributes:
        loads: The loads on their hooks, in order.
        hooks: Positions of the cranes; empty if there is only one (its load gives its position).
    """

    loads: tuple[Held, ...]
    hooks: tuple[HeldHook, ...] = ()

    @property
    def orders(self) -> frozenset[int]:
        """Orders of the lifts whose loads are on the hooks."""
        return frozenset(load.lift.order for load in self.loads)
