"""Noticing that a file changed: by content, whatever way an editor writes it.

The parent folder is watched, not the file: editors replace files by renaming, which a watch on the file itself misses.
Events only wake the loop; whether something changed is decided by the content's hash. A safety look every second covers
file systems that give no events; polling looks as often as it is told instead, for network shares.
"""

from __future__ import annotations

import hashlib
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

_DEBOUNCE_MS = 50
_STEP_MS = 10
_SAFETY_MS = 1000
_CHUNK_BYTES = 1 << 20
_ALWAYS_READ_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class FileState:
    """What a file held at one moment.

    Attributes:
        digest: SHA-256 of the content of the file and of those it refers to; None where the file is not there.
        seen_s: When it was noticed, on the monotonic clock.
    """

    digest: str | None
    seen_s: float


def state_of(path: Path, others: tuple[Path, ...] = ()) -> FileState:
    """Return the state of a file and of the files that it refers to."""
    return _Looks().state_of(path, others)


def changes(
    path: Path,
    others: Callable[[], tuple[Path, ...]],
    stop: threading.Event,
    since: FileState,
    *,
    poll_s: float | None = None,
    again: Callable[[], bool] = lambda: False,
) -> Iterator[FileState]:
    """Yield the state of a file every time its content changes.

    Args:
        path: The file; it need not exist, its folder must.
        others: Files that it refers to at the moment, watched with it.
        stop: Ends the watch.
        since: State from which a change counts.
        poll_s: Look this often instead of waiting for events: for network shares.
        again: Asked at every look; where it says so, the state is yielded although the content is the same.
    """
    last = since.digest
    looks = _Looks()
    # The caller took ``since`` before this watch began: what happened between is caught by looking first.
    for woken in _wakes(path, others, stop, poll_s):
        now = looks.state_of(path, others(), may_trust_size=not woken)
        if now.digest != last or again():
            last = now.digest
            yield now


def _wakes(
    path: Path, others: Callable[[], tuple[Path, ...]], stop: threading.Event, poll_s: float | None
) -> Iterator[bool]:
    """Yield whenever it is time to look: True after an event, False where only time has passed."""
    yield True
    if poll_s is not None:
        while not stop.wait(poll_s):
            yield False
        return
    from watchfiles import watch

    while not stop.is_set():
        folders = _folders(path, others())
        for events in watch(
            *sorted(folders),
            debounce=_DEBOUNCE_MS,
            step=_STEP_MS,
            rust_timeout=_SAFETY_MS,
            yield_on_timeout=True,
            recursive=False,
            stop_event=stop,
            raise_interrupt=True,
            watch_filter=None,
        ):
            yield bool(events)
            # A link may lead elsewhere now, and the content may refer to files in other folders.
            if _folders(path, others()) != folders:
                break
        yield True  # what happened while no watch was on


def _folders(path: Path, others: tuple[Path, ...]) -> set[Path]:
    """Folders of the file, of every link on the way to it, and of the files that it refers to."""
    folders = {path.absolute().parent}
    link = path.absolute()
    for _ in range(40):  # as many links as systems follow
        if not link.is_symlink():
            break
        link = link.parent / link.readlink()
        folders.add(link.parent)
    for file in (path, *others):
        with suppress(OSError, RuntimeError):  # a link may lead to itself
            folders.add(file.resolve().parent)
    return {folder for folder in folders if folder.is_dir()}


class _Looks:
    """Reads contents; a large file is read again only when its attributes changed, or when an event says so."""

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, ...], bytes]] = {}

    def state_of(self, path: Path, others: tuple[Path, ...] = (), *, may_trust_size: bool = False) -> FileState:
        seen_s = time.monotonic()
        try:
            own = self._digest(path, may_trust_size)
        except OSError:
            return FileState(None, seen_s)
        digest = hashlib.sha256(own)
        for other in others:
            try:
                digest.update(b"\0" + self._digest(other, may_trust_size))
            except OSError:
                digest.update(b"\0missing")
        return FileState(digest.hexdigest(), seen_s)

    def _digest(self, path: Path, may_trust_size: bool) -> bytes:
        with path.open("rb") as stream:
            status = os.fstat(stream.fileno())
            attributes = (status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino, status.st_dev)
            known = self._known.get(path)
            if may_trust_size and known and known[0] == attributes and status.st_size > _ALWAYS_READ_BYTES:
                return known[1]
            digest = hashlib.sha256()
            while chunk := stream.read(_CHUNK_BYTES):
                digest.update(chunk)
        self._known[path] = (attributes, digest.digest())
        return digest.digest()
