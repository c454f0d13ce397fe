"""Detects changes of a file by its content, whichever way an editor writes it.

The parent folder is watched, not the file: editors replace files by renaming, which a watch on the file itself misses.
Events only wake the loop; the hash of the content decides whether something changed. The file is also read every
second, for file systems that send no events. Polling, for network shares, replaces the events.

A file larger than ``MOST_DIGESTED_BYTES`` is not read: its size and times stand for its content.
"""

from __future__ import annotations

import hashlib
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from bimvox.errors import FileError
from bimvox.files import read_input, reason_of, require_regular, status_of
from bimvox.library.site import LoadedSite, attached_as, load_obstructions, obstructed
from bimvox.progress import Progress
from bimvox.site.obstructions.obstruction_set import EMPTY, ObstructionSet
from bimvox.site.site import Site

MOST_DIGESTED_BYTES = 512 << 20
"""The largest file whose content is read: no larger obstruction file is accepted."""

_DEBOUNCE_MS = 50
_STEP_MS = 10
_SAFETY_MS = 1000
_CHUNK_BYTES = 1 << 20
_ALWAYS_READ_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class FileState:
    """The content of a file at one moment.

    Attributes:
        digest: SHA-256 over the file and the files that it refers to; None if the file does not exist.
        seen_s: When it was read, on the monotonic clock.
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
        path: The file; it need not exist, but its folder must.
        others: Returns the files that it refers to at the moment; they are watched too.
        stop: Ends the watch.
        since: The state with which the first one is compared.
        poll_s: Read the file this often instead of waiting for events: for network shares.
        again: Called at every reading; if it returns True, the state is yielded even if it is unchanged.
    """
    last = since.digest
    looks = _Looks()
    # The caller took ``since`` before this watch began: the first reading finds changes in between.
    for woken in _wakes(path, others, stop, poll_s):
        now = looks.state_of(path, others(), may_trust_size=not woken)
        if now.digest != last or again():
            last = now.digest
            yield now


def _wakes(
    path: Path, others: Callable[[], tuple[Path, ...]], stop: threading.Event, poll_s: float | None
) -> Iterator[bool]:
    """Yield whenever it is time to read: True after an event, False if only time has passed."""
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
            # A link may have a new target, and the content may refer to files in other folders.
            if _folders(path, others()) != folders:
                break
        yield True  # for changes while no watch was active


def _folders(path: Path, others: tuple[Path, ...]) -> set[Path]:
    """Return the folders of the file, of every link that leads to it, and of the files that it refers to."""
    folders = {path.absolute().parent}
    link = path.absolute()
    for _ in range(40):  # operating systems follow no more links than this
        if not link.is_symlink():
            break
        link = link.parent / link.readlink()
        folders.add(link.parent)
    for file in (path, *others):
        with suppress(OSError, RuntimeError):  # a link may point to itself
            folders.add(file.resolve().parent)
    return {folder for folder in folders if folder.is_dir()}


class _Looks:
    """Reads contents; a large file is read again only after an event, or if its attributes have changed."""

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
        try:
            require_regular(path, most_bytes=sys.maxsize)  # a pipe would block
        except FileError as error:
            raise FileNotFoundError(path) from error
        with path.open("rb") as stream:
            status = os.fstat(stream.fileno())
            attributes = (status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino, status.st_dev)
            known = self._known.get(path)
            if may_trust_size and known and known[0] == attributes and status.st_size > _ALWAYS_READ_BYTES:
                return known[1]
            digest, left = hashlib.sha256(), MOST_DIGESTED_BYTES + 1
            if status.st_size >= left:
                digest.update(repr(attributes).encode())
                left = 0
            while chunk := stream.read(min(left, _CHUNK_BYTES)):  # it may grow while it is read
                digest.update(chunk)
                left -= len(chunk)
        self._known[path] = (attributes, digest.digest())
        return digest.digest()


# Reads the obstruction file of a watch, and decides when content that could not be used is read again.

