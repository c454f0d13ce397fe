"""Files are byte for byte those of the MCAP library's own writer."""

from __future__ import annotations

import io

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from bimvox.log.mcap.packed import packed
from bimvox.log.mcap.writer import McapFile

CHUNK = 300
messages = st.lists(
    st.tuples(st.integers(0, 2), st.integers(0, 2**63 - 1), st.integers(0, 2**32 - 1), st.binary(max_size=200)),
    max_size=40,
)


def ours(told: list[tuple[int, int, int, bytes]], blocks: tuple[int, ...] = ()) -> bytes:
    """Return the file; each of ``blocks`` messages are written in one call, the rest one by one."""
    stream = io.BytesIO()
    file = McapFile(stream, "writer", CHUNK)
    channels = [file.channel(f"/{n}", "protobuf", file.schema(f"s{n}", "protobuf", bytes([n]) * 50)) for n in range(3)]
    file.metadata("m", {"a": "1", "b": "ü"})
    file.attachment("name", "text/plain", b"data")
    left = list(told)
    for size in blocks:
        block, left = left[:size], left[size:]
        if block:
            number, time_ns, sequence, data = zip(*block, strict=True)
            of = np.array([channels[n] for n in number])
            file.messages(of, np.array(sequence), np.array(time_ns, np.int64), packed(data))
    for channel, time_ns, sequence, data in left:
        file.message(channels[channel], sequence, time_ns, data)
    file.finish()
    return stream.getvalue()


def theirs(told: list[tuple[int, int, int, bytes]]) -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream, CHUNK, CompressionType.ZSTD, enable_crcs=True, enable_data_crcs=True)
    writer.start(profile="", library="writer")
    channels = [
        writer.register_channel(f"/{n}", "protobuf", writer.register_schema(f"s{n}", "protobuf", bytes([n]) * 50))
        for n in range(3)
    ]
    writer.add_metadata("m", {"a": "1", "b": "ü"})
    writer.add_attachment(create_time=0, log_time=0, name="name", media_type="text/plain", data=b"data")
    for channel, time_ns, sequence, data in told:
        writer.add_message(channels[channel], time_ns, data, publish_time=time_ns, sequence=sequence)
    writer.finish()
    return stream.getvalue()


@given(messages)
def test_the_bytes_are_those_of_the_library(told: list[tuple[int, int, int, bytes]]):
    assert ours(told) == theirs(told)


@given(messages, st.lists(st.integers(1, 30), max_size=4))
def test_messages_written_at_a_time_are_those_written_one_by_one(
    told: list[tuple[int, int, int, bytes]], blocks: list[int]
):
    assert ours(told, tuple(blocks)) == ours(told)


@given(messages)
def test_the_library_reads_what_was_written(told: list[tuple[int, int, int, bytes]]):
    reader = make_reader(io.BytesIO(ours(told)), validate_crcs=True)
    found = [(m.sequence, m.log_time, m.data) for _, _, m in reader.iter_messages(log_time_order=False)]
    assert found == [(sequence, time_ns, data) for _, time_ns, sequence, data in told]
