"""Third-party formats: each is read back by a library other than the one that wrote it, if one exists."""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ifcopenshell
import ifcopenshell.util.sequence
import numpy as np
import pytest
import trimesh
from bimvox_pipeline.export import export, parsed_start
from bimvox_pipeline.plan import plan
from bimvox_pipeline.render.revisions import page_of_log
from bimvox_pipeline.site import init
from full_disk import full_disk
from opened_pages import Opened
from rosbags.highlevel import AnyReader
from valid_ifc import issues

from bimvox.bim.read import read_building
from bimvox.errors import FileError, InputError
from bimvox.exporters.ms_project import NAMESPACE
from bimvox.library.arguments import PolicyWish
from bimvox.library.export import When
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog, log_dates
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.rendering.page.document import DOCUMENT

SAMPLES = Path(__file__).parents[3] / "sample_models"
BEGIN = datetime(2026, 12, 1, 7, 0)


def run(folder: Path, *, start: str | None = None, **options: Any) -> dict[str, Any]:
    when = When(parsed_start(start), options.pop("done", None), options.pop("baseline", None))
    return export(folder / "frame.mcap", when=when, progress=SilentProgress(), **options)


def text_of(iso: str) -> timedelta:
    """Return the seconds of a duration such as PT1H2M3S."""
    hours, rest = iso.removeprefix("PT").split("H")
    minutes, rest = rest.split("M")
    return timedelta(hours=int(hours), minutes=int(minutes), seconds=int(rest.removesuffix("S")))


def dated(log: PlanLog) -> dict[int, tuple[datetime, datetime]]:
    """Return start and end of each lift: after the first delivery is unloaded, without one that runs into a break."""
    dates = log_dates(log, BEGIN)
    assert dates is not None
    found = {order: (dates.moment(start), dates.moment(end)) for order, (start, end) in dates.lifts.items()}
    begins, ends = (dates.moment(at) for at in dates.deliveries[0])
    assert begins == BEGIN < ends <= min(found.values())[0]
    return found


def test_ifc_has_one_task_per_lift_to_the_second_and_all_its_content(site_folder: Path) -> None:
    model = site_folder / "frame.ifc"
    before = model.read_bytes()
    out = site_folder / "out.ifc"
    run(site_folder, to="ifc", model=model, start="2026-12-01T07:00", out=out)
    assert model.read_bytes() == before
    file, source = ifcopenshell.open(out), ifcopenshell.open(model)
    assert issues(file) == []
    for entity in source:
        assert str(file.by_id(entity.id())) == str(entity)
    log = read_log(site_folder / "frame.mcap")
    (whole,) = [task for task in file.by_type("IfcTask") if not task.Nests]
    tasks = sorted(
        (task for task in ifcopenshell.util.sequence.get_all_nested_tasks(whole) if task.Identification is not None),
        key=lambda task: int(task.Identification),
    )
    above = [[one.Nests[0].RelatingObject.Name for one in (task, task.Nests[0].RelatingObject)] for task in tasks]
    assert {tuple(names) for names in above} == {("Columns", "Ground floor"), ("Beams", "Ground floor")}
    tracks = tracks_of(log)
    assert len(tasks) == len(tracks) == 8
    (crane,) = file.by_type("IfcTransportElement")
    (link,) = file.by_type("IfcRelAssignsToResource")
    assert link.RelatedObjects == (crane,)
    (crew,) = file.by_type("IfcCrewResource")
    for task, track in zip(tasks, tracks, strict=True):
        component = log.plan.site.components[track.lift.component]
        (product,) = ifcopenshell.util.sequence.get_task_outputs(task)
        assert product.GlobalId == component.global_id
        assert set(ifcopenshell.util.sequence.get_task_resources(task)) == {link.RelatingResource, crew}
        start = datetime.fromisoformat(task.TaskTime.ScheduleStart)
        finish = datetime.fromisoformat(task.TaskTime.ScheduleFinish)
        assert (start, finish) == dated(log)[track.lift.order]
        assert text_of(task.TaskTime.ScheduleDuration) == finish - start
    for before_task, after_task in itertools.pairwise(tasks):
        (link,) = (one for one in before_task.IsPredecessorTo if one.RelatedProcess in tasks)
        assert (link.RelatedProcess, link.SequenceType) == (after_task, "FINISH_START")
        assert before_task.TaskTime.ScheduleFinish <= after_task.TaskTime.ScheduleStart
    first = out.read_bytes()
    run(site_folder, to="ifc", model=model, start="2026-12-01T07:00", out=out)
    assert out.read_bytes() == first


