"""Reads the obstruction file of a watch, and decides when content that could not be used is read again."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from bimvox.errors import FileError
from bimvox.files import read_input, reason_of, require_regular, status_of
from bimvox.library.site import LoadedSite, attached_as, load_obstructions, obstructed
from bimvox.progress import Progress
from bimvox.site.obstructions.obstruction_set import EMPTY, ObstructionSet
from bimvox.site.site import Site
from bimvox_pipeline.watch.file_watch import MOST_DIGESTED_BYTES, FileState, state_of

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
