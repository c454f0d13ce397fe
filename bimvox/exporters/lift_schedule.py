"""The lifts of a plan as dated tasks, from which every schedule format is written."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from math import floor

from bimvox.crane.tower_crane import TowerCrane
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog, how_set, task_name
from bimvox.records.crews import Crew, casting_crew, crew_of, erection_crews, unloading_crew
from bimvox.records.done import DoneWork
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.plan_dates import PlanDates
from bimvox.records.steps import Step, Steps, cured_ns
from bimvox.records.track import LoadTrack
from bimvox.site.component import Component
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.site.work import kind_of
from bimvox.units import elapsed

DEFAULT_BEGIN = datetime(2000, 1, 3, 7, 0, 0)
"""Start of the first lift if none is given: a Monday long past. Files hold no wall-clock time."""


@dataclass(frozen=True, slots=True)
class Preparation:
    """Work before a lift: the set-up of the crane, or the unloading of a delivery.

    Attributes:
        name: Its name.
        start_s: When it starts, elapsed seconds after work may begin.
        finish_s: When it ends.
        work_s: Its working time.
        first: Number of the lift that waits for it.
        is_delivery: Whether it is the unloading of a delivery.
        crew: The people who do it; None if not stated.
        cranes: The cranes that do it: indices into ``LiftSchedule.cranes``.
        is_begun: Whether it has begun.
        is_ended: Whether it has ended.
    """

    name: str
    start_s: float
    finish_s: float
    work_s: float
    first: int
    is_delivery: bool = False
    crew: Crew | None = None
    cranes: tuple[int, ...] = ()
    is_begun: bool = False
    is_ended: bool = False

    @property
    def key(self) -> str:
        """What it is known by in another version of the plan."""
        return self.name


@dataclass(frozen=True, slots=True)
class LiftTask:
    """One lift, or one step of work that the crane does not do.

    Attributes:
        number: Its number, from 1.
        component: Id of the part.
        global_id: Its GlobalId.
        name: Name of the task.
        description: Mass, and how it comes, in one line.
        start_s: When it starts, elapsed seconds after the start of the first lift.
        finish_s: When it ends.
        crane: Its crane: index into ``LiftSchedule.cranes``; None for a step.
        method: The method of work, in words.
        waits_for: Numbers of the steps, and of the lifts whose joints cure, that it waits for.
        work_s: Working time of a step, nights and breaks left out; None if it is all of its time.
        storey: Name of the part's storey, if any.
        kind: Class of the part, for example ``wall``.
        crew: The people who do it; None if nobody says how many they are.
        is_begun: Whether it has begun.
        is_ended: Whether it has ended.
        second_crane: The other crane of a part that two carry.
    """

    number: int
    component: str
    global_id: str
    name: str
    description: str
    start_s: float
    finish_s: float
    crane: int | None = 0
    method: str = "crane lift"
    waits_for: tuple[int, ...] = ()
    work_s: float | None = None
    storey: str | None = None
    kind: str = "other"
    crew: Crew | None = None
    is_begun: bool = False
    is_ended: bool = False
    second_crane: int | None = None

    @property
    def key(self) -> str:
        """What it is known by in another version of the plan."""
        return self.component

    @property
    def cranes(self) -> tuple[int, ...]:
        """Its crane or cranes."""
        return tuple(one for one in (self.crane, self.second_crane) if one is not None)


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
        begins: When the first lift starts, with a calendar when work may begin; local time.
        tasks: In erection sequence.
        cranes: The cranes; none on a site without one.
        dates: The plan in calendar time; None for round the clock.
        preparations: The set-up of the crane and the unloading of deliveries, in time; none without dates.
        until: When the state of the work was stated; None if nothing of it is known.
        baseline: Start and finish as they were planned, by the key of tasks and preparations; none if these are the
            plan's own.
    """

    name: str
    identity: str
    begins: datetime
    tasks: tuple[LiftTask, ...]
    cranes: tuple[CraneResource, ...] = ()
    dates: PlanDates | None = None
    preparations: tuple[Preparation, ...] = ()
    until: datetime | None = None
    baseline: Mapping[str, tuple[datetime, datetime]] = field(default_factory=dict)

    @property
    def all_times(self) -> dict[str, tuple[datetime, datetime]]:
        """Start and finish of each task and preparation, by its key."""
        every: tuple[LiftTask | Preparation, ...] = (*self.preparations, *self.tasks)
        return {one.key: self.times(one) for one in every}

    def with_progress(self, done: DoneWork, baseline: Mapping[str, tuple[datetime, datetime]]) -> LiftSchedule:
        """Return the schedule with what has been carried out, and with its dates as they were planned.

        A preparation has ended if a lift that waits for it has begun.
        """
        tasks = tuple(
            replace(one, is_begun=one.number - 1 in done.begun, is_ended=one.number - 1 in done.ended)
            for one in self.tasks
        )
        last = max((one.number for one in tasks if one.is_begun), default=0)
        preparations = tuple(
            replace(one, is_begun=one.first <= last, is_ended=one.first <= last) for one in self.preparations
        )
        return replace(self, tasks=tasks, preparations=preparations, until=done.until, baseline=baseline)

    def before(self, index: int) -> tuple[tuple[int, bool], ...]:
        """Return the predecessors of a task: their indices, and whether the task starts after them or only ends after.

        The lifts of one crane follow each other. A part is set only after the part before it in the erection sequence
        was released, whichever crane set that one. A step begins after the lift before it; what rests on it waits for
        it.
        """
        task = self.tasks[index]
        lifts = [n for n in range(index) if self.tasks[n].crane is not None]
        waits = [(n, True) for n in range(index) if self.tasks[n].number in task.waits_for]
        if task.crane is None:
            return (*((n, True) for n in lifts[-1:]), *waits)
        links = [(n, True) for n in lifts if self.tasks[n].crane == task.crane][-1:]
        if lifts and self.tasks[lifts[-1]].crane != task.crane:
            links.append((lifts[-1], False))
        return tuple(dict.fromkeys((*links, *waits)))

    def times(self, task: LiftTask | Preparation) -> tuple[datetime, datetime]:
        """Return start and finish to the second, both rounded half up, so that adjoining tasks still adjoin."""
        start, finish = (
            self.begins + timedelta(seconds=floor(seconds + 0.5)) for seconds in (task.start_s, task.finish_s)
        )
        return start, finish

    @property
    def starts(self) -> datetime:
        """When the first work starts: the first lift, or what is done before it."""
        every: tuple[LiftTask | Preparation, ...] = (*self.preparations, *self.tasks)
        return min((self.times(task)[0] for task in every), default=self.begins)

    @property
    def finishes(self) -> datetime:
        """When the last lift, or the last step, ends."""
        return max((self.times(task)[1] for task in self.tasks), default=self.begins)