_SETTLE_S = 0.05
"""A file that cannot be used may be half written: it is read again after this time before it is refused."""
_RETRY_S = (1.0, 30.0)
"""Shortest and longest wait before a failed reading or writing is tried again."""


class ObstructionReader:
    """Reads the file.

    Args:
        file: The obstruction file.
        loaded: The site that it belongs to.

    Attributes:
        file: The obstruction file.
        files: The files that it refers to.
        refused: Why its last content was refused; None if it was accepted.
    """

    def __init__(self, file: Path, loaded: LoadedSite) -> None:
        self.file, self._loaded = file, loaded
        self.files: tuple[Path, ...] = ()
        self.refused: str | None = None
        self._retry_at_s: float | None = None

    @property
    def waits(self) -> bool:
        """Whether content that could not be used will be read again."""
        return self._retry_at_s is not None

    @property
    def is_due(self) -> bool:
        """Whether it is time to read it again."""
        return self._retry_at_s is not None and time.monotonic() >= self._retry_at_s

    def now_of(self, loaded: LoadedSite) -> None:
        """Read the file for another site from now on."""
        self._loaded = loaded

    def read(self, state: FileState, progress: Progress) -> tuple[Site, dict[str, bytes]]:
        """Return the site with the obstructions, and the file's bytes for the log.

        Raises:
            BimvoxError: If the content cannot be used.
        """
        wanted, content = self._read(state, progress)
        return obstructed(self._loaded.site, wanted, progress), content

    def settles(self, state: FileState) -> bool:
        """Wait a moment, and return whether the file still holds what could not be used."""
        time.sleep(_SETTLE_S)
        return bool(self.files) or state_of(self.file).digest == state.digest

    def holds_other_than(self, content: Mapping[str, bytes]) -> bool:
        """Return whether the content of the file differs from what is being planned."""
        try:
            return read_input(self.file, most_bytes=MOST_DIGESTED_BYTES, may_be_empty=True) not in content.values()
        except FileError:
            return False

    def why_missing(self) -> FileError | None:
        """Return why an existing file cannot be read; None if it does not exist, or can be read after all."""
        try:
            if status_of(self.file) is not None:
                require_regular(self.file)
            with self.file.open("rb"):
                return None
        except FileError as error:
            return error
        except FileNotFoundError:
            return None
        except OSError as error:
            hint = "if nothing is in the way, write an empty list of obstructions"
            return FileError(self.file, f"cannot be read: {reason_of(error)}", hint=hint)

    def accept(self) -> None:
        """Note that the content was accepted."""
        self.refused, self._retry_at_s = None, None

    def forget(self) -> None:
        """Note that the file no longer exists, so there is nothing to read again."""
        self._retry_at_s = None

    def try_again(self, started_s: float) -> None:
        """Try again later: a full disk or a missing file may be transient. A slow reading is tried less often."""
        now_s = time.monotonic()
        self._retry_at_s = now_s + min(max(_RETRY_S[0], 10.0 * (now_s - started_s)), _RETRY_S[1])

    def _read(self, state: FileState, progress: Progress) -> tuple[ObstructionSet, dict[str, bytes]]:
        if state.digest is None:
            if (error := self.why_missing()) is not None:
                raise error
            progress.note(f"{self.file} does not exist yet: nothing is in the way")
            return EMPTY, {}
        try:
            size = self.file.stat().st_size
            if size > MOST_DIGESTED_BYTES:
                raise FileError(
                    self.file,
                    f"is too large ({size >> 20} MiB, at most {MOST_DIGESTED_BYTES >> 20})",
                    hint="give cells or boxes",
                )
            content = read_input(self.file, most_bytes=MOST_DIGESTED_BYTES, may_be_empty=True)
            found = load_obstructions(self.file, self._loaded.site, self._loaded.survey)
        except OSError as error:
            raise FileError(self.file, f"cannot be read: {reason_of(error)}") from error
        self.files = found.files
        return found, {attached_as(self.file): content}
