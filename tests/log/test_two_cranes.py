"""Logs of a site with two cranes: the reader reads what the recorder writes, and each crane has its own topics."""

import dataclasses
import io
import json
import xml.etree.ElementTree as ET
from collections import Counter

import numpy as np
import pytest
from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from log_building import same
from two_cranes import two_crane_plan, waiting

from bimvox.crane.kinematics import hook_of
from bimvox.log import schema as topics
from bimvox.log.check import check_commands, check_load_poses
from bimvox.log.crane_command import CraneCommandMessage
from bimvox.log.layout import foxglove_layout
from bimvox.log.mcap.reader import read_contents
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import log_of
from bimvox.log.recorder import write_log
from bimvox.proof.motion import verify_motions
from bimvox.site.build import with_digests
from bimvox.workers import Workers


@pytest.fixture(scope="module")
def record():
    plan, motions = two_crane_plan()
    return PlanLog(plan=plan, motions=motions, attachments={}, metadata={})


@pytest.fixture(scope="module")
def data(record):
    stream = io.BytesIO()
    write_log(stream, record)
    return stream.getvalue()


@pytest.fixture(scope="module")
def contents(data):
    return read_contents(data, "two.mcap")


def on(contents, topic):
    return [message for message in contents.messages if message.topic == topic]


def test_a_log_is_read_back_as_it_was(record, contents, tmp_path):
    log = log_of(contents, tmp_path / "two.mcap")
    same(log.plan.site, record.plan.site)
    for was, read in zip(record.motions, log.motions, strict=True):
        assert (read.order, read.crane, read.phases) == (was.order, was.crane, was.phases)
        assert np.abs(read.samples()[1] - was.samples()[1]).max() < 1e-9
    for was, read in zip(record.plan.lifts, log.plan.lifts, strict=True):
        assert np.array_equal(was.path_vox, read.path_vox)
    proof = verify_motions(log.plan, log.motions)
    assert proof.verified, proof.failures
    assert {check.name for check in proof.checks} >= {"cranes", "turns"}


def test_the_same_plan_gives_the_same_bytes(record, data):
    again = io.BytesIO()
    write_log(again, record)
    assert again.getvalue() == data
    shared, workers = io.BytesIO(), Workers(2)
    with workers.knowing(record.plan.site):
        write_log(shared, record, workers=workers)
    workers.close()
    assert shared.getvalue() == data


def test_every_crane_has_its_own_topics(record, contents):
    counts = Counter(message.topic for message in contents.messages)
    for number in (0, 1):
        own = [motion for motion in record.motions if motion.crane == number]
        assert counts[topics.of_crane(topics.PLANNED, number)] == len(own)
        samples = sum(len(motion.samples()[0]) for motion in own)
        assert 2 * len(own) <= counts[topics.of_crane(topics.JOINTS, number)] < samples
        assert counts[topics.of_crane(topics.LOAD, number)] > 0
        named = {
            CraneCommandMessage.FromString(message.data).crane
            for message in on(contents, topics.of_crane(topics.COMMAND, number))
        }
        assert named == {record.plan.site.cranes[number].name}
    assert "/crane_2/load/pose" in counts
    assert set(counts) <= {topic.name for topic in topics.topics_of(2)}


def test_times_ascend_on_every_topic(contents):
    last = {}
    for message in contents.messages:
        assert message.time_ns >= last.get(message.topic, 0)
        last[message.topic] = message.time_ns


def test_frames_of_both_cranes_lead_to_their_hooks(record, contents):
    site = record.plan.site
    seen = {0: 0, 1: 0}
    for message in on(contents, topics.TF)[::5]:
        frames = {t.child_frame_id: t for t in FrameTransforms.FromString(message.data).transforms}
        number = int("crane_2/hook" in frames)
        seen[number] += 1
        base, jib, trolley, hook = (
            frames[topics.of_crane(name, number)] for name in ("crane_base", "jib", "trolley", "hook")
        )
        assert base.parent_frame_id == "site"
        assert jib.parent_frame_id == topics.of_crane("crane_base", number)
        slew = 2.0 * np.arctan2(jib.rotation.z, jib.rotation.w)
        height = base.translation.z + jib.translation.z + hook.translation.z
        there = hook_of(site.cranes[number], slew, trolley.translation.x, height)
        motion = next(m for m in record.motions if m.crane == number and m.start_ns <= message.time_ns <= m.end_ns)
        times, axes = motion.samples()
        wanted = [np.interp(message.time_ns, times, axis) for axis in axes.T]
        assert there == pytest.approx(hook_of(site.cranes[number], *wanted), abs=1e-6)
    assert min(seen.values()) > 20


def test_events_name_the_crane_and_the_wait(contents):
    spans = [
        {pair.key: pair.value for pair in Event.FromString(message.data).metadata}
        for message in on(contents, topics.EVENTS)
    ]
    assert {span["crane"] for span in spans if span["kind"] == "lift"} == {"west", "east"}
    assert "wait" in {span.get("phase") for span in spans}


