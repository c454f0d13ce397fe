"""Writes the topics into an MCAP file."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, BinaryIO, Self

import numpy as np
from mcap.well_known import MessageEncoding, SchemaEncoding

from bimvox.log.mcap.packed import Block
from bimvox.log.mcap.writer import McapFile
from bimvox.log.schema import MEDIA_TYPES, OTHER_MEDIA_TYPE, SCHEMA_VERSION, channel_numbers, topics_of

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