def schedule_of(
    log: PlanLog, begins: datetime, orders: Collection[int], dates: PlanDates | None = None
) -> LiftSchedule:
    """Return the planned lifts of a log and the steps of other work, those of the given orders, as dated tasks.

    With dates, they are in calendar time; otherwise they go on round the clock from ``begins``.
    """
    site, steps = log.plan.site, log.steps
    motions = {motion.order: motion for motion in log.motions}
    erection = erection_crews(site, dates.calendar) if dates else ()
    tasks = [_step_task(site, step, dates) for step in steps.steps if step.order in orders]
    paused = {pause.order: steps.starting_ns(pause.at_ns) for pause in steps.pauses}
    carries: dict[int, list[int]] = {}
    for one in steps.steps:
        carries.setdefault(one.carries_ns, []).append(one.order + 1)
    for motion in motions.values():
        if (cured_at_ns := cured_ns(site, steps, motion)) is not None:
            carries.setdefault(cured_at_ns, []).append(motion.number)
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
                task_name(component, lift.number, is_lift=True),
                f"{component.mass_kg:.0f} kg{_delivery(lift)}",
                *_span_s(track, motions.get(lift.order), steps, dates),
                _crane_of(site, component),
                second_crane=None if component.tandem is None else component.tandem.second,
                waits_for=tuple(sorted(carries.get(paused.get(lift.order, -1), ()))),
                storey=component.storey,
                kind=kind_of(component).value,
                crew=erection[crew_of(site, component)] if erection else None,
            )
        )
    tasks.sort(key=lambda task: task.number)
    cranes = tuple(CraneResource(crane.name, _properties(crane)) for crane in site.cranes)
    if site.moving is not None:
        first = site.cranes[0]
        places = (("SetUps", ", ".join(site.moving.names)),)
        cranes = (CraneResource(first.machine or first.name, (*_properties(first), *places)),)
    return LiftSchedule(
        site.name, f"{site.digest} {log.revision}", dates.begins if dates else begins, tuple(tasks), cranes, dates,
        (*_moves(log, orders, dates), *(_preparations(log, orders, dates) if dates else ())),
    )  # fmt: skip


def _crane_of(site: Site, component: Component) -> int:
    """Return the number of a part's crane among the resources: a crane that moves is one."""
    return component.crane if site.moving is None else 0


