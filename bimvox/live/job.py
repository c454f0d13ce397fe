"""What a crane has to do on a site that moves: lifts with their proven ways, and where others go."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.live.traffic import Ground
from bimvox.live.way import Way, seconds_of


@dataclass(frozen=True, slots=True, eq=False)
class LiveLift:
    """One lift.

    Attributes:
        number: Its number in the plan, from 1.
        name: The part's name.
        ways: Its proven ways, the planned one first.
        hook_on_s: How long the crew attaches the slings.
        fix_s: How long the load is aligned, fixed and released at its place.
        earlier: Positions in ``LiveJob.lifts`` of those that must be set before.
    """

    number: int
    name: str
    ways: tuple[Way, ...]
    hook_on_s: float
    fix_s: float
    earlier: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class LiveJob:
    """Lifts of one crane in the order of the plan, and the ground on which others move.

    Attributes:
        name: Name of the site.
        lifts: The lifts.
        approach_s: (N + 1, N) float64 how long the empty hook takes to a pick: in row 0 at the start, in row n + 1 from
            the place of lift n.
        ground: Where others go.
    """

    name: str
    lifts: tuple[LiveLift, ...]
    approach_s: NDArray[np.float64]
    ground: Ground

    def ready(self, done: Iterable[int]) -> tuple[int, ...]:
        """Return the positions of the lifts that may be next, in the order of the plan."""
        left = frozenset(range(len(self.lifts))) - (gone := frozenset(done))
        return tuple(n for n in sorted(left) if self.lifts[n].earlier <= gone)

    def usual_s(self, n: int) -> float:
        """Return how long a lift takes in the order of the plan, on its planned way, without traffic."""
        lift = self.lifts[n]
        return float(self.approach_s[n, n]) + lift.hook_on_s + seconds_of(lift.ways[0]) + lift.fix_s

    @property
    def undisturbed_s(self) -> float:
        """How long all lifts take so."""
        return sum(self.usual_s(n) for n in range(len(self.lifts)))
