"""Microsoft Project's XML (schema http://schemas.microsoft.com/project, 2003 and later) of a schedule."""

from __future__ import annotations

from datetime import datetime
from xml.etree import ElementTree

from bimvox.exporters.lift_schedule import LiftSchedule, duration_text
from bimvox.exporters.text import for_xml

NAMESPACE = "http://schemas.microsoft.com/project"

_ELAPSED_MINUTES = "4"  # of DurationFormat: elapsed time, not working hours
_FINISH_TO_FINISH = "0"
_FINISH_TO_START = "1"
_TENTHS_OF_MINUTES = 10
_EQUIPMENT = "1"  # of a resource's Type: work, which includes equipment (0 is material)
_FIXED_DURATION = "1"
_ROUND_THE_CLOCK = "1"


def to_ms_project(schedule: LiftSchedule) -> bytes:
    """Return a schedule as Microsoft Project XML: a summary, one task per lift or step, the cranes as resources.

    Durations are elapsed time to the second, on a round-the-clock calendar, so that no lift is stretched over a night.
    Each task carries the part's GlobalId as ``Text1``.
    """
    ElementTree.register_namespace("", NAMESPACE)
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
            "CalendarUID": _ROUND_THE_CLOCK,
            "MinutesPerDay": "1440",
            "MinutesPerWeek": "10080",
            "DaysPerMonth": "30",
            "DurationFormat": _ELAPSED_MINUTES,
        },
    )
    attribute = _child(_child(project, "ExtendedAttributes"), "ExtendedAttribute")
    _fill(attribute, {"FieldID": "188743731", "FieldName": "Text1", "Alias": "GlobalId"})
    _calendar(_child(_child(project, "Calendars"), "Calendar"))
    tasks = _child(project, "Tasks")
    _task(tasks, 0, f"Assembly of {schedule.name}", schedule.starts, schedule.finishes, level=1, summary=True)
    for number, task in enumerate(schedule.tasks, start=1):
        start, finish = schedule.times(task)
        entry = _task(tasks, number, task.name, start, finish, level=2, summary=False)
        _fill(entry, {"Notes": task.description})
        for before, is_start in schedule.before(number - 1):
            gap = (start if is_start else finish) - schedule.times(schedule.tasks[before])[1]
            lag = int(gap.total_seconds() * _TENTHS_OF_MINUTES / 60)
            kind = _FINISH_TO_START if is_start else _FINISH_TO_FINISH
            link = _child(entry, "PredecessorLink")
            _fill(link, {"PredecessorUID": str(before + 1), "Type": kind, "LinkLag": str(lag)})
        value = _child(entry, "ExtendedAttribute")
        _fill(value, {"FieldID": "188743731", "Value": task.global_id})
    if schedule.cranes:
        _cranes(project, schedule)
    ElementTree.indent(project, " ")
    written: bytes = ElementTree.tostring(project, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _task(
    tasks: ElementTree.Element,
    number: int,
    name: str,
    start: datetime,
    finish: datetime,
    *,
    level: int,
    summary: bool,
) -> ElementTree.Element:
    dates = {"Start": start.isoformat(), "Finish": finish.isoformat(), "Duration": duration_text(finish - start)}
    entry = _child(tasks, "Task")
    _fill(
        entry,
        {
            "UID": str(number),
            "ID": str(number),
            "Name": name,
            "Type": _FIXED_DURATION,
            "IsNull": "0",
            "OutlineLevel": str(level),
            **dates,
            **{f"Manual{name}": value for name, value in dates.items()},
            "DurationFormat": _ELAPSED_MINUTES,
            "Milestone": "0",
            "Summary": str(int(summary)),
            "ConstraintType": "0",
        },
    )
    return entry


def _calendar(calendar: ElementTree.Element) -> None:
    _fill(calendar, {"UID": _ROUND_THE_CLOCK, "Name": "Round the clock", "IsBaseCalendar": "1"})
    days = _child(calendar, "WeekDays")
    for day in range(1, 8):
        entry = _child(days, "WeekDay")
        _fill(entry, {"DayType": str(day), "DayWorking": "1"})
        time = _child(_child(entry, "WorkingTimes"), "WorkingTime")
        _fill(time, {"FromTime": "00:00:00", "ToTime": "00:00:00"})


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
