"""The records of a chunk are read as the MCAP library reads them, and malformed ones are refused."""

from __future__ import annotations

import struct
import zlib

import pytest
from mcap.records import Chunk, Message
from mcap.stream_reader import breakup_chunk

from bimvox.log.mcap.reader import Contents, chunk_records

CHANNEL = struct.pack("<BQ", 4, 2 + 2 + 4 + 4 + 4 + 4) + struct.pack("<HHI4sII", 7, 1, 4, b"/new", 0, 0)


def message(channel: int, sequence: int, time_ns: int, data: bytes) -> bytes:
    return struct.pack("<BQHIQQ", 5, 22 + len(data), channel, sequence, time_ns, time_ns + 1) + data


def test_messages_are_those_of_the_library() -> None:
    body = CHANNEL + message(7, 0, 5, b"one") + message(7, 1, 2**63, b"") + message(8, 4, 6, b"three")
    others, found = chunk_records(body)
    assert others == [(0, 4, CHANNEL[9:])]
    chunk = Chunk("", body, 6, 5, zlib.crc32(body), len(body))
    wanted = [one for one in breakup_chunk(chunk) if isinstance(one, Message)]
    told = [
        Message(channel, time_ns, body[data:end], published_ns, sequence)
        for channel, sequence, time_ns, published_ns, _, data, end in zip(*(c.tolist() for c in found), strict=True)
    ]
    assert told == wanted
    assert [body[at] for at in found.at] == [5, 5, 5]


def test_a_chunk_without_messages() -> None:
    others, found = chunk_records(CHANNEL)
    assert len(others) == 1
    assert len(found.channel) == len(found.end) == 0


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (message(7, 0, 5, b"one")[:-1], "past the end of its chunk"),
        (struct.pack("<BQ", 5, 21) + bytes(21), "shorter than its head"),
    ],
)
def test_malformed_messages_are_refused(body: bytes, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        chunk_records(body)


def test_a_channel_comes_before_its_messages() -> None:
    contents = Contents()
    contents._add_chunk(CHANNEL + message(7, 0, 5, b"one"))
    contents._add_chunk(message(7, 1, 6, b"two") + CHANNEL)
    assert [one.data for one in contents.messages] == [b"one", b"two"]
    with pytest.raises(ValueError, match="before its channel, '/new'"):
        Contents()._add_chunk(message(7, 0, 5, b"one") + CHANNEL)
    with pytest.raises(KeyError):
        Contents()._add_chunk(message(7, 0, 5, b"one"))
