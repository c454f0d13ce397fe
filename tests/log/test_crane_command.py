from __future__ import annotations

from math import sin

import numpy as np
import pytest
from box_sites import test_crane as some_crane
from google.protobuf import descriptor_pool, timestamp_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorProto
from named_cranes import default_luffing_crane

from bimvox.crane.kinematics import joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log.crane_command import (
    FIELDS,
    PHASE_NUMBERS,
    CraneCommandMessage,
    command_rows,
    file_descriptor,
)
from bimvox.log.mcap.form import stamp
from bimvox.log.motion_message import motion_descriptor
from bimvox.log.schema import proto_file
from bimvox.motion.commands import PHASES, Commands
from bimvox.records.motion import PhaseName


def test_every_phase_has_its_own_number() -> None:
    assert set(PHASE_NUMBERS) == set(PhaseName)
    assert len(set(PHASE_NUMBERS.values())) == len(PHASE_NUMBERS)
    assert 0 not in PHASE_NUMBERS.values()


def test_published_numbers_do_not_change() -> None:
    """Old logs and third-party readers depend on these fields: add to this list, never change it."""
    assert {field.name: field.number for field in FIELDS} == {
        "time": 1,
        "lift_order": 2,
        "component_id": 3,
        "phase": 4,
        "slew_rate_rad_s": 5,
        "trolley_rate_m_s": 6,
        "hoist_rate_m_s": 7,
        "slew_rad": 8,
        "radius_m": 9,
        "height_m": 10,
        "rope_length_m": 11,
        "loaded": 12,
        "luff_rad": 13,
        "luff_rate_rad_s": 14,
    }
    assert {name.value: number for name, number in PHASE_NUMBERS.items()} == {
        "approach": 1,
        "hook_on": 2,
        "raise": 3,
        "hoist": 4,
        "traverse": 5,
        "lower": 6,
        "set": 7,
        "release": 8,
        "turn": 9,
        "stop": 10,
        "wait": 11,
        "leave": 12,
    }


def some_commands() -> Commands:
    phases = [PHASES.index(phase) for phase in (PhaseName.HOIST, PhaseName.LOWER, PhaseName.RELEASE)]
    rates = np.array([[0.0, 0.5, 1.0], [0.01, -0.2, -0.3], [0.0, 0.0, 0.0]])
    targets = np.array([[0.0, 12.0, 9.0], [7.0, 12.5, 9.25], [7.0, 12.5, 9.25]])
    times = np.array([0, 1_500_000_001, 200 * 10**9], np.int64)
    return Commands(4, 1, times, np.array(phases), rates, targets, np.array([True, True, False]))


VALUES = (
    "slew_rate_rad_s", "trolley_rate_m_s", "hoist_rate_m_s", "slew_rad", "radius_m", "height_m", "rope_length_m",
    "luff_rad", "luff_rate_rad_s",
)  # fmt: skip


def test_a_command_comes_back_from_its_bytes() -> None:
    rows = command_rows(some_commands(), ["a", "b"], some_crane(height=30.0))
    back = CraneCommandMessage.FromString(rows.data[1])
    assert (back.time.seconds, back.time.nanos) == (1, 500_000_001)
    assert (back.lift_order, back.component_id, back.phase, back.loaded) == (4, "b", 6, True)
    rates = (back.slew_rate_rad_s, back.trolley_rate_m_s, back.hoist_rate_m_s)
    assert rates == pytest.approx((0.01, -0.2, -0.3), abs=1e-9)  # viewers are shown them to a nanometre
    assert (back.slew_rad, back.radius_m, back.height_m, back.rope_length_m) == (7.0, 12.5, 9.25, 20.75)


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize(
    "crane", [some_crane(height=30.0), default_luffing_crane("luffing-40")], ids=["trolley", "luffing"]
)
def test_the_bytes_are_protobufs_own(crane: TowerCrane, named: bool) -> None:
    commands = some_commands()
    rows = command_rows(commands, ["a", "b"], crane, topic="/x", named=named)
    assert (rows.topic, rows.time_ns.tolist()) == ("/x", [command.time_ns for command in commands])
    for command, data in zip(commands, rows.data, strict=True):
        target = np.array([[command.target_slew_rad, command.target_radius_m, command.target_height_m]])
        _, reach, rope_length_m = joints_of(crane, target)[0].tolist()
        jib = crane.luffing
        message = CraneCommandMessage(
            time=stamp(command.time_ns),
            lift_order=4,
            component_id="b",
            phase=PHASE_NUMBERS[command.phase],
            slew_rate_rad_s=command.slew_rate_rad_s,
            trolley_rate_m_s=command.trolley_rate_m_s,
            hoist_rate_m_s=command.hoist_rate_m_s,
            slew_rad=command.target_slew_rad,
            radius_m=command.target_radius_m,
            height_m=command.target_height_m,
            rope_length_m=rope_length_m,
            loaded=command.loaded,
            luff_rad=0.0 if jib is None else reach,
            luff_rate_rad_s=0.0 if jib is None else -command.trolley_rate_m_s / (jib.length_m * sin(reach)),
            crane=crane.name if named else "",
        )
        exact = CraneCommandMessage.FromString(data)
        for name in VALUES:
            assert getattr(exact, name) == pytest.approx(getattr(message, name), abs=1e-9)
            setattr(message, name, getattr(exact, name))
        assert data == message.SerializeToString(deterministic=True)


def test_the_descriptor_builds_in_an_empty_pool() -> None:
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.AddSerializedFile(file_descriptor().SerializeToString())
    assert pool.FindMessageTypeByName("bimvox.CraneCommand").full_name == "bimvox.CraneCommand"


def test_the_proto_text_says_what_the_descriptor_says() -> None:
    text = proto_file()
    assert text.startswith('syntax = "proto3";')
    for file in (file_descriptor(), motion_descriptor()):
        assert isinstance(file, FileDescriptorProto)
        (message,) = file.message_type
        assert f"message {message.name} {{" in text
        for field in message.field:
            assert f" {field.name} = {field.number};" in text
        for value in (value for enum in message.enum_type for value in enum.value):
            assert f"    {value.name} = {value.number};" in text
    assert text.count("{") == text.count("}") == 3
