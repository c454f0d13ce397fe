"""Holds Ctrl-C back: the main thread has a lock that another one needs, or is in code that is not Python."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def undisturbed() -> Iterator[None]:
    """Let a Ctrl-C take effect only at the end of the block.

    Python raises ``KeyboardInterrupt`` between any two instructions, also inside the methods of locks and events. One
    of them is then held for ever, and the end of the watch waits for a thread that waits for it. Raised within a
    callback of LLVM, it is lost or ends the process with a segmentation fault.
    """
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield
        return
    came: list[int] = []
    try:
        signal.signal(signal.SIGINT, lambda number, _frame: came.append(number))
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if came:
            signal.raise_signal(came[0])
