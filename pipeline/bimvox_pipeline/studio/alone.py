"""One at a time: what is checked about the files of a folder still holds when they are written."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path

from bimvox.errors import InputError

_THREADS = threading.Lock()


class ChangedMeanwhileError(InputError):
    """A file that somebody else changed since the page read it: nothing was written."""

    def __init__(self, file: Path) -> None:
        super().__init__(
            f"{file.name} was changed since it was opened here; nothing was saved",
            hint="what you entered is still here",
        )


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a folder: no other thread and no other studio checks and writes a file in it meanwhile.

    The folder itself is locked, so no file is left behind; the system frees it if the process ends. On Windows only
    the threads of this process wait for each other.
    """
    with _THREADS, _locked(folder):
        yield


if sys.platform == "win32":

    def _locked(folder: Path) -> AbstractContextManager[None]:
        """Windows cannot lock a folder."""
        return nullcontext()

else:
    import fcntl

    @contextmanager
    def _locked(folder: Path) -> Iterator[None]:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            with suppress(OSError):  # a file system of a network may not lock; threads still wait for each other
                fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)
