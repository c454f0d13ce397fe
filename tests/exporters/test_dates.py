"""Dates in what other programs read: Microsoft Project XML, IFC 4D, CSV and JSON."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from datetime import date, datetime, timedelta
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import ifcopenshell
import pytest
import seeded_faults as faults
from valid_ifc import issues

from bimvox.exporters.csv_json import json_bytes, lifts_csv
from bimvox.exporters.ifc import with_schedule
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN, LiftSchedule, duration_text, schedule_of
from bimvox.exporters.ms_project import NAMESPACE, to_ms_project
from bimvox.log.plan_log import PlanLog, log_dates
from bimvox.records.plan_dates import PlanDates

CALENDAR = b'\n[calendar]\nstart = 2026-04-02\ncountry = "DE"\nshifts = ["22:00-06:00"]\nbreaks = ["22:30-22:40"]\n'
MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"


@cache
def log() -> PlanLog:
    """Return the log of two columns, a beam that is cast on them, and a slab; work at night, over Easter."""
    made = faults.log_with_a_cast_beam()
    return dataclasses.replace(made, attachments={"site.toml": made.attachments["site.toml"] + CALENDAR})


def dates() -> PlanDates:
    found = log_dates(log())
    assert found is not None
    return found


def schedule() -> LiftSchedule:
    return schedule_of(log(), DEFAULT_BEGIN, [lift.order for lift in log().plan.lifts], dates())


def of(entry: ElementTree.Element, name: str) -> str:
    return entry.findtext(f"{{{NAMESPACE}}}{name}") or ""


def test_a_log_is_dated_by_its_site_file_or_by_the_start_that_is_given():
    assert dates().first == datetime(2026, 4, 2, 22, 0)
    other = log_dates(log(), datetime(2027, 1, 4, 23, 0))
    assert other is not None
    assert other.first == datetime(2027, 1, 4, 23, 0)
    assert log_dates(log().extract([3])) is None
    assert log_dates(faults.log_with_a_cast_beam()) is None


def test_a_table_of_another_version_of_the_site_file_does_not_hide_the_calendar():
    text = log().attachments["site.toml"] + b"[of_another_version]\nkey = 1\n"
    found = log_dates(dataclasses.replace(log(), attachments={"site.toml": text}))
    assert found is not None
    assert found.end_in_words == dates().end_in_words


def test_a_broken_calendar_in_a_log_gives_the_default_hours():
    text = b"[calendar]\nstart = 2026-04-02\nshifts = 5\n"
    broken = dataclasses.replace(log(), attachments={"site.toml": text})
    assert log_dates(broken) is None
    found = log_dates(broken, datetime(2026, 3, 9))
    assert found is not None
    assert "Mon to Fri 07:00-16:00" in found.notes[0]


def test_the_schedule_is_in_working_hours_and_the_wait_is_elapsed_time():
    made = schedule()
    spans = [made.times(task) for task in made.tasks]
    for task, (start, finish) in zip(made.tasks, spans, strict=True):
        if task.crane is not None:
            assert start.hour >= 22 or finish.hour <= 6
            assert start.hour != 22 or not start.minute < 30 <= finish.minute < 40
    step, slab = spans[2:]
    assert slab[0] >= step[1] + timedelta(hours=168)
    assert slab[0].date() >= date(2026, 4, 9)
    assert made.tasks[2].work_s == (log().steps.steps[0].ends_ns - log().steps.steps[0].begins_ns) / 1e9


def test_ms_project_has_the_hours_and_the_holidays():
    root = ElementTree.fromstring(to_ms_project(schedule()))
    (calendar,) = root.iter(f"{{{NAMESPACE}}}Calendar")
    week = {of(day, "DayType"): day for day in calendar.iter(f"{{{NAMESPACE}}}WeekDay")}
    times = {
        kind: [(of(time, "FromTime"), of(time, "ToTime")) for time in day.iter(f"{{{NAMESPACE}}}WorkingTime")]
        for kind, day in week.items()
    }
    night, evening = ("00:00:00", "06:00:00"), [("22:00:00", "22:30:00"), ("22:40:00", "00:00:00")]
    assert times == {"1": [], "2": evening, **{kind: [night, *evening] for kind in "3456"}, "7": [night]}
    assert [of(week[kind], "DayWorking") for kind in "1234567"] == list("0111111")
    free = [of(one, "FromDate") for one in calendar.iter(f"{{{NAMESPACE}}}TimePeriod")]
    assert free == ["2026-04-03T00:00:00", "2026-04-06T00:00:00"]
    step = next(task for task in root.iter(f"{{{NAMESPACE}}}Task") if "cast in place" in of(task, "Name"))
    assert (of(step, "Start"), of(step, "DurationFormat")) == (
        schedule().times(schedule().tasks[2])[0].isoformat(),
        "3",
    )


def crewed() -> LiftSchedule:
    """Return the schedule with crews and a set-up of the crane."""
    text = b"setup_h = 5\nerection_people = 4\nunloading_people = 2\n"
    made = dataclasses.replace(log(), attachments={"site.toml": log().attachments["site.toml"] + text})
    return schedule_of(made, DEFAULT_BEGIN, [lift.order for lift in made.plan.lifts], log_dates(made))


def test_ms_project_has_set_up_deliveries_levels_and_crews():
    made = crewed()
    root = ElementTree.fromstring(to_ms_project(made))
    tasks = list(root.iter(f"{{{NAMESPACE}}}Task"))
    names = [of(task, "Name") for task in tasks]
    deliveries = [one for one in made.preparations if one.is_delivery]
    assert names[1:3] == ["Set up the crane", "Deliveries"] and deliveries
    assert names[3 : 3 + len(deliveries)] == [one.name for one in deliveries]
    levels = {of(task, "UID"): of(task, "OutlineLevel") for task in tasks}
    assert [levels[str(task.number)] for task in made.tasks] == ["4"] * len(made.tasks)
    by_name = {of(task, "Name"): task for task in tasks}
    first = by_name[made.tasks[0].name]
    before = {of(link, "PredecessorUID") for link in first.iter(f"{{{NAMESPACE}}}PredecessorLink")}
    assert before >= {of(by_name[name], "UID") for name in ("Set up the crane", deliveries[0].name)}
    crews = {of(one, "Name"): of(one, "MaxUnits") for one in root.iter(f"{{{NAMESPACE}}}Resource")}
    assert crews == {made.cranes[0].name: "", "Erection crew": "4", "Casting crew": "8", "Unloading crew": "2"}
    start, finish = made.times(made.tasks[0])
    hours = [of(one, "Work") for one in root.iter(f"{{{NAMESPACE}}}Assignment") if of(one, "Units") == "4"]
    assert hours[0] == duration_text(4 * (finish - start))


@pytest.mark.parametrize("name", [pytest.param("frame.ifc", marks=pytest.mark.slow), "frame_ifc2x3_mm.ifc"])
def test_ifc_has_set_up_deliveries_and_crews(tmp_path, name):
    model = MODEL.with_name(name)
    columns = [str(column.GlobalId) for column in ifcopenshell.open(model).by_type("IfcColumn")]
    made = crewed()
    tasks = tuple(
        dataclasses.replace(task, component=column, global_id=column)
        for task, column in zip(made.tasks, columns, strict=False)
    )
    path = tmp_path / "out.ifc"
    path.write_bytes(with_schedule(model, model.read_bytes(), dataclasses.replace(made, tasks=tasks)))
    written = ifcopenshell.open(path)
    assert issues(written) == []
    by_name = {one.Name: one for one in written.by_type("IfcTask")}
    assert {one.name for one in made.preparations} < by_name.keys() and len(made.preparations) > 1
    for one in made.preparations:
        times = by_name[one.name].TaskTime
        assert (times.ScheduleStart, times.ScheduleFinish) == tuple(at.isoformat() for at in made.times(one))
    assert [one.PredefinedType for one in by_name.values()].count("LOGISTIC") == len(made.preparations)
    usage = {one.Name: one.Usage.ScheduleUsage for one in written.by_type("IfcCrewResource")}
    assert usage == {"Erection crew": 4.0, "Casting crew": 8.0, "Unloading crew": 2.0}
    links = [
        link for link in written.by_type("IfcRelAssignsToProcess") if link.RelatedObjects[0].is_a("IfcCrewResource")
    ]
    assert {(link.RelatedObjects[0].Name, link.RelatingProcess.Name) for link in links} == {
        (one.crew.name, one.name) for one in (*made.preparations, *tasks) if one.crew is not None
    }
    assert {one.Description for one in written.by_type("IfcCrewResource")} == {"4 people", "8 people", "2 people"}
    waits = {
        (link.RelatingProcess.Name, link.RelatedProcess.Name)
        for link in written.by_type("IfcRelSequence")
        if link.RelatingProcess.Name in {one.name for one in made.preparations}
        and link.RelatedProcess.Name in {task.name for task in tasks}
    }
    assert waits == {
        (one.name, next(task.name for task in tasks if task.number == one.first))
        for one in made.preparations
        if any(task.number == one.first for task in tasks)
    }


def test_a_file_that_violates_a_rule_of_its_schema_is_not_valid():
    file = ifcopenshell.open(MODEL)
    file.by_type("IfcProject")[0].Name = None
    assert [one["attribute"] for one in issues(file)] == ["IfcProject.HasName"]


@pytest.mark.parametrize("name", ["frame.ifc", "frame_ifc2x3_mm.ifc"])
def test_ifc_has_the_dates_and_is_valid(tmp_path, name):
    model = MODEL.with_name(name)
    columns = [str(column.GlobalId) for column in ifcopenshell.open(model).by_type("IfcColumn")]
    tasks = tuple(
        dataclasses.replace(task, component=column, global_id=column)
        for task, column in zip(schedule().tasks, columns, strict=False)
    )
    path = tmp_path / "out.ifc"
    path.write_bytes(with_schedule(model, model.read_bytes(), dataclasses.replace(schedule(), tasks=tasks)))
    written = ifcopenshell.open(path)
    assert issues(written) == []
    assert written.schema == "IFC4"
    (calendar,) = written.by_type("IfcWorkCalendar")
    assert [time.Start for time in calendar.ExceptionTimes] == ["2026-04-03", "2026-04-06"]
    weeks = {tuple(time.RecurrencePattern.WeekdayComponent): time for time in calendar.WorkingTimes}
    assert set(weeks) == {(1,), (2, 3, 4, 5), (6,)}
    assert {one.TaskTime.ScheduleStart for one in written.by_type("IfcTask")} >= {
        schedule().times(task)[0].isoformat() for task in tasks
    }


def test_tables_have_local_times_and_the_calendar():
    rows = list(csv.DictReader(io.StringIO(lifts_csv(log(), dates()))))
    assert [(row["begins"], row["ends"]) for row in rows] == [dates().span(order) for order in range(4)]
    document = json.loads(json_bytes(log(), dates()))
    assert document["calendar"]["ends"] == rows[-1]["ends"] == document["lifts"][-1]["ends"]
    assert json.loads(json_bytes(log()))["calendar"] is None
    assert {row["begins"] for row in csv.DictReader(io.StringIO(lifts_csv(log())))} == {""}


def unloaded_by_crane() -> LiftSchedule:
    """Return the schedule of a site with an access of trucks beside the yard."""
    site = log().plan.site
    plan = dataclasses.replace(log().plan, site=dataclasses.replace(site, access=~site.yard))
    made = dataclasses.replace(log(), plan=plan)
    return schedule_of(made, DEFAULT_BEGIN, [lift.order for lift in plan.lifts], log_dates(made))


@pytest.mark.slow
def test_the_crane_works_at_the_deliveries_that_it_unloads(tmp_path):
    assert not any(one.cranes for one in schedule().preparations)
    made = unloaded_by_crane()
    deliveries = [one for one in made.preparations if one.is_delivery]
    assert deliveries
    assert all(one.cranes == (0,) and one.work_s != 1800.0 for one in deliveries)
    root = ElementTree.fromstring(to_ms_project(made))
    uids = {of(task, "Name"): of(task, "UID") for task in root.iter(f"{{{NAMESPACE}}}Task")}
    crane = next(of(one, "UID") for one in root.iter(f"{{{NAMESPACE}}}Resource"))
    work = {
        of(one, "TaskUID"): of(one, "Work")
        for one in root.iter(f"{{{NAMESPACE}}}Assignment")
        if of(one, "ResourceUID") == crane
    }
    for one in deliveries:
        assert work[uids[one.name]] == duration_text(timedelta(seconds=round(one.work_s)))
    path = tmp_path / "out.ifc"
    columns = [str(column.GlobalId) for column in ifcopenshell.open(MODEL).by_type("IfcColumn")]
    tasks = tuple(
        dataclasses.replace(task, component=column, global_id=column)
        for task, column in zip(made.tasks, columns, strict=False)
    )
    path.write_bytes(with_schedule(MODEL, MODEL.read_bytes(), dataclasses.replace(made, tasks=tasks)))
    written = ifcopenshell.open(path)
    assert issues(written) == []
    done_by_crane = {
        link.RelatingProcess.Name
        for link in written.by_type("IfcRelAssignsToProcess")
        if link.RelatedObjects[0].is_a("IfcConstructionEquipmentResource")
    }
    assert done_by_crane >= {one.name for one in deliveries}
