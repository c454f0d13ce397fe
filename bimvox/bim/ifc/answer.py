"""What the geometry workers and their parent say to each other, within a limit of processor time."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.ifc.shape import Shape
from bimvox.errors import SelectionError

# A limit of the processor time that a geometry worker spends on one request.
#
# Elapsed time would lose other parts on a busy machine than on an idle one, so that one model gave two plans.

_NO_LIMIT_S = 1e8


@contextmanager
def _processor_time_limit(limit_s: float) -> Iterator[None]:
    """Let the system end this process if the body takes more than ``limit_s`` seconds of its processor time.

    The system ends it inside a library too, where Python would not come to look at a clock.
    """
    _set_limit(limit_s)
    try:
        yield
    finally:
        _set_limit(None)


if sys.platform == "win32":
    import ctypes
    from ctypes import wintypes
    from functools import cache

    OUT_OF_TIME = 1816
    """Exit status of a process that the system has ended at its limit: ERROR_NOT_ENOUGH_QUOTA."""

    class _BasicLimits(ctypes.Structure):
        """``JOBOBJECT_BASIC_LIMIT_INFORMATION``; times in units of 100 ns."""

        _fields_ = (
            ("PerProcessUserTimeLimit", ctypes.c_int64),
            ("PerJobUserTimeLimit", ctypes.c_int64),
            ("LimitFlags", wintypes.DWORD),
            ("MinimumWorkingSetSize", ctypes.c_size_t),
            ("MaximumWorkingSetSize", ctypes.c_size_t),
            ("ActiveProcessLimit", wintypes.DWORD),
            ("Affinity", ctypes.c_size_t),
            ("PriorityClass", wintypes.DWORD),
            ("SchedulingClass", wintypes.DWORD),
        )

    _BASIC_LIMITS, _PROCESS_TIME = 2, 0x2

    @cache
    def _job() -> tuple[Any, Any]:
        """Return the system's library and a job that holds this process alone."""
        kernel32 = ctypes.WinDLL("kernel32")
        kernel32.CreateJobObjectW.restype = wintypes.HANDLE
        kernel32.GetCurrentProcess.restype = wintypes.HANDLE
        job = wintypes.HANDLE(kernel32.CreateJobObjectW(None, None))
        kernel32.AssignProcessToJobObject(job, wintypes.HANDLE(kernel32.GetCurrentProcess()))
        return kernel32, job

    def _set_limit(limit_s: float | None) -> None:
        """Limit what this process takes from now on. A system that refuses leaves the limit of elapsed time."""
        kernel32, job = _job()
        until_s = os.times().user + (_NO_LIMIT_S if limit_s is None else limit_s)
        limits = _BasicLimits(PerProcessUserTimeLimit=int(until_s * 1e7), LimitFlags=_PROCESS_TIME)
        kernel32.SetInformationJobObject(job, _BASIC_LIMITS, ctypes.byref(limits), ctypes.sizeof(limits))

else:
    import signal

    OUT_OF_TIME = -signal.SIGPROF
    """Exit status of a process that the system has ended at its limit."""

    def _set_limit(limit_s: float | None) -> None:
        """Start or stop the timer that ends this process; a signal without a handler needs no Python."""
        if hasattr(signal, "setitimer"):  # otherwise the limit of elapsed time is left
            signal.setitimer(signal.ITIMER_PROF, limit_s or 0.0)


READY = "ready"
"""The first message: the file is loaded."""
Answer = tuple[Shape, list[NDArray[np.float64]]] | str
"""A shape and the placement of each product, (4, 4) float64, metres; or the reason why there is no shape."""
Selected = frozenset[int] | SelectionError
"""Step ids, or the error about the query."""
Selector = Callable[[str], Selected]
"""Finds the products that a query matches."""
Mesher = Callable[[tuple[int, ...], str], Answer]
"""Meshes products that share one shape, with the named library."""


def no_selector(query: str) -> Selected:
    """Refuse queries, in a worker that gets none."""
    raise NotImplementedError(query)


def answer_requests(channel: Connection, mesher: Mesher, selector: Selector = no_selector) -> None:
    """Answer requests until the parent closes the connection: a query or (step ids, library), each with its limit.

    The limit is in seconds of processor time; the process ends there.
    """
    with suppress(EOFError, OSError):
        while True:
            request, limit_s = channel.recv()
            with _processor_time_limit(limit_s):
                answer = selector(request) if isinstance(request, str) else mesher(*request)
            channel.send(answer)