def test_a_part_is_never_shown_as_built_before_it_is(record, contents):
    """Lifts overlap: the scene follows the clock, not the order."""
    shown = {}
    ids = {component.id: component.index for component in record.plan.site.components}
    ended = {motion.component: motion.end_ns for motion in record.motions}
    lifted = {motion.component: motion.start_ns + int(motion.raising.time_ns[0]) for motion in record.motions}
    for message in on(contents, topics.SCENE):
        for entity in SceneUpdate.FromString(message.data).entities:
            if entity.id not in ids:
                continue
            state = {pair.key: pair.value for pair in entity.metadata}["state"]
            shown[entity.id] = state
            if state == "assembled":
                assert message.time_ns >= ended[ids[entity.id]] - 60 * 10**9
            if state == "in_transit":
                assert message.time_ns == lifted[ids[entity.id]]
    assert set(shown.values()) == {"assembled"}
    assert set(shown) == set(ids)


def test_jibs_of_both_cranes_are_in_the_scene(contents):
    first = SceneUpdate.FromString(on(contents, topics.SCENE)[0].data)
    frames = {entity.id: entity.frame_id for entity in first.entities}
    assert frames["crane/jib"] == "jib"
    assert frames["crane_2/jib"] == "crane_2/jib"


def test_files_of_both_cranes_are_attached(record, contents):
    for number, crane in enumerate(record.plan.site.cranes):
        chart = json.loads(contents.attachments[topics.of_crane(topics.CHART_FILE, number)])
        assert chart["crane"] == crane.name
        robot = ET.fromstring(contents.attachments[topics.of_crane(topics.URDF_FILE, number)])
        links = {link.get("name") for link in robot.iter("link")}
        assert {"site", topics.of_crane("jib", number), topics.of_crane("hook", number)} <= links
        joints = {joint.get("name") for joint in robot.findall("joint")}
        assert topics.of_crane("slewing", number) in joints
        parents = {parent.get("link") for parent in robot.iter("parent")}
        assert parents <= links
    assert set(contents.attachments) <= topics.OWN_ATTACHMENTS


def test_the_layout_shows_both_cranes(record, contents):
    layout = foxglove_layout(record.plan.site)
    text = json.dumps(layout)
    there = {message.topic for message in contents.messages}
    for topic in (topics.JOINTS, topics.COMMAND):
        for number in (0, 1):
            assert topics.of_crane(topic, number) in text
            assert topics.of_crane(topic, number) in there
    shown = layout["configById"]["3D!scene"]
    assert {"/crane/load/pose", "/crane_2/load/pose"} <= set(shown["topics"])
    assert "frame:crane_2/jib" in shown["transforms"]

    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])

    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])


def test_load_poses_and_commands_are_proven_for_each_crane(contents, tmp_path):
    log = log_of(contents, tmp_path / "two.mcap")
    for check in (check_load_poses(contents, log), check_commands(contents, log)):
        assert check.passed, check.failures
        assert check.samples > 100


def test_commands_for_the_other_crane_are_found(contents, tmp_path):
    log = log_of(contents, tmp_path / "two.mcap")
    swapped = {"/crane/command": "/crane_2/command", "/crane_2/command": "/crane/command"}
    mixed = dataclasses.replace(
        contents,
        messages=[m._replace(topic=swapped.get(m.topic, m.topic)) for m in contents.messages],
    )
    assert not check_commands(mixed, log).passed


def test_commands_of_one_crane_name_no_other(record):
    """The schema of logs with one crane is unchanged: no field for the crane's name, no phase ``wait``."""
    command = next(topic for topic in topics.TOPICS if topic.name == topics.COMMAND)
    alone, several = (command.descriptor_set_for(several_cranes=flag) for flag in (False, True))
    assert b"PHASE_WAIT" in several
    assert b"PHASE_WAIT" not in alone
    assert len(alone) < len(several)


def failed_of_the_log(record, tmp_path):
    """Return the names of the motion checks that fail after the log is written and read back."""
    stream = io.BytesIO()
    write_log(stream, record)
    log = log_of(read_contents(stream.getvalue(), "spoiled.mcap"), tmp_path / "spoiled.mcap")
    return {check.name for check in verify_motions(log.plan, log.motions).checks if not check.passed}


def test_a_written_log_with_one_crane_late_fails_its_proof(record, tmp_path):
    """The clock has no gap, and every phase follows the one before: only the other crane is in the way."""
    late = next(motion for motion in record.motions if motion.order == 4)
    waits = waiting(late, late.start_ns, 140 * 10**9)
    spoiled = tuple(waits if motion.order == 4 else motion for motion in record.motions)
    assert failed_of_the_log(dataclasses.replace(record, motions=spoiled), tmp_path) == {"cranes", "turns"}


def test_a_written_log_of_a_site_with_a_larger_separation_fails_only_for_the_cranes(record, tmp_path):
    site = record.plan.site
    rules = dataclasses.replace(site.rules, crane_separation_m=8.0)
    plan = dataclasses.replace(record.plan, site=with_digests(dataclasses.replace(site, rules=rules)))
    assert failed_of_the_log(dataclasses.replace(record, plan=plan), tmp_path) == {"cranes"}
