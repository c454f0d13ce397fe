"""A copy of this process that works beside it, on another core: it knows all that it needs already.

A copy is made by a process that has threads (the whole log, viewers, what watches the file), and has none of them. A
lock that one of these held at that moment is held in the copy for ever: Python makes its own new, the C library too,
and no work done here takes one of ours, but a module that is just being imported, or a kernel that is just being
compiled elsewhere, has one. A copy that waits for it uses no processor time; that is noticed within a second.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import select
import signal
import struct
import sys
import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from bimvox_pipeline.orphans import end_with

LIMIT_S = 60.0
"""A copy that has not answered then is given up."""
_STUCK_S = 0.5
"""So is one that has slept for so long and used no processor time: its work waits for nothing but a lock."""
_LOOK_S = 0.05
_STATE, _USER_TICKS, _SYSTEM_TICKS = 0, 11, 12
"""Of the fields of /proc/PID/stat after the name, see proc(5)."""
_TOLD_TO_END = (signal.SIGINT, signal.SIGTERM)
_HEAD = struct.Struct("<Q")
_PIECE = 1 << 20


def can_copy() -> bool:
    """Return whether a copy of this process can work beside it."""
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


class Link:
    """One end of what two processes tell each other.

    Args:
        read: File descriptor to read from.
        write: File descriptor to write to; it does not block.
    """

    def __init__(self, read: int, write: int) -> None:
        self._read, self._write = read, write
        self._come = bytearray()
        self._ended = False

    def give(self, found: Any) -> None:
        """Let the other one have something; what it gives meanwhile is kept. Nothing happens where it is gone."""
        data = pickle.dumps(found, pickle.HIGHEST_PROTOCOL)
        left = memoryview(_HEAD.pack(len(data)) + data)
        while len(left) and self._goes_on():
            readable, writable, _ = select.select([] if self._ended else [self._read], [self._write], [], _LOOK_S)
            if readable:
                self._hear()
            if writable:
                try:
                    left = left[os.write(self._write, left[:_PIECE]) :]
                except OSError:
                    return

    def take(self) -> Any:
        """Wait for what the other one gives next; None where it gives nothing more."""
        while True:
            size = _HEAD.unpack_from(self._come)[0] if len(self._come) >= _HEAD.size else None
            if size is not None and len(self._come) >= _HEAD.size + size:
                found = pickle.loads(memoryview(self._come)[_HEAD.size : _HEAD.size + size])
                self._come = self._come[_HEAD.size + size :]
                return found
            if self._ended or not self._goes_on():
                return None
            if select.select([self._read], [], [], _LOOK_S)[0]:
                self._hear()

    def _hear(self) -> None:
        part = os.read(self._read, _PIECE)
        self._come += part
        self._ended = not part

    def _goes_on(self) -> bool:
        """Whether the other one may still be heard; asked again and again while it is waited for."""
        return True

    def _close(self) -> None:
        os.close(self._read)
        os.close(self._write)


class Copied(Link):
    """A copy at work, as the process sees it that it was made from.

    Args:
        work: What it does; it is given its end of the link.
        limit_s: Time after which it is given up.

    Raises:
        OSError: If none can be made.
    """

    def __init__(self, work: Callable[[Link], None], limit_s: float = LIMIT_S) -> None:
        self._limit_s = limit_s
        self._slept: _Slept | None = None
        ends, here = [*_pipe()], os.getpid()
        # Told to end before it is deaf to that, the copy would end as this process does: write, close, tell.
        heard = signal.pthread_sigmask(signal.SIG_BLOCK, _TOLD_TO_END)
        try:
            ends += _pipe()
            self._pid = os.fork()
            mine, its = (ends[0], ends[3]), (ends[2], ends[1])
            if self._pid == 0:
                _work(work, mine, its, here, heard)
            super().__init__(*mine)
            for end in its:
                os.close(end)
        except OSError:
            for end in ends:
                os.close(end)
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, heard)

    @property
    def goes_on(self) -> bool:
        """Whether it was not given up."""
        return bool(self._pid)

    def give(self, found: Any) -> None:
        """Let it have something; what it gives meanwhile is kept."""
        self._slept = None
        super().give(found)

    def take(self) -> Any:
        """Wait for what it gives next; None where it gives nothing more, or too late."""
        self._slept = None
        return super().take()

    def give_up(self) -> None:
        """End it, where it goes on."""
        pid, self._pid, self._ended = self._pid, 0, True  # first: whatever interrupts this, nothing is done twice
        if pid:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            self._close()
            with contextlib.suppress(ChildProcessError):
                os.waitpid(pid, 0)

    def _hear(self) -> None:
        self._slept = None
        super()._hear()

    def _goes_on(self) -> bool:
        if not self._pid:
            return False
        self._slept = self._slept or _Slept(self._pid, self._limit_s)
        return not self._slept.too_long


class _Slept:
    """How long a process has slept without using any processor time, or has not been heard of at all.

    Args:
        pid: The process.
        limit_s: How long it may take to be heard of.
    """

    def __init__(self, pid: int, limit_s: float) -> None:
        self._pid = pid
        self._since_s, self._ticks = time.monotonic(), -1
        self._until_s = self._since_s + limit_s
        self._looked_s = 0.0

    @property
    def too_long(self) -> bool:
        """Whether it waits for what will not come; not where the system does not say."""
        now_s = time.monotonic()
        if now_s > self._until_s:
            return True
        if now_s - self._looked_s < _LOOK_S:
            return False
        self._looked_s = now_s
        try:
            with Path(f"/proc/{self._pid}/stat").open("rb") as stream:
                fields = stream.read().rpartition(b")")[2].split()
        except OSError:
            return False
        ticks = int(fields[_USER_TICKS]) + int(fields[_SYSTEM_TICKS])
        # Ready to run, or waiting for a disk, is not asleep.
        if fields[_STATE] != b"S" or ticks != self._ticks:
            self._since_s, self._ticks = now_s, ticks
        return now_s - self._since_s > _STUCK_S


def _pipe() -> tuple[int, int]:
    read, write = os.pipe()
    os.set_blocking(write, False)
    return read, write


def _work(
    work: Callable[[Link], None], others: tuple[int, int], its: tuple[int, int], parent: int, heard: Collection[int]
) -> None:
    """In the copy: work, and be gone; nothing of the original's is closed, flushed or told."""
    code = 1
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)
        end_with(parent)
        for end in others:
            os.close(end)
        work(Link(*its))
        code = 0
    finally:
        os._exit(code)
