"""What a watch writes and resumes from: segments, the whole log, full disks, files of every kind."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bimvox_pipeline.watch.file_watch
import bimvox_pipeline.watch.revise
import numpy as np
import pytest
import trainings
import trimesh
from bimvox_pipeline.render.render import render
from bimvox_pipeline.report import report
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.file_watch import MOST_DIGESTED_BYTES, changes, state_of
from bimvox_pipeline.watch.log import WholeLog, read_newest, segment_file, segments_on_disk
from bimvox_pipeline.watch.plan import WatchedPlan
from bimvox_pipeline.watch.watch import Watcher, follow
from opened_pages import Opened
from planned_frame import copy_to

from bimvox.errors import FileError
from bimvox.library.arguments import PolicyWish
from bimvox.library.plan import policy_of
from bimvox.library.plan_value import write_log_file
from bimvox.library.prove import prepared
from bimvox.library.site import load_site
from bimvox.log.mcap.reader import read_contents, read_file
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.log.schema import REMARKS_FILE
from bimvox.progress import SilentProgress
from bimvox.records.lift import Status

EMPTY = {"version": 1, "unit": "m", "obstructions": []}


@pytest.fixture(scope="module")
def parts(store, tmp_path_factory) -> tuple[Any, Any, Any]:
    """Return the sample frame's site, its preparation and its policy."""
    quiet = SilentProgress()
    loaded = load_site(copy_to(tmp_path_factory.mktemp("frame")) / "frame.site.toml", quiet)
    _, preparation = prepared(loaded.site, quiet)
    policy = policy_of(loaded, loaded.site, preparation, PolicyWish("default"), quiet)
    return loaded, preparation, policy


@pytest.fixture
def watcher(parts, site_folder) -> Watcher:
    return watcher_in(site_folder, parts)


def log_of(watcher: Watcher) -> Path:
    """Return the whole log."""
    return watcher.file.parent / "frame.mcap"


def watcher_in(folder: Path, parts: tuple[Any, Any, Any]) -> Watcher:
    loaded, preparation, policy = parts
    file = folder / "obstructions.json"
    return Watcher(WatchedPlan(loaded, policy, folder / "frame.mcap", 0), preparation, file, SilentProgress())