def _moves(log: PlanLog, orders: Collection[int], dates: PlanDates | None) -> tuple[Preparation, ...]:
    """Return the moves of the crane before chosen lifts."""
    site, found = log.plan.site, list[Preparation]()
    for move in log.steps.moves:
        if move.order not in orders or site.moving is None:
            continue
        one, other = (site.moving.names[n] for n in (move.come_from, move.goes_to))
        span_ns = dates.moves[move.order] if dates else (move.begins_ns, move.ends_ns)
        name = f"Move the crane from {one} to {other}: derig, drive, rig"
        work_s = (move.ends_ns - move.begins_ns) / 1e9
        begin_s, end_s = (at_ns / 1e9 for at_ns in span_ns)
        found.append(Preparation(name, begin_s, end_s, work_s, move.order + 1, cranes=(0,)))
    return tuple(found)


def _preparations(log: PlanLog, orders: Collection[int], dates: PlanDates) -> tuple[Preparation, ...]:
    """Return the set-up of the crane and the unloading of the deliveries of chosen lifts."""
    lifts = sorted((lift for lift in log.planned if lift.order in orders), key=lambda lift: lift.order)
    found = []
    if dates.setup is not None and lifts:
        begin_ns, end_ns = dates.setup
        work_s = dates.calendar.setup_h * 3600.0
        found.append(Preparation("Set up the crane", begin_ns / 1e9, end_ns / 1e9, work_s, lifts[0].number))
    crew = unloading_crew(dates.calendar) or next(iter(erection_crews(log.plan.site, dates.calendar)), None)
    for number, (begin_ns, end_ns) in sorted(dates.deliveries.items()):
        own = [lift for lift in lifts if lift.place is not None and lift.place.delivery == number]
        if not own:
            continue
        mass_kg = sum(log.plan.site.components[lift.component].mass_kg for lift in own)
        name = f"Unload delivery {number + 1}: {len(own)} part{'' if len(own) == 1 else 's'}, {mass_kg / 1e3:.1f} t"
        work_s = dates.work.between(begin_ns, end_ns) / 1e9
        parts = (log.plan.site.components[lift.component] for lift in own)
        cranes = tuple(sorted({_crane_of(log.plan.site, part) for part in parts})) if dates.is_unloaded_by_crane else ()
        found.append(
            Preparation(
                name, begin_ns / 1e9, end_ns / 1e9, work_s, own[0].number, is_delivery=True, crew=crew, cranes=cranes
            )
        )
    return tuple(found)


def duration_text(length: timedelta) -> str:
    """Return a duration as ISO 8601 has it: ``PT1H2M3S``."""
    minutes, seconds = divmod(int(length.total_seconds()), 60)
    hours, minutes = divmod(minutes, 60)
    return f"PT{hours}H{minutes}M{seconds}S"


def time_text(minutes: int) -> str:
    """Return a time of day as ISO 8601 has it; the midnight that ends a day is ``00:00:00`` too."""
    return f"{minutes // 60 % 24:02d}:{minutes % 60:02d}:00"


def _delivery(lift: Lift) -> str:
    return "" if lift.place is None else f", delivery {lift.place.delivery + 1}"


def _step_task(site: Site, step: Step, dates: PlanDates | None) -> LiftTask:
    component = site.components[step.component]
    how = how_set(component)
    wait_s = (step.carries_ns - step.ends_ns) / 1e9
    begins_ns, ends_ns = dates.steps[step.order][:2] if dates else (step.begins_ns, step.ends_ns)
    return LiftTask(
        step.order + 1,
        component.id,
        component.global_id,
        task_name(component, step.order + 1, is_lift=False),
        f"{component.mass_kg:.0f} kg, {how}" + (f", carries {elapsed(wait_s)} after its end" if wait_s else ""),
        begins_ns / 1e9,
        ends_ns / 1e9,
        None,
        how,
        work_s=(step.ends_ns - step.begins_ns) / 1e9 if dates else None,
        storey=component.storey,
        kind=kind_of(component).value,
        crew=casting_crew(site) if component.means is Means.IN_SITU else None,
    )


def _span_s(track: LoadTrack, motion: LiftMotion | None, steps: Steps, dates: PlanDates | None) -> tuple[float, float]:
    """Return start and end of the work on a lift, without the crane's wait before it and its departure after it."""
    if motion is None:
        return track.start_ns / 1e9, track.end_ns / 1e9
    if dates is not None:
        start_ns, released_ns = dates.lifts[motion.order]
        return start_ns / 1e9, released_ns / 1e9
    return steps.starting_ns(motion.work_starts_ns) / 1e9, steps.ending_ns(motion.released_ns) / 1e9


def _properties(crane: TowerCrane) -> tuple[tuple[str, str | float], ...]:
    names = ("base_x_m", "base_y_m", "base_z_m", "jib_height_m", "jib_length_m")
    values = (float(value) for value in (*crane.base_m, crane.jib_height_m, crane.jib_length_m))
    return tuple(zip(names, values, strict=True))
