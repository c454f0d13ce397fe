"""The lifts of a plan as dated tasks, from which every schedule format is written."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime, timedelta

from bimvox.crane.tower_crane import TowerCrane
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import tracks_of
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.track import LoadTrack

DEFAULT_BEGIN = datetime(2000, 1, 3, 7, 0, 0)
"""Start of the first lift if none is given: a Monday long past. Files hold no wall-clock time."""


@dataclass(frozen=True, slots=True)
class LiftTask:
    """One lift.

    Attributes:
        number: Its number, from 1.
        component: Id of the part.
        global_id: Its GlobalId.
        name: Name of the task.
        description: Mass, moves and how the path was found, in one line.
        start_s: When it starts, seconds after the schedule's beginning.
        finish_s: When it ends.
        crane: Its crane: index into ``LiftSchedule.cranes``.
    """

    number: int
    component: str
    global_id: str
    name: str
    description: str
    start_s: float
    finish_s: float
    crane: int = 0


@dataclass(frozen=True, slots=True)
class CraneResource:
    """A crane.

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
        name: Name of the site.
        identity: Digest of the plan: the same plan gives the same identities of tasks.
        begins: When the first lift starts, local time.
        tasks: In erection sequence.
        cranes: The cranes; none on a site without one.
    """

    name: str
    identity: str
    begins: datetime
    tasks: tuple[LiftTask, ...]
    cranes: tuple[CraneResource, ...] = ()

    def before(self, index: int) -> tuple[tuple[int, bool], ...]:
        """Return the predecessors of a task: their indices, and whether the task starts after them or only ends after.

        The lifts of one crane follow each other. A part is set only after the part before it in the erection sequence
        was released, whichever crane set that one.
        """
        task = self.tasks[index]
        own = [n for n in range(index) if self.tasks[n].crane == task.crane][-1:]
        links = [(n, True) for n in own]
        if index and self.tasks[index - 1].crane != task.crane:
            links.append((index - 1, False))
        return tuple(links)

    def times(self, task: LiftTask) -> tuple[datetime, datetime]:
        """Return start and finish to the second, both rounded half up, so that adjoining tasks still adjoin."""
        start, finish = (
            self.begins + timedelta(seconds=int(seconds + 0.5)) for seconds in (task.start_s, task.finish_s)
        )
        return start, finish

    @property
    def finishes(self) -> datetime:
        """When the last lift ends."""
        return max((self.times(task)[1] for task in self.tasks), default=self.begins)


def schedule_of(log: PlanLog, begins: datetime, orders: Collection[int]) -> LiftSchedule:
    """Return the planned lifts of a log, those of the given orders, as dated tasks."""
    site = log.plan.site
    motions = {motion.order: motion for motion in log.motions}
    tasks = []
    for track in tracks_of(log):
        lift = track.lift
        if lift.order not in orders:
            continue
        component = site.components[lift.component]
        tasks.append(
            LiftTask(
                lift.number,
                component.id,
                component.global_id,
                f"Lift {lift.number}: {component.name or component.id}",
                f"{component.mass_kg:.0f} kg, {lift.moves} moves, path by {lift.method.value if lift.method else '?'}",
                *_span_s(track, motions.get(lift.order)),
                component.crane,
            )
        )
    cranes = tuple(CraneResource(crane.name, _properties(crane)) for crane in site.cranes)
    return LiftSchedule(site.name, f"{site.digest} {log.revision}", begins, tuple(tasks), cranes)


def duration_text(length: timedelta) -> str:
    """Return a duration as ISO 8601 has it: ``PT1H2M3S``."""
    minutes, seconds = divmod(int(length.total_seconds()), 60)
    hours, minutes = divmod(minutes, 60)
    return f"PT{hours}H{minutes}M{seconds}S"


def _span_s(track: LoadTrack, motion: LiftMotion | None) -> tuple[float, float]:
    """Return start and end of the work on a lift, without the crane's wait before it and its departure after it."""
    if motion is None:
        return track.start_ns / 1e9, track.end_ns / 1e9
    waited = [p.end_ns for p in motion.phases if p.name is PhaseName.WAIT and p.end_ns <= motion.released_ns]
    return max([motion.start_ns, *waited]) / 1e9, motion.released_ns / 1e9


def _properties(crane: TowerCrane) -> tuple[tuple[str, str | float], ...]:
    names = ("base_x_m", "base_y_m", "base_z_m", "jib_height_m", "jib_length_m")
    values = (float(value) for value in (*crane.base_m, crane.jib_height_m, crane.jib_length_m))
    return tuple(zip(names, values, strict=True))
