"""Every message of a ROS 2 bag is as the library that reads it would write it."""

from collections import Counter

import pytest
from drawn_plans import motions_by_hand, plan_by_hand
from rosbags.highlevel import AnyReader
from two_cranes import two_crane_plan

from bimvox.exporters.ros2 import write_ros2_bag
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog


def by_hand(*, crane):
    plan = plan_by_hand(crane=crane)
    return PlanLog(plan=plan, motions=motions_by_hand(plan) if crane else ())


LOGS = {
    "a crane": lambda: by_hand(crane=True),
    "no crane": lambda: by_hand(crane=False),
    "two cranes": lambda: PlanLog(*two_crane_plan()),
}


@pytest.mark.parametrize("name", LOGS)
def test_messages_are_complete_and_as_the_library_writes_them(name, tmp_path):
    log = LOGS[name]()
    count = write_ros2_bag(log, tmp_path / "bag")
    topics, paths, loads = Counter(), [], set()
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            assert bytes(reader.typestore.serialize_cdr(message, connection.msgtype)) == raw
            topics[connection.topic] += 1
            if connection.topic == "/lift/path":
                last = message.poses[-1].pose.position
                paths.append((time_ns, len(message.poses), last.x, last.y, last.z))
            if connection.topic == "/tf":
                stamps = {one.header.stamp.sec * 10**9 + one.header.stamp.nanosec for one in message.transforms}
                assert stamps == {time_ns}
                carried = [one for one in message.transforms if one.child_frame_id.startswith("component/")]
                loads |= {(time_ns, one.child_frame_id, one.transform.translation.z) for one in carried}
    assert topics.total() == count
    tracks = tracks_of(log)
    assert sorted(paths) == sorted(
        (track.start_ns, len(track.time_ns), *track.corner_m[-1].tolist()) for track in tracks
    )
    assert topics["/joint_trajectory"] == len(log.motions)
    samples = sum(len(motion.samples()[0]) for motion in log.motions)
    assert topics["/joint_states"] == samples
    wanted = {
        (time_ns, f"component/{log.plan.site.components[track.lift.component].id}", corner_m[2])
        for track in tracks
        for time_ns, corner_m in zip(track.time_ns.tolist(), track.corner_m.tolist(), strict=True)
    }
    assert loads == wanted
