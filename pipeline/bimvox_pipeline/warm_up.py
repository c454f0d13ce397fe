"""Compiles the kernels that a first run needs, in several processes at once."""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError
from bimvox.processes import processors, python_module, worker_environment
from bimvox.progress import Progress

_STAGE = "compiling, once"
_LOOK_EVERY_S = 0.1


def warm_up(*, processes: int | None = None, progress: Progress) -> dict[str, Any]:
    """Compile every kernel of the demo that is not on disk yet, in as many processes as there are processors.

    Returns the document of ``bimvox warm-up --json``.

    Raises:
        BimvoxError: If machine code cannot be stored.
    """
    from bimvox.kernel_cache import cache_folder
    from bimvox.kernel_list import wanted

    began = time.perf_counter()
    files = [one.file for one in wanted()]
    there = sum(file.is_file() for file in files)
    found = there
    if there < len(files):
        progress.stage(_STAGE, len(files))
        workers = [_started(forwards=number == 0) for number in range(processes or processors())]
        try:
            while found < len(files) and any(worker.poll() is None for worker in workers):
                time.sleep(_LOOK_EVERY_S)
                found = sum(file.is_file() for file in files)
                progress.report(_STAGE, found, len(files))
        finally:
            for worker in workers:
                _end(worker)
        progress.finish()
        found = sum(file.is_file() for file in files)
        if found == there and not _can_store(cache_folder()):
            raise BimvoxError(
                f"no machine code could be stored in {cache_folder()}",
                hint="make the folder writable, or name another one in NUMBA_CACHE_DIR",
            )
    return {
        "kernels": len(files),
        "compiled": found - there,
        "folder": str(cache_folder()),
        "seconds": round(time.perf_counter() - began, 3),
    }


class Helper:
    """Starts one process that compiles what an act needs, beside this one, when this one compiles its second kernel.

    For a single kernel, such a process takes longer to start than the kernel takes to compile.

    Args:
        act: An act of the demo.
    """

    def __init__(self, act: str) -> None:
        self._act = act
        self._before: int | None = None
        self._worker: subprocess.Popen[bytes] | None = None

    def compiling(self, begun: int, now: bool) -> None:
        """Take a report; see `bimvox.progress`."""
        self._before = begun if self._before is None else self._before
        if now and begun > self._before and self._worker is None and processors() > 1:
            self._worker = _started(self._act, forwards=False)

    def end(self) -> None:
        """End the process."""
        if self._worker is not None:
            _end(self._worker)


@contextmanager
def helped(act: str) -> Iterator[None]:
    """Compile in two processes in the ``with`` block, should anything have to be compiled."""
    from bimvox.progress import told

    helper = Helper(act)
    try:
        with told(helper.compiling):
            yield
    finally:
        helper.end()


def _can_store(folder: Path) -> bool:
    with suppress(OSError), tempfile.TemporaryFile(dir=folder):
        return True
    return False


def _started(*act: str, forwards: bool) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        python_module("bimvox.kernel_list", *act, "forwards" if forwards else "backwards"),
        env=worker_environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _end(worker: subprocess.Popen[bytes]) -> None:
    worker.kill()
    worker.wait()