@pytest.mark.slow
def test_ifc2x3_becomes_ifc4_whose_tasks_have_dates(store: Path, tmp_path: Path) -> None:
    model = tmp_path / "frame.ifc"
    shutil.copy(SAMPLES / "frame_ifc2x3_mm.ifc", model)
    init(model, tmp_path / "frame.site.toml", voxel_size_m=0.5, progress=SilentProgress())
    plan(tmp_path / "frame.site.toml", tmp_path / "frame.mcap", wish=PolicyWish("default"), progress=SilentProgress())
    run(tmp_path, to="ifc", model=model, start="2026-12-01T07:00", out=tmp_path / "out.ifc")
    file = ifcopenshell.open(tmp_path / "out.ifc")
    assert file.schema == "IFC4"
    assert issues(file) == []
    log = read_log(tmp_path / "frame.mcap")
    lifts = [task for task in file.by_type("IfcTask") if task.PredefinedType == "INSTALLATION"]
    found = {int(task.Identification) - 1: datetime.fromisoformat(task.TaskTime.ScheduleStart) for task in lifts}
    assert found == {order: start for order, (start, _) in dated(log).items()}
    old, new = (sorted(read_building(path).elements, key=lambda one: one.id) for path in (model, tmp_path / "out.ifc"))
    assert [one.global_id for one in new] == [one.global_id for one in old]
    for one, other in zip(old, new, strict=True):
        assert (other.name, other.mass_kg, other.mass_source) == (one.name, one.mass_kg, one.mass_source)
        assert np.array_equal(other.mesh.vertices_m, one.mesh.vertices_m)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "--model"),
        ({"model": SAMPLES / "prefab.ifc"}, "not the file that the plan was made from"),
        ({"model": SAMPLES / "frame.ifc", "start": "soon"}, "not a date and time"),
        ({"model": SAMPLES / "frame.ifc", "start": "2026-12-01T07:00+01:00"}, "without a zone"),
    ],
)
def test_what_cannot_be_dated_is_refused(site_folder: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        run(site_folder, to="ifc", out=site_folder / "out.ifc", **options)
    assert words in f"{caught.value} {caught.value.hint}"
    assert not (site_folder / "out.ifc").exists()


def test_ms_project_has_the_right_durations(site_folder: Path) -> None:
    out = site_folder / "frame.xml"
    run(site_folder, start="2026-12-01T07:00", out=out)
    space = "{http://schemas.microsoft.com/project}"
    root = ElementTree.fromstring(out.read_bytes())
    tasks = root.findall(f"{space}Tasks/{space}Task")
    log = read_log(site_folder / "frame.mcap")

    def said(task: ElementTree.Element, name: str) -> str:
        return str(task.findtext(space + name))

    assert said(tasks[0], "Summary") == "1"
    assert [said(task, "ID") for task in tasks] == [str(n) for n in range(len(tasks))]
    lifts = [task for task in tasks if said(task, "Name").startswith("Lift ")]
    assert len(lifts) == len(log.planned)
    lifts.sort(key=lambda task: int(said(task, "UID")))
    for task, track in zip(lifts, tracks_of(log), strict=True):
        start, finish = (datetime.fromisoformat(said(task, name)) for name in ("Start", "Finish"))
        assert (start, finish) == dated(log)[track.lift.order]
        assert text_of(said(task, "Duration")) == finish - start
        component = log.plan.site.components[track.lift.component]
        assert task.findtext(f"{space}ExtendedAttribute/{space}Value") == component.global_id
    working: dict[str, list[str]] = {}
    for one in root.findall(f"{space}Assignments/{space}Assignment"):
        working.setdefault(said(one, "ResourceUID"), []).append(said(one, "TaskUID"))
    uids = [said(task, "UID") for task in lifts]
    unloading = [said(task, "UID") for task in tasks if said(task, "Name").startswith("Unload delivery")]
    assert working == {"1": uids + unloading, "2": uids + unloading}, "the crane, and its crew"


def python_with_mpxj() -> str | None:
    """Return a Python that has MPXJ: this one, or that of ``make check-log``."""
    for python in (sys.executable, str(SAMPLES.parent / ".venv-viewers" / "bin" / "python")):
        found = Path(python).exists() and subprocess.run(
            [python, "-c", "import jpype, mpxj; jpype.getDefaultJVMPath()"], check=False, capture_output=True
        )
        if found and found.returncode == 0:
            return python
    return None


def test_mpxj_reads_the_schedule_as_it_is(site_folder: Path) -> None:
    python = python_with_mpxj()
    if python is None:
        pytest.skip("needs mpxj, jpype1 and a Java: make check-log installs the first two")
    out = site_folder / "mpxj.xml"
    run(site_folder, to="msproject", start="2026-12-01T07:00", out=out)
    reader = SAMPLES.parent / "benchmarks" / "read_ms_project.py"
    read = subprocess.run([python, reader, out], check=True, capture_output=True, text=True, timeout=60)
    summary, *rows = json.loads(read.stdout)
    log = read_log(site_folder / "frame.mcap")
    assert summary["is_summary"]
    assert summary["finish"] == max(row["finish"] for row in rows)
    tasks = [row for row in rows if row["name"].startswith("Lift ")]
    tasks.sort(key=lambda task: task["start"])
    assert len(tasks) == len(log.planned)
    for task, track in zip(tasks, tracks_of(log), strict=True):
        start, finish = (datetime.fromisoformat(task[key]) for key in ("start", "finish"))
        assert (start, finish) == dated(log)[track.lift.order]
        assert task["is_elapsed"]
        assert timedelta(seconds=round(task["duration_s"], 3)) == finish - start
        assert task["text1"] == log.plan.site.components[track.lift.component].global_id
        assert task["resources"] == [log.plan.site.cranes[0].name]
    for before, task in itertools.pairwise(tasks):
        assert [before["id"], "FS"] in task["after"]


def test_the_animated_glb_moves_every_part_to_its_place(site_folder: Path) -> None:
    out = site_folder / "frame.glb"
    run(site_folder, out=out)
    log = read_log(site_folder / "frame.mcap")
    data = out.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    binary = data[20 + length + 8 :]

    def values(number: int) -> np.ndarray:
        accessor = document["accessors"][number]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
        return np.frombuffer(binary, np.float32, accessor["count"] * width, start).reshape(-1, width)

    (animation,) = document["animations"]
    moves = {
        document["nodes"][channel["target"]["node"]]["name"]: animation["samplers"][channel["sampler"]]
        for channel in animation["channels"]
        if channel["target"]["path"] == "translation"
    }
    for track in tracks_of(log):
        component = log.plan.site.components[track.lift.component]
        sampler = moves[component.label]
        times, places = values(sampler["input"])[:, 0], values(sampler["output"])
        assert (np.diff(times) > 0).all()
        target_m = log.plan.site.frame.corner_of(np.array(component.target_vox))
        np.testing.assert_allclose(places[-1], target_m, atol=1e-3)
        drawn = np.stack([np.interp(track.time_ns / 1e9, times, places[:, axis]) for axis in range(3)], axis=1)
        assert np.linalg.norm(drawn - track.corner_m, axis=1).max() < 0.006
    scene = trimesh.load(out)
    names = {component.label for component in log.plan.site.components}
    assert names | {"jib", "mast"} <= set(scene.graph.nodes)


def test_the_data_of_the_page_are_those_that_the_page_embeds(site_folder: Path) -> None:
    out = site_folder / "frame.page.json"
    document = run(site_folder, to="page", out=out)
    assert document["verified"] is True
    shown = json.loads(out.read_text())
    DOCUMENT.model.model_validate_json(out.read_bytes())
    assert document["lifts"] == len(read_log(site_folder / "frame.mcap").motions)
    page = page_of_log(site_folder / "frame.mcap", proven=True, progress=SilentProgress())
    assert Opened(page).document == {key: value for key, value in shown.items() if key != "numbers"}
    for options in ({"lifts": ["1"]}, {"recover": True}):
        with pytest.raises(InputError, match="this format is of a whole log"):
            run(site_folder, to="page", out=out, **options)


def test_a_ros2_bag_holds_joints_paths_and_frames(site_folder: Path) -> None:
    out = site_folder / "frame.ros2"
    document = run(site_folder, to="ros2", out=out)
    log = read_log(site_folder / "frame.mcap")
    with AnyReader([out]) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
        assert kinds == {
            "/robot_description": "std_msgs/msg/String",
            "/joint_states": "sensor_msgs/msg/JointState",
            "/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
            "/lift/path": "nav_msgs/msg/Path",
            "/tf": "tf2_msgs/msg/TFMessage",
        }
        assert reader.message_count == document["messages"]
        states, paths = [], []
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/joint_states":
                states.append((time_ns, *message.position))
            if connection.topic == "/lift/path":
                paths.append(message)
    assert len(paths) == len(log.planned)
    end = paths[-1].poses[-1].pose.position
    last = log.plan.site.components[log.planned[-1].component]
    np.testing.assert_allclose(
        (end.x, end.y, end.z), log.plan.site.frame.corner_of(np.array(last.target_vox)), atol=1e-6
    )
    crane = log.plan.site.cranes[0]
    assert crane is not None
    times, axes = log.motions[0].samples()
    assert states[0][0] == times[0]
    np.testing.assert_allclose(states[0][1:], (axes[0, 0], axes[0, 1], crane.jib_height_m - axes[0, 2]))
    with pytest.raises(FileError, match="exists already"):
        run(site_folder, to="ros2", out=out)
    assert sorted(path.name for path in site_folder.iterdir() if path.name.startswith(".")) == []


def test_a_full_disk_is_reported_and_leaves_no_schedule(site_folder: Path) -> None:
    before = sorted(site_folder.iterdir())
    with full_disk(100), pytest.raises(FileError, match="file too large; nothing was changed"):
        run(site_folder, to="ifc", model=site_folder / "frame.ifc", out=site_folder / "out.ifc")
    assert sorted(site_folder.iterdir()) == before


def test_what_is_done_is_in_schedules_with_the_dates_as_planned_and_the_rest_is_later(site_folder: Path) -> None:
    planned = dated(read_log(site_folder / "frame.mcap"))
    first, last = min(planned), max(planned)
    done, out = site_folder / "done.csv", site_folder / "out.xml"
    begun, ended = (at + timedelta(hours=2) for at in planned[first])
    done.write_text(f"part,begins,ends\n{first + 1},{begun},{ended}\nnobody,{begun},{ended}\n")
    run(site_folder, to="msproject", start="2026-12-01T07:00", out=out, done=done)
    space = {"p": NAMESPACE}
    tasks = {
        one.findtext("p:Name", None, space): one
        for one in ElementTree.parse(out).getroot().iterfind(".//p:Task", space)
    }
    (own,) = (one for name, one in tasks.items() if name.startswith("Lift 1:"))
    assert own.findtext("p:ActualStart", None, space) == begun.isoformat()
    assert own.findtext("p:ActualFinish", None, space) == ended.isoformat()
    assert own.findtext("p:Baseline/p:Start", None, space) == planned[first][0].isoformat()
    (final,) = (one for name, one in tasks.items() if name.startswith(f"Lift {last + 1}:"))
    assert final.findtext("p:ActualStart", None, space) is None
    assert datetime.fromisoformat(final.findtext("p:Start", None, space)) > planned[last][0]
    with pytest.raises(InputError, match="glb has no dates"):
        run(site_folder, to="glb", start="2026-12-01T07:00", out=site_folder / "out.glb", done=done)
    with pytest.raises(InputError, match="needs a plan with dates"):
        run(site_folder, to="msproject", out=out, done=done)
    model, file = site_folder / "frame.ifc", site_folder / "out.ifc"
    run(site_folder, to="ifc", model=model, start="2026-12-01T07:00", out=file, done=done)
    written = ifcopenshell.open(file)
    assert issues(written) == []
    schedules = {one.PredefinedType: one for one in written.by_type("IfcWorkSchedule")}
    (relation,) = schedules["BASELINE"].Controls
    before = {one.Name: one.TaskTime.ScheduleStart for one in relation.RelatedObjects}
    times = {one.Name: one.TaskTime for one in written.by_type("IfcTask") if one not in relation.RelatedObjects}
    (name,) = (name for name in times if name.startswith("Lift 1:"))
    assert (times[name].ActualFinish, times[name].Completion) == (ended.isoformat(), 1.0)
    assert before[name] == planned[first][0].isoformat() != times[name].ScheduleStart
