"""Something worked out on another core: by a copy of this process, which knows all that it needs already.

Where there is only one core, or no copy can be made, or it does not answer, the work is done here when its result is
asked for: the result is the same.

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
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

from pipeline.orphans import end_with

T = TypeVar("T")

_LIMIT_S = 60.0
"""A copy that has not answered then is given up."""
_STUCK_S = 0.5
"""So is one that has slept for so long and used no processor time: its work waits for nothing but a lock."""
_LOOK_S = 0.05
_STATE, _USER_TICKS, _SYSTEM_TICKS = 0, 11, 12
"""Of the fields of /proc/PID/stat after the name, see proc(5)."""


class Beside:
    """Begins work on another core.

    Args:
        limit_s: Time after which a copy is given up.
    """

    def __init__(self, limit_s: float = _LIMIT_S) -> None:
        self._limit_s = limit_s
        self._begun: list[Begun[Any]] = []

    def __call__(self, work: Callable[[], T], or_else: Callable[[], T] | None = None) -> Begun[T]:
        """Begin work whose result can be pickled, and that changes nothing that anyone looks at later.

        Args:
            work: The work.
            or_else: Done instead where no copy brings the result; the work itself where not given.
        """
        begun = Begun(work, or_else or work, self._limit_s)
        self._begun = [one for one in self._begun if one.goes_on]
        self._begun.append(begun)
        return begun

    def close(self) -> None:
        """Give up what was begun and not asked for."""
        for begun in self._begun:
            begun.give_up()
        self._begun = []


class Begun(Generic[T]):
    """Work that was begun; calling it waits for the result.

    Args:
        work: The work.
        or_else: Done here where no copy brings the result.
        limit_s: Time after which the copy is given up.
    """

    def __init__(self, work: Callable[[], T], or_else: Callable[[], T], limit_s: float) -> None:
        self._or_else, self._limit_s = or_else, limit_s
        self._pid, self._read = 0, -1
        if not can_copy():
            return
        try:
            read, write = os.pipe()
        except OSError:
            return
        here = os.getpid()
        try:
            pid = os.fork()
        except OSError:
            os.close(read)
            os.close(write)
            return
        if pid == 0:
            _work(work, read, write, here)
        os.close(write)
        self._pid, self._read = pid, read

    @property
    def goes_on(self) -> bool:
        """Whether a copy is at it, or has a result that was not asked for."""
        return bool(self._pid)

    @property
    def is_done(self) -> bool:
        """Whether the copy answers."""
        return bool(self._pid) and bool(select.select([self._read], [], [], 0.0)[0])

    def __call__(self) -> T:
        """Return the result."""
        try:
            answer = self._all() if self._pid else None
        finally:
            self.give_up()
        if answer is None:
            return self._or_else()  # here it says for itself what went wrong
        result: T = pickle.loads(answer)
        return result

    def _all(self) -> bytes | None:
        """Everything that comes until the end; None where nothing does, or too late."""
        until_s = time.monotonic() + self._limit_s
        slept, parts = _Slept(self._pid), list[bytes]()
        while not slept.too_long and time.monotonic() < until_s:
            if select.select([self._read], [], [], _LOOK_S)[0]:
                part = os.read(self._read, 1 << 20)
                if not part:
                    return b"".join(parts) or None
                parts.append(part)
                slept = _Slept(self._pid)
        return None

    def give_up(self) -> None:
        """End the copy, if there is one still."""
        if self._pid:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._pid, signal.SIGKILL)
            os.close(self._read)
            with contextlib.suppress(ChildProcessError):
                os.waitpid(self._pid, 0)
            self._pid, self._read = 0, -1


def can_copy() -> bool:
    """Return whether a copy of this process can work beside it."""
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


class _Slept:
    """How long a process has slept without using any processor time.

    Args:
        pid: The process.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._since_s, self._ticks = time.monotonic(), -1

    @property
    def too_long(self) -> bool:
        """Whether it waits for what will not come; not where the system does not say."""
        try:
            with Path(f"/proc/{self._pid}/stat").open("rb") as stream:
                fields = stream.read().rpartition(b")")[2].split()
        except OSError:
            return False
        ticks = int(fields[_USER_TICKS]) + int(fields[_SYSTEM_TICKS])
        now_s = time.monotonic()
        # Ready to run, or waiting for a disk, is not asleep.
        if fields[_STATE] != b"S" or ticks != self._ticks:
            self._since_s, self._ticks = now_s, ticks
        return now_s - self._since_s > _STUCK_S


def _work(work: Callable[[], Any], read: int, write: int, parent: int) -> None:
    """In the copy: work, answer, and be gone; nothing of the original's is closed, flushed or told."""
    code = 1
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        end_with(parent)
        os.close(read)
        answer = pickle.dumps(work(), pickle.HIGHEST_PROTOCOL)
        with os.fdopen(write, "wb") as stream:
            stream.write(answer)
        code = 0
    finally:
        os._exit(code)
