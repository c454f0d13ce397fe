"""Writing a log and reading it back, with bimvox's reader and with the plain MCAP reader."""

from __future__ import annotations

import dataclasses
import io
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from log_building import NS, log_bytes, same, tiny_log, tiny_plan
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from bimvox.crane.links import urdf
from bimvox.errors import InputError, LogFileError
from bimvox.log.bundle import site_from_bytes
from bimvox.log.plan_log import LogEvent, PlanLog, with_full_rate
from bimvox.log.reader import read_log
from bimvox.log.schema import COMMAND, JOINTS, MOTIONS, topics_of
from bimvox.records.lift import Epoch
from bimvox.site.site import Blocker


@pytest.fixture(scope="module")
def data() -> bytes:
    return log_bytes(tiny_log())


@pytest.fixture(scope="module")
def messages(data: bytes) -> dict[str, list[Any]]:
    return decoded_messages(data)


@pytest.fixture(scope="module")
def every_message() -> dict[str, list[Any]]:
    """The messages of a log with every sample."""
    return decoded_messages(log_bytes(with_full_rate(tiny_log())))


def decoded_messages(data: bytes) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for _, channel, message, decoded in make_reader(
        io.BytesIO(data), validate_crcs=True, decoder_factories=[DecoderFactory()]
    ).iter_decoded_messages():
        assert message.log_time == message.publish_time
        found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def plain(log: PlanLog) -> PlanLog:
    return dataclasses.replace(
        log,
        attachments=dict(log.attachments),
        metadata=dict(log.metadata),
        events=tuple(dataclasses.replace(event, fields=dict(event.fields)) for event in log.events),
    )


@pytest.mark.parametrize("crane", [True, False])
def test_a_log_comes_back_as_it_was_written(crane: bool, tmp_path: Path) -> None:
    record = tiny_log(crane=crane)
    path = tmp_path / "plan.mcap"
    path.write_bytes(log_bytes(record))
    same(plain(read_log(path)), plain(record), tolerance=1e-12)  # rope length = jib height - hook height is rounded


