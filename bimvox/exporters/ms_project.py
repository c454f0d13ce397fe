"""Microsoft Project's XML (schema http://schemas.microsoft.com/project, 2003 and later) of a schedule."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from itertools import count
from typing import NamedTuple
from xml.etree import ElementTree

from bimvox.exporters.lift_schedule import LiftSchedule, LiftTask, Preparation, duration_text, time_text
from bimvox.exporters.text import for_xml
from bimvox.units import NS_PER_S

NAMESPACE = "http://schemas.microsoft.com/project"

_GLOBAL_ID_FIELD = "188743731"  # Text1 of a task
_ELAPSED_MINUTES = "4"  # of DurationFormat: elapsed time, not working hours
_FINISH_TO_FINISH = "0"
_FINISH_TO_START = "1"
_AS_SOON_AS_POSSIBLE, _NOT_EARLIER = "0", "4"  # of ConstraintType
_TENTHS_OF_MINUTES = 10
_EQUIPMENT = "1"  # of a resource's Type: work, which includes equipment (0 is material)
_FIXED_DURATION = "1"
_CALENDAR = "1"
_KINDS = {"other": "Other parts", "steel": "Steel"}
_MINUTES = "3"  # of DurationFormat: working minutes


def to_ms_project(schedule: LiftSchedule) -> bytes:
    """Return a schedule as Microsoft Project XML: tasks by storey and class, cranes and crews as resources.

    A lift or step is a task; so are the set-up of the crane and the unloading of each delivery, if there are dates. A
    delivery follows the last lift of the one before, which frees the yard, and starts no earlier than its date. What
    moves the end if it takes longer is critical.

    Durations of lifts are elapsed time to the second, those of steps working time. The calendar is the site's;
    without dates it is round the clock, so that no lift is stretched over a night.
    Each task carries the part's GlobalId as ``Text1``.
    """
    ElementTree.register_namespace("", NAMESPACE)
    hours = schedule.dates.hours if schedule.dates else None
    day_min = sum(high - low for low, high in hours.spans) if hours else 1440
    week_days = len(hours.days) if hours else 7
    project = ElementTree.Element(f"{{{NAMESPACE}}}Project")
    _fill(
        project,
        SaveVersion="14",
        Name=schedule.name,
        Title=f"Lifts of {schedule.name}",
        ScheduleFromStart="1",
        StartDate=schedule.starts.isoformat(),
        FinishDate=schedule.finishes.isoformat(),
        CalendarUID=_CALENDAR,
        MinutesPerDay=str(day_min),
        MinutesPerWeek=str(day_min * week_days),
        DaysPerMonth=str(round(week_days * 30 / 7)),
        DurationFormat=_ELAPSED_MINUTES,
    )
    attributes = _add(project, "ExtendedAttributes")
    _add(attributes, "ExtendedAttribute", FieldID=_GLOBAL_ID_FIELD, FieldName="Text1", Alias="GlobalId")
    _calendar(_add(project, "Calendars"), schedule)
    lags = {"LagFormat": _ELAPSED_MINUTES} if schedule.dates else {}
    first_uid = len(schedule.tasks) + 1
    preparing = {first_uid + n: one for n, one in enumerate(schedule.preparations)}
    tasks = _add(project, "Tasks")
    rows = list(_rows(schedule, preparing))
    links = {one.uid: list(_links(schedule, preparing, one)) for one in rows}
    critical = _critical(schedule, rows, links)
    for row, one in enumerate(rows):
        entry = _task(tasks, row, one, is_critical=one.uid in critical)
        if isinstance(one.task, LiftTask):
            _fill(entry, Notes=one.task.description)
        for before, kind, gap in links[one.uid]:
            lag = int(gap.total_seconds() * _TENTHS_OF_MINUTES / 60)
            _add(entry, "PredecessorLink", PredecessorUID=str(before), Type=kind, LinkLag=str(lag), **lags)
        if isinstance(one.task, LiftTask):
            _add(entry, "ExtendedAttribute", FieldID=_GLOBAL_ID_FIELD, Value=one.task.global_id)
    _resources(project, schedule, preparing)
    ElementTree.indent(project, " ")
    written: bytes = ElementTree.tostring(project, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


class _Row(NamedTuple):
    """A row of the task table: a summary has a name, every other row a task."""

    uid: int
    level: int
    times: tuple[datetime, datetime]
    task: LiftTask | Preparation | None = None
    name: str = ""


def _rows(schedule: LiftSchedule, preparing: Mapping[int, Preparation]) -> Iterator[_Row]:
    """Yield the rows: preparations, then the parts by storey and class, each with a summary."""
    uids = count(len(schedule.tasks) + len(preparing) + 1)
    yield _Row(0, 1, (schedule.starts, schedule.finishes), name=f"Assembly of {schedule.name}")
    yield from (_Row(uid, 2, schedule.times(one), one) for uid, one in preparing.items() if not one.is_delivery)
    unloading = [_Row(uid, 3, schedule.times(one), one) for uid, one in preparing.items() if one.is_delivery]
    if unloading:
        yield _Row(next(uids), 2, _span(unloading), name="Deliveries")
        yield from unloading
    groups: dict[str, dict[str, list[_Row]]] = {}
    for number, task in enumerate(schedule.tasks, start=1):
        own = groups.setdefault(task.storey or "No storey", {}).setdefault(task.kind, [])
        own.append(_Row(number, 4, schedule.times(task), task))
    for storey, kinds in groups.items():
        yield _Row(next(uids), 2, _span([row for rows in kinds.values() for row in rows]), name=storey)
        for kind, rows in kinds.items():
            yield _Row(next(uids), 3, _span(rows), name=_KINDS.get(kind, f"{kind.capitalize()}s"))
            yield from rows


def _span(rows: Sequence[_Row]) -> tuple[datetime, datetime]:
    return min(row.times[0] for row in rows), max(row.times[1] for row in rows)


def _links(
    schedule: LiftSchedule, preparing: Mapping[int, Preparation], row: _Row
) -> Iterator[tuple[int, str, timedelta]]:
    """Yield UID, kind and lag of the predecessors of a row."""
    start, finish = row.times
    if isinstance(row.task, Preparation) and row.task.is_delivery:
        yield from _before_delivery(schedule, preparing, row.task)
    elif isinstance(row.task, Preparation) and row.task.cranes:  # a move of the crane follows the lift before it
        lifts = [n for n, task in enumerate(schedule.tasks) if task.crane is not None and task.number < row.task.first]
        for before in lifts[-1:]:
            yield before + 1, _FINISH_TO_START, start - schedule.times(schedule.tasks[before])[1]
    if not isinstance(row.task, LiftTask):
        return
    for before, is_start in schedule.before(row.uid - 1):
        gap = (start if is_start else finish) - schedule.times(schedule.tasks[before])[1]
        yield before + 1, _FINISH_TO_START if is_start else _FINISH_TO_FINISH, gap
    for uid, one in preparing.items():
        if one.first == row.task.number and schedule.times(one)[1] <= start:
            yield uid, _FINISH_TO_START, start - schedule.times(one)[1]


def _before_delivery(
    schedule: LiftSchedule, preparing: Mapping[int, Preparation], own: Preparation
) -> Iterator[tuple[int, str, timedelta]]:
    """Yield what a delivery follows: the last lift before its first one, and the delivery or set-up before it.

    Its date is a constraint of its own, so nothing lies between.
    """
    start = schedule.times(own)[0]
    lifts = [n for n, task in enumerate(schedule.tasks) if task.crane is not None and task.number < own.first]
    if lifts and schedule.times(schedule.tasks[lifts[-1]])[1] <= start:
        yield lifts[-1] + 1, _FINISH_TO_START, timedelta()
    earlier = [uid for uid, one in preparing.items() if one.first <= own.first and schedule.times(one)[1] <= start]
    if earlier:
        yield earlier[-1], _FINISH_TO_START, timedelta()


def _critical(
    schedule: LiftSchedule, rows: Sequence[_Row], links: Mapping[int, Sequence[tuple[int, str, timedelta]]]
) -> frozenset[int]:
    """Return the UIDs of what moves the end if it takes longer: what ends last, and what that waits for, in turn.

    A lag is what the plan needs, so a link without slack is critical. A delivery that is unloaded working time before
    its first lift has slack. A summary is critical if a task in it is.
    """
    tasks = {row.uid: row.task for row in rows if row.task is not None}
    last = max((row.times[1] for row in rows if row.task is not None), default=None)
    found = [row.uid for row in rows if row.task is not None and row.times[1] == last]
    known = set(found)
    for uid in found:
        for before, *_ in links[uid]:
            if before not in known and not _has_slack(schedule, tasks[before], tasks[uid]):
                known.add(before)
                found.append(before)
    critical = set(found)
    above: list[_Row] = []
    for row in rows:
        above = [one for one in above if one.level < row.level]
        if row.uid in critical:
            critical.update(one.uid for one in above)
        if row.task is None:
            above.append(row)
    return frozenset(critical)


def _has_slack(schedule: LiftSchedule, before: LiftTask | Preparation, task: LiftTask | Preparation) -> bool:
    if schedule.dates is None or not isinstance(before, Preparation):
        return False
    end_ns, start_ns = (round(at_s * NS_PER_S) for at_s in (before.finish_s, task.start_s))
    return schedule.dates.work.between(end_ns, start_ns) > NS_PER_S


def _task(tasks: ElementTree.Element, number: int, row: _Row, *, is_critical: bool) -> ElementTree.Element:
    """Add a row."""
    is_delivery = isinstance(row.task, Preparation) and row.task.is_delivery
    work_s, name = (None, row.name) if row.task is None else (row.task.work_s, row.task.name)
    start, finish = row.times
    length = finish - start if work_s is None else timedelta(seconds=round(work_s))
    dates = {"Start": start.isoformat(), "Finish": finish.isoformat(), "Duration": duration_text(length)}
    return _add(
        tasks,
        "Task",
        UID=str(row.uid),
        ID=str(number),
        Name=name,
        Type=_FIXED_DURATION,
        IsNull="0",
        OutlineLevel=str(row.level),
        **dates,
        **{f"Manual{key}": value for key, value in dates.items()},
        DurationFormat=_ELAPSED_MINUTES if work_s is None else _MINUTES,
        Milestone="0",
        Summary=str(int(row.task is None)),
        Critical=str(int(is_critical)),
        ConstraintType=_NOT_EARLIER if is_delivery else _AS_SOON_AS_POSSIBLE,
        **({"ConstraintDate": start.isoformat()} if is_delivery else {}),
    )


def _calendar(calendars: ElementTree.Element, schedule: LiftSchedule) -> None:
    hours = schedule.dates.hours if schedule.dates else None
    name = "Site" if hours else "Round the clock"
    calendar = _add(calendars, "Calendar", UID=_CALENDAR, Name=name, IsBaseCalendar="1")
    days = _add(calendar, "WeekDays")
    for day in range(1, 8):  # from Sunday on
        spans = hours.of_weekday((day + 5) % 7) if hours else ((0, 1440),)
        entry = _add(days, "WeekDay", DayType=str(day), DayWorking="1" if spans else "0")
        times = _add(entry, "WorkingTimes") if spans else entry
        for low, high in spans:
            _add(times, "WorkingTime", FromTime=time_text(low), ToTime=time_text(high))
    free = hours.free_days(schedule.starts.date(), schedule.finishes.date()) if hours else ()
    exceptions = _add(calendar, "Exceptions") if free else calendar
    for day_off in free:
        exception = _add(exceptions, "Exception", EnteredByOccurrences="0")
        _add(exception, "TimePeriod", FromDate=f"{day_off}T00:00:00", ToDate=f"{day_off}T23:59:00")
        _fill(exception, Occurrences="1", Name="No work", Type="1", DayWorking="0")


def _resources(project: ElementTree.Element, schedule: LiftSchedule, preparing: Mapping[int, Preparation]) -> None:
    """Add cranes and crews, and what each works at. The work of a crew is its people's together."""
    working: list[tuple[int, LiftTask | Preparation]] = [*enumerate(schedule.tasks, start=1), *preparing.items()]
    crews = list(dict.fromkeys(task.crew for _, task in working if task.crew is not None))
    if not schedule.cranes and not crews:
        return
    resources = _add(project, "Resources")
    for number, crane in enumerate(schedule.cranes, start=1):
        _add(resources, "Resource", UID=str(number), ID=str(number), Name=crane.name, Type=_EQUIPMENT)
    for number, crew in enumerate(crews, start=len(schedule.cranes) + 1):
        units = {"Type": _EQUIPMENT, "MaxUnits": f"{crew.people:g}"}
        _add(resources, "Resource", UID=str(number), ID=str(number), Name=crew.name, **units)
    assignments = _add(project, "Assignments")
    uids = count(1)
    for uid, task in working:
        times = schedule.times(task)
        length = times[1] - times[0] if task.work_s is None else timedelta(seconds=round(task.work_s))
        for own in task.cranes:
            _assign(assignments, next(uids), (uid, own + 1), times, length, 1.0)
        if task.crew is not None:
            number = len(schedule.cranes) + 1 + crews.index(task.crew)
            _assign(assignments, next(uids), (uid, number), times, length, task.crew.people)


def _assign(
    assignments: ElementTree.Element,
    number: int,
    task_and_resource: tuple[int, int],
    times: tuple[datetime, datetime],
    length: timedelta,
    units: float,
) -> None:
    task, resource = task_and_resource
    _add(
        assignments,
        "Assignment",
        UID=str(number),
        TaskUID=str(task),
        ResourceUID=str(resource),
        Start=times[0].isoformat(),
        Finish=times[1].isoformat(),
        Units=f"{units:g}",
        Work=duration_text(length * units),
    )


def _add(parent: ElementTree.Element, tag: str, /, **values: str) -> ElementTree.Element:
    """Return a new element in another one, with these values in it."""
    child = ElementTree.SubElement(parent, f"{{{NAMESPACE}}}{tag}")
    _fill(child, **values)
    return child


def _fill(parent: ElementTree.Element, /, **values: str) -> None:
    for name, value in values.items():
        ElementTree.SubElement(parent, f"{{{NAMESPACE}}}{name}").text = for_xml(value)
