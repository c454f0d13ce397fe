"""Writes the logs of a watch: a segment per revision immediately, and the whole newest log when idle.

A revision counts once its segment is synced to disk. A thread rewrites the whole log after a short time without
changes; a change interrupts it, and it starts again later. So the newest plan is always in the whole log and the
segments after it, however the process ends.
"""

from __future__ import annotations

import re
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, cast

from bimvox.errors import FileError, LogFileError
from bimvox.files import write_atomically
from bimvox.log import recorder
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.log.segments import first_plan_of, newest
from bimvox.progress import Progress, SilentProgress
from bimvox.undisturbed import undisturbed

_QUIET_S = 0.5
_RETRY_S = 5.0


def segment_file(log: Path, revision: int) -> Path:
    """Return the path of the segment of a revision: next to the log, even if the log is a link."""
    return log.with_name(f"{log.stem}.r{revision:04d}{log.suffix}")


def segments_on_disk(log: Path) -> dict[int, Path]:
    """Return the segments of a log by revision, ascending."""
    pattern = re.compile(re.escape(log.stem) + r"\.r(\d{4,})" + re.escape(log.suffix))
    found = {int(m.group(1)): p for p in log.parent.iterdir() if (m := pattern.fullmatch(p.name))}
    return dict(sorted(found.items()))


def keep_as_segment(log: Path, revision: int) -> None:
    """Keep the log from which a watch continues as a segment: later segments build on it."""
    kept = segment_file(log, revision)
    if not kept.exists():
        write_atomically(kept, log.read_bytes())


@dataclass(frozen=True, slots=True, eq=False)
class Newest:
    """The newest plan on disk.

    Attributes:
        log: The plan.
        behind: Whether the whole log is missing or older than that.
    """

    log: PlanLog
    behind: bool


def read_newest(log: Path, fixed_digest: str | None, progress: Progress) -> Newest | None:
    """Return the newest plan on disk for a site, regardless of obstructions; None if there is none.

    Args:
        log: The whole log; if it is missing or damaged, the last intact segment replaces it.
        fixed_digest: The fixed digest of the site; None: that of any site.
        progress: Receives a note for each file that is not used.
    """
    segments = segments_on_disk(log)
    base = _of_site(_read(log, progress), fixed_digest, log, progress) if log.exists() else None
    no_whole = base is None
    after: list[PlanLog] = []
    for revision in sorted(segments, reverse=True):
        if base is not None and revision <= base.revision:
            break
        read = _read(segments[revision], progress)
        segment = _of_site(read, fixed_digest, segments[revision], progress)
        if base is None and read is not None and segment is None:
            break  # reading hundreds of large segments of another site takes minutes: the earlier ones are of it too
        if segment is None:
            # Later segments build on this one, which cannot be used.
            after.clear()
        elif base is None and not segment.context:
            base = segment
        else:
            after.append(segment)
    if base is None:
        return None
    first = first_plan_of(base)
    own = [segment for segment in after[::-1] if first_plan_of(segment) == first]
    if len(own) < len(after):
        progress.note(f"{len(after) - len(own)} segments next to {log} belong to an earlier plan and are not used")
    return Newest(newest(base, own), no_whole or bool(own))


def newest_log(log: Path) -> Path:
    """Return the file of the newest plan: the whole log, or the last segment if a watch ended before it was written."""
    found = read_newest(log, None, SilentProgress())
    segment = None if found is None or not found.behind else segment_file(log, found.log.revision)
    return log if segment is None or not segment.exists() else segment


def _read(path: Path, progress: Progress) -> PlanLog | None:
    try:
        return read_log(path)
    except LogFileError as error:
        progress.note(f"{path} is not used: {error.message}")
        return None


def _of_site(record: PlanLog | None, fixed_digest: str | None, path: Path, progress: Progress) -> PlanLog | None:
    """Return a log if it is of a site; None, with a note, if it is of another one."""
    if record is not None and fixed_digest not in (None, record.plan.site.fixed_digest):
        progress.note(f"{path} belongs to another site and is not used")
        return None
    return record


class WholeLog:
    """Writes the whole newest log in the background.

    Args:
        target: The log.
        progress: Receives failures.
    """

    def __init__(self, target: Path, progress: Progress) -> None:
        self._target, self._progress = target, progress
        self._wanted: PlanLog | None = None
        self._changed = threading.Condition()
        self._interrupted = threading.Event()
        self._closed = False
        self._thread: threading.Thread | None = None

    @undisturbed()
    def hold(self) -> None:
        """Stop writing, because something else is more urgent."""
        self._interrupted.set()

    @undisturbed()
    def offer(self, record: PlanLog) -> None:
        """Write this plan when idle, instead of one offered earlier."""
        with self._changed:
            self._wanted = record
            self._interrupted.clear()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="whole log", daemon=True)
                self._thread.start()
            self._changed.notify()

    @undisturbed()
    def resume(self) -> None:
        """Resume after ``hold`` with the plan that was offered last."""
        with self._changed:
            self._interrupted.clear()
            self._changed.notify()

    def close(self) -> None:
        """Write the last offered plan, unless it is written already, and end; the segments hold it if that fails."""
        with undisturbed(), self._changed:
            self._closed = True
            self._interrupted.set()
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()
        if self._wanted is not None:
            try:
                self._write(self._wanted, None)
            except FileError as error:
                self._progress.note(f"{error.message}; the segments hold the newest plan")
                return
            self._wanted = None

    def _run(self) -> None:
        wait_s = _QUIET_S
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._may_write())
                record = self._wanted
                # Files often change in bursts, so another change is likely.
                if not self._closed and self._changed.wait(wait_s):
                    continue
                if self._closed:
                    return
                if record is None or not self._may_write():
                    continue
            wait_s = _QUIET_S
            try:
                self._write(record, self._interrupted)
            except _Interrupted:
                continue
            except FileError as error:
                self._progress.note(error.message)
                wait_s = _RETRY_S
                continue
            with self._changed:
                if self._wanted is record:
                    self._wanted = None

    def _may_write(self) -> bool:
        return self._wanted is not None and not self._interrupted.is_set()

    def _write(self, record: PlanLog, interrupted: threading.Event | None) -> None:
        def write(stream: BinaryIO) -> None:
            out = stream if interrupted is None else cast(BinaryIO, _Stoppable(stream, interrupted))
            recorder.write_log(out, record)

        write_atomically(self._target, write)


class _Interrupted(Exception):  # noqa: N818 (not an error: something else is more urgent)
    """Writing was stopped."""


class _Stoppable:
    """A stream that can be stopped from another thread."""

    def __init__(self, stream: BinaryIO, stopped: threading.Event) -> None:
        self._stream, self._stopped = stream, stopped

    def write(self, data: bytes) -> int:
        if self._stopped.is_set():
            raise _Interrupted
        return self._stream.write(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