def test_a_log_that_was_read_writes_the_same_paths_and_site(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "plan.mcap"
    path.write_bytes(data)
    log = read_log(path)
    for lift, before in zip(log.plan.lifts, tiny_plan().lifts, strict=True):
        if before.path_vox is not None:
            assert lift.path_vox is not None
            assert lift.path_vox.tobytes() == before.path_vox.tobytes()
            assert not lift.path_vox.flags.writeable


def test_the_same_plan_gives_the_same_bytes(data: bytes) -> None:
    assert log_bytes(tiny_log()) == data
    shuffled = dataclasses.replace(tiny_log(), attachments=dict(reversed(list(tiny_log().attachments.items()))))
    assert log_bytes(shuffled) == data


@pytest.mark.parametrize("crane", [True, False])
def test_every_message_has_the_bytes_that_protobuf_gives_it(crane: bool) -> None:
    record = tiny_log(crane=crane)
    of = {topic.name: topic.message for topic in topics_of(1)}
    found = Counter[str]()
    for _, channel, message in make_reader(io.BytesIO(log_bytes(record))).iter_messages():
        again = of[channel.topic].FromString(message.data).SerializeToString(deterministic=True)
        assert message.data == again
        found[channel.topic] += 1
    assert set(found) == (set(of) if crane else set(of) - {COMMAND, JOINTS, MOTIONS})


def test_the_container_is_laid_out_as_documented(data: bytes) -> None:
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    header, summary = reader.get_header(), reader.get_summary()
    assert (header.profile, header.library) == ("", "bimvox log 2")
    assert summary is not None
    assert {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()} == {
        "/tf": "foxglove.FrameTransforms",
        "/site/voxels": "foxglove.VoxelGrid",
        "/crane/path/planned": "foxglove.PosesInFrame",
        "/crane/load/pose": "foxglove.PoseInFrame",
        "/crane/joint_states": "foxglove.JointStates",
        "/crane/command": "bimvox.CraneCommand",
        "/scene": "foxglove.SceneUpdate",
        "/log": "foxglove.Log",
        "/events": "foxglove.Event",
        "/motions": "bimvox.LiftMotion",
    }
    assert {index.compression for index in summary.chunk_indexes} == {"zstd"}
    assert all(index.uncompressed_size < 80 * 1024 for index in summary.chunk_indexes)
    (metadata,) = reader.iter_metadata()
    assert metadata.name == "bimvox"
    assert metadata.metadata["seed"] == "7"
    assert metadata.metadata["revision"] == "3"
    assert json.loads(metadata.metadata["origin_m"]) == [-2.0, -3.0, -1.0]
    files = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
    assert set(files) == {
        "plan.json",
        "motions.json",
        "crane.urdf",
        "load_chart.json",
        "foxglove.layout.json",
        "remarks.json",
        "site.bimvox.zip",
        "site.toml",
        "obstructions.json",
    }
    site = tiny_plan().site
    assert site.cranes
    assert files["crane.urdf"].decode() == urdf(site.cranes[0])
    same(site_from_bytes(files["site.bimvox.zip"], "log"), site)


def test_times_start_at_zero_and_never_fall(messages: dict[str, list[Any]]) -> None:
    for topic, found in messages.items():
        times = [time for time, _ in found]
        assert times == sorted(times), topic
    assert min(found[0][0] for found in messages.values()) == 0
    assert messages["/crane/joint_states"][-1][0] == tiny_log().motions[-1].end_ns


def test_load_poses_are_where_the_path_is(every_message: dict[str, list[Any]]) -> None:
    """The hand-made motions pass through every cell of the path, so the load takes every planned pose."""
    messages = every_message
    plan = tiny_plan()
    planned = [lift for lift in plan.lifts if lift.path_vox is not None]
    assert len(messages["/crane/path/planned"]) == len(planned)
    load = np.array(
        [(m.pose.position.x, m.pose.position.y, m.pose.position.z) for _, m in messages["/crane/load/pose"]]
    )
    for lift, (_, message) in zip(planned, messages["/crane/path/planned"], strict=True):
        corners = np.array([(p.position.x, p.position.y, p.position.z) for p in message.poses])
        assert np.allclose(corners, plan.site.frame.corner_of(lift.path_vox))
        distance = np.linalg.norm(load[:, None] - corners[None], axis=2).min(axis=0)
        assert distance.max() < 1e-9


def test_motions_are_read_bit_for_bit_at_every_rate(tmp_path: Path) -> None:
    log = tiny_log()
    for record in (log, with_full_rate(log)):
        path = tmp_path / "log.mcap"
        path.write_bytes(log_bytes(record))
        read = read_log(path)
        assert read.rate is record.rate
        assert log_bytes(read) == path.read_bytes()
        for motion, before in zip(read.motions, log.motions, strict=True):
            for found, wanted in zip(motion.samples(), before.samples(), strict=True):
                assert found.tobytes() == wanted.tobytes()


def test_viewers_are_shown_the_samples_that_they_need_and_all_at_the_full_rate(
    messages: dict[str, list[Any]], every_message: dict[str, list[Any]]
) -> None:
    log = tiny_log()
    samples = [time_ns for motion in log.motions for time_ns in motion.samples()[0].tolist()]
    for topic in ("/crane/joint_states", "/tf"):
        assert [time_ns for time_ns, _ in every_message[topic]] == samples
        shown = [(time_ns, message.SerializeToString()) for time_ns, message in messages[topic]]
        assert set(shown) < {(time_ns, message.SerializeToString()) for time_ns, message in every_message[topic]}
    ends = {time_ns for motion in log.motions for one in motion.phases for time_ns in (one.start_ns, one.end_ns)}
    assert ends & set(samples) <= {time_ns for time_ns, _ in messages["/crane/joint_states"]}
    exact = [[message.SerializeToString() for _, message in one["/motions"]] for one in (messages, every_message)]
    assert exact[0] == exact[1]
    assert len(messages["/crane/load/pose"]) < len(every_message["/crane/load/pose"])


def rotation(q: Any) -> np.ndarray[Any, Any]:
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def chained(transforms: Any, last: str) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return rotation and position of a frame in the site frame."""
    by_child = {t.child_frame_id: t for t in transforms}
    turn, at, frame = np.eye(3), np.zeros(3), last
    while frame != "site":
        t = by_child[frame]
        r = rotation(t.rotation)
        at = r @ at + (t.translation.x, t.translation.y, t.translation.z)
        turn, frame = r @ turn, t.parent_frame_id
    return turn, at


def test_the_frames_lead_to_the_hook_and_to_the_load(every_message: dict[str, list[Any]]) -> None:
    messages = every_message
    crane = tiny_plan().site.cranes[0]
    assert crane is not None
    joints = [{j.name: j.position for j in m.joints} for _, m in messages["/crane/joint_states"]]
    assert len(joints) == len(messages["/tf"])
    loads = {(t, m.pose.position.x): m.pose for t, m in messages["/crane/load/pose"]}
    met = 0
    for (time, tf), joint in zip(messages["/tf"], joints, strict=True):
        turn, at = chained(tf.transforms, "hook")
        angle, radius = joint["slewing"], joint["trolley"]
        expected = np.array([radius * np.cos(angle), radius * np.sin(angle), crane.jib_height_m - joint["hoist"]])
        assert np.allclose(at, expected + np.array([crane.base_m[0], crane.base_m[1], 0.0]))
        for child in (t.child_frame_id for t in tf.transforms if t.child_frame_id.startswith("component/")):
            turn, at = chained(tf.transforms, child)
            pose = min((p for (t, _), p in loads.items() if t == time), key=lambda p: abs(p.position.x - at[0]))
            assert np.allclose(at, (pose.position.x, pose.position.y, pose.position.z))
            assert np.allclose(turn, rotation(pose.orientation))
            met += 1
    assert met == len(messages["/crane/load/pose"])


def test_a_part_stored_lying_is_drawn_where_it_lies_while_it_is_tipped(messages: dict[str, list[Any]]) -> None:
    plan = tiny_plan()
    lift, component = plan.lifts[0], plan.site.components[0]
    assert lift.place is not None
    _, first = messages["/crane/load/pose"][0]
    size = np.array(component.shape.size_vox) * plan.site.frame.voxel_size_m
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    at = (first.pose.position.x, first.pose.position.y, first.pose.position.z)
    lying = corners @ rotation(first.pose.orientation).T + at
    low = plan.site.frame.corner_of(lift.place.cell_vox)
    assert np.allclose(lying.min(axis=0), low)
    assert np.allclose(lying.max(axis=0), low + np.array(lift.place.shape.size_vox) * plan.site.frame.voxel_size_m)


def test_scene_updates_follow_the_construction(messages: dict[str, list[Any]]) -> None:
    def states(component: str) -> list[tuple[float, str]]:
        return [
            (time / NS, pair.value)
            for time, update in messages["/scene"]
            for entity in update.entities
            if entity.id == component
            for pair in entity.metadata
            if pair.key == "state"
        ]

    first, second = tiny_log().motions
    assert [state for _, state in states("0GlobalIdColumnA")] == ["unbuilt", "in_transit", "arrived", "assembled"]
    assert [time for time, _ in states("0GlobalIdColumnA")] == [
        0.0,
        first.raising.time_ns[0] / NS,
        first.loaded.time_ns[-1] / NS,
        (first.loaded.time_ns[-1] + 120 * NS) / NS,
    ]
    assert states("0GlobalIdColumnB") == [(0.0, "unbuilt")]
    gone = [(time, d.id) for time, update in messages["/scene"] for d in update.deletions]
    assert gone == [(second.start_ns, "0GlobalIdColumnB")]  # its delivery has ended, and it was never lifted
    assert states("0GlobalIdBeam")[0] == (second.start_ns / NS, "unbuilt")


def test_events_and_words_say_what_happens(messages: dict[str, list[Any]]) -> None:
    events = [{pair.key: pair.value for pair in m.metadata} for _, m in messages["/events"]]
    kinds = Counter(event["kind"] for event in events)
    assert kinds == {"lift": 2, "phase": 7 + 8, "replan": 1}
    assert [event["order"] for event in events if event["kind"] == "lift"] == ["0", "2"]
    assert [event["number"] for event in events if event["kind"] == "lift"] == ["1", "3"]
    words = [m.message for _, m in messages["/log"]]
    assert words[0] == "tiny: 2 of 3 lifts planned"
    assert (
        "lift 2: ColumnB (0GlobalIdColumnB) cannot be lifted: the obstruction stands on its place; blocked by truck-7"
        in words
    )
    assert "overlap in the model: ColumnB (0GlobalIdColumnB) and Beam (0GlobalIdBeam), at least 250.0 mm" in words


@pytest.mark.parametrize("full_rate", [False, True])
def test_commands_drive_the_crane_along_the_motion(full_rate: bool) -> None:
    log = tiny_log()
    messages = decoded_messages(log_bytes(with_full_rate(log) if full_rate else log))
    told = [m for _, m in messages["/crane/command"]]
    assert {m.component_id for m in told} == {"0GlobalIdColumnA", "0GlobalIdBeam"}
    for before, now, after in zip(told, told[1:], told[2:], strict=False):
        if before.lift_order == after.lift_order:
            gap = (after.time.seconds - now.time.seconds) + (after.time.nanos - now.time.nanos) / 1e9
            assert gap > 0.0
            assert gap <= 0.5 + 1e-9 or not full_rate
            rates = np.array([now.slew_rate_rad_s, now.trolley_rate_m_s, now.hoist_rate_m_s])
            reached = np.array([before.slew_rad, before.radius_m, before.height_m]) + rates * gap
            assert np.allclose(reached, [now.slew_rad, now.radius_m, now.height_m])


def test_motions_must_be_those_of_the_plan() -> None:
    record = tiny_log()
    with pytest.raises(InputError, match=r"the motions are of lifts \[1\], but lifts \[1, 3\] are planned"):
        log_bytes(dataclasses.replace(record, motions=record.motions[:1]))
    with pytest.raises(InputError, match="no crane"):
        log_bytes(dataclasses.replace(record, plan=tiny_plan(crane=False)))


@pytest.mark.parametrize(
    "changes",
    [{"attachments": {"plan.json": b""}}, {"metadata": {"site_digest": "x"}}, {"events": (LogEvent("lift", 0, 1),)}],
)
def test_names_of_the_log_itself_cannot_be_taken(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"the log writes .+ itself"):
        log_bytes(dataclasses.replace(tiny_log(), **changes))


def with_a_block(log: PlanLog, cell: tuple[int, int, int], *, past: bool = False) -> PlanLog:
    """Return a log with an obstruction of one cell, now or in the past."""
    block = Blocker("block", "obstruction", np.array([cell], np.int32))
    site = log.plan.site
    blocked = dataclasses.replace(site, blockers=(*site.blockers, block))
    now = log.plan if past else dataclasses.replace(log.plan, site=blocked)
    history = (Epoch(1, (block,)),) if past else ()
    return dataclasses.replace(log, plan=dataclasses.replace(now, history=history))


@pytest.mark.parametrize("past", [False, True])
@pytest.mark.parametrize("cell", [(900, 0, 1), (0, 0, -1)])
def test_an_obstruction_outside_the_grid_is_not_written(cell: tuple[int, int, int], past: bool) -> None:
    with pytest.raises(InputError, match=r"obstruction 'block' has cells outside the grid of \(") as refused:
        log_bytes(with_a_block(tiny_log(), cell, past=past))
    assert refused.value.hint == "clip it, as bimvox.plan and bimvox.revise do"


@pytest.mark.parametrize("crane", [-1, 3])
def test_the_crane_of_a_part_and_of_a_motion_exists(crane: int) -> None:
    log = tiny_log()
    site, count = log.plan.site, len(log.plan.site.cranes)
    parts = (dataclasses.replace(site.components[0], crane=crane), *site.components[1:])
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(site, components=parts))
    with pytest.raises(InputError, match=f"part .+ is of crane {crane}; the site has {count}"):
        log_bytes(dataclasses.replace(log, plan=plan))
    motions = (dataclasses.replace(log.motions[0], crane=crane), *log.motions[1:])
    with pytest.raises(InputError, match=f"the motion of lift 1 is of crane {crane}; the site has {count}"):
        log_bytes(dataclasses.replace(log, motions=motions))


def test_a_motion_of_no_planned_lift_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, path = tiny_log(), tmp_path / "other.mcap"
    motions = tuple(dataclasses.replace(motion, order=motion.order + 70) for motion in log.motions)
    monkeypatch.setattr("bimvox.log.recorder._check", lambda record: None)
    path.write_bytes(log_bytes(dataclasses.replace(log, motions=motions)))
    with pytest.raises(LogFileError, match="its motion 71 is of a lift that is not planned"):
        read_log(path)


def test_a_plan_without_any_lift_is_still_a_log(tmp_path: Path) -> None:
    plan = tiny_plan()
    record = PlanLog(dataclasses.replace(plan, lifts=plan.lifts[1:2]))
    path = tmp_path / "none.mcap"
    path.write_bytes(log_bytes(record))
    assert [lift.order for lift in read_log(path).plan.lifts] == [1]


def test_a_foreign_log_is_refused(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "foreign.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.finish()
    with pytest.raises(LogFileError, match="not a bimvox log"):
        read_log(path)


def test_what_viewers_are_shown_is_rounded_to_about_a_nanometre_and_the_motions_are_exact() -> None:
    log = tiny_log()
    joints = decoded_messages(log_bytes(log))[JOINTS]
    values = np.array([state.position for _, message in joints for state in message.joints])
    assert np.array_equal(values, np.round(values * 2.0**30) / 2.0**30)
    motion = log.motions[0]
    time_ns, axes = motion.samples()
    slews = np.array([message.joints[0].position for at_ns, message in joints if at_ns <= motion.end_ns])
    shown_ns = np.array([at_ns for at_ns, _ in joints if at_ns <= motion.end_ns])
    assert 0.0 < np.abs(slews - axes[np.searchsorted(time_ns, shown_ns), 0]).max() < 1e-9
