"""A girder that two cranes carry together, from the site file to log, proof, report, page and exports."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.plan import WatchWish
from bimvox_pipeline.watch.watch import watch
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from page_program import needs_node, program_says

import bimvox
from bimvox.crane.kinematics import axes_of_joints, hook_of, joint_names
from bimvox.errors import InputError
from bimvox.exporters.csv_json import to_csv
from bimvox.exporters.hung_load import hung_load_of
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN, schedule_of
from bimvox.library.arguments import PolicyWish
from bimvox.log.mcap.reader import read_contents
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.log.schema import JOINTS, of_crane
from bimvox.progress import SilentProgress
from bimvox.rendering.report.risks import with_categories

SITE = """
name = "girder"
[sequence]
search = false
[model]
path = "girder.obj"
voxel_size_m = 0.25
unit = "m"
up = "z"
[areas]
yard = [[[-2, 0], [12, 0], [12, 6], [-2, 6]]]
[rules.tandem]
[[crane]]
name = "west"
machine = "hammerhead-30"
base_m = [-9, -8]
jib_height_m = 15.5
jib_length_m = 24
[[crane]]
name = "east"
machine = "hammerhead-30"
base_m = [19.5, -8]
jib_height_m = 22
jib_length_m = 24
"""
PARTS = (
    ("block1", (1.0, 9.0, 0.0), (2.0, 10.0, 0.8)),
    ("block2", (8.0, 9.0, 0.0), (9.0, 10.0, 0.8)),
    ("girder", (0.0, 9.25, 0.8), (10.0, 9.7, 1.25)),
    ("top", (4.0, 9.25, 1.25), (5.0, 9.75, 1.75)),
)
_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def _obj() -> str:
    lines = []
    for n, (name, low, high) in enumerate(PARTS):
        lines.append(f"o {name}")
        corners = itertools.product(*((low[axis], high[axis]) for axis in (2, 1, 0)))
        lines += [f"v {x:g} {y:g} {z:g}" for z, y, x in corners]
        lines += ["f " + " ".join(str(8 * n + at + 1) for at in face) for face in _FACES]
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Return the folder with model, site file and log, and the plan's document."""
    folder = tmp_path_factory.mktemp("girder")
    (folder / "girder.obj").write_text(_obj())
    (folder / "girder.site.toml").write_text(SITE)
    wish, log = PolicyWish("none"), folder / "girder.mcap"
    return folder, plan(folder / "girder.site.toml", log, wish=wish, progress=SilentProgress())


def girder_of(document: dict[str, Any]) -> dict[str, Any]:
    return next(lift for lift in document["lifts"] if lift["component"] == "girder")


