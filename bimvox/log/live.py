"""A log that grows while something happens, and survives whatever ends the process.

A chunk is closed and handed to the system at least every half second of wall time, by a thread of its own, so that a
killed process loses less than a second; ``bimvox export --recover`` reads what is there. When it is closed the log gets
its index and is a log like any other, but for the sizes of its chunks, which depend on the wall clock.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from bimvox.errors import LogFileError
from bimvox.log.channels import LogWriter
from bimvox.log.container import read_file, salvage_contents

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
        for name, values in metadata.items():
            self._writer.metadata(name, values)
        for name, data in attachments.items():
            self._writer.attachment(name, data)
        self._save()
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


def last_time_ns(path: Path | str) -> int | None:
    """Return the time of the last message that survived in a live log, closed or not; None where none did."""
    try:
        contents = salvage_contents(read_file(Path(path)), Path(path))
    except LogFileError:
        return None
    return max((message.time_ns for message in contents.messages), default=None)
