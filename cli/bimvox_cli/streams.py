"""stdin, stdout and stderr of the process, also if one is closed, its disk is full, or its reader has left.

One rule: what cannot be written to stdout ends the command, because a result was asked for; quietly if the reader has
left (``bimvox ... | head -1``), otherwise with one sentence. What cannot be written to stderr is dropped.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import TYPE_CHECKING, NoReturn, TextIO, cast

from bimvox.errors import BimvoxError
from bimvox.files import reason_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from _typeshed import ReadableBuffer

READER_LEFT = 141
"""Exit code if nobody reads stdout: what a shell shows for a command that SIGPIPE ends."""

_STDOUT, _STDERR = 1, 2


class StdoutError(BimvoxError):
    """A result that cannot be written to stdout."""

    code = "stdout"


def guard_streams() -> None:
    """Replace the process's own stdout and stderr by ones that keep the rule; those of a test stay."""
    ours = sys.stdout is sys.__stdout__, sys.stderr is sys.__stderr__
    if any(ours):
        _occupy_closed_numbers()
    if ours[0]:
        sys.stdout = _guarded(sys.stdout, _STDOUT, _lost)
    if ours[1]:
        sys.stderr = _guarded(sys.stderr, _STDERR, _dropped)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _occupy_closed_numbers() -> None:
    """Open what is closed of 0, 1 and 2; otherwise an output file gets the number, and what a library prints."""
    for number in (0, _STDOUT, _STDERR):
        try:
            os.fstat(number)
        except OSError:
            # stdout is opened in the wrong way, so that writing to it still fails.
            opened = os.open(os.devnull, os.O_WRONLY if number == _STDERR else os.O_RDONLY)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
            os.set_inheritable(number, True)


def _guarded(stream: TextIO | None, number: int, fail: Callable[[OSError], None]) -> TextIO:
    """Return a stream over the same file; ``fail`` is called with the first error of writing."""
    if stream is None:
        return _text(io.FileIO(number, "w", closefd=False), fail, "utf-8", line_buffering=False)
    stream = cast("io.TextIOWrapper", stream)
    raw = cast("io.RawIOBase", getattr(stream.buffer, "raw", stream.buffer))
    return _text(raw, fail, stream.encoding, line_buffering=stream.line_buffering, write_through=stream.write_through)


def _text(
    raw: io.RawIOBase,
    fail: Callable[[OSError], None],
    encoding: str,
    *,
    line_buffering: bool,
    write_through: bool = False,
) -> TextIO:
    return io.TextIOWrapper(
        io.BufferedWriter(_Guard(raw, fail)),
        encoding=encoding,
        line_buffering=line_buffering,
        write_through=write_through,
    )


def _lost(error: OSError) -> NoReturn:
    if isinstance(error, BrokenPipeError):
        raise SystemExit(READER_LEFT)
    reason = "is closed" if error.errno == errno.EBADF else f"cannot be written: {reason_of(error)}"
    raise StdoutError(
        f"stdout {reason}; every output file is complete or unchanged",
        hint="name a file or a program that takes what is printed, or print nothing (-q)",
    )


def _dropped(_error: OSError) -> None:
    pass


class _Guard(io.RawIOBase):
    """Passes bytes on to a file until one write fails; then it takes all that comes, and drops it."""

    def __init__(self, file: io.RawIOBase, fail: Callable[[OSError], None]) -> None:
        self._file, self._fail, self._failed = file, fail, False

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return self._file.isatty()

    def fileno(self) -> int:
        return self._file.fileno()

    def write(self, data: ReadableBuffer, /) -> int | None:
        if not self._failed:
            try:
                return self._file.write(data)
            except OSError as error:
                self._failed = True
                self._fail(error)
        return memoryview(data).nbytes
