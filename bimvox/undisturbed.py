"""Holds back what stops a command: the main thread has a lock that others need, or is in code that is not Python."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""The signals that stop a command: Ctrl-C, an order to end, a terminal that closes."""


@contextmanager
def undisturbed() -> Iterator[None]:
    """Let what stops a command, such as Ctrl-C, take effect only at the end of the block.

    Python raises ``KeyboardInterrupt`` between any two instructions, also inside the methods of locks and events. One
    of them is then held for ever, and the end of the watch waits for a thread that waits for it. Raised within a
    callback of LLVM, it is lost or ends the process with a segmentation fault.
    """
    usual = {number: handler for number in STOPPING if callable(handler := signal.getsignal(number))}
    if threading.current_thread() is not threading.main_thread() or not usual:
        yield
        return
    came: list[int] = []
    try:
        for number in usual:
            signal.signal(number, lambda number, _frame: came.append(number))
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


@contextmanager
def interruptible() -> Iterator[None]:
    """Within the block, raise ``KeyboardInterrupt`` also for a Ctrl-C that came while a kernel returned its result.

    Numba makes Python's objects of a result by calls of Python; if one of them is interrupted, Python reports that a
    function returned a result with an exception set: ``SystemError``, caused by the interrupt.
    """
    try:
        yield
    except SystemError as error:
        cause: BaseException | None = error
        while isinstance(cause, SystemError):
            cause = cause.__cause__
        if isinstance(cause, KeyboardInterrupt):
            raise cause from None
        raise


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage in the ``with`` block, or in the function that this decorates."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
