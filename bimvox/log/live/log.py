"""A log that grows while something happens, and survives whatever ends the process.

A chunk is closed and handed to the system at least every half second of wall time, by a thread of its own, so that a
killed process loses less than a second; ``bimvox export --recover`` reads what is there. When it is closed the log gets
its index and is a log like any other, but for the sizes of its chunks, which depend on the wall clock.
"""

from __future__ import annotations

import contextlib
import os
import struct
import threading
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, Self

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Metadata
from mcap.stream_reader import MAGIC_SIZE

from bimvox.log.mcap.channels import LogWriter
from bimvox.log.schema import METADATA

_PREFIX = struct.Struct("<BQ")  # of a record: kind, length
_TIMES = struct.Struct("<QQ")  # of a chunk: first and last time

CHUNK_S = 0.4
"""Wall time after which a chunk is closed: with the time that it takes, within half a second."""


class LiveLog:
    """A growing log; safe to be written to from several threads.

    Args:
        path: Where to; what is there is replaced.
        metadata: Metadata records, written first.
        attachments: Files, written after them, by name.
        cranes: How many cranes there are.
        every_s: Largest wall time between two chunks.
    """

    def __init__(
        self,
        path: Path | str,
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, bytes],
        *,
        cranes: int = 1,
        every_s: float = CHUNK_S,
    ) -> None:
        self._stream = Path(path).open("wb")  # noqa: SIM115 (open as long as the log is)
        self._writer = LogWriter(self._stream, cranes)
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._failure: OSError | None = None
        try:
            for name, values in metadata.items():
                self._writer.metadata(name, values)
            for name, data in attachments.items():
                self._writer.attachment(name, data)
            self._save()
        except OSError:
            with contextlib.suppress(OSError):  # what could not be written then cannot now
                self._stream.close()
            raise
        self._thread = threading.Thread(target=self._run, args=(every_s,), name="live log", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def message(self, topic: str, time_ns: int, message: Any) -> None:
        """Write a message.

        Raises:
            OSError: If an earlier one could not be saved (the disk is full); the log ends before it.
        """
        self.serialized(topic, time_ns, message.SerializeToString(deterministic=True))

    def serialized(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write a message that is serialized already.

        Raises:
            OSError: See ``message``.
        """
        with self._lock:
            if self._failure is not None:
                raise self._failure
            self._writer.serialized(topic, time_ns, data)

    def close(self) -> None:
        """Write the last chunk and the index.

        Raises:
            OSError: If that, or a chunk before it, could not be saved.
        """
        if self._closed.is_set():
            return
        self._closed.set()
        self._thread.join()
        try:
            if self._failure is not None:
                raise self._failure
            self._writer.finish()
            self._stream.flush()
            os.fsync(self._stream.fileno())
        finally:
            self._stream.close()

    def _run(self, every_s: float) -> None:
        while not self._closed.wait(every_s):
            with self._lock:
                try:
                    self._save()
                except OSError as error:
                    self._failure = error
                    return

    def _save(self) -> None:
        self._writer.end_chunk()
        self._stream.flush()


class Driven(NamedTuple):
    """What a live log says of itself, closed or not.

    Attributes:
        metadata: Of its record of ours.
        last_ns: Time of the last message that survived; None where none did.
    """

    metadata: Mapping[str, str]
    last_ns: int | None


def driven_of(path: Path | str) -> Driven:
    """Return what a live log says of itself; its messages are not read, however long it is.

    Raises:
        OSError: If it cannot be read.
    """
    metadata: dict[str, str] = {}
    last_ns = 0
    with Path(path).open("rb") as stream:
        size = os.fstat(stream.fileno()).st_size
        at = MAGIC_SIZE
        while at + _PREFIX.size <= size:
            stream.seek(at)
            opcode, length = _PREFIX.unpack(stream.read(_PREFIX.size))
            at += _PREFIX.size + length
            if at > size or opcode in (0, Opcode.DATA_END):
                break  # the rest is cut off, or there is no more
            if opcode == Opcode.CHUNK:
                last_ns = max(last_ns, _TIMES.unpack(stream.read(_TIMES.size))[1])
            elif opcode == Opcode.METADATA:
                record = Metadata.read(ReadDataStream(BytesIO(stream.read(length))))
                if record.name == METADATA:
                    metadata = record.metadata
    return Driven(metadata, last_ns or None)
