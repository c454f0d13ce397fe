"""Progress of a long job: its stages, how far each one is, how long each took, and notes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import Protocol, TypeAlias

from bimvox.errors import InputError, shown

Report: TypeAlias = Callable[[str, int, int], None]
"""Called with (stage, done, total): so many of so many units of work of a stage are done."""


class Progress(Protocol):
    """What a long job reports to.

    One stage runs at a time: starting one ends the one before. ``stage`` may be called plainly or in a ``with``
    statement, which also ends it.
    """

    def stage(self, name: str, total: int | None = None) -> AbstractContextManager[None]:
        """Start a stage of ``total`` units of work; None if the number is unknown."""

    def advance(self, count: int = 1) -> None:
        """Report ``count`` more units of the running stage as done."""

    def report(self, stage: str, done: int, total: int) -> None:
        """Take a ``Report``; a new stage name starts a new stage."""

    def note(self, text: str) -> None:
        """Tell the user something, one sentence."""

    def finish(self) -> None:
        """End the running stage, if any."""

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time of every stage so far, summed by name, in the order in which they first ran."""


Listener: TypeAlias = Progress | Callable[[str], object] | None
"""What the library's functions report to: a ``Progress``, a function that takes a line of text (``print``), or None."""


class SilentProgress:
    """Measures and remembers, shows nothing. A subclass that shows it overrides ``shown``, ``noted`` and ``ended``."""

    def __init__(self) -> None:
        self.name: str | None = None
        self.done = 0
        self.total: int | None = None
        self.notes: list[str] = []
        self._started = 0.0
        self._seconds: dict[str, float] = {}

    def stage(self, name: str, total: int | None = None) -> AbstractContextManager[None]:
        """Start a stage; see `Progress.stage`."""
        self.finish()
        self.name, self.done, self.total = name, 0, total
        self._seconds.setdefault(name, 0.0)
        self._started = time.perf_counter()
        self.shown()
        return _EndsStage(self)

    def advance(self, count: int = 1) -> None:
        """Report more of the running stage as done; see `Progress.advance`."""
        self.done += count
        self.shown()

    def report(self, stage: str, done: int, total: int) -> None:
        """Take a ``Report``; see `Progress.report`."""
        if stage != self.name:
            self.stage(stage, total or None)
        self.done, self.total = done, total or None
        self.shown()

    def note(self, text: str) -> None:
        """Keep a note; a repeated one is kept once."""
        if text not in self.notes:
            self.notes.append(text)
            self.noted(text)

    def finish(self) -> None:
        """End the running stage, if any."""
        if self.name is None:
            return
        self._seconds[self.name] += time.perf_counter() - self._started
        self.ended()
        self.name = None

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time by stage, rounded to milliseconds; the running stage counts up to now."""
        running = time.perf_counter() - self._started
        return {
            name: round(spent + (running if name == self.name else 0.0), 3) for name, spent in self._seconds.items()
        }

    @property
    def running_s(self) -> float:
        """Seconds since the running stage began."""
        return time.perf_counter() - self._started

    def shown(self) -> None:
        """Called when ``name``, ``done`` or ``total`` changed."""

    def noted(self, text: str) -> None:
        """Called for every new note."""

    def ended(self) -> None:
        """Called when the running stage ends."""


class _Lines(SilentProgress):
    """Passes on a line for every stage that begins and for every note."""

    def __init__(self, say: Callable[[str], object]) -> None:
        super().__init__()
        self._say = say

    def stage(self, name: str, total: int | None = None) -> AbstractContextManager[None]:
        """Start a stage; see `Progress.stage`."""
        if name != self.name:
            self._say(name if total is None else f"{name} ({total:,})")
        return super().stage(name, total)

    def noted(self, text: str) -> None:
        """Pass on a note."""
        self._say(text)


def progress_of(listener: Listener) -> Progress:
    """Return the ``Progress`` that reports to a listener.

    Raises:
        InputError: If it is neither a ``Progress`` nor a function.
    """
    if listener is None:
        return SilentProgress()
    if callable(listener):
        return _Lines(listener)
    if not hasattr(listener, "stage"):
        raise InputError(f"progress is {shown(listener)}", hint="give a function of one line of text, such as print")
    return listener


class _EndsStage(AbstractContextManager[None]):
    """Ends the stage that runs when the ``with`` block is left: a ``Report`` may have started further ones."""

    def __init__(self, progress: SilentProgress) -> None:
        self._progress = progress

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.finish()


# Who is told that a kernel is being compiled: the cache of kernels tells, a progress line shows it.
#
# Imports nothing, so that a progress line does not load a compiler.

CompileListener: TypeAlias = Callable[[int, bool], None]
"""Called with the number of kernels that this process has begun to compile, and whether one is being compiled."""

_compile_listeners: list[CompileListener] = []
_compiles_begun = 0
_compiles_open = 0


@contextmanager
def compiling_one() -> Iterator[None]:
    """Tell the listeners that a kernel is compiled, or that another process compiles it, in the ``with`` block."""
    global _compiles_begun, _compiles_open
    _compiles_begun, _compiles_open = _compiles_begun + 1, _compiles_open + 1
    _tell_compiling()
    try:
        yield
    finally:
        _compiles_open -= 1
        _tell_compiling()


@contextmanager
def told(listener: CompileListener) -> Iterator[None]:
    """Call a listener in the ``with`` block whenever compiling begins or ends."""
    _compile_listeners.append(listener)
    try:
        yield
    finally:
        _compile_listeners.remove(listener)


def _tell_compiling() -> None:
    for listener in tuple(_compile_listeners):
        listener(_compiles_begun, _compiles_open > 0)
