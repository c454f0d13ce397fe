"""Reads MCAP files: strictly, with every checksum verified, or salvaging a damaged one."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Collection
from dataclasses import astuple, dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Message, Metadata, Schema
from mcap.stream_reader import MAGIC_SIZE, StreamReader
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from bimvox.errors import LogFileError
from bimvox.files import read_input
from bimvox.log.mcap.writer import LIBRARY, RECORD_HEAD
from bimvox.log.schema import channel_numbers, of_first_crane

RECOVER_HINT = "bimvox export --recover FILE saves every complete part of a damaged log"

_NOT_A_LOG = "name a log that `bimvox plan` or `bimvox watch` wrote"
_MOST_UNPACKED, _MOST_PACKED = 64 << 20, 100
"""All chunks of a file may claim this many bytes, and this many more for each byte of the file; ours claim 4."""
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, start of the summary, start of its offsets, checksum
_ZSTD = b"\x04\x00\x00\x00zstd"
_MESSAGE = np.dtype(
    [
        ("head", f"V{RECORD_HEAD.size}"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("time_ns", "<u8"),
        ("published_ns", "<u8"),
    ]
)
_HEAD_RECORD = re.compile(b"[" + bytes((Opcode.ATTACHMENT, Opcode.METADATA)) + b"]")
_CHUNK_START_TO_ZSTD = 1 + 8 + 8 + 8 + 8 + 4  # opcode, length, first and last time, size, checksum
_BROKEN = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, EOFError, OverflowError, MemoryError)


class _RepeatedError(ValueError):
    """Something that a log has once is in it twice: two readers could take different ones."""


class LogMessage(NamedTuple):
    """One message of the file.

    Attributes:
        topic: Its topic.
        sequence: Its number within the topic.
        time_ns: Its log time.
        data: The serialized message.
    """

    topic: str
    sequence: int
    time_ns: int
    data: bytes


@dataclass(slots=True)
class Contents:
    """What a log file holds.

    Attributes:
        library: The program that wrote it.
        attachments: By name.
        metadata: Records by name.
        channels: Topic by channel id.
        messages: In the order of the file.
        lost: What could not be read, one sentence each; empty for a sound file.
        topics: Keep only messages on these, and on the corresponding ones of further cranes; None keeps all.
        misleading: What the file tells other readers that is not so, one sentence each; only looked for by a proof.
        room: How many bytes the chunks that are still to come may claim.
    """

    library: str = ""
    attachments: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    channels: dict[int, str] = field(default_factory=dict)
    messages: list[LogMessage] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    topics: frozenset[str] | None = None
    misleading: tuple[str, ...] = ()
    room: int = _MOST_UNPACKED

    def add(self, record: Any) -> None:
        """Add a record; unknown kinds are ignored."""
        if isinstance(record, Header):
            self.library = record.library
            if record.library == LIBRARY:
                # The writer registers every topic first, in this order, so it is known even if the first chunk is lost.
                self.channels |= {number: name for name, number in channel_numbers().items()}
        elif isinstance(record, Attachment):
            _insist_on_one("attachment", record.name, self.attachments)
            self.attachments[record.name] = record.data
        elif isinstance(record, Metadata):
            _insist_on_one("metadata record", record.name, self.metadata)
            self.metadata[record.name] = record.metadata
        elif isinstance(record, Channel):
            if self.channels.setdefault(record.id, record.topic) != record.topic:
                raise _RepeatedError(f"channel {record.id} is {self.channels[record.id]!r} and {record.topic!r}")
        elif isinstance(record, Message):
            self._add_message(record.channel_id, record.sequence, record.log_time, record.data)
        elif isinstance(record, Chunk):
            body = chunk_body(record, self.room)
            self.room -= len(body)
            self._add_chunk(body)

    def _add_chunk(self, body: bytes) -> None:
        others, messages = chunk_records(body)
        for at, opcode, content in others:
            if opcode == Opcode.CHANNEL:
                channel = Channel.read(ReadDataStream(BytesIO(content)))
                if channel.id not in self.channels and channel.id in messages.channel[messages.at < at]:
                    raise ValueError(f"a message comes before its channel, {channel.topic!r}")
                self.add(channel)
            elif opcode != Opcode.SCHEMA:
                raise ValueError(f"a chunk holds a record of the kind {opcode}, which is none of a chunk's")
        keeps = {number: self._keeps(number) for number in np.unique(messages.channel).tolist()}
        columns = (messages.channel, messages.sequence, messages.time_ns, messages.data_at, messages.end)
        for number, sequence, time_ns, begin, end in zip(*(column.tolist() for column in columns), strict=True):
            if keeps[number]:
                self.messages.append(LogMessage(self.channels[number], sequence, time_ns, body[begin:end]))

    def _keeps(self, channel: int) -> bool:
        return self.topics is None or of_first_crane(self.channels[channel]) in self.topics

    def _add_message(self, channel: int, sequence: int, time_ns: int, data: bytes) -> None:
        if self._keeps(channel):
            self.messages.append(LogMessage(self.channels[channel], sequence, time_ns, data))


class _ChunkMessages(NamedTuple):
    """The messages of a chunk, in order.

    Attributes:
        channel: (N,) number of the channel of each; so for the others.
        sequence: Its number in its topic.
        time_ns: Its log time.
        published_ns: Its publish time.
        at: Where its record begins in the chunk.
        data_at: Where its data begin.
        end: Where its record ends.
    """

    channel: NDArray[np.uint16]
    sequence: NDArray[np.uint32]
    time_ns: NDArray[np.uint64]
    published_ns: NDArray[np.uint64]
    at: NDArray[np.int64]
    data_at: NDArray[np.int64]
    end: NDArray[np.int64]


def chunk_records(body: bytes) -> tuple[list[tuple[int, int, bytes]], _ChunkMessages]:
    """Return the records of a chunk that are not messages, as (where it begins, kind, content), and its messages.

    The MCAP library makes an object of every record and is many times slower; logs have a million messages.

    Raises:
        ValueError: If a record extends past the chunk, or is too short.
    """
    at, total, head, unpack = 0, len(body), RECORD_HEAD.size, RECORD_HEAD.unpack_from
    begins: list[int] = []
    opcodes: list[int] = []
    while at < total:
        opcode, length = unpack(body, at)
        begins.append(at)
        opcodes.append(opcode)
        at += head + length
    if at > total:
        raise ValueError("a record extends past the end of its chunk")
    starts, ends = np.array(begins, np.int64), np.array([*begins[1:], at], np.int64)[: len(begins)]
    is_message = np.array(opcodes, np.uint8) == Opcode.MESSAGE
    others = [(begins[n], opcodes[n], body[begins[n] + head : ends[n]]) for n in np.flatnonzero(~is_message).tolist()]
    starts, ends = starts[is_message], ends[is_message]
    if (ends - starts < _MESSAGE.itemsize).any():
        raise ValueError("a message is shorter than its head")
    heads = np.frombuffer(body, np.uint8)[starts[:, None] + np.arange(_MESSAGE.itemsize)].view(_MESSAGE)[:, 0]
    return others, _ChunkMessages(
        heads["channel"],
        heads["sequence"],
        heads["time_ns"],
        heads["published_ns"],
        starts,
        starts + _MESSAGE.itemsize,
        ends,
    )


def _insist_on_one(kind: str, name: str, known: Collection[str]) -> None:
    if name in known:
        raise _RepeatedError(f"the {kind} {name!r} is in it twice")


def read_file(path: Path) -> bytes:
    """Return the bytes of a file.

    Raises:
        LogFileError: If it is missing, not a file, or empty.
    """
    return read_input(path, LogFileError)


def read_contents(data: bytes, name: Path | str, topics: frozenset[str] | None = None) -> Contents:
    """Return the contents of a sound log; every checksum is verified.

    Kept are the messages on ``topics`` and on the corresponding ones of further cranes; None keeps all.

    Raises:
        LogFileError: If it is not an MCAP file, is truncated, or any byte was changed.
    """
    if not data.startswith(MCAP0_MAGIC):
        raise LogFileError(name, "is not an MCAP file: it does not begin with the MCAP signature", hint=_NOT_A_LOG)
    if not data.endswith(MCAP0_MAGIC) or len(data) < 2 * MAGIC_SIZE + _FOOTER.size:
        raise LogFileError(name, "is truncated: the signature at its end is missing", hint=RECOVER_HINT)
    contents = Contents(topics=topics, room=_room_of(data))
    try:
        reader = _Reader(BytesIO(data), emit_chunks=True, validate_crcs=True, record_size_limit=len(data))
        for record in reader.records:
            contents.add(record)
            if isinstance(record, Footer):
                _check_summary(data, record)
    except _RepeatedError as error:
        hint = "two readers could take different ones; ask its author for a log as bimvox writes it"
        raise LogFileError(name, str(error), hint=hint) from error
    except _BROKEN as error:
        raise LogFileError(name, f"is damaged ({_reason(error)})", hint=RECOVER_HINT) from error
    return contents


class _Reader(StreamReader):
    """Does not look into the indices of messages, which :mod:`bimvox.log.mcap.form_check` compares with the chunks."""

    def _read_record(self, opcode: int, length: int) -> Any:
        if opcode == Opcode.MESSAGE_INDEX:
            self._stream.read(length)
            return None
        return super()._read_record(opcode, length)


def salvage_contents(data: bytes, name: Path | str) -> Contents:
    """Return every complete chunk, attachment and metadata record of a damaged log.

    Records are read from the start. After a damaged one, reading goes on at the next recognizable record: a chunk or an
    attachment with a correct checksum, or a complete metadata record. The losses are named.

    Raises:
        LogFileError: If it is not an MCAP file, or has no complete record.
    """
    if not data.startswith(MCAP0_MAGIC):
        raise LogFileError(
            name, "is not an MCAP file, nothing can be recovered: the MCAP signature is missing", hint=_NOT_A_LOG
        )
    contents = Contents(room=_room_of(data))
    at, ended = MAGIC_SIZE, False
    while at < len(data) and not (len(data) - at == MAGIC_SIZE and data.endswith(MCAP0_MAGIC)):
        record, after = _record_at(data, at)
        # After the data come copies and indexes: what looks like a message there is a damaged record of another kind.
        ended |= isinstance(record, DataEnd)
        if record is not None and not (ended and isinstance(record, Message)):
            try:
                contents.add(record)
            except _BROKEN as error:
                contents.lost.append(f"a record at byte {at}: {_reason(error)}")
        if isinstance(record, DataEnd) and not contents.lost and zlib.crc32(data[:at]) != record.data_section_crc:
            contents.lost.append("a metadata record, a channel or a schema was changed; it is not known which")
        if after is None:
            after = _next_whole(data, at + 1)
            contents.lost.append(f"{_what(data, at)}{(after or len(data)) - at} bytes at byte {at}")
        if after is None:
            break
        at = after
    if not contents.messages and not contents.attachments:
        raise LogFileError(name, "it has no complete record")
    return contents


def _room_of(data: bytes) -> int:
    """Return how many bytes all chunks of a file may claim together."""
    return _MOST_UNPACKED + _MOST_PACKED * len(data)


def chunk_body(chunk: Chunk, most_bytes: int) -> bytes:
    """Return a chunk's records, decompressed; the size is checked before, the checksum after."""
    if chunk.uncompressed_size > most_bytes:
        raise ValueError(
            f"a chunk claims {chunk.uncompressed_size:,} bytes, but a log of this size can hold {most_bytes:,} more"
        )
    body = chunk.data
    if chunk.compression == "zstd":
        if zstandard.get_frame_parameters(chunk.data).content_size != chunk.uncompressed_size:
            raise ValueError("a chunk does not have the size that it claims")
        body = zstandard.decompress(chunk.data)
    elif chunk.compression:
        raise ValueError(f"a chunk is compressed with {chunk.compression}, which bimvox never uses")
    if chunk.uncompressed_crc and zlib.crc32(body) != chunk.uncompressed_crc:
        raise ValueError("checksum mismatch in a chunk")
    return body


