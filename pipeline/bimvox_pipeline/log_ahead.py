"""A log that is written beside its file while its plan is being proven, and put in its place once it is."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Self, cast

from bimvox.files import check_output, put_in_place, written_aside
from bimvox.log.plan_log import PlanLog, with_full_rate
from bimvox.log.recorder import write_log
from bimvox.workers import Workers


class LogAhead:
    """Writes the log of a plan; leaving the block removes what was begun in vain.

    Args:
        path: The log.
        inputs: Files that it must not replace.
        full_rate: Whether viewers are shown every sample of the motions.
    """

    def __init__(self, path: Path, *, inputs: Iterable[Path] = (), full_rate: bool = False) -> None:
        self._path, self._inputs, self._full_rate = path, tuple(inputs), full_rate
        self._thread = ThreadPoolExecutor(1, "log")
        self._begun: tuple[PlanLog, _Target, Future[Path]] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._give_up()
        self._thread.shutdown()

    def begin(self, record: PlanLog, workers: Workers) -> None:
        """Begin to write the log of a plan that is still to be proven, if there are processes to share the work."""
        self._give_up()
        if workers.count > 1:
            target = _Target()
            with suppress(RuntimeError):  # the system gives no further thread
                self._begun = record, target, self._thread.submit(self._written, record, workers, target)

    def finish(self, record: PlanLog, workers: Workers) -> None:
        """Put the log of a proven plan in its place.

        Raises:
            FileError: If it cannot be written.
        """
        check_output(self._path, inputs=self._inputs)
        if self._begun is not None and self._begun[0] is record:
            written = self._begun[2].result()
        else:
            written = self._written(record, workers, _Target())
        put_in_place(written, self._path)

    def _written(self, record: PlanLog, workers: Workers, target: _Target) -> Path:
        record = with_full_rate(record) if self._full_rate else record
        return written_aside(self._path, lambda stream: write_log(target.on(stream), record, workers=workers))

    def _give_up(self) -> None:
        """End what was begun; its file does not remain."""
        if self._begun is None:
            return
        (_, target, future), self._begun = self._begun, None
        target.is_wanted = False
        with suppress(Exception):
            future.result().unlink(missing_ok=True)


class _GivenUpError(Exception):
    """The file is not wanted any more."""


class _Target:
    """A stream that fails once it is not wanted any more."""

    is_wanted = True

    def on(self, stream: BinaryIO) -> BinaryIO:
        """Return this, writing to a stream."""
        self._stream, self.tell = stream, stream.tell
        return cast(BinaryIO, self)

    def write(self, data: bytes) -> int:
        """Write to the stream."""
        if not self.is_wanted:
            raise _GivenUpError
        return self._stream.write(data)
