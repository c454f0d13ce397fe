"""Stops a command at Ctrl-C, SIGTERM or SIGHUP in the normal way: temporary files are removed and workers end."""

from __future__ import annotations

import _thread
import math
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from bimvox.undisturbed import STOPPING

_AGAIN_S = 0.01
_LONGEST_IMPORT_S = 2.0
_ONE_STOP_S = 2.0
"""`timeout` and terminals may send a signal twice; the second one must not interrupt the tidying up."""


class Stop:
    """The handler of the signals that stop a command.

    Attributes:
        raised: What it has raised; None if nothing has stopped the command.
    """

    def __init__(self) -> None:
        self.raised: BaseException | None = None
        self._raised_s = -math.inf
        self._waits_since_s: float | None = None
        self._waiting: int | None = None
        self._is_over = False

    def overdue(self) -> None:
        """Raise what still waits for the end of an import: the command may end before it is sent again."""
        if self._waiting is not None:
            raise self._error(self._waiting)

    def end(self) -> None:
        """Send nothing from now on: the command has ended."""
        self._is_over = True

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Stop the command; during an import only after it, because a library that swallows it stays half imported."""
        now_s = time.monotonic()
        self._waits_since_s = self._waits_since_s or now_s
        if _imports(frame):
            if now_s - self._waits_since_s < _LONGEST_IMPORT_S:
                self._waiting = number
                self._send_soon(number)
                return
            self._send_soon(number, _ONE_STOP_S + _AGAIN_S)  # in case the import swallows what is raised below
        self._waits_since_s = self._waiting = None
        if now_s - self._raised_s < _ONE_STOP_S:
            return
        self._raised_s = now_s
        raise self._error(number)

    def _error(self, number: int) -> BaseException:
        self.raised = KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
        return self.raised

    def raise_again(self, unraisable: sys.UnraisableHookArgs) -> None:
        """Bring what a callback swallowed back to the main thread, without a traceback."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            number = int(signal.SIGINT)
        elif issubclass(unraisable.exc_type, SystemExit):
            code = getattr(unraisable.exc_value, "code", None)
            number = code - 128 if isinstance(code, int) and code > 128 else int(signal.SIGTERM)
        else:
            sys.__unraisablehook__(unraisable)
            return
        self._raised_s = -math.inf
        self._send_soon(number)

    def _send_soon(self, number: int, after_s: float | None = None) -> None:
        """Send a signal to the main thread when it has left the handler or hook: there, it would be swallowed again."""
        _thread.start_new_thread(self._send, (number, _AGAIN_S if after_s is None else after_s))

    def _send(self, number: int, after_s: float) -> None:
        time.sleep(after_s)
        if self._is_over:
            return
        if sys.platform == "win32":
            _thread.interrupt_main(signal.Signals(number))
        else:
            os.kill(os.getpid(), number)  # unlike interrupt_main, it ends a wait


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Within the block, raise ``KeyboardInterrupt`` or ``SystemExit`` where a signal comes that stops a command.

    A signal that this process ignores stays ignored: Ctrl-C in the background, SIGHUP after `nohup`.
    """
    stop = Stop()
    before = {number: signal.getsignal(number) for number in STOPPING}
    heard = [number for number, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    hook = sys.unraisablehook
    try:
        sys.unraisablehook = stop.raise_again
        for number in heard:
            signal.signal(number, stop)
        yield stop
    finally:
        stop.end()
        for number in heard:
            signal.signal(number, before[number])
        sys.unraisablehook = hook


def _imports(frame: FrameType | None) -> bool:
    """Return whether code runs within the import of a module."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False