def _check_summary(data: bytes, footer: Footer) -> None:
    """Raise if the summary at the end, which other readers rely on, was changed."""
    end = len(data) - MAGIC_SIZE - 4
    last = _FOOTER.pack(Opcode.FOOTER, _FOOTER.size - RECORD_HEAD.size, *astuple(footer)) + MCAP0_MAGIC
    if not data.endswith(last):
        raise ValueError("something follows its footer")
    if footer.summary_start and zlib.crc32(data[footer.summary_start : end]) != footer.summary_crc:
        raise ValueError("checksum mismatch in its summary")


_READERS: dict[int, Callable[[ReadDataStream], Any]] = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.METADATA: Metadata.read,
    Opcode.DATA_END: DataEnd.read,
}


def _record_at(data: bytes, at: int) -> tuple[Any, int | None]:
    """Return the record at a position, None if it is damaged or irrelevant, and where the next one begins.

    The position is None if the record's own length cannot be trusted.
    """
    if at + RECORD_HEAD.size > len(data):
        return None, None
    opcode, length = RECORD_HEAD.unpack_from(data, at)
    after = at + RECORD_HEAD.size + length
    if after > len(data) or not 1 <= opcode <= max(Opcode):
        return None, None
    body = data[at + RECORD_HEAD.size : after]
    try:
        if opcode == Opcode.MESSAGE:
            return Message.read(ReadDataStream(BytesIO(body)), length), after
        if opcode not in _READERS:
            return None, after
        if opcode == Opcode.ATTACHMENT and zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
            return None, None
        record = _READERS[opcode](ReadDataStream(BytesIO(body)))
        if isinstance(record, Chunk):
            chunk_body(record, _room_of(data))
    except _BROKEN:
        return None, None
    return record, after


