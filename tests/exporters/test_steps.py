"""Steps of work that the crane does not do, in what other programs read, and after a revision."""

from __future__ import annotations

import csv
import io
from datetime import timedelta
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import seeded_faults as faults

import bimvox
from bimvox.exporters.csv_json import lifts_csv
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN, LiftSchedule, schedule_of
from bimvox.exporters.ms_project import NAMESPACE, to_ms_project
from bimvox.log.moving import tracks_of
from bimvox.log.narration import log_messages
from bimvox.log.plan_log import PlanLog
from bimvox.records.steps import Steps
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet


@cache
def log() -> PlanLog:
    """Return the log of two columns, a beam that is cast on them, and a slab that waits for the beam."""
    return faults.log_with_a_cast_beam()


def schedule() -> LiftSchedule:
    return schedule_of(log(), DEFAULT_BEGIN, [lift.order for lift in log().plan.lifts])


def test_a_schedule_has_the_step_between_the_lifts_in_elapsed_time() -> None:
    made = schedule()
    assert [task.number for task in made.tasks] == [1, 2, 3, 4]
    step, slab = made.tasks[2:]
    assert (step.crane, step.method, slab.method) == (None, "cast in place", "crane lift")
    assert made.before(2) == ((1, True),)
    assert made.before(3) == ((1, True), (2, True))
    waited = made.times(slab)[0] - made.times(step)[1]
    assert waited == timedelta(hours=168)
    assert made.finishes - made.begins > waited


def test_work_before_the_first_lift_is_dated_before_it() -> None:
    early = faults.log_cast("left", "right")
    made = schedule_of(early, DEFAULT_BEGIN, [lift.order for lift in early.plan.lifts])
    assert made.starts < made.begins == DEFAULT_BEGIN
    assert [step.carries_ns <= 0 for step in early.steps.steps] == [True, True]


def test_ms_project_has_a_task_without_a_crane_for_the_step() -> None:
    root = ElementTree.fromstring(to_ms_project(schedule()))
    tasks = root.findall(f".//{{{NAMESPACE}}}Task")
    assert sum(task.findtext(f"{{{NAMESPACE}}}Summary") == "0" for task in tasks) == 4
    done_by = {one.findtext(f"{{{NAMESPACE}}}UID"): one for one in root.iter(f"{{{NAMESPACE}}}Resource")}
    of_task: dict[str, list[str]] = {}
    for one in root.iter(f"{{{NAMESPACE}}}Assignment"):
        task, resource = (str(one.findtext(f"{{{NAMESPACE}}}{key}UID")) for key in ("Task", "Resource"))
        of_task.setdefault(task, []).append(str(done_by[resource].findtext(f"{{{NAMESPACE}}}Name")))
    crane = schedule().cranes[0].name
    assert of_task == {"1": [crane], "2": [crane], "3": ["Casting crew"], "4": [crane]}


def test_the_table_of_lifts_has_both_clocks() -> None:
    rows = list(csv.DictReader(io.StringIO(lifts_csv(log()))))
    beam, slab = rows[2:]
    assert beam["start_s"] == ""
    assert float(beam["carries_s"]) - float(beam["elapsed_end_s"]) == 168 * 3600.0
    assert slab["elapsed_start_s"] == beam["carries_s"]
    assert float(slab["elapsed_start_s"]) - float(slab["start_s"]) > 168 * 3600.0


def test_the_log_tells_of_work_and_pauses() -> None:
    words = [message.message for _, _, message in log_messages(log(), tracks_of(log()), 0)]
    assert any("in situ: IfcBeam: 1 parts" in text for text in words)
    assert "the crane pauses before lift 4: what its part rests on carries 7 d 0 h later" in words
    assert not any("pauses" in message.message for _, _, message in log_messages(log().extract([3]), (), 0))


def test_an_extract_has_no_steps() -> None:
    assert log().extract([3]).steps == Steps()


def test_a_revision_keeps_step_and_pause(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    bimvox.write_log(bimvox.Plan(log()), file)
    pole = Obstruction("pole", Box((6.0, 1.0, 0.0), (7.0, 3.0, 3.0)))
    revised = bimvox.revise(bimvox.read_log(file), ObstructionSet.of([pole]))
    assert revised.verified
    (step,), (pause,) = revised.record.steps.steps, revised.record.steps.pauses
    assert (step.order, pause.order) == (2, 3)
    assert revised.verdict is not None
    assert "steps" in {check.name for check in revised.verdict.checks}
    bimvox.write_log(revised, tmp_path / "b.mcap")
    assert bimvox.verify(tmp_path / "b.mcap").verified
