"""Checks that a log tells other readers what it holds: schemas, channels, indices and summary.

bimvox reads a log from its first byte to its last. Viewers decode messages with the schemas in the file, and many read
only what the summary and the indices at its end name: forged ones would show something else than what is proven.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.stream_reader import MAGIC_SIZE
from mcap.well_known import MessageEncoding, SchemaEncoding

from bimvox.log.mcap.reader import chunk_body, chunk_records
from bimvox.log.mcap.writer import LIBRARY, RECORD_HEAD
from bimvox.log.schema import MEDIA_TYPES, MOST_CRANES, OTHER_MEDIA_TYPE, topics_of

_CHECKSUM = struct.Struct("<I")
_INDEX_HEAD = struct.Struct("<HI")
"""Before the entries of a message index: channel, number of bytes of its entries."""
_INDICES: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.STATISTICS: Statistics,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.METADATA_INDEX: MetadataIndex,
}


def form_faults(data: bytes) -> tuple[str, ...]:
    """Return what a sound log tells other readers that is not so, one sentence each."""
    found = _File()
    for at, opcode, body in _records(data, MAGIC_SIZE, len(data) - MAGIC_SIZE):
        found.add(data, at, opcode, body)
    found.check_registered()
    found.check_summary()
    return tuple(found.faults)


def _records(data: bytes, at: int, end: int) -> Iterator[tuple[int, int, bytes]]:
    while at < end:
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        yield at, opcode, data[at + RECORD_HEAD.size : at + RECORD_HEAD.size + length]
        at += RECORD_HEAD.size + length


def _parsed(kind: Any, body: bytes) -> Any:
    return kind.read(ReadDataStream(BytesIO(body)))


@dataclass(slots=True)
class _File:
    """What a file holds, and what its summary says.

    Attributes:
        faults: What does not agree.
        schemas: By number; so for channels.
        indices: The summary that follows from the file, by kind.
        summary: The summary of the file, by kind.
        offsets: Its offsets.
        groups: Where each kind begins and ends in the summary.
        start: Where the summary begins; 0 before it.
        offset_start: Where the offsets begin; 0 if there are none.
        open: The indices of the messages of the last chunk by channel, which follow it.
        counts: Number of messages by channel.
        times: First and last time of the messages of each chunk.
        misnumbered: Channels whose messages are not numbered from 0.
    """

    faults: list[str] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    indices: defaultdict[int, list[Any]] = field(default_factory=lambda: defaultdict(list))
    summary: defaultdict[int, list[Any]] = field(default_factory=lambda: defaultdict(list))
    offsets: list[SummaryOffset] = field(default_factory=list)
    groups: dict[int, tuple[int, int]] = field(default_factory=dict)
    start: int = 0
    offset_start: int = 0
    open: dict[int, bytes] = field(default_factory=dict)
    counts: defaultdict[int, int] = field(default_factory=lambda: defaultdict(int))
    times: list[int] = field(default_factory=list)
    misnumbered: set[int] = field(default_factory=set)

    def add(self, data: bytes, at: int, opcode: int, body: bytes) -> None:
        end = at + RECORD_HEAD.size + len(body)
        if opcode == Opcode.MESSAGE_INDEX:
            self._add_message_index(at, body)
            return
        self._insist(not self.open, "a chunk's messages are not all in its index")
        self.open = {}
        if self.start:
            self._add_to_summary(at, end, opcode, body)
        elif opcode == Opcode.CHUNK:
            self._add_chunk(at, end, _parsed(Chunk, body))
        elif opcode == Opcode.ATTACHMENT:
            one = _parsed(Attachment, body)
            self.indices[Opcode.ATTACHMENT_INDEX].append(
                AttachmentIndex(
                    offset=at,
                    length=end - at,
                    create_time=0,
                    log_time=0,
                    data_size=len(one.data),
                    name=one.name,
                    media_type=MEDIA_TYPES.get(one.name, OTHER_MEDIA_TYPE),
                )
            )
            same = (one.create_time, one.log_time, one.media_type)
            wanted = (0, 0, MEDIA_TYPES.get(one.name, OTHER_MEDIA_TYPE))
            self._insist(same == wanted, f"the attachment {one.name!r} has another media type or time than bimvox's")
        elif opcode == Opcode.METADATA:
            one = _parsed(Metadata, body)
            self.indices[Opcode.METADATA_INDEX].append(MetadataIndex(offset=at, length=end - at, name=one.name))
        elif opcode == Opcode.DATA_END:
            self.start = end
            (said,) = _CHECKSUM.unpack(body)
            self._insist(said == zlib.crc32(data[:at]), "its data have no checksum, or another one")
        else:
            self._insist(opcode == Opcode.HEADER and at == MAGIC_SIZE, f"a record of the kind {opcode} is out of place")
            if opcode == Opcode.HEADER:
                one = _parsed(Header, body)
                own = one.profile == "" and one.library == LIBRARY
                self._insist(own, "its header names another writer")

    def _insist(self, good: bool, fault: str) -> None:
        if not good and fault not in self.faults:
            self.faults.append(fault)

    def _add_chunk(self, at: int, end: int, chunk: Chunk) -> None:
        others, messages = chunk_records(chunk_body(chunk, chunk.uncompressed_size))
        for _, opcode, body in others:
            kind, known = (Schema, self.schemas) if opcode == Opcode.SCHEMA else (Channel, self.channels)
            one = _parsed(kind, body)
            self._insist(known.setdefault(one.id, one) == one, f"{kind.__name__.lower()} {one.id} is two things")
        same = bool((messages.time_ns == messages.published_ns).all())
        self._insist(same, "a message is published at another time than it is logged")
        self.open = {}
        for channel in np.unique(messages.channel).tolist():
            own = messages.channel == channel
            first, count = self.counts[channel], int(own.sum())
            if (messages.sequence[own] != np.arange(first, first + count)).any():
                self.misnumbered.add(channel)
            self.counts[channel] += count
            entries = np.stack([messages.time_ns[own], messages.at[own].astype(np.uint64)], axis=1).astype("<u8")
            self.open[channel] = _INDEX_HEAD.pack(channel, entries.nbytes) + entries.tobytes()
        times = [int(messages.time_ns.min()), int(messages.time_ns.max())] if len(messages.time_ns) else []
        said = (chunk.message_start_time, chunk.message_end_time)
        self._insist(said == tuple(times or (0, 0)), "a chunk does not say when it is")
        self.times += times
        self.indices[Opcode.CHUNK_INDEX].append(
            ChunkIndex(
                message_start_time=chunk.message_start_time,
                message_end_time=chunk.message_end_time,
                chunk_start_offset=at,
                chunk_length=end - at,
                message_index_offsets={},
                message_index_length=0,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def _add_message_index(self, at: int, body: bytes) -> None:
        channel = int.from_bytes(body[:2], "little")
        self._insist(self.open.pop(channel, None) == body, "a chunk's messages are not those of its index")
        if chunks := self.indices[Opcode.CHUNK_INDEX]:
            chunks[-1].message_index_offsets[channel] = at
            chunks[-1].message_index_length += RECORD_HEAD.size + len(body)

    def _add_to_summary(self, at: int, end: int, opcode: int, body: bytes) -> None:
        if opcode in _INDICES:
            self.summary[opcode].append(_parsed(_INDICES[opcode], body))
            self.groups[opcode] = (self.groups.get(opcode, (at, end))[0], end)
        elif opcode == Opcode.SUMMARY_OFFSET:
            self.offset_start = self.offset_start or at
            self.offsets.append(_parsed(SummaryOffset, body))
        elif opcode == Opcode.FOOTER:
            footer = _parsed(Footer, body)
            good = (footer.summary_start, footer.summary_offset_start) == (self.start, self.offset_start)
            self._insist(good, "its footer does not point at its summary")
        else:
            self._insist(False, f"a record of the kind {opcode} is in its summary")

    def check_registered(self) -> None:
        """Check that channels and schemas are those of bimvox: with others, viewers read something else."""
        known = {topic.name: topic for topic in topics_of(MOST_CRANES, traffic=True)}
        names = [channel.topic for channel in self.channels.values()]
        for channel in self.channels.values():
            topic, schema = known.get(channel.topic), self.schemas.get(channel.schema_id)
            if topic is None or schema is None:
                self._insist(False, f"channel {channel.id}, {channel.topic!r}, is none of bimvox's")
                continue
            data = {topic.descriptor_set_for(several_cranes=several) for several in (False, True)}
            good = (schema.name, schema.encoding) == (topic.schema, SchemaEncoding.Protobuf) and schema.data in data
            self._insist(good, f"{channel.topic}: its messages have another schema than bimvox's")
            good = channel.message_encoding == MessageEncoding.Protobuf and not channel.metadata
            self._insist(good, f"{channel.topic}: its channel is not as bimvox writes it")
            self._insist(names.count(channel.topic) == 1, f"{channel.topic}: it has two channels")
            numbered = channel.id not in self.misnumbered
            self._insist(numbered, f"{channel.topic}: its messages are not numbered 0, 1, 2 ...")

    def check_summary(self) -> None:
        """Check that the summary names everything in the file, and nothing else."""
        self.indices[Opcode.SCHEMA] = list(self.schemas.values())
        self.indices[Opcode.CHANNEL] = list(self.channels.values())
        self.indices[Opcode.STATISTICS] = [
            Statistics(
                attachment_count=len(self.indices[Opcode.ATTACHMENT_INDEX]),
                channel_count=len(self.channels),
                channel_message_counts=dict(self.counts),
                chunk_count=len(self.indices[Opcode.CHUNK_INDEX]),
                message_count=sum(self.counts.values()),
                metadata_count=len(self.indices[Opcode.METADATA_INDEX]),
                message_start_time=min(self.times, default=0),
                message_end_time=max(self.times, default=0),
                schema_count=len(self.schemas),
            )
        ]
        for opcode in _INDICES:
            what = Opcode(opcode).name.lower().replace("_", " ")
            self._insist(self.summary[opcode] == self.indices[opcode], f"its summary has another {what} than the file")
        for one in self.offsets:
            first, last = self.groups.get(one.group_opcode, (0, 0))
            good = not one.group_length or (first, last) == (one.group_start, one.group_start + one.group_length)
            self._insist(good, "the offsets in its summary do not point at its groups")