def _what(data: bytes, at: int) -> str:
    """Return what a damaged record was, if its beginning still tells."""
    name = at + RECORD_HEAD.size + 8 + 8  # of an attachment: after its two times
    if at + RECORD_HEAD.size > len(data) or data[at] != Opcode.ATTACHMENT:
        return ""
    length = int.from_bytes(data[name : name + 4], "little")
    text = data[name + 4 : name + 4 + min(length, 256)].decode(errors="replace")
    return f"the attachment {text}: " if text.isprintable() else "an attachment: "


def _next_whole(data: bytes, start: int) -> int | None:
    """Return where the next certainly complete record begins: a chunk, or before it an attachment or metadata.

    Metadata has no checksum: it counts as complete if its fields fill it exactly.
    """
    chunk = _next_chunk(data, start)
    end = len(data) if chunk is None else chunk
    for opcode in re.finditer(_HEAD_RECORD, data[start:end]):
        at = start + opcode.start()
        _, length = RECORD_HEAD.unpack_from(data, at) if at + RECORD_HEAD.size <= end else (0, end)
        if at + RECORD_HEAD.size + length > end:
            continue
        record, _ = _record_at(data, at)
        if isinstance(record, Attachment) or (
            isinstance(record, Metadata) and record.name and _metadata_bytes(record) == length
        ):
            return at
    return chunk


def _metadata_bytes(record: Metadata) -> int:
    """Return the length of a metadata record."""
    texts = [record.name, *record.metadata.keys(), *record.metadata.values()]
    return 4 + sum(4 + len(text.encode()) for text in texts)


def _next_chunk(data: bytes, start: int) -> int | None:
    """Return where the next complete chunk begins."""
    found = data.find(_ZSTD, start + _CHUNK_START_TO_ZSTD)
    while found >= 0:
        at = found - _CHUNK_START_TO_ZSTD
        if data[at] == Opcode.CHUNK and isinstance(_record_at(data, at)[0], Chunk):
            return at
        found = data.find(_ZSTD, found + 1)
    return None


def _reason(error: BaseException) -> str:
    if isinstance(error, EndOfFile):
        return "it ends in the middle of a record"
    return " ".join(str(error).split()) or type(error).__name__
