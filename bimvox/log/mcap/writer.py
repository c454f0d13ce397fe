"""Writes an MCAP file record by record.

A log has about 3,000 messages per lift, and the MCAP library's own writer spends more time on their bookkeeping than
planning spends on the lift. This one appends messages to the chunk as bytes and leaves every other record to the
library's classes; the files are byte-identical.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, BinaryIO, Self

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.well_known import MessageEncoding, SchemaEncoding
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.log.mcap.packed import Block, Packed
from bimvox.log.schema import MEDIA_TYPES, OTHER_MEDIA_TYPE, SCHEMA_VERSION, channel_numbers, topics_of

MAGIC = b"\x89MCAP0\r\n"
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_SIZE, _OPCODE = _MESSAGE.size, int(Opcode.MESSAGE)
_MESSAGE_FIELDS = _MESSAGE.size - 9  # counted by the length: everything after opcode and length
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries
_ENTRY = struct.Struct("<QQ")  # log time, offset in the chunk


class McapFile:
    """Writes one file: chunks compressed with zstd, every index, every checksum.

    Args:
        stream: The output; must support ``tell``.
        library: The writer's name in the header.
        chunk_bytes: The message that takes a chunk past this uncompressed size ends it.
    """

    def __init__(self, stream: BinaryIO, library: str, chunk_bytes: int) -> None:
        self._stream, self._chunk_bytes = stream, chunk_bytes
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._chunks: list[ChunkIndex] = []
        self._chunk = bytearray()
        self._entries: defaultdict[int, bytearray] = defaultdict(bytearray)
        self._times: list[int] = []
        self._counts: defaultdict[int, int] = defaultdict(int)
        self._first_ns: int | None = None
        self._last_ns = 0
        self._compressor = zstandard.ZstdCompressor()
        self._write(MAGIC)
        self._write(_bytes_of(Header(profile="", library=library)))

    def schema(self, name: str, encoding: str, data: bytes) -> int:
        """Register a schema and return its number."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name))
        self._chunk += _bytes_of(self._schemas[-1])
        return len(self._schemas)

    def channel(self, topic: str, encoding: str, schema: int, number: int | None = None) -> int:
        """Register a channel and return its number; by default the next one."""
        number = number or len(self._channels) + 1
        channel = Channel(id=number, topic=topic, message_encoding=encoding, schema_id=schema, metadata={})
        self._channels.append(channel)
        self._chunk += _bytes_of(channel)
        return number

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        record = _bytes_of(Metadata(name=name, metadata=dict(values)))
        self._metadata.append(MetadataIndex(offset=self._stream.tell(), length=len(record), name=name))
        self._write(record)

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment, at time 0."""
        # Its data is not copied: it may be a large file.
        times_and_names = _bytes_of(Attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=b""))
        fields = times_and_names[9:-12] + struct.pack("<Q", len(data))
        head = struct.pack("<BQ", Opcode.ATTACHMENT, len(fields) + len(data) + 4) + fields
        index = AttachmentIndex(
            offset=self._stream.tell(),
            length=len(head) + len(data) + 4,
            create_time=0,
            log_time=0,
            data_size=len(data),
            name=name,
            media_type=media_type,
        )
        self._attachments.append(index)
        self._write(head)
        self._write(data)
        self._write(struct.pack("<I", zlib.crc32(data, zlib.crc32(fields))))

    def message(self, channel: int, sequence: int, time_ns: int, data: bytes) -> None:
        """Write a message, logged when it is published."""
        chunk = self._chunk
        self._entries[channel] += _ENTRY.pack(time_ns, len(chunk))
        self._times.append(time_ns)
        chunk += _MESSAGE.pack(Opcode.MESSAGE, _MESSAGE_FIELDS + len(data), channel, sequence, time_ns, time_ns)
        chunk += data
        if len(chunk) > self._chunk_bytes:
            self.end_chunk()

    def messages(
        self, channels: NDArray[np.int64], sequences: NDArray[np.int64], times_ns: NDArray[np.int64], data: Packed
    ) -> None:
        """Write consecutive messages, with the same result as ``message`` for each.

        Each has its channel, its sequence number and its time ((N,) each).
        """
        end = np.cumsum(data.size + _MESSAGE.size)
        if not len(end):
            return
        begin = np.concatenate([[0], end[:-1]])
        whole = np.empty(end[-1], np.uint8)
        _put_messages(channels, sequences, times_ns, data.flat, data.begin, data.end, whole)
        done = 0
        while done < len(end):
            before = len(self._chunk) - int(begin[done])
            # The message that takes the chunk past its size is the last one in it.
            last = int(np.searchsorted(end, self._chunk_bytes - before, side="right"))
            until = min(last + 1, len(end))
            self._chunk += whole[begin[done] : end[until - 1]].data
            entries = np.stack([times_ns[done:until], begin[done:until] + before], axis=1)
            self._index(channels[done:until], entries)
            self._times += (int(times_ns[done:until].min()), int(times_ns[done:until].max()))
            done = until
            if last < len(end):
                self.end_chunk()

    def _index(self, channels: NDArray[np.int64], entries: NDArray[np.int64]) -> None:
        """Index messages ((N,) channels, (N, 2) time and offset in the chunk); channels in order of first use."""
        order = np.argsort(channels, kind="stable")
        ordered, data, size = channels[order], entries[order].astype("<u8").tobytes(), _ENTRY.size
        borders = [0, *(np.flatnonzero(ordered[1:] != ordered[:-1]) + 1).tolist(), len(order)]
        for _, at, until in sorted((int(order[at]), at, until) for at, until in pairwise(borders)):
            self._entries[int(ordered[at])] += data[size * at : size * until]

    def finish(self) -> None:
        """Write the last chunk, the summary and the footer."""
        self.end_chunk()
        self._write(_bytes_of(DataEnd(self._crc)))
        start = self._stream.tell()
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            metadata_count=len(self._metadata),
            message_start_time=self._first_ns or 0,
            message_end_time=self._last_ns,
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*self._schemas]),
            (Opcode.CHANNEL, [*self._channels]),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, [*self._chunks]),
            (Opcode.ATTACHMENT_INDEX, [*self._attachments]),
            (Opcode.METADATA_INDEX, [*self._metadata]),
        ]
        summary, offsets = bytearray(), bytearray()
        for opcode, records in groups:
            group = b"".join(_bytes_of(record) for record in records)
            offset = SummaryOffset(group_opcode=opcode, group_start=start + len(summary), group_length=len(group))
            offsets += _bytes_of(offset)
            summary += group
        offset_start = start + len(summary)
        summary += offsets
        crc = zlib.crc32(struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start), zlib.crc32(summary))
        self._stream.write(summary)
        self._stream.write(_bytes_of(Footer(start, offset_start, crc)))
        self._stream.write(MAGIC)

    def end_chunk(self) -> None:
        """Write the messages since the last chunk as a chunk; nothing if there are none."""
        if not self._times:
            return
        first_ns, last_ns = min(self._times), max(self._times)
        compressed = self._compressor.compress(self._chunk)
        chunk = Chunk(
            compression="zstd",
            data=compressed,
            message_start_time=first_ns,
            message_end_time=last_ns,
            uncompressed_crc=zlib.crc32(self._chunk),
            uncompressed_size=len(self._chunk),
        )
        index = ChunkIndex(
            message_start_time=first_ns,
            message_end_time=last_ns,
            chunk_start_offset=self._stream.tell(),
            chunk_length=0,
            message_index_offsets={},
            message_index_length=0,
            compression="zstd",
            compressed_size=len(compressed),
            uncompressed_size=len(self._chunk),
        )
        record = _bytes_of(chunk)
        index.chunk_length = len(record)
        self._write(record)
        start = self._stream.tell()
        indices = bytearray()
        for channel, entries in self._entries.items():
            index.message_index_offsets[channel] = start + len(indices)
            indices += _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(entries), channel, len(entries))
            indices += entries
            self._counts[channel] += len(entries) // _ENTRY.size
        index.message_index_length = len(indices)
        self._write(bytes(indices))
        self._chunks.append(index)
        self._first_ns = first_ns if self._first_ns is None else min(self._first_ns, first_ns)
        self._last_ns = max(self._last_ns, last_ns)
        self._chunk, self._entries, self._times = bytearray(), defaultdict(bytearray), []

    def _write(self, data: bytes) -> None:
        """Write into the data section and update its checksum."""
        self._crc = zlib.crc32(data, self._crc)
        self._stream.write(data)


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


@leaf_kernel
def _put_little(out: NDArray[np.uint8], at: int, value: int, size: int) -> None:
    for n in range(size):
        out[at + n] = (value >> (8 * n)) & 0xFF


@leaf_kernel
def _put_messages(
    channels: NDArray[np.int64],
    sequences: NDArray[np.int64],
    times_ns: NDArray[np.int64],
    flat: NDArray[np.uint8],
    begin: NDArray[np.int64],
    end: NDArray[np.int64],
    out: NDArray[np.uint8],
) -> None:
    """Write consecutive message records: the header ``_MESSAGE``, then the message (``begin``..``end``)."""
    at = 0
    for row in range(len(begin)):
        data = flat[begin[row] : end[row]]
        head, body = out[at : at + _MESSAGE_SIZE], out[at + _MESSAGE_SIZE : at + _MESSAGE_SIZE + len(data)]
        head[0] = _OPCODE
        _put_little(head, 1, _MESSAGE_FIELDS + len(data), 8)
        _put_little(head, 9, channels[row], 2)
        _put_little(head, 11, sequences[row], 4)
        _put_little(head, 15, times_ns[row], 8)
        _put_little(head, 23, times_ns[row], 8)
        for n in range(len(data)):  # counting from 0 lets the compiler vectorize it
            body[n] = data[n]
        at += _MESSAGE_SIZE + len(data)


# The topics of a log in such a file.

# A killed process loses the chunk in progress. Small chunks lose little and cost 0.5 % of the size.
CHUNK_BYTES = 64 * 1024
RECORD_HEAD = struct.Struct("<BQ")
"""Before every record: kind, length."""
LIBRARY = f"bimvox log {SCHEMA_VERSION}"
"""What a log calls its writer: its bytes do not depend on the version of the MCAP library."""


class LogWriter:
    """An MCAP file with every topic registered, in the table's order, before the first message.

    Metadata and attachments come first, so that they survive a truncated tail.

    Args:
        stream: The output; must support ``tell``.
        cranes: Number of cranes.
        traffic: Whether the log also holds how its plan was carried out.
    """

    def __init__(self, stream: BinaryIO, cranes: int = 1, *, traffic: bool = False) -> None:
        self._file = McapFile(stream, LIBRARY, CHUNK_BYTES)
        schemas: dict[str, int] = {}
        self._channels = channel_numbers()
        self._sequence: dict[str, int] = {}
        for topic in topics_of(cranes, traffic=traffic):
            if topic.schema not in schemas:
                descriptors = topic.descriptor_set_for(several_cranes=cranes > 1)
                schemas[topic.schema] = self._file.schema(topic.schema, SchemaEncoding.Protobuf, descriptors)
            number = self._channels[topic.name]
            self._file.channel(topic.name, MessageEncoding.Protobuf, schemas[topic.schema], number)
        self.messages = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, error: object, *_: object) -> None:
        if error is None:
            self.finish()

    def end_chunk(self) -> None:
        """Write the messages so far, so that a reader of the file finds them whatever happens next."""
        self._file.end_chunk()

    def finish(self) -> None:
        """Write the remaining messages and the index."""
        self._file.finish()

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record, keys in ascending order."""
        self._file.metadata(name, dict(sorted(values.items())))

    def attachment(self, name: str, data: bytes) -> None:
        """Write an attachment."""
        media_type = MEDIA_TYPES.get(name, OTHER_MEDIA_TYPE)
        self._file.attachment(name, media_type, data)

    def message(self, topic: str, time_ns: int, message: Any) -> None:
        """Write a message; its sequence number counts the messages of its topic."""
        self.serialized(topic, time_ns, message.SerializeToString(deterministic=True))

    def serialized(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write a serialized message, numbered like others."""
        sequence = self._sequence.get(topic, 0)
        self._sequence[topic] = sequence + 1
        self._file.message(self._channels[topic], sequence, time_ns, data)
        self.messages += 1

    def block(self, block: Block) -> None:
        """Write consecutive messages, numbered like others."""
        sequence = np.zeros(len(block.data), np.int64)
        for n, topic in enumerate(block.topics):
            own = np.flatnonzero(block.topic == n)
            first = self._sequence.get(topic, 0)
            sequence[own] = np.arange(first, first + len(own))
            self._sequence[topic] = first + len(own)
        channels = np.array([self._channels[topic] for topic in block.topics])[block.topic]
        self._file.messages(channels, sequence, block.time_ns, block.data)
        self.messages += len(block.data)

    def raw(self, topic: str, sequence: int, time_ns: int, data: bytes) -> None:
        """Write a serialized message with its number, such as a copy from another log."""
        self._file.message(self._channels[topic], sequence, time_ns, data)
        self.messages += 1
