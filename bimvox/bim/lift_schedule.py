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
    """

    order: int
    component: str
    global_id: str
    name: str
    description: str
    start_s: float
    finish_s: float


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
    """

    name: str
    identity: str
    begins: datetime
    tasks: tuple[LiftTask, ...]
    crane: str | None
    properties: tuple[tuple[str, str | float], ...] = ()

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
