"""Microsoft Project's XML (schema http://schemas.microsoft.com/project, 2003 and later) of a schedule."""

from __future__ import annotations

from datetime import datetime, timedelta
from xml.etree import ElementTree

from bimvox.exporters.lift_schedule import LiftSchedule, LiftTask, duration_text, time_text
from bimvox.exporters.text import for_xml

NAMESPACE = "http://schemas.microsoft.com/project"

_ELAPSED_MINUTES = "4"  # of DurationFormat: elapsed time, not working hours
_FINISH_TO_FINISH = "0"
_FINISH_TO_START = "1"
_TENTHS_OF_MINUTES = 10
_EQUIPMENT = "1"  # of a resource's Type: work, which includes equipment (0 is material)
_FIXED_DURATION = "1"
_CALENDAR = "1"
_MINUTES = "3"  # of DurationFormat: working minutes


def to_ms_project(schedule: LiftSchedule) -> bytes:
    """Return a schedule as Microsoft Project XML: a summary, one task per lift or step, the cranes as resources.

    Durations of lifts are elapsed time to the second, those of steps working time. The calendar is the site's;
    without dates it is round the clock, so that no lift is stretched over a night.
    Each task carries the part's GlobalId as ``Text1``.
    """
    ElementTree.register_namespace("", NAMESPACE)
    hours = schedule.dates.calendar.hours if schedule.dates else None
    day_min = sum(high - low for low, high in hours.spans) if hours else 1440
    week_days = len(hours.days) if hours else 7
    project = ElementTree.Element(f"{{{NAMESPACE}}}Project")
    _fill(
        project,
        {
            "SaveVersion": "14",
            "Name": schedule.name,
            "Title": f"Lifts of {schedule.name}",
            "ScheduleFromStart": "1",
            "StartDate": schedule.starts.isoformat(),
            "FinishDate": schedule.finishes.isoformat(),
            "CalendarUID": _CALENDAR,
            "MinutesPerDay": str(day_min),
            "MinutesPerWeek": str(day_min * week_days),
            "DaysPerMonth": str(round(week_days * 30 / 7)),
            "DurationFormat": _ELAPSED_MINUTES,
        },
    )
    attribute = _child(_child(project, "ExtendedAttributes"), "ExtendedAttribute")
    _fill(attribute, {"FieldID": "188743731", "FieldName": "Text1", "Alias": "GlobalId"})
    _calendar(_child(_child(project, "Calendars"), "Calendar"), schedule)
    lags = {"LagFormat": _ELAPSED_MINUTES} if schedule.dates else {}
    tasks = _child(project, "Tasks")
    _task(tasks, 0, f"Assembly of {schedule.name}", (schedule.starts, schedule.finishes))
    for number, task in enumerate(schedule.tasks, start=1):
        start, finish = schedule.times(task)
        entry = _task(tasks, number, task, (start, finish))
        _fill(entry, {"Notes": task.description})
        for before, is_start in schedule.before(number - 1):
            gap = (start if is_start else finish) - schedule.times(schedule.tasks[before])[1]
            lag = int(gap.total_seconds() * _TENTHS_OF_MINUTES / 60)
            kind = _FINISH_TO_START if is_start else _FINISH_TO_FINISH
            link = _child(entry, "PredecessorLink")
            _fill(link, {"PredecessorUID": str(before + 1), "Type": kind, "LinkLag": str(lag), **lags})
        value = _child(entry, "ExtendedAttribute")
        _fill(value, {"FieldID": "188743731", "Value": task.global_id})
    if schedule.cranes:
        _cranes(project, schedule)
    ElementTree.indent(project, " ")
    written: bytes = ElementTree.tostring(project, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _task(
    tasks: ElementTree.Element, number: int, task: LiftTask | str, times: tuple[datetime, datetime]
) -> ElementTree.Element:
    """Add a task, or the summary of a name."""
    work_s, name = (None, task) if isinstance(task, str) else (task.work_s, task.name)
    start, finish = times
    length = finish - start if work_s is None else timedelta(seconds=round(work_s))
    dates = {"Start": start.isoformat(), "Finish": finish.isoformat(), "Duration": duration_text(length)}
    entry = _child(tasks, "Task")
    _fill(
        entry,
        {
            "UID": str(number),
            "ID": str(number),
            "Name": name,
            "Type": _FIXED_DURATION,
            "IsNull": "0",
            "OutlineLevel": "1" if isinstance(task, str) else "2",
            **dates,
            **{f"Manual{key}": value for key, value in dates.items()},
            "DurationFormat": _ELAPSED_MINUTES if work_s is None else _MINUTES,
            "Milestone": "0",
            "Summary": str(int(isinstance(task, str))),
            "ConstraintType": "0",
        },
    )
    return entry


def _calendar(calendar: ElementTree.Element, schedule: LiftSchedule) -> None:
    hours = schedule.dates.calendar.hours if schedule.dates else None
    name = "Site" if hours else "Round the clock"
    _fill(calendar, {"UID": _CALENDAR, "Name": name, "IsBaseCalendar": "1"})
    days = _child(calendar, "WeekDays")
    for day in range(1, 8):  # from Sunday on
        spans = hours.of_weekday((day + 5) % 7) if hours else ((0, 1440),)
        entry = _child(days, "WeekDay")
        _fill(entry, {"DayType": str(day), "DayWorking": "1" if spans else "0"})
        times = _child(entry, "WorkingTimes") if spans else entry
        for low, high in spans:
            time = _child(times, "WorkingTime")
            _fill(time, {"FromTime": time_text(low), "ToTime": time_text(high)})
    free = hours.free_days(schedule.starts.date(), schedule.finishes.date()) if hours else ()
    exceptions = _child(calendar, "Exceptions") if free else calendar
    for day_off in free:
        exception = _child(exceptions, "Exception")
        period = {"FromDate": f"{day_off}T00:00:00", "ToDate": f"{day_off}T23:59:00"}
        _fill(exception, {"EnteredByOccurrences": "0"})
        _fill(_child(exception, "TimePeriod"), period)
        _fill(exception, {"Occurrences": "1", "Name": "No work", "Type": "1", "DayWorking": "0"})


def _cranes(project: ElementTree.Element, schedule: LiftSchedule) -> None:
    resources = _child(project, "Resources")
    for number, crane in enumerate(schedule.cranes, start=1):
        resource = _child(resources, "Resource")
        _fill(resource, {"UID": str(number), "ID": str(number), "Name": crane.name, "Type": _EQUIPMENT})
    assignments = _child(project, "Assignments")
    for number, task in enumerate(schedule.tasks, start=1):
        if task.crane is None:
            continue
        start, finish = schedule.times(task)
        _fill(
            _child(assignments, "Assignment"),
            {
                "UID": str(number),
                "TaskUID": str(number),
                "ResourceUID": str(task.crane + 1),
                "Start": start.isoformat(),
                "Finish": finish.isoformat(),
                "Units": "1",
                "Work": duration_text(finish - start),
            },
        )


def _child(parent: ElementTree.Element, name: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, f"{{{NAMESPACE}}}{name}")


def _fill(parent: ElementTree.Element, values: dict[str, str]) -> None:
    for name, value in values.items():
        _child(parent, name).text = for_xml(value)
