"""Messages are serialized to the same bytes as by protobuf."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.log.crane_command import CraneCommandMessage
from bimvox.log.mcap.form import Form, stamp

times = st.one_of(st.integers(0, 10**6), st.integers(0, 2 * 10**15), st.integers(0, 10**5).map(lambda s: s * 10**9))
doubles = st.one_of(st.just(0.0), st.just(-0.0), st.floats(width=64))
names = st.one_of(st.text(max_size=5), st.just("n" * 300))


def joints(time_ns: int, row: Any) -> Any:
    states = [JointState(name=name, position=value) for name, value in zip("abc", row, strict=True)]
    return JointStates(timestamp=stamp(time_ns), joints=states)


def bytes_of(message: Any) -> bytes:
    data: bytes = message.SerializeToString(deterministic=True)
    return data


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(times, doubles, doubles, doubles), max_size=30))
def test_many_messages_are_serialized_as_protobuf_does(told):
    rows = np.array([values for _, *values in told], np.float64).reshape(-1, 3)
    made = Form(joints, 3).serialized(np.array([t for t, *_ in told], np.int64), rows)
    assert list(made) == [bytes_of(joints(t, values)) for t, *values in told]


@settings(max_examples=100, deadline=None)
@given(names, names, st.lists(st.tuples(times, doubles, doubles), min_size=1, max_size=10))
def test_nested_messages_have_their_length(first, second, told):
    """Nested messages of any length, next to constant ones and to empty ones that are present."""

    def frames(time_ns: int, row: Any) -> Any:
        still = FrameTransform(parent_frame_id=first, translation=Vector3(x=1.5), rotation=Quaternion())
        moved = FrameTransform(timestamp=stamp(time_ns), child_frame_id=second, translation=Vector3())
        moved.translation.y = row[0]
        moved.rotation.w = row[1]
        return FrameTransforms(transforms=[still, moved])

    rows = np.array([values for _, *values in told], np.float64)
    made = Form(frames, 2).serialized(np.array([t for t, *_ in told], np.int64), rows)
    assert list(made) == [bytes_of(frames(t, values)) for t, *values in told]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(times, st.integers(0, 2**31 - 1), st.booleans(), doubles), min_size=1, max_size=10))
def test_numbers_that_differ(told):
    def command(time_ns: int, row: Any, numbers: Any) -> Any:
        return CraneCommandMessage(
            time=stamp(time_ns), component_id="a", phase=numbers[0], loaded=bool(numbers[1]), rope_length_m=row[0]
        )

    made = Form(command, 1, (4, 12)).serialized(
        np.array([t for t, *_ in told], np.int64),
        np.array([[value] for *_, value in told]),
        np.array([[phase, loaded] for _, phase, loaded, _ in told]),
    )
    assert list(made) == [bytes_of(command(t, [value], [phase, loaded])) for t, phase, loaded, value in told]


@settings(max_examples=50, deadline=None)
@given(names, st.lists(st.tuples(times, doubles, doubles, doubles), min_size=1, max_size=10))
def test_forms_that_follow_each_other(name, told):
    def first(time_ns: int, row: Any) -> Any:
        return FrameTransforms(transforms=[FrameTransform(timestamp=stamp(time_ns), translation=Vector3(x=row[0]))])

    def second(time_ns: int, row: Any) -> Any:
        rotation = Quaternion(y=row[0], w=row[1])
        return FrameTransforms(
            transforms=[FrameTransform(timestamp=stamp(time_ns), child_frame_id=name, rotation=rotation)]
        )

    rows = np.array([values for _, *values in told], np.float64)
    made = Form(first, 1).followed_by(Form(second, 2)).serialized(np.array([t for t, *_ in told], np.int64), rows)
    for data, (time_ns, one, *others) in zip(made, told, strict=True):
        both = FrameTransforms(transforms=[*first(time_ns, [one]).transforms, *second(time_ns, others).transforms])
        assert data == bytes_of(both)


def test_a_value_with_no_place_or_with_two_is_noticed():
    with pytest.raises(AssertionError, match="does not occur exactly once"):
        Form(lambda time_ns, row: JointState(position=row[0]), 2)
    with pytest.raises(AssertionError, match="does not occur exactly once"):
        Form(lambda time_ns, row: Vector3(x=row[0], y=row[0]), 1)


def test_a_message_of_another_form_is_noticed():
    form = Form(lambda time_ns, row: Vector3(x=row[0], y=row[0] if row[0] == 1.0 else 0.0), 1)
    with pytest.raises(AssertionError, match="differs from protobuf's own"):
        form.serialized(np.array([0], np.int64), np.array([[1.0]]))
