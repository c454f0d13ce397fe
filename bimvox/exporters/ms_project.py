"""Microsoft Project's XML (schema http://schemas.microsoft.com/project, 2003 and later) of a schedule."""

from __future__ import annotations

from datetime import datetime, timedelta
from itertools import count
from xml.etree import ElementTree

from bimvox.bim.task_ranks import Link
from bimvox.exporters.lift_schedule import LiftSchedule, LiftTask, duration_text, time_text
from bimvox.exporters.outline import Outline, Row, outline_of
from bimvox.exporters.text import for_xml

NAMESPACE = "http://schemas.microsoft.com/project"

_GLOBAL_ID_FIELD = "188743731"  # Text1 of a task
_ELAPSED_MINUTES = "4"  # of DurationFormat: elapsed time, not working hours
_LINKS = {Link.FINISH_FINISH: "0", Link.FINISH_START: "1"}
_AS_SOON_AS_POSSIBLE, _NOT_EARLIER = "0", "4"  # of ConstraintType
_TENTHS_OF_MINUTES = 10
_EQUIPMENT = "1"  # of a resource's Type: work, which includes equipment (0 is material)
_FIXED_DURATION = "1"
_CALENDAR = "1"
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
        **({} if schedule.until is None else {"StatusDate": schedule.until.isoformat()}),
    )
    attributes = _add(project, "ExtendedAttributes")
    _add(attributes, "ExtendedAttribute", FieldID=_GLOBAL_ID_FIELD, FieldName="Text1", Alias="GlobalId")
    _calendar(_add(project, "Calendars"), schedule)
    lags = {"LagFormat": _ELAPSED_MINUTES} if schedule.dates else {}
    tasks = _add(project, "Tasks")
    outline = outline_of(schedule)
    for number, row in enumerate(outline.rows):
        entry = _task(tasks, number, row, is_critical=row.uid in outline.critical)
        if isinstance(row.task, LiftTask):
            _fill(entry, Notes=row.task.description)
        for before, link, gap in outline.waits[row.uid]:
            # The date of a delivery is a constraint of its own, so nothing lies between.
            lag = 0 if row.is_delivery else int(gap.total_seconds() * _TENTHS_OF_MINUTES / 60)
            _add(entry, "PredecessorLink", PredecessorUID=str(before), Type=_LINKS[link], LinkLag=str(lag), **lags)
        if isinstance(row.task, LiftTask):
            _add(entry, "ExtendedAttribute", FieldID=_GLOBAL_ID_FIELD, Value=row.task.global_id)
        if row.task is not None and (planned := schedule.baseline.get(row.task.key)) is not None:
            _add(entry, "Baseline", Number="0", **_dates(planned, row.task.work_s))
    _resources(project, schedule, outline)
    ElementTree.indent(project, " ")
    written: bytes = ElementTree.tostring(project, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _task(tasks: ElementTree.Element, number: int, row: Row, *, is_critical: bool) -> ElementTree.Element:
    """Add a row."""
    work_s = None if row.task is None else row.task.work_s
    dates = _dates(row.times, work_s)
    return _add(
        tasks,
        "Task",
        UID=str(row.uid),
        ID=str(number),
        Name=row.name,
        Type=_FIXED_DURATION,
        IsNull="0",
        OutlineLevel=str(row.level),
        **dates,
        **{f"Manual{key}": value for key, value in dates.items()},
        DurationFormat=_ELAPSED_MINUTES if work_s is None else _MINUTES,
        Milestone="0",
        Summary=str(int(row.task is None)),
        Critical=str(int(is_critical)),
        **_actual(row),
        ConstraintType=_NOT_EARLIER if row.is_delivery else _AS_SOON_AS_POSSIBLE,
        **({"ConstraintDate": dates["Start"]} if row.is_delivery else {}),
    )


def _dates(times: tuple[datetime, datetime], work_s: float | None) -> dict[str, str]:
    start, finish = times
    length = finish - start if work_s is None else timedelta(seconds=round(work_s))
    return {"Start": start.isoformat(), "Finish": finish.isoformat(), "Duration": duration_text(length)}


def _actual(row: Row) -> dict[str, str]:
    """Return what has been carried out of a row; its dates are those at which it was."""
    if row.task is None or not row.task.is_begun:
        return {}
    dates = _dates(row.times, row.task.work_s)
    if not row.task.is_ended:
        return {"PercentComplete": "0", "ActualStart": dates["Start"]}
    return {"PercentComplete": "100", **{f"Actual{key}": value for key, value in dates.items()}}


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


def _resources(project: ElementTree.Element, schedule: LiftSchedule, outline: Outline) -> None:
    """Add cranes and crews, and what each works at. The work of a crew is its people's together."""
    working = [(row.uid, row.task) for row in sorted(outline.rows, key=lambda row: row.uid) if row.task is not None]
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
