"""What a long job tells about itself: stages, how far each is, and how long each took."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Protocol


class Progress(Protocol):
    """Told by the pipeline, shown (or not) by the command line.

    One stage runs at a time: starting one ends the one before. ``stage`` may be called plainly or in a ``with``
    statement, which also ends it.
    """

    def stage(self, name: str, total: int | None = None) -> AbstractContextManager[None]:
        """Start a stage of ``total`` units of work (None: not known)."""

    def advance(self, count: int = 1) -> None:
        """Say that ``count`` more units of the running stage are done."""

    def report(self, stage: str, done: int, total: int) -> None:
        """Take a library callback ``(stage, done, total)``; a new stage name starts a new stage."""

    def note(self, text: str) -> None:
        """Tell the user something, one sentence."""

    def finish(self) -> None:
        """End the running stage, if any."""

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time of every stage so far, summed by name, in the order in which they first ran."""


class SilentProgress:
    """Measures and remembers, shows nothing. What is to be shown overrides ``shown``, ``noted`` and ``ended``."""

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
        """Say that more of the running stage is done; see `Progress.advance`."""
        self.done += count
        self.shown()

    def report(self, stage: str, done: int, total: int) -> None:
        """Take a library callback; see `Progress.report`."""
        if stage != self.name:
            self.stage(stage, total or None)
        self.done, self.total = done, total or None
        self.shown()

    def note(self, text: str) -> None:
        """Keep a note; the same one is kept once."""
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

    def shown(self) -> None:
        """Called when ``name``, ``done`` or ``total`` changed."""

    def noted(self, text: str) -> None:
        """Called for every new note."""

    def ended(self) -> None:
        """Called when the running stage ends."""


class _EndsStage(AbstractContextManager[None]):
    """Ends whatever stage runs when the ``with`` block is left: library callbacks may have started further ones."""

    def __init__(self, progress: SilentProgress) -> None:
        self._progress = progress

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.finish()
