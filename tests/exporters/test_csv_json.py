from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest
from log_building import NS, log_bytes, same, tiny_log
from mcap.reader import make_reader

from bimvox.errors import SelectionError
from bimvox.exporters.csv_json import (
    LIFT,
    SAMPLE_COLUMNS,
    json_bytes,
    lifts_csv,
    to_csv,
    to_mcap,
)
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN
from bimvox.exporters.log import WRITERS, Chosen, messages_in
from bimvox.log.plan_log import PlanLog, chosen_lifts
from bimvox.log.reader import read_log


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def chosen(log: PlanLog, ids: list[str]) -> PlanLog:
    return log.extract(chosen_lifts(log, ids))


def test_samples_as_csv() -> None:
    log = tiny_log()
    table = rows(to_csv(log))
    assert list(table[0]) == list(SAMPLE_COLUMNS)
    first = [row for row in table if row["order"] == "0"]
    assert {row["number"] for row in first} == {"1"}
    times, axes = log.motions[0].samples()
    assert [float(row["time_s"]) for row in first] == [t / NS for t in times.tolist()]
    assert [float(row["slew_rad"]) for row in first] == axes[:, 0].round(6).tolist()
    assert [float(row["hook_height_m"]) for row in first] == axes[:, 2].round(6).tolist()
    hooking = [row for row in first if row["phase"] == "hook_on"]
    assert hooking
    assert all(row["x_m"] == "" for row in hooking)
    lowering = [row for row in first if row["phase"] == "lower"]
    assert all(row["x_m"] != "" for row in lowering)
    target = log.plan.site.frame.corner_of(log.plan.site.components[0].target_vox)
    set_down = next(row for row in first if row["phase"] == "set")
    assert [float(set_down[axis]) for axis in ("x_m", "y_m", "z_m")] == pytest.approx(target.tolist())


def test_a_site_without_a_crane_has_its_path_as_samples() -> None:
    log = tiny_log(crane=False)
    table = rows(to_csv(chosen(log, ["3"])))
    path = log.plan.lifts[2].path_vox
    assert path is not None
    corner = log.plan.site.frame.corner_of(path)
    assert [[float(row[axis]) for axis in ("x_m", "y_m", "z_m")] for row in table] == corner.tolist()
    assert {row["slew_rad"] for row in table} == {""}
    assert [float(row["time_s"]) for row in table] == list(range(len(path)))


def test_lifts_as_csv() -> None:
    table = rows(lifts_csv(tiny_log()))
    assert list(table[0]) == list(LIFT.meanings)
    assert [(row["component"], row["status"], row["moves"]) for row in table] == [
        ("0GlobalIdColumnA", "planned", "17"),
        ("0GlobalIdColumnB", "infeasible", ""),
        ("0GlobalIdBeam", "planned", "16"),
    ]
    assert [(row["number"], row["order"]) for row in table] == [("1", "0"), ("2", "1"), ("3", "2")]
    assert table[1]["blocked_by"] == "truck-7"
    motion = tiny_log().motions[1]
    assert float(table[2]["duration_s"]) == (motion.end_ns - motion.start_ns) / NS
    assert float(table[2]["bound_s"]) == round(motion.loaded.bound_s, 6)


def test_json_is_plain_and_holds_paths_and_samples() -> None:
    log = tiny_log()
    document = json.loads(json_bytes(chosen(log, ["1", "2"])))
    assert [lift["order"] for lift in document["lifts"]] == [0, 1]
    assert [lift["number"] for lift in document["lifts"]] == [1, 2]
    path = log.plan.lifts[0].path_vox
    assert path is not None
    assert document["lifts"][0]["path_vox"] == path.tolist()
    assert document["lifts"][0]["samples"]["radius_m"] == log.motions[0].samples()[1][:, 1].tolist()
    assert document["lifts"][1]["path_vox"] is None
    assert document["lifts"][1]["blocked_by"] == ["truck-7"]
    assert document["frame"]["voxel_size_m"] == 1.0


def extract(log: PlanLog, ids: list[str], tmp_path: Path) -> PlanLog:
    path = tmp_path / "part.mcap"
    path.write_bytes(to_mcap(chosen(log, ids)))
    return read_log(path)


def test_all_lifts_are_the_log_itself() -> None:
    assert WRITERS["mcap"](Chosen(tiny_log(), (0, 1, 2), DEFAULT_BEGIN)) == log_bytes(tiny_log())


@pytest.mark.parametrize("crane", [True, False])
def test_an_extract_holds_only_the_chosen_lifts(crane: bool, tmp_path: Path) -> None:
    log = tiny_log(crane=crane)
    part = extract(log, ["0GlobalIdBeam"], tmp_path)
    same(part.plan.lifts, log.plan.lifts[2:])
    assert [(lift.order, lift.path_vox) for lift in part.context] == [(0, None), (1, None)]
    assert dict(part.attachments) == dict(log.attachments)
    assert dict(part.metadata) == dict(log.metadata)
    if crane:
        same(part.motions, log.motions[1:], tolerance=1e-12)
    same(extract(part, ["3"], tmp_path).plan, part.plan)


def test_an_extract_begins_with_what_stands_by_then() -> None:
    log = tiny_log()
    data = to_mcap(chosen(log, ["3"]))
    found: dict[str, list[int]] = {}
    for _, channel, message in make_reader(io.BytesIO(data)).iter_messages():
        found.setdefault(channel.topic, []).append(message.log_time)
    start = log.motions[1].start_ns
    assert min(times[0] for times in found.values()) == start
    assert len(found["/crane/path/planned"]) == 1
    assert found["/motions"] == [start]
    assert 1 < len(found["/crane/joint_states"]) < len(log.motions[1].samples()[0])


def test_an_id_of_an_extract_must_be_in_it(tmp_path: Path) -> None:
    part = extract(tiny_log(), ["3"], tmp_path)
    with pytest.raises(SelectionError, match="there is no lift 1 in this log"):
        chosen_lifts(part, ["1"])


@pytest.mark.parametrize("orders", [(), (0,), (0, 1, 2)])
@pytest.mark.parametrize("crane", [False, True])
def test_json_written_lift_by_lift_is_that_of_the_whole_document(crane: bool, orders: tuple[int, ...]) -> None:
    log = tiny_log(crane=crane).extract(orders)
    data = json_bytes(log)
    document = json.loads(data)
    assert data == (json.dumps(document, ensure_ascii=False, indent=1) + "\n").encode()
    assert messages_in(data, "json") == sum(len(lift["samples"]["time_s"]) for lift in document["lifts"])
