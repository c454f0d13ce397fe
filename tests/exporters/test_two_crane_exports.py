"""Exports of a plan of two cranes, read back."""

import csv
import io
import json

import numpy as np
import pytest
import trimesh
from rosbags.highlevel import AnyReader
from two_cranes import two_crane_plan

from bimvox.crane.kinematics import hook_of
from bimvox.exporters.animation import to_animated_glb
from bimvox.exporters.csv_json import json_bytes, lifts_csv, to_csv, to_mcap
from bimvox.exporters.ros2 import write_ros2_bag
from bimvox.log.mcap.reader import read_contents
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import log_of
from bimvox.proof.motion import verify_motions


@pytest.fixture(scope="module")
def log():
    plan, motions = two_crane_plan()
    return PlanLog(plan=plan, motions=motions, attachments={}, metadata={})


def test_every_sample_and_every_lift_names_its_crane(log):
    names = {motion.order: log.plan.site.cranes[motion.crane].name for motion in log.motions}
    rows = list(csv.DictReader(io.StringIO(to_csv(log))))
    assert len(rows) == sum(len(motion.samples()[0]) for motion in log.motions)
    assert all(row["crane"] == names[int(row["order"])] for row in rows)
    assert {row["crane"] for row in rows} == {"west", "east"}
    lifts = list(csv.DictReader(io.StringIO(lifts_csv(log))))
    assert {int(row["order"]): row["crane"] for row in lifts} == names
    assert {lift["order"]: lift["crane"] for lift in json.loads(json_bytes(log))["lifts"]} == names
    assert set(json.loads(json_bytes(log))["lifts"][0]["samples"]["crane"]) == {names[0]}
    assert "wait" in {row["phase"] for row in rows}


def test_a_part_of_a_log_is_proven_by_itself(log, tmp_path):
    for orders in ([0, 1], [3, 6], [5]):
        data = to_mcap(log.extract(orders))
        part = log_of(read_contents(data, "part.mcap"), tmp_path / "part.mcap")
        assert [motion.order for motion in part.motions] == orders
        proof = verify_motions(part.plan, part.motions, part.context)
        assert proof.verified, proof.failures


def test_a_ros2_bag_moves_both_cranes_in_the_order_of_time(log, tmp_path):
    site = log.plan.site
    write_ros2_bag(log, tmp_path / "bag")
    last_ns, states, frames = 0, {}, set()
    with AnyReader([tmp_path / "bag"]) as reader:
        topics = {connection.topic: connection.msgcount for connection in reader.connections}
        for connection, time_ns, raw in reader.messages():
            assert time_ns >= last_ns
            last_ns = time_ns
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/joint_states":
                states.setdefault(tuple(message.name), []).append((time_ns, message.position.copy()))
            if connection.topic == "/tf":
                frames |= {transform.child_frame_id for transform in message.transforms}
    assert {"/robot_description", "/crane_2/robot_description"} <= set(topics)
    assert topics["/joint_trajectory"] == len(log.motions)
    assert {"hook", "crane_2/hook", "jib", "crane_2/jib"} <= frames
    for number, names in enumerate(
        (("slewing", "trolley", "hoist"), ("crane_2/slewing", "crane_2/trolley", "crane_2/hoist"))
    ):
        own = [motion for motion in log.motions if motion.crane == number]
        assert len(states[names]) == sum(len(motion.samples()[0]) for motion in own)
        times, axes = own[0].samples()
        (first_ns, position), crane = states[names][0], site.cranes[number]
        assert first_ns == times[0]
        assert position == pytest.approx([axes[0, 0], axes[0, 1], crane.jib_height_m - axes[0, 2]])


def test_a_glb_has_both_cranes_at_their_places(log):
    scene = trimesh.load(io.BytesIO(to_animated_glb(log)), file_type="glb")
    site = log.plan.site
    nodes = set(scene.graph.nodes)
    assert {"mast", "jib", "trolley", "rope", "crane_2/mast", "crane_2/jib", "crane_2/trolley", "crane_2/rope"} <= nodes
    for name, crane in zip(("mast", "crane_2/mast"), site.cranes, strict=True):
        matrix, _ = scene.graph.get(name)
        # glTF is y up: site x, z, -y.
        at = np.array([matrix[0, 3], -matrix[2, 3], matrix[1, 3]])
        candidates = (at, matrix[:3, 3])
        assert any(np.allclose(found, crane.base_m, atol=1e-6) for found in candidates)


def test_hooks_in_the_csv_are_apart(log):
    """Two hooks are never at the same place at the same time."""
    rows = list(csv.DictReader(io.StringIO(to_csv(log))))
    site = log.plan.site
    series = {}
    for number, crane in enumerate(site.cranes):
        own = [row for row in rows if row["crane"] == crane.name]
        values = np.array(
            [[float(row[key]) for key in ("time_s", "slew_rad", "radius_m", "hook_height_m")] for row in own]
        )
        values = values[np.argsort(values[:, 0], kind="stable")]
        at = np.arange(0.0, 600.0, 2.0)
        axes = [np.interp(at, values[:, 0], values[:, n]) for n in (1, 2, 3)]
        series[number] = hook_of(crane, *axes)
    assert np.linalg.norm(series[0] - series[1], axis=1).min() > site.rules.crane_separation_m
