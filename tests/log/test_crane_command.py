from __future__ import annotations

from box_sites import test_crane as some_crane
from google.protobuf import descriptor_pool, timestamp_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorProto

from bimvox.log.crane_command import (
    FIELDS,
    PHASE_NUMBERS,
    CraneCommandMessage,
    file_descriptor,
    proto_text,
    to_messages,
)
from bimvox.trajectory.commands import CraneCommand
from bimvox.trajectory.motion import PhaseName


def test_every_phase_has_a_number_of_its_own() -> None:
    assert set(PHASE_NUMBERS) == set(PhaseName)
    assert len(set(PHASE_NUMBERS.values())) == len(PHASE_NUMBERS)
    assert 0 not in PHASE_NUMBERS.values()


def test_numbers_that_were_given_out_stay() -> None:
    """Old logs and other people's readers depend on these: add to this list, never change it."""
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


def test_a_command_comes_back_from_its_bytes() -> None:
    command = CraneCommand(1_500_000_001, 4, 1, PhaseName.LOWER, 0.01, -0.2, -0.3, 7.0, 12.5, 9.25, loaded=True)
    (message,) = to_messages([command], ["a", "b"], some_crane(height=30.0))
    back = CraneCommandMessage.FromString(message.SerializeToString())
    assert (back.time.seconds, back.time.nanos) == (1, 500_000_001)
    assert (back.lift_order, back.component_id, back.phase, back.loaded) == (4, "b", 6, True)
    assert (back.slew_rate_rad_s, back.trolley_rate_m_s, back.hoist_rate_m_s) == (0.01, -0.2, -0.3)
    assert (back.slew_rad, back.radius_m, back.height_m, back.rope_length_m) == (7.0, 12.5, 9.25, 20.75)


def test_the_descriptor_builds_in_an_empty_pool() -> None:
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.AddSerializedFile(file_descriptor().SerializeToString())
    assert pool.FindMessageTypeByName("bimvox.CraneCommand").full_name == "bimvox.CraneCommand"


def test_the_proto_text_says_what_the_descriptor_says() -> None:
    text, file = proto_text(), file_descriptor()
    assert text.startswith('syntax = "proto3";')
    assert isinstance(file, FileDescriptorProto)
    (message,) = file.message_type
    for field in message.field:
        assert f" {field.name} = {field.number};" in text
    for value in message.enum_type[0].value:
        assert f"    {value.name} = {value.number};" in text
    assert text.count("{") == text.count("}") == 2
