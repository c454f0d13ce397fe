"""What a viewer is shown at one time: every crane, the same as in the written log at that time."""

import dataclasses
import io

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from two_cranes import two_crane_plan

from bimvox.crane.kinematics import hook_of
from bimvox.log import schema as topics
from bimvox.log.live.log import LiveLog, Moving, standing_messages, with_held
from bimvox.log.mcap.reader import read_contents
from bimvox.log.plan_log import LogEvent, PlanLog, with_full_rate
from bimvox.log.recorder import write_log
from bimvox.motion.swing import rigged_crane
from bimvox.records.lift import Status
from bimvox.stop.brake_axes import stop_at
from bimvox.stop.redirect import Held

OF_CRANES = (topics.LOAD, topics.JOINTS, topics.COMMAND)


@pytest.fixture(scope="module")
def record():
    plan, motions = two_crane_plan()
    return PlanLog(plan=plan, motions=motions)


@pytest.fixture(scope="module")
def contents(record):
    stream = io.BytesIO()
    write_log(stream, with_full_rate(record))
    return read_contents(stream.getvalue(), "two.mcap")


def times_of(record):
    """Times at which the first crane works, at which both work, and after the end."""
    end_ns = max(motion.end_ns for motion in record.motions)
    return [int(share * end_ns) for share in (0.0, 0.11, 0.32, 0.5, 0.71, 0.93, 1.2)]


def states_of(messages):
    shown = {}
    for _, topic, message in messages:
        if topic == topics.SCENE:
            for entity in message.entities:
                found = {pair.key: pair.value for pair in entity.metadata}
                if "state" in found:
                    shown[entity.id] = found["state"]
    return shown


def test_every_crane_moves_as_in_the_written_log(record, contents):
    moving, seen = Moving(record), set()
    for now_ns in times_of(record):
        got = list(moving.at(now_ns))
        for number in (0, 1):
            for topic in (topics.of_crane(name, number) for name in OF_CRANES):
                before = [m for m in contents.messages if m.topic == topic and m.time_ns <= now_ns]
                sent = [data for name, data in got if name == topic]
                if sent:
                    assert sent == [before[-1].data]
                    seen.add(topic)
                elif topic != topics.of_crane(topics.LOAD, number):
                    assert not before
    assert seen == {topics.of_crane(name, number) for name in OF_CRANES for number in (0, 1)}


def test_frames_of_every_crane_are_sent(record):
    moving = Moving(record)
    for now_ns in times_of(record)[1:]:
        sent = [FrameTransforms.FromString(data) for topic, data in moving.at(now_ns) if topic == topics.TF]
        named = {frame.child_frame_id for message in sent for frame in message.transforms}
        assert {"hook", "crane_2/hook"} <= named


def test_parts_are_in_the_states_of_the_written_log(record, contents):
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

    written = [
        (m.time_ns, topics.SCENE, SceneUpdate.FromString(m.data)) for m in contents.messages if m.topic == topics.SCENE
    ]
    for now_ns in times_of(record):
        then = states_of(one for one in written if one[0] <= now_ns)
        assert states_of(standing_messages(record, now_ns)) == then


def test_the_path_of_every_lift_under_way_is_sent(record):
    ways = {}
    for share in np.linspace(0.0, 0.99, 40):
        now_ns = int(share * max(motion.end_ns for motion in record.motions))
        for _, topic, message in standing_messages(record, now_ns):
            if topic in {topics.PLANNED, topics.of_crane(topics.PLANNED, 1)}:
                ways.setdefault(topic, set()).add(len(message.poses))
    by_crane = {
        topics.of_crane(topics.PLANNED, number): {
            len(lift.path_vox)
            for lift in record.plan.lifts
            if record.plan.site.components[lift.component].crane == number
        }
        for number in (0, 1)
    }
    assert ways == by_crane


def test_what_was_shown_before_is_removed_first(record):
    """A removed obstruction must disappear for viewers that stay connected."""
    updates = [message for _, topic, message in standing_messages(record, 0) if topic == topics.SCENE]
    assert [deletion.type for deletion in updates[0].deletions] == [SceneEntityDeletion.ALL]
    assert all(not update.deletions for update in updates[1:])


def test_what_happened_is_sent(record):
    told = dataclasses.replace(record, events=(LogEvent("replan", 5, 5, {"replanned": "a"}),))
    (event,) = (message for _, topic, message in standing_messages(told, 5) if topic == topics.EVENTS)
    assert {pair.key: pair.value for pair in event.metadata} == {"kind": "replan", "replanned": "a"}


def test_a_live_log_takes_every_cranes_topics(record, tmp_path):
    path = tmp_path / "live.mcap"
    with LiveLog(path, {topics.METADATA: {"schema_version": "1"}}, {}, cranes=2) as log:
        for now_ns in times_of(record):
            for time_ns, topic, message in standing_messages(record, now_ns):
                log.message(topic, time_ns, message)
            for topic, data in Moving(record).at(now_ns):
                log.serialized(topic, now_ns, data)
    there = {message.topic for message in read_contents(path.read_bytes(), path).messages}
    assert {topics.of_crane(name, 1) for name in topics.OF_A_CRANE} <= there


def test_a_held_load_hangs_where_it_came_to_rest(record):
    site, motion = record.plan.site, record.motions[0]
    lift = next(lift for lift in record.plan.lifts if lift.order == motion.order)
    begun_ns = motion.start_ns + int(motion.loaded.time_ns[len(motion.loaded.time_ns) // 2])
    component = site.components[motion.component]
    crane = site.crane_of(component)
    rigged = rigged_crane(site, crane, component)._replace(sample_period_s=0.1)
    stop = stop_at(rigged, motion, begun_ns)
    held = Held(lift, motion, stop, "brakes", True, "no way")
    lifts = tuple(held.infeasible if one.order == lift.order else one for one in record.plan.lifts)
    stands = PlanLog(plan=dataclasses.replace(record.plan, lifts=lifts))
    shown = with_held(stands, held)
    now_ns = stop.end_ns + 100 * 10**9
    name = site.components[lift.component].id
    assert states_of(standing_messages(shown, now_ns, [lift.component]))[name] == "in_transit"
    (message,) = (FrameTransforms.FromString(data) for topic, data in Moving(shown).at(now_ns) if topic == topics.TF)
    frames = {frame.child_frame_id.removeprefix("crane_2/"): frame for frame in message.transforms}
    assert f"component/{name}" in frames
    pose = stop.pose
    height_m = sum(frames[n].translation.z for n in ("crane_base", "jib", "hook"))
    slew_rad = 2.0 * np.arctan2(frames["jib"].rotation.z, frames["jib"].rotation.w)
    there = hook_of(crane, slew_rad, frames["trolley"].translation.x, height_m)
    assert there == pytest.approx(hook_of(crane, pose.slew_rad, pose.radius_m, pose.height_m), abs=1e-6)
    assert with_held(stands, dataclasses.replace(held, stop=None)) is stands
    assert lifts[0].status is Status.INFEASIBLE
