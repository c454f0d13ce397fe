"""A process that works for this one and is of no use without it: it ends when this one does, whatever ends it."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time

_PR_SET_PDEATHSIG = 1
"""Linux, prctl(2): the signal that the system sends to a process when its parent ends."""
_LOOK_S = 1.0

_c = ctypes.CDLL(None) if sys.platform == "linux" else None
"""Loaded ahead: a copy of a process with threads had better load nothing."""


def end_with(parent: int) -> None:
    """In a process that was forked: from now on, end when the parent has ended.

    Args:
        parent: Process id of the parent, asked for before the fork.
    """
    if _c is not None:
        _c.prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
    else:
        threading.Thread(target=_look, args=(parent,), name="parent", daemon=True).start()
    if os.getppid() != parent:
        os._exit(1)  # it ended meanwhile


def _look(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_S)
    os._exit(1)