def box_on(watcher: Watcher, number: int, name: str = "box") -> dict[str, Any]:
    """Return an obstruction smaller than a cell at two thirds of a lift's path."""
    assert watcher.current is not None
    plan = watcher.current.plan
    path = plan.lifts[number].path_vox
    low = plan.site.frame.corner_of(path[2 * len(path) // 3]) + 0.1
    return {"id": name, "box": {"min": low.tolist(), "max": (low + 0.2).tolist()}}


def put(watcher: Watcher, *entries: dict[str, Any]) -> None:
    watcher.file.write_text(json.dumps(EMPTY | {"obstructions": list(entries)}))


def taken_up(watcher: Watcher) -> list[dict[str, Any]]:
    put(watcher)
    return list(watcher.take_up(state_of(watcher.file)))


def test_a_first_plan_counts_its_remarks_and_no_segment_carries_any(parts, tmp_path):
    watcher = watcher_in(tmp_path, parts)
    (document,) = taken_up(watcher)
    assert document["event"] == "planned"
    first = read_contents(read_file(Path(document["segment"])), "log").attachments
    severities = [remark["severity"] for remark in json.loads(first[REMARKS_FILE])]
    assert document["remarks"] == {one: severities.count(one) for one in ("serious", "minor", "note")}
    put(watcher, box_on(watcher, 7))
    (revised,) = change(watcher)
    assert "remarks" not in revised
    assert REMARKS_FILE not in read_contents(read_file(Path(revised["segment"])), "log").attachments
    watcher.close()
    assert REMARKS_FILE in read_contents(read_file(tmp_path / "frame.mcap"), "log").attachments
    document = verify(tmp_path / "frame.mcap", progress=SilentProgress())
    assert document["verified"] is True


def change(watcher: Watcher) -> list[dict[str, Any]]:
    return list(watcher.change(state_of(watcher.file)))


def test_a_segment_carries_what_is_new_and_is_proven_like_any_log(watcher):
    assert taken_up(watcher)[0]["event"] == "unchanged"
    put(watcher, box_on(watcher, 7))
    (document,) = change(watcher)
    segment = Path(document["segment"])
    log = read_log(segment)
    new = {log.plan.site.components[lift.component].id for lift in log.plan.lifts}
    assert new == {*document["replanned"], *document["retimed"], *document["infeasible"]}
    assert len(log.plan.lifts) + len(log.context) == len(watcher.current.plan.lifts)
    assert log.events[0].kind == "replan"
    assert log.events[0].fields["obstructions"] == "box"
    assert verify(segment, progress=SilentProgress())["verified"]
    assert set(document["stages_ms"]) == {"read", "plan", "prove", "write"}
    assert document["verdict_ms"] <= document["latency_ms"] == document["all_ms"]
    watcher.close()


def assert_proves_nothing_else(segment):
    """A segment without a new planned lift is sound, but proves nothing."""
    document = verify(segment, progress=SilentProgress())
    assert not document["verified"]
    assert document["lifts"] == 0
    assert {name for name, check in document["checks"].items() if not check["passed"]} == {"complete"}
    assert len(document["checks"]["complete"]["failures"]) == 1
    assert "nothing was proven" in document["checks"]["complete"]["failures"][0]


def test_a_change_that_affects_nothing_is_its_own_revision(watcher):
    taken_up(watcher)
    put(watcher, {"id": "far", "voxels": [[0, 0, 1]]})
    (document,) = change(watcher)
    assert document["event"] == "replanned"
    assert document["replanned"] == document["infeasible"] == document["retimed"] == []
    segment = read_log(Path(document["segment"]))
    assert segment.plan.lifts == ()
    assert_proves_nothing_else(Path(document["segment"]))
    watcher.close()
    assert verify(log_of(watcher), progress=SilentProgress())["verified"]


def test_after_a_kill_the_newest_plan_comes_from_the_segments(watcher, parts):
    taken_up(watcher)
    for number in (5, 2):
        put(watcher, box_on(watcher, number))
        change(watcher)
    watcher._whole.hold()  # killed before the whole log was written
    assert read_log(log_of(watcher)).revision == 0
    again = watcher_in(watcher.file.parent, parts)
    (document,) = again.take_up(state_of(again.file))
    assert document["event"] == "unchanged"
    assert document["revision"] == watcher.revision
    assert again.current.plan.site.digest == watcher.current.plan.site.digest
    for one, other in zip(again.current.plan.lifts, watcher.current.plan.lifts, strict=True):
        assert (one.path_vox == other.path_vox).all()
    again.close()
    whole = read_log(log_of(again))
    assert whole.revision == watcher.revision
    assert verify(log_of(again), progress=SilentProgress())["verified"]
    assert [m.end_ns for m in whole.motions] == [m.end_ns for m in watcher.current.chain]


@pytest.mark.slow
def test_the_page_of_a_watched_plan_has_every_revision_whole(watcher):
    taken_up(watcher)
    put(watcher, box_on(watcher, 7))
    change(watcher)
    place = watcher.current.plan.lifts[2].place
    low = watcher.current.plan.site.frame.corner_of(place.cell_vox) + 0.1
    put(watcher, {"id": "on-the-yard", "box": {"min": low.tolist(), "max": (low + 0.2).tolist()}})
    (lost,) = change(watcher)
    watcher._whole.hold()
    count = len(watcher.current.plan.lifts)

    def revisions(log: Path) -> list[dict[str, Any]]:
        out = log.with_suffix(".html")
        render(log, out, proven=True, progress=SilentProgress())
        return Opened(out.read_bytes()).document["revisions"]

    # The page is newer than the whole log.
    ahead = revisions(log_of(watcher))
    assert [r["number"] for r in ahead] == [0, 1, 2]
    watcher.close()
    found = revisions(log_of(watcher))
    assert [r["number"] for r in found] == [0, 1, 2]
    assert [r["carried"] for r in found] == [count] * 3
    assert all(r["proof"]["verified"] for r in found)
    assert [r["infeasible"] for r in found] == [0, 0, len(lost["infeasible"])]
    assert found[2]["lifts"] == ahead[2]["lifts"]
    for revision in found:
        for lift in revision["lifts"]:
            assert (lift["motion"] is not None) == (lift["status"] == "planned")
    # Page and report of a segment are those of the whole plan after it.
    segment = segment_file(log_of(watcher), 1)
    assert [r["carried"] for r in revisions(segment)] == [count] * 2
    record = report(segment, segment.with_suffix(".html"), pictures=0, progress=SilentProgress())["record"]
    assert len(record["lifts"]) == count
    assert record["proof"]["verified"]
    # Later segments that depend on a damaged one are left out.
    segment.write_bytes(segment.read_bytes()[:500])
    assert [r["number"] for r in revisions(log_of(watcher))] == [0, 2]


def test_a_plan_on_disk_whose_proof_fails_is_not_continued(watcher):
    target = log_of(watcher)
    told: list[str] = []
    record = read_log(target)
    (lift, *rest), way = record.plan.lifts, record.plan.lifts[0].path_vox
    short = replace(lift, path_vox=np.delete(way, len(way) // 2, axis=0))
    write_log_file(target, replace(record, plan=replace(record.plan, lifts=(short, *rest))))
    watcher.progress = SilentProgress()
    watcher.progress.note = told.append  # type: ignore[method-assign]
    (document,) = taken_up(watcher)
    assert document["event"] == "planned"
    name = record.plan.site.components[lift.component].label
    assert told[0].startswith(f"{target} is not used, its proof failed: unit_moves: {name}: move")
    watcher.close()
    assert verify(target, progress=SilentProgress())["verified"] is True


def test_a_plan_on_disk_of_another_site_under_the_same_digest_is_not_continued(watcher):
    target, record = log_of(watcher), read_log(log_of(watcher))
    (crane,) = record.plan.site.cranes
    stronger = replace(crane, chart=replace(crane.chart, capacity_kg=tuple(9.0 * kg for kg in crane.chart.capacity_kg)))
    site = replace(record.plan.site, cranes=(stronger,))
    write_log_file(target, replace(record, plan=replace(record.plan, site=site)))
    told: list[str] = []
    watcher.progress = SilentProgress()
    watcher.progress.note = told.append  # type: ignore[method-assign]
    (document,) = taken_up(watcher)
    assert document["event"] == "planned"
    assert told[0] == f"{target} is not used, the site in it is not that of its digest"
    watcher.close()
    assert verify(target, progress=SilentProgress())["verified"] is True


def test_without_the_whole_log_or_with_a_damaged_segment_the_sound_rest_is_resumed(watcher):
    taken_up(watcher)
    for number in (5, 2):
        put(watcher, box_on(watcher, number))
        change(watcher)
    watcher._whole.hold()  # on a busy machine it is written before the segments are read
    digest, target = watcher.current.plan.site.fixed_digest, log_of(watcher)
    segments = segments_on_disk(target)
    newest = read_newest(target, digest, SilentProgress())
    assert newest.behind
    assert newest.log.revision == max(segments)
    last = segments[max(segments)]
    last.write_bytes(last.read_bytes()[:500])
    assert read_newest(target, digest, SilentProgress()).log.revision == max(segments) - 1
    told: list[str] = []
    progress = SilentProgress()
    progress.note = told.append  # type: ignore[method-assign]
    assert read_newest(target, "another site", progress) is None
    # The whole log, the damaged segment, the one before it; the first one is not read.
    assert [note.endswith("belongs to another site and is not used") for note in told] == [True, False, True]
    assert len(segments) == 3


def test_segments_of_an_earlier_plan_are_not_confused_with_those_of_a_new_one(watcher, parts):
    """``bimvox plan`` replaced the log with another plan: the segments are not proven for that plan."""
    taken_up(watcher)
    put(watcher, box_on(watcher, 7))
    change(watcher)
    watcher._whole.hold()  # killed before the whole log was written
    target = log_of(watcher)
    first = read_log(target)
    lost = first.plan.lifts[-1]
    unplanned = replace(
        lost, status=Status.INFEASIBLE, reason="left out", method=None, path_vox=None, shortest_moves=None
    )
    other = replace(
        first, plan=replace(first.plan, lifts=(*first.plan.lifts[:-1], unplanned)), motions=first.motions[:-1]
    )
    with target.open("wb") as stream:
        write_log(stream, other)
    quiet = SilentProgress()
    newest = read_newest(target, first.plan.site.fixed_digest, quiet)
    assert (newest.log.revision, newest.behind) == (0, False)
    assert [lift.status for lift in newest.log.plan.lifts][-1] is Status.INFEASIBLE
    assert any("earlier plan" in note for note in quiet.notes)
    again = watcher_in(watcher.file.parent, parts)
    (document,) = again.take_up(state_of(again.file))
    assert document["event"] == "replanned"
    assert document["revision"] == watcher.revision + 1
    killed = read_newest(target, first.plan.site.fixed_digest, quiet)
    assert killed.log.revision == document["revision"]
    again.close()
    assert verify(target, progress=quiet)["verified"]


def test_a_file_missing_at_the_start_of_a_watch_removes_no_obstruction(watcher, parts):
    """The same as if the file is removed during the watch: editors delete and recreate files, networks fail."""
    taken_up(watcher)
    put(watcher, box_on(watcher, 7))
    change(watcher)
    watcher.close()
    watcher.file.unlink()
    again = watcher_in(watcher.file.parent, parts)
    (document,) = again.take_up(state_of(again.file))
    assert document["event"] == "missing"
    assert "does not exist; the last good plan stands, with its obstructions" in document["message"]
    assert again.current.plan.site.digest == watcher.current.plan.site.digest
    assert list(again.change(state_of(again.file))) == []
    put(again)
    (document,) = change(again)
    assert document["event"] == "replanned"
    again.close()


def test_a_full_disk_loses_nothing(watcher, monkeypatch):
    taken_up(watcher)
    before = watcher.current
    put(watcher, box_on(watcher, 7))
    write = bimvox_pipeline.watch.revise.write_atomically

    def full(path, data):
        raise FileError(path, "cannot be written: no space left on device; nothing was changed")

    monkeypatch.setattr(bimvox_pipeline.watch.revise, "write_atomically", full)
    (document,) = change(watcher)
    assert document["event"] == "failed"
    assert "no space" in document["message"]
    assert watcher.current is before
    assert change(watcher) == []  # an unchanged problem is not reported again
    monkeypatch.setattr(bimvox_pipeline.watch.revise, "write_atomically", write)
    until = time.monotonic() + 60.0
    while not watcher.wants_another_look() and time.monotonic() < until:
        time.sleep(0.05)
    (document,) = change(watcher)
    assert document["event"] == "replanned"
    assert document["revision"] == watcher.revision == 1
    assert not watcher.wants_another_look()
    watcher.close()


def test_a_jump_of_the_systems_clock_changes_nothing(watcher, monkeypatch):
    taken_up(watcher)
    now_s = iter([1e10, 0.0, 5e9] * 1000)
    monkeypatch.setattr(time, "time", lambda: next(now_s))
    monkeypatch.setattr(time, "time_ns", lambda: int(next(now_s) * 1e9))
    put(watcher, box_on(watcher, 7))
    (document,) = change(watcher)
    assert document["event"] == "replanned"
    assert 0.0 < document["verdict_ms"] <= document["latency_ms"] < 1e6
    assert all(0.0 <= value < 1e6 for value in document["stages_ms"].values())
    watcher.file.write_text("{")
    assert change(watcher)[-1]["event"] == "rejected"
    assert not watcher.wants_another_look()
    watcher.close()


def test_many_lifts_come_in_segments_the_first_lifts_first(watcher, monkeypatch):
    taken_up(watcher)
    monkeypatch.setattr(bimvox_pipeline.watch.revise, "_FIRST", 1)
    put(watcher, box_on(watcher, 2, "a"), box_on(watcher, 7, "b"))
    documents = change(watcher)
    assert [d["event"] for d in documents] == ["replanned", *["continued"] * (len(documents) - 1)]
    assert len(documents) > 1
    assert documents[0]["pending"]
    assert documents[0]["undecided"]
    assert set(documents[0]["undecided"]) <= set(documents[0]["pending"])
    assert not any(document["undecided"] for document in documents[1:])
    verdicts_ms = [document["verdict_ms"] for document in documents]
    assert verdicts_ms[0] < documents[0]["latency_ms"] < verdicts_ms[1]
    assert set(verdicts_ms[1:]) == {verdicts_ms[1]}
    assert not documents[-1]["pending"]
    assert documents[-1]["all_ms"] >= documents[0]["latency_ms"]
    for document in documents:
        assert verify(Path(document["segment"]), progress=SilentProgress())["verified"]
    watcher.close()
    assert verify(log_of(watcher), progress=SilentProgress())["verified"]


def test_a_newer_change_goes_first_and_nothing_is_forgotten(watcher, monkeypatch):
    taken_up(watcher)
    monkeypatch.setattr(bimvox_pipeline.watch.revise, "_FIRST", 1)
    entries = [box_on(watcher, 2, "a"), box_on(watcher, 7, "b")]
    put(watcher, *entries)
    parts = watcher.change(state_of(watcher.file))
    first = next(parts)
    assert first["pending"]
    put(watcher, entries[0])
    assert list(parts) == []
    assert watcher.wants_another_look()
    monkeypatch.undo()
    documents = change(watcher)
    assert not documents[-1]["pending"]
    watcher.close()
    assert verify(log_of(watcher), progress=SilentProgress())["verified"]


def test_warming_up_changes_nothing(watcher):
    taken_up(watcher)
    before, on_disk = watcher.current, sorted(watcher.file.parent.iterdir())
    watcher.warm()
    assert watcher.current is before
    assert not watcher.is_cold
    assert sorted(watcher.file.parent.iterdir()) == on_disk


def test_an_unreadable_file_is_not_reported_as_missing(watcher, parts):
    taken_up(watcher)
    watcher.file.unlink()
    watcher.file.mkdir()
    (document,) = change(watcher)
    assert document["event"] == "missing"
    assert "obstructions.json: cannot be read: this is a folder" in document["message"]
    assert "the last good plan stands" in document["message"]
    watcher.close()
    again = watcher_in(watcher.file.parent, parts)
    (document,) = again.take_up(state_of(again.file))
    assert document["event"] == "rejected"
    assert "this is a folder" in document["message"]
    again.close()


def test_an_obstruction_outside_the_site_is_accepted_and_reported(watcher):
    """The author most likely used other units or another origin."""
    taken_up(watcher)
    watcher.progress = SilentProgress()  # the same as while watching
    far = {"id": "far", "box": {"min": [500.0, 500.0, 0.0], "max": [502.0, 502.0, 2.0]}}
    for entry in (far, box_on(watcher, 7)):
        put(watcher, far, entry) if entry is not far else put(watcher, far)
        (document,) = change(watcher)
        assert "far" in document["notes"][-1]
        assert "outside" in document["notes"][-1]
    put(watcher)
    (document,) = change(watcher)
    assert document["notes"] == []
    watcher.close()


def test_first_references_to_files_are_not_separate_changes(watcher):
    taken_up(watcher)
    trimesh.creation.box(extents=(1.0, 1.0, 1.0)).export(watcher.file.parent / "works.stl")
    put(watcher, {"id": "works", "mesh": "works.stl"})
    (document,) = change(watcher)
    assert document["event"] == "replanned"
    with_mesh = state_of(watcher.file, watcher.files)
    assert list(watcher.change(with_mesh)) == []
    put(watcher, {"mesh": "works.stl", "id": "works"})
    (document,) = watcher.change(state_of(watcher.file, watcher.files))
    assert document["event"] == "unchanged"
    watcher.close()


def test_segments_are_next_to_a_log_that_is_a_link_and_are_found_again(watcher, parts):
    """The whole log is written to the target of the link, the segments next to the given name."""
    target = log_of(watcher)
    elsewhere = target.parent / "elsewhere"
    elsewhere.mkdir()
    target.rename(elsewhere / target.name)
    target.symlink_to(elsewhere / target.name)
    taken_up(watcher)
    put(watcher, box_on(watcher, 7))
    change(watcher)
    watcher._whole.hold()  # killed before the whole log was written
    again = watcher_in(watcher.file.parent, parts)
    (document,) = again.take_up(state_of(again.file))
    assert (document["event"], document["revision"]) == ("unchanged", watcher.revision)
    again.close()
    assert target.is_symlink()


def test_a_file_that_is_too_large_is_refused(watcher, monkeypatch):
    taken_up(watcher)
    monkeypatch.setattr(bimvox_pipeline.watch.file_watch, "MOST_DIGESTED_BYTES", 100)
    watcher.file.write_text(" " * 200 + json.dumps(EMPTY))
    (document,) = change(watcher)
    assert document["event"] == "rejected"
    assert "too large" in document["message"]


def test_a_mesh_and_a_scan_that_come_later_are_accepted(watcher):
    taken_up(watcher)
    watcher.file.write_text(json.dumps(EMPTY | {"obstructions": [{"id": "scan", "points": "scan.ply"}]}))
    (document,) = change(watcher)
    assert document["event"] == "rejected"
    assert "scan.ply" in document["message"]
    low = box_on(watcher, 7)["box"]["min"]
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    (watcher.file.parent / "scan.ply").write_text(head + " ".join(map(str, low)) + "\n")
    (document,) = change(watcher)
    assert document["event"] == "replanned"
    assert document["obstructions"] == ["scan"]
    assert [path.name for path in watcher.files] == ["scan.ply"]
    watcher.close()


def cell_box(watcher: Watcher, cell: Any, name: str, size_vox: float = 1.0) -> dict[str, Any]:
    """Return an obstruction that fills one or more cells."""
    assert watcher.current is not None
    frame = watcher.current.plan.site.frame
    low = frame.corner_of(cell) + 0.01
    high = low + size_vox * frame.voxel_size_m - 0.02
    return {"id": name, "box": {"min": low.tolist(), "max": high.tolist()}}


def own_cell(plan: Any, component: Any) -> Any:
    """Return a cell of a part at its place that no other part shares."""
    others = {
        tuple(cell)
        for other in plan.site.components
        if other is not component
        for cell in (other.shape.cells + np.array(other.target_vox)).tolist()
    }
    own = (component.shape.cells + np.array(component.target_vox)).tolist()
    return next(cell for cell in own if tuple(cell) not in others)


@pytest.mark.parametrize("where", ["yard slot", "start", "target"])
def test_an_obstruction_on_a_start_or_target_names_the_lift_and_the_others_continue(watcher, where):
    taken_up(watcher)
    plan = watcher.current.plan
    lift = plan.lifts[-1]
    component = plan.site.components[lift.component]
    cell = {
        "yard slot": lift.place.cell_vox,
        "start": lift.place.transit_start_vox,
        "target": own_cell(plan, component),
    }[where]
    put(watcher, cell_box(watcher, cell, "pallet"))
    told = change(watcher)[-1]
    assert component.id in told["infeasible"]
    (why,) = [one for one in told["blocked"] if one["component"] == component.id]
    assert why["blocked_by"] == ["pallet"]
    assert why["reason"]
    assert told["kept"]
    if read_log(Path(told["segment"])).planned:
        assert verify(Path(told["segment"]), progress=SilentProgress())["verified"]
    else:
        assert_proves_nothing_else(Path(told["segment"]))
    put(watcher)
    told = change(watcher)[-1]
    assert told["infeasible"] == []
    assert component.id in told["replanned"]


def test_boxes_around_a_component_close_it_in(watcher):
    taken_up(watcher)
    plan = watcher.current.plan
    lift = plan.lifts[-1]
    component = plan.site.components[lift.component]
    size = plan.site.frame.voxel_size_m
    low = plan.site.frame.corner_of(lift.place.cell_vox)
    high = low + size * np.array(lift.place.shape.size_vox)
    top = size * plan.site.shape[2]
    walls = [
        {"min": [low[0] - size, low[1] - size, 0.0], "max": [low[0] - 0.01, high[1] + size, top]},
        {"min": [high[0] + 0.01, low[1] - size, 0.0], "max": [high[0] + size, high[1] + size, top]},
        {"min": [low[0] - size, low[1] - size, 0.0], "max": [high[0] + size, low[1] - 0.01, top]},
        {"min": [low[0] - size, high[1] + 0.01, 0.0], "max": [high[0] + size, high[1] + size, top]},
    ]
    put(watcher, *({"id": f"wall {n}", "box": wall} for n, wall in enumerate(walls)))
    told = change(watcher)[-1]
    assert component.id in told["infeasible"]
    (why,) = [one for one in told["blocked"] if one["component"] == component.id]
    assert set(why["blocked_by"]) & {f"wall {n}" for n in range(4)}


def test_a_moved_box_is_a_change_of_that_box_alone(watcher):
    taken_up(watcher)
    put(watcher, box_on(watcher, 7, "truck"), box_on(watcher, 2, "stack"))
    change(watcher)
    put(watcher, box_on(watcher, 6, "truck"), box_on(watcher, 2, "stack"))
    told = change(watcher)[0]
    assert "truck" in told["obstructions"]


def test_obstructions_everywhere_make_every_lift_infeasible_and_none_afterwards(watcher):
    taken_up(watcher)
    frame, shape = watcher.current.plan.site.frame, watcher.current.plan.site.shape
    low, high = frame.corner_of([0, 0, 1]), frame.corner_of(list(shape))
    put(watcher, {"id": "flood", "box": {"min": low.tolist(), "max": high.tolist()}})
    (document,) = change(watcher)
    assert len(document["infeasible"]) == len(watcher.current.plan.lifts)
    assert all("flood" in entry["blocked_by"] or entry["reason"] for entry in document["blocked"])
    put(watcher)
    (document,) = change(watcher)
    assert document["infeasible"] == []
    assert len(document["replanned"]) == len(watcher.current.plan.lifts)
    watcher.close()
    assert verify(log_of(watcher), progress=SilentProgress())["verified"]


def test_a_whole_watch_ends_well_and_leaves_the_newest_log(watcher):
    put(watcher)
    stop, heard = threading.Event(), []

    def run() -> None:
        heard.extend(follow(watcher, once=False, poll_s=0.05, stop=stop))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    until = time.monotonic() + 120.0
    while watcher.is_cold and time.monotonic() < until:
        time.sleep(0.05)
    watcher.file.write_text("{")
    put(watcher, box_on(watcher, 7))
    while watcher.revision < 1 and time.monotonic() < until:
        time.sleep(0.05)
    stop.set()
    thread.join(timeout=60.0)
    assert not thread.is_alive()
    assert read_log(log_of(watcher)).revision == watcher.revision == 1


def test_polling_sees_every_content(tmp_path):
    file = tmp_path / "o.json"
    file.write_text("one")
    stop = threading.Event()
    found: Iterator[Any] = changes(file, tuple, stop, state_of(file), poll_s=0.02)
    threading.Timer(0.2, file.write_text, ["two"]).start()
    assert next(found).digest == state_of(file).digest
    stop.set()
    assert list(found) == []


def test_a_link_with_a_new_target_is_followed(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "o.json").write_text(name)
    link = tmp_path / "o.json"
    link.symlink_to(tmp_path / "one" / "o.json")
    stop = threading.Event()
    found = changes(link, tuple, stop, state_of(link))

    def lead_elsewhere() -> None:
        new = tmp_path / "new"
        new.symlink_to(tmp_path / "two" / "o.json")
        new.replace(link)

    threading.Timer(0.3, lead_elsewhere).start()
    first = next(found)
    threading.Timer(0.3, (tmp_path / "two" / "o.json").write_text, ["three"]).start()
    assert next(found).digest != first.digest
    stop.set()


@pytest.mark.slow
def test_the_whole_log_is_stopped_by_a_change_and_written_at_the_end(watcher, monkeypatch):
    taken_up(watcher)
    written: list[int] = []

    def slow(stream, record) -> None:
        for _ in range(200):
            stream.write(b"x" * 10)
            time.sleep(0.01)
        written.append(record)

    monkeypatch.setattr("bimvox.log.recorder.write_log", slow)
    whole = WholeLog(watcher.file.parent / "whole.mcap", SilentProgress())
    whole.offer(1)
    time.sleep(1.0)
    whole.hold()
    time.sleep(0.3)
    assert not written
    assert not (watcher.file.parent / "whole.mcap").exists()
    whole.offer(2)
    whole.close()
    assert written == [2]
    assert (watcher.file.parent / "whole.mcap").stat().st_size == 2000
    assert not list(watcher.file.parent.glob(".bimvox-*"))


def test_segment_names_sort_and_are_found(tmp_path):
    log = tmp_path / "a.site.mcap"
    for revision in (2, 10_000, 0):
        segment_file(log, revision).write_bytes(b"")
    (tmp_path / "a.site.rx.mcap").write_bytes(b"")
    assert list(segments_on_disk(log)) == [0, 2, 10_000]


@pytest.fixture
def may_end(tmp_path, monkeypatch) -> Path:
    """Return a file whose existence lets a training end."""
    monkeypatch.setenv(trainings.MAY_END, str(tmp_path / "may_end"))
    return tmp_path / "may_end"


def wait_for_training(watcher: Watcher, may_end: Path, limit_s: float = 120.0) -> None:
    may_end.touch()
    until = time.monotonic() + limit_s
    while not watcher.wants_another_look():
        assert time.monotonic() < until
        time.sleep(0.05)


def fails(transit: Any) -> None:
    """Find no path, as a policy."""


@pytest.mark.slow
def test_retraining_runs_in_parallel_and_its_path_is_used_if_not_longer(watcher, may_end):
    watcher.retrain(100)
    watcher._retraining.train = trainings.better
    taken_up(watcher)
    watcher._reviser.propose = fails
    put(watcher, box_on(watcher, 7))
    told = change(watcher)[-1]
    assert told["event"] == "replanned"
    searched = {name for name in told["replanned"] if method_of(watcher, name) == "search"}
    assert searched
    before = {lift.component: lift.moves for lift in watcher.current.plan.lifts}
    wait_for_training(watcher, may_end)
    (told,) = change(watcher)
    assert told["event"] == "retrained"
    assert told["policy"] == "better"
    assert set(told["replanned"]) <= searched
    for lift in watcher.current.plan.lifts:
        assert lift.moves <= before[lift.component]
    assert {name for name in searched if method_of(watcher, name) == "retrained"}
    assert verify(Path(told["segment"]), progress=SilentProgress())["verified"]
    assert change(watcher)[-1]["event"] == "unchanged"
    watcher.close()
    assert read_log(log_of(watcher)).revision == watcher.revision


def method_of(watcher: Watcher, name: str) -> str:
    plan = watcher.current.plan
    return next(lift.method.value for lift in plan.lifts if plan.site.components[lift.component].id == name)


@pytest.mark.slow
def test_retraining_without_gain_or_with_failure_changes_nothing(watcher, may_end):
    watcher.retrain(100)
    taken_up(watcher)
    watcher._reviser.propose = fails
    for number, (outcome, event, said) in enumerate(
        (
            (trainings.unchanged, "retrained", "no retrained policy was better"),
            (trainings.broken, "failed", "no lessons"),
        )
    ):
        may_end.unlink(missing_ok=True)
        watcher._retraining.train = outcome
        put(watcher, box_on(watcher, 6 - number))
        revision = change(watcher)[-1]["revision"]
        lifts = watcher.current.plan.lifts
        wait_for_training(watcher, may_end)
        (told,) = change(watcher)
        assert told["event"] == event
        assert said in told["message"]
        assert told["revision"] == watcher.revision == revision
        assert watcher.current.plan.lifts is lifts


@pytest.mark.slow
def test_a_newer_change_ends_the_training(watcher):
    watcher.retrain(100)
    watcher._retraining.train = trainings.endless
    taken_up(watcher)
    watcher._reviser.propose = fails
    put(watcher, box_on(watcher, 7))
    change(watcher)
    process = watcher._retraining._process
    assert process.is_alive()
    put(watcher)
    change(watcher)
    assert not process.is_alive()
    watcher.close()


HUGE_BYTES = 1 << 40


def test_a_huge_sparse_file_is_refused_without_being_read(watcher, monkeypatch):
    taken_up(watcher)
    good = watcher.current
    with watcher.file.open("wb") as stream:
        stream.truncate(HUGE_BYTES)
    read = count_reads(monkeypatch)
    (document,) = change(watcher)
    assert document["event"] == "rejected"
    assert "obstructions.json: is too large (1048576 MiB, at most 512)" in document["message"]
    assert read.bytes < 2 * MOST_DIGESTED_BYTES
    assert watcher.current is good
    put(watcher)
    assert [d["event"] for d in change(watcher)] in ([], ["unchanged"])
    watcher.close()


def test_a_huge_file_has_a_state_of_its_own(tmp_path, monkeypatch):
    file, other = tmp_path / "obstructions.json", tmp_path / "spoil.ply"
    for path in (file, other):
        with path.open("wb") as stream:
            stream.truncate(HUGE_BYTES)
    read = count_reads(monkeypatch)
    first = state_of(file, (other,)).digest
    assert first == state_of(file, (other,)).digest
    with other.open("wb") as stream:
        stream.truncate(HUGE_BYTES + 1)
    assert state_of(file, (other,)).digest != first
    assert read.bytes == 0


class Read:
    """The number of bytes read."""

    bytes = 0


def count_reads(monkeypatch: pytest.MonkeyPatch) -> Read:
    """Count the bytes read from any file; a test that would read a terabyte fails instead of running on."""
    read, of_path = Read(), Path.open

    def opened(path: Path, *args: Any, **more: Any) -> Any:
        stream = of_path(path, *args, **more)
        if args[:1] == ("rb",):
            of_stream = stream.read

            class Counted:
                def __enter__(self) -> Any:
                    return self

                def __exit__(self, *_: object) -> None:
                    stream.close()

                def __getattr__(self, name: str) -> Any:
                    return getattr(stream, name)

                def read(self, size: int = -1) -> bytes:
                    read.bytes += size if size >= 0 else HUGE_BYTES
                    assert read.bytes < 1 << 31, "reads without end"
                    return of_stream(size)

            return Counted()
        return stream

    monkeypatch.setattr(Path, "open", opened)
    return read
