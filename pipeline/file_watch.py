"""Noticing that a file changed: by content, whatever way an editor writes it.

The parent folder is watched, not the file: editors replace files by renaming, which a watch on the file itself misses.
Events only wake the loop; whether something changed is decided by the content's hash. A safety look every second covers
file systems that give no events.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

_DEBOUNCE_MS = 50
_STEP_MS = 10
_SAFETY_MS = 1000


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
    seen_s = time.monotonic()
    try:
        content = path.read_bytes()
    except OSError:
        return FileState(None, seen_s)
    digest = hashlib.sha256(content)
    for other in others:
        try:
            digest.update(b"\0" + hashlib.sha256(other.read_bytes()).digest())
        except OSError:
            digest.update(b"\0missing")
    return FileState(digest.hexdigest(), seen_s)


def changes(
    path: Path, others: Callable[[], tuple[Path, ...]], stop: threading.Event, since: FileState
) -> Iterator[FileState]:
    """Yield the state of a file every time its content changes.

    Args:
        path: The file; it need not exist, its folder must.
        others: Files that it refers to at the moment, watched with it.
        stop: Ends the watch.
        since: State from which a change counts.
    """
    from watchfiles import watch

    folders = {path.absolute().parent, path.resolve().parent, *(p.resolve().parent for p in others())}
    last = since.digest
    # The caller took ``since`` before this watch began: what happened between is caught by looking first.
    now = state_of(path, others())
    if now.digest != last:
        last = now.digest
        yield now
    for _ in watch(
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
        now = state_of(path, others())
        if now.digest != last:
            last = now.digest
            yield now
