"""The memory use of a step, and a limit for it."""

from __future__ import annotations

import ctypes
import gc
import resource
import sys
from collections.abc import Callable
from pathlib import Path

_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def limit_memory(gigabytes: float) -> None:
    """Make allocations beyond a limit fail, so that a tool cannot exhaust the machine's memory."""
    size = int(gigabytes * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (size, size))


def peak_mb_of(step: Callable[[], None]) -> float:
    """Run a step and return the largest growth of the resident set, MB (10^6 bytes).

    On Linux the kernel's high-water mark is reset first. Elsewhere the growth of the process's own mark is used,
    which is too low if an earlier step used more.
    """
    gc.collect()
    if _CLEAR.exists():
        ctypes.CDLL(None).malloc_trim(0)
        _CLEAR.write_text("5")
        before = _kilobytes("VmRSS")
        step()
        return (_kilobytes("VmHWM") - before) * 1024 / 1e6
    # macOS counts bytes here, others kilobytes.
    unit = 1 if sys.platform == "darwin" else 1024
    start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    step()
    return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - start) * unit / 1e6


def _kilobytes(field: str) -> int:
    for line in _STATUS.read_text().splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1])
    raise RuntimeError(f"{_STATUS} has no {field}")
