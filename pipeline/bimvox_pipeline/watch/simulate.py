"""``bimvox watch --simulate``: a plan carried out against a clock, and the state of every part."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.revision.current_plan import CurrentPlan
from bimvox.site.component import ConstructionState
from bimvox.units import NS_PER_S

_ANSWER_S = 3.0
"""Wall-clock time within which a new plan is on disk: a stopped load is held at least that long."""
_ANSWER_TOGETHER_S = 12.0
"""The same for several cranes, whose plan is timed and proven as a whole."""


class PlanClock:
    """The site's clock, a multiple of the wall clock.

    Args:
        speed: Seconds on the site's clock per second on the wall clock.
        wall_s: The wall clock.
        started: Told the time in seconds from which it runs.
    """

    def __init__(
        self,
        speed: float,
        wall_s: Callable[[], float] = time.monotonic,
        started: Callable[[float], object] | None = None,
    ) -> None:
        self.speed, self._wall_s, self._on_start = speed, wall_s, started
        self._start_ns = 0
        self._started_s: float | None = None

    def start(self, at_ns: int = 0) -> None:
        """Run from a time on."""
        self._start_ns, self._started_s = at_ns, self._wall_s()
        if self._on_start is not None:
            self._on_start(at_ns / NS_PER_S)

    def stand_at(self, at_ns: int) -> None:
        """Stop at a time until it is started again."""
        self._start_ns, self._started_s = at_ns, None

    @property
    def now_ns(self) -> int:
        """The time on the site's clock."""
        return self.at_ns(self._wall_s())

    def at_ns(self, wall_s: float) -> int:
        """Return the time on the site's clock for a time on the wall clock."""
        if self._started_s is None:
            return self._start_ns
        return self._start_ns + round(max(0.0, wall_s - self._started_s) * self.speed * NS_PER_S)

    def hold_s(self, cranes: int) -> float:
        """Return the seconds on the site's clock until a new plan for this number of cranes should be on disk."""
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
        """Return whether any part has changed its state since the last report."""
        return current is not None and next(self._news(current, self.clock.now_ns), None) is not None

    def news(self, current: CurrentPlan | None) -> list[dict[str, Any]]:
        """Return the changes since the last report, in order of time."""
        if current is None:
            return []
        found = sorted(self._news(current, self.clock.now_ns), key=lambda one: one[0])
        components = current.plan.site.components
        documents = []
        for at_ns, motion, state in found:
            self._told[motion.component] = state
            documents.append(state_document(components[motion.component].id, motion, state, at_ns))
        return documents

    def _news(self, current: CurrentPlan, now_ns: int) -> Iterator[tuple[int, LiftMotion, str]]:
        motions = current.on_the_clock
        for order in sorted(motions):
            motion = motions[order]
            if motion.start_ns > now_ns:
                continue  # with several cranes, a later lift may have started already
            told = self._told.get(motion.component)
            names = [name for _, name in changes_of(motion)]
            after = names.index(told) + 1 if told in names else 0
            for at_ns, state in changes_of(motion)[after:]:
                if at_ns <= now_ns:
                    yield at_ns, motion, state


def state_document(component: str, motion: LiftMotion, state: str, at_ns: int) -> dict[str, Any]:
    """Return the document of a part that has changed its state."""
    numbers = {"order": motion.order, "number": motion.number}
    return {"event": "state", "component": component, **numbers, "state": state, "time_s": round(at_ns / 1e9, 3)}


def changes_of(motion: LiftMotion) -> list[tuple[int, str]]:
    """Return the times at which a lift's part changes its state, and the new states; at first it is unbuilt."""
    lifted_ns = motion.start_ns + int(motion.raising.time_ns[0])
    arrived_ns = motion.start_ns + int(motion.loaded.time_ns[-1])
    set_ns = max([arrived_ns, *(phase.end_ns for phase in motion.phases if phase.name is PhaseName.SET)])
    return [
        (lifted_ns, ConstructionState.IN_TRANSIT.value),
        (arrived_ns, ConstructionState.ARRIVED.value),
        (set_ns, ConstructionState.ASSEMBLED.value),
    ]