def test_the_document_has_the_share_of_each_crane(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    girder = girder_of(document)
    shared = girder["tandem"]
    assert girder["status"] == "planned" and shared["names"] == ["west", "east"]
    assert sum(shared["load_kg"]) == pytest.approx(girder["mass_kg"], abs=0.2)
    assert shared["most_kg"][0] > shared["load_kg"][0]
    assert girder["utilisation"] == pytest.approx(max(shared["used"]), abs=1e-4) and girder["utilisation"] < 0.75
    assert shared["apart_m"] == pytest.approx(6.0)
    assert all("tandem" not in lift for lift in document["lifts"] if lift is not girder)
    (remark,) = (one for one in document["remarks"] if one["kind"] == "two_cranes")
    assert "west and east carry it together" in remark["text"]


def test_the_log_is_proven_from_itself(made: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = made
    document = verify(folder / "girder.mcap", site=folder / "girder.site.toml", progress=SilentProgress())
    assert [check["failures"] for check in document["checks"].values() if not check["passed"]] == []
    looked = {name: check["samples"] for name, check in document["checks"].items()}
    assert looked["tandem"] > 10 and looked["together"] > 100


def test_the_log_has_the_motion_of_both_cranes(made: tuple[Path, dict[str, Any]]) -> None:
    """Recomputed from the joint states that viewers are shown: the hooks stay 6 m apart while the girder hangs."""
    folder, _ = made
    contents, log = read_contents((folder / "girder.mcap").read_bytes(), "log"), read_log(folder / "girder.mcap")
    motion = next(one for one in log.motions if one.second is not None)
    begins_ns, ends_ns = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    at_ns = np.linspace(begins_ns, ends_ns, 50)
    hooks = []
    for number, crane in enumerate(log.plan.site.cranes):
        topic, names = of_crane(JOINTS, number), joint_names(crane)
        found = [message for message in contents.messages if message.topic == topic]
        states = [{one.name: one.position for one in JointStates.FromString(m.data).joints} for m in found]
        joints = np.array([[state[name] for name in names] for state in states])
        axes = axes_of_joints(crane, joints)
        times = [message.time_ns for message in found]
        hooks.append(hook_of(crane, *(np.interp(at_ns, times, axis) for axis in axes.T)))
    away = hooks[1] - hooks[0]
    np.testing.assert_allclose(away[:, :2], np.tile([6.0, 0.0], (50, 1)), atol=0.03)


def test_what_is_read_is_what_was_written(made: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = made
    log = read_log(folder / "girder.mcap")
    with (tmp_path / "again.mcap").open("wb") as stream:
        write_log(stream, log)
    again = read_log(tmp_path / "again.mcap")
    one, other = (next(m for m in each.motions if m.second is not None) for each in (log, again))
    assert one.second is not None and other.second is not None
    assert (one.second.crane, one.second.phases) == (other.second.crane, other.second.phases)
    assert (one.second.loaded.axes == other.second.loaded.axes).all()
    assert [lift.tandem for lift in log.plan.lifts] == [lift.tandem for lift in again.plan.lifts]


def _bent(log: Any) -> Any:
    """Return a log in which the second crane swings the girder aside on its way."""
    motions = []
    for motion in log.motions:
        if motion.second is not None:
            loaded = motion.second.loaded
            bow = 0.4 * np.sin(np.linspace(0.0, np.pi, len(loaded.radius_m))) ** 4
            second = replace(motion.second, loaded=replace(loaded, radius_m=loaded.radius_m + bow))
            motion = replace(motion, second=second)
        motions.append(motion)
    return replace(log, motions=tuple(motions))


def _alone(log: Any) -> Any:
    """Return a log that says that the first crane carries the girder alone."""
    parts = tuple(replace(part, tandem=None) for part in log.plan.site.components)
    lifts = tuple(replace(lift, tandem=None) for lift in log.plan.lifts)
    site = replace(log.plan.site, components=parts)
    motions = tuple(replace(motion, second=None) for motion in log.motions)
    return replace(log, plan=replace(log.plan, site=site, lifts=lifts), motions=motions)


def _lighter(log: Any) -> Any:
    """Return a log in which each crane is said to carry a third."""
    lifts = tuple(
        lift if lift.tandem is None else replace(lift, tandem=replace(lift.tandem, load_kg=(1_600.0, 1_600.0)))
        for lift in log.plan.lifts
    )
    return replace(log, plan=replace(log.plan, lifts=lifts))


@pytest.mark.parametrize(
    ("forge", "check", "said"),
    [
        (_bent, "together", "its hooks are"),
        (_alone, "reach", "where the crane carries"),
        (_lighter, "tandem", "its two cranes carry 3.200 t together"),
    ],
)
def test_a_forged_log_is_refused(
    made: tuple[Path, dict[str, Any]], tmp_path: Path, forge: Any, check: str, said: str
) -> None:
    folder, _ = made
    with (tmp_path / "forged.mcap").open("wb") as stream:
        write_log(stream, forge(read_log(folder / "girder.mcap")))
    document = verify(tmp_path / "forged.mcap", progress=SilentProgress())
    failed = {name: one for name, one in document["checks"].items() if not one["passed"]}
    assert not document["verified"] and check in failed
    assert any(said in failure for failure in failed[check]["failures"])


def test_it_is_neither_revised_nor_watched(made: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = made
    with pytest.raises(InputError, match="two cranes carry girder together: such a plan is not revised"):
        bimvox.revise(bimvox.read_log(folder / "girder.mcap"), bimvox.ObstructionSet.of([]))
    with pytest.raises(InputError, match="such a plan is not revised"):
        next(
            watch(
                folder / "none.json",
                site=folder / "girder.site.toml",
                out=folder / "watched.mcap",
                wish=PolicyWish("none"),
                how=WatchWish(once=True),
                progress=SilentProgress(),
            )
        )


def test_samples_name_both_cranes(made: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = made
    text = to_csv(read_log(folder / "girder.mcap"))
    rows = [line for line in text.splitlines() if ",girder," in line]
    assert {line.rsplit(",", 1)[1] for line in rows} == {"west", "east"}


def test_a_task_has_both_cranes_and_one_robot_is_refused(made: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = made
    log = read_log(folder / "girder.mcap")
    order = next(lift.order for lift in log.plan.lifts if lift.tandem is not None)
    made_of = schedule_of(log, DEFAULT_BEGIN, [lift.order for lift in log.plan.lifts])
    tasks = {task.component: task.cranes for task in made_of.tasks}
    assert tasks == {"block1": (0,), "block2": (1,), "girder": (0, 1), "top": (1,)}
    with pytest.raises(InputError, match="two cranes carry girder, and this format has one"):
        hung_load_of(log, [order])


def test_its_category_is_complex() -> None:
    about = {"status": "planned", "critical": False, "stored": "as_built", "mass_source": "quantity", "number": 3}
    remark = {"component": "girder", "kind": "two_cranes", "severity": "minor"}
    (lift,) = with_categories([about | {"id": "girder"}], [remark], [], [])
    assert (lift["category"], lift["category_why"]) == ("complex", ["carried by two cranes"])


def test_the_report_says_who_carries_it(made: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = made
    plan_of = bimvox.read_log(folder / "girder.mcap")
    bimvox.render(plan_of, tmp_path / "girder.html")
    assert (tmp_path / "girder.html").stat().st_size > 100_000


@needs_node
def test_the_page_moves_both_cranes(tmp_path: Path) -> None:
    numbers = [0, 1_000, 0, 0, 0, 0, 0, 0]
    motion = {"kind": "crane", "crane": 0, "keys": numbers, "tip": None, "phases": [], "length_s": 10.0}
    motion["second"] = {"crane": 1, "starts_s": -5.0, "keys": numbers}
    prelude = 'import { motionOf } from "WEB/motion.mjs";\nimport { Plan } from "WEB/plan.mjs";\n'
    scales = {"time": 1000, "length": 1000, "angle": 1000}
    prelude += f"const motion = motionOf({json.dumps(motion)}, (keys) => keys, {json.dumps(scales)});\n"
    revision = {"lifts": [{"motion": 0, "begins_s": 20.0, "order": 0, "part": 0}], "begins_s": 0.0, "ends_s": 30.0}
    prelude += f"const plan = new Plan({json.dumps(revision | {'critical_share': 0.75})}, [{{}}], [motion]);\n"
    body = "[plan.cranes, plan.ofCrane.map((own) => own.length), plan.drives.map((own) => own[0].begins_s)]"
    assert program_says(tmp_path, prelude, body) == [2, [1, 1], [20, 15]]
