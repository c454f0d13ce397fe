from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.log.mcap.packed import Rows, merged, packed

times = st.lists(st.integers(0, 20), max_size=12).map(sorted)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(times, st.integers(0, 2)), max_size=4), st.lists(st.integers(0, 20), max_size=3).map(sorted))
def test_streams_are_merged_by_time_and_at_equal_times_by_stream(streams, cuts):
    """Streams of messages in rows (0), one by one on one topic (1), or alternating on two topics (2)."""
    given_streams, wanted = [], []
    for n, (stream, kind) in enumerate(streams):
        told = [(t, f"/{n}/{i % 2 if kind == 2 else 0}", Log(message=f"{n}.{i}", line=i)) for i, t in enumerate(stream)]
        data = [message.SerializeToString(deterministic=True) for _, _, message in told]
        given_streams.append([Rows(np.array(stream, np.int64), f"/{n}/0", packed(data))] if kind == 0 else told)
        wanted += [(t, topic, message) for (t, topic, _), message in zip(told, data, strict=True)]
    wanted.sort(key=lambda message: message[0])
    blocks = list(merged(given_streams, cuts))
    found = [
        (time_ns, block.topics[topic], message)
        for block in blocks
        for time_ns, topic, message in zip(block.time_ns.tolist(), block.topic.tolist(), block.data, strict=True)
    ]
    assert found == wanted
    for cut_ns in cuts:
        assert all((block.time_ns < cut_ns).all() or (block.time_ns >= cut_ns).all() for block in blocks)
