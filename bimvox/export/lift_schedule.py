"""The lifts of a plan as dated tasks: what every schedule format is written from."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta


@dataclass(frozen=True, slots=True)
class LiftTask:
    """One lift.

    Attributes:
        order: Its position, from 0.
        component: Id of the part.
        global_id: Its GlobalId.
        name: What the task is called.
        description: How the path was found, mass, radius: one line for a reader.
        start_s: When it starts, seconds after the schedule's beginning.
        finish_s: When it ends.
        crane: Which crane lifts it: 0 for ``LiftSchedule.crane``, then those of ``further``.
    """

    order: int
    component: str
    global_id: str
    name: str
    description: str
    start_s: float
    finish_s: float
    crane: int = 0


@dataclass(frozen=True, slots=True)
class CraneResource:
    """A crane beside the first one.

    Attributes:
        name: Its name.
        properties: Plain values about it.
    """

    name: str
    properties: tuple[tuple[str, str | float], ...] = ()


@dataclass(frozen=True, slots=True)
class LiftSchedule:
    """All lifts of a plan.

    Attributes:
        name: Of the site.
        identity: Digest of the plan: the same plan gives the same identities of tasks.
        begins: When the first lift starts, local time.
        tasks: In order.
        crane: The crane's name; None without one.
        properties: Plain values about the crane.
        further: The cranes beside it.
    """

    name: str
    identity: str
    begins: datetime
    tasks: tuple[LiftTask, ...]
    crane: str | None
    properties: tuple[tuple[str, str | float], ...] = ()
    further: tuple[CraneResource, ...] = ()

    @property
    def cranes(self) -> tuple[CraneResource, ...]:
        """All cranes, by the numbers that tasks have."""
        return () if self.crane is None else (CraneResource(self.crane, self.properties), *self.further)

    def before(self, number: int) -> tuple[tuple[int, bool], ...]:
        """Return what a task follows: numbers of tasks, and whether it starts (else: only ends) when they are done.

        A crane's lifts follow each other. A part is set only when the part before it in the order stands by itself,
        whichever crane sets that.
        """
        task = self.tasks[number]
        own = [n for n in range(number) if self.tasks[n].crane == task.crane][-1:]
        links = [(n, True) for n in own]
        if number and self.tasks[number - 1].crane != task.crane:
            links.append((number - 1, False))
        return tuple(links)

    def times(self, task: LiftTask) -> tuple[datetime, datetime]:
        """Return start and finish to the second; rounded alike, so tasks that follow each other still do."""
        start, finish = (
            self.begins + timedelta(seconds=int(seconds + 0.5)) for seconds in (task.start_s, task.finish_s)
        )
        return start, finish

    @property
    def finishes(self) -> datetime:
        """When the last lift ends."""
        return max((self.times(task)[1] for task in self.tasks), default=self.begins)


def duration_text(length: timedelta) -> str:
    """Return a duration as ISO 8601 has it: ``PT1H2M3S``."""
    minutes, seconds = divmod(int(length.total_seconds()), 60)
    hours, minutes = divmod(minutes, 60)
    return f"PT{hours}H{minutes}M{seconds}S"
