"""``bimvox watch --simulate``: the plan carried out against a clock, and what is where at every moment of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bimvox.records.motion import LiftMotion
    from bimvox.revision.current_plan import CurrentPlan

NOW_NS = "simulated_ns"
"""Metadata key: how far the plan was carried out when a revision was made."""

_NS_PER_S = 1_000_000_000
_ANSWER_S = 3.0
"""Wall time within which a new plan is on disk: a stopped load is held at least that long."""
_ANSWER_TOGETHER_S = 12.0
"""The same of a plan of several cranes, which is timed and proven as a whole."""


class PlanClock:
    """The site's clock, going so many times as fast as the wall's.

    Args:
        speed: How many times as fast.
        wall_s: The wall's clock.
    """

    def __init__(self, speed: float, wall_s: Callable[[], float] = time.monotonic) -> None:
        self.speed, self._wall_s = speed, wall_s
        self._start_ns = 0
        self._started_s: float | None = None

    def start(self, at_ns: int = 0) -> None:
        """Let it go on from a time."""
        self._start_ns, self._started_s = at_ns, self._wall_s()

    def stand_at(self, at_ns: int) -> None:
        """Let it stand at a time until it is started."""
        self._start_ns, self._started_s = at_ns, None

    @property
    def now_ns(self) -> int:
        """The time on the site's clock."""
        return self.at_ns(self._wall_s())

    def at_ns(self, wall_s: float) -> int:
        """Return the time on the site's clock at a time of the wall's; before it was started it stands."""
        if self._started_s is None:
            return self._start_ns
        return self._start_ns + round(max(0.0, wall_s - self._started_s) * self.speed * _NS_PER_S)

    def hold_s(self, cranes: int) -> float:
        """Return how much of the site's time goes by until a new plan of so many cranes should be on disk."""
        return self.speed * (_ANSWER_S if cranes <= 1 else _ANSWER_TOGETHER_S)


class Execution:
    """Follows a plan that is carried out.

    Args:
        clock: The site's clock.
    """

    def __init__(self, clock: PlanClock) -> None:
        self.clock = clock
        self._told: dict[int, str] = {}

    def has_news(self, current: CurrentPlan | None) -> bool:
        """Return whether the state of any part has changed since it was told."""
        return current is not None and next(self._news(current, self.clock.now_ns), None) is not None

    def news(self, current: CurrentPlan | None) -> list[dict[str, Any]]:
        """Return what has changed since it was told, in order of time."""
        if current is None:
            return []
        found = sorted(self._news(current, self.clock.now_ns), key=lambda one: one[0])
        components = current.plan.site.components
        documents = []
        for at_ns, motion, state in found:
            self._told[motion.component] = state
            component = components[motion.component]
            documents.append(
                {
                    "event": "state",
                    "component": component.id,
                    "order": motion.order,
                    "number": motion.number,
                    "state": state,
                    "time_s": round(at_ns / 1e9, 3),
                }
            )
        return documents

    def _news(self, current: CurrentPlan, now_ns: int) -> Iterator[tuple[int, LiftMotion, str]]:
        motions = current.on_the_clock
        for order in sorted(motions):
            motion = motions[order]
            if motion.start_ns > now_ns:
                continue  # of several cranes a later one may have begun before
            told = self._told.get(motion.component)
            names = [name for _, name in _changes(motion)]
            after = names.index(told) + 1 if told in names else 0
            for at_ns, state in _changes(motion)[after:]:
                if at_ns <= now_ns:
                    yield at_ns, motion, state


def _changes(motion: LiftMotion) -> list[tuple[int, str]]:
    """When the state of a lift's part changes, and to what; before that it is unbuilt."""
    from bimvox.log.colours import ConstructionState
    from bimvox.records.motion import PhaseName

    lifted_ns = motion.start_ns + int(motion.raising.time_ns[0])
    arrived_ns = motion.start_ns + int(motion.loaded.time_ns[-1])
    set_ns = max([arrived_ns, *(phase.end_ns for phase in motion.phases if phase.name is PhaseName.SET)])
    return [
        (lifted_ns, ConstructionState.IN_TRANSIT.value),
        (arrived_ns, ConstructionState.ARRIVED.value),
        (set_ns, ConstructionState.ASSEMBLED.value),
    ]
