from __future__ import annotations

from typing import Any

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.log.merge import merged
from bimvox.log.messages import stamp
from bimvox.log.rows import Rows, rows_of

times = st.lists(
    st.one_of(st.integers(0, 10**6), st.integers(0, 2 * 10**15), st.integers(0, 10**5).map(lambda s: s * 10**9)),
    min_size=0,
    max_size=40,
).map(sorted)
doubles = st.one_of(st.just(0.0), st.just(-0.0), st.floats(allow_nan=False, width=64))


def joints(time_ns: int, row: Any) -> Any:
    states = [JointState(name=name, position=value) for name, value in zip("abc", row, strict=True)]
    return JointStates(timestamp=stamp(time_ns), joints=states)


@settings(max_examples=100, deadline=None)
@given(times, st.data())
def test_many_messages_are_serialized_as_protobuf_does(time_ns, data):
    values = [data.draw(st.tuples(doubles, doubles, doubles)) for _ in time_ns]
    made = rows_of("/t", np.array(time_ns, np.int64), np.array(values, np.float64).reshape(-1, 3), joints)
    one_by_one = [joints(t, row).SerializeToString(deterministic=True) for t, row in zip(time_ns, values, strict=True)]
    assert made.data == one_by_one


@settings(max_examples=50, deadline=None)
@given(st.lists(times, max_size=4), st.lists(st.integers(0, 2 * 10**15), max_size=3).map(sorted))
def test_streams_are_merged_by_time_and_at_equal_times_by_stream(streams, cuts):
    rows = [
        Rows(np.array(stream, np.int64), f"/{n}", [f"{n}.{i}".encode() for i in range(len(stream))])
        for n, stream in enumerate(streams)
    ]
    wanted = [
        (t, one.topic, message) for one in rows for t, message in zip(one.time_ns.tolist(), one.data, strict=True)
    ]
    wanted.sort(key=lambda message: message[0])
    found = [
        (time_ns, block.topics[topic], message)
        for block in merged([[one] for one in rows], cuts)
        for time_ns, topic, message in zip(block.time_ns.tolist(), block.topic.tolist(), block.data, strict=True)
    ]
    assert found == wanted
