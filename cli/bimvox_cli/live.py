"""Progress on a terminal: one line that disappears at the end. Otherwise: a plain line now and then."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, SpinnerColumn, Task, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars
from rich.text import Text

from bimvox.progress import SilentProgress
from bimvox.rendering.words import plain

_PLAIN_LINE_EVERY_S = 10.0
_PACE_S = 3.0
"""From then on the pace of a stage tells how long it will take."""


class LiveProgress(SilentProgress):
    """Shows the running stage on stderr.

    Args:
        console: The console of stderr.
        verbose: Print every stage, when it ends, with its time.
    """

    def __init__(self, console: Console, *, verbose: bool = False) -> None:
        super().__init__()
        self._verbose = verbose
        self._console = console
        self._animated = console.is_terminal and not console.is_dumb_terminal
        self._last_line = time.monotonic()
        self._bars: Bars | None = None
        self._task = TaskID(0)
        self._kernels = 0

    def compiling(self, begun: int, now: bool) -> None:
        """Say that kernels are compiled, which takes long and happens once, and how many; see `bimvox.progress`."""
        first, self._kernels = now and begun == 1, begun if now else 0
        if self._bars is not None:
            self._bars.update(self._task, description=self._words())
        elif now and not self._animated:
            self._plain_line(at_once=first)

    def shown(self) -> None:
        """Move the bar, or print a plain line if none was printed for a while."""
        if self._animated:
            if self._bars is None:
                self._bars = _bars_on(self._console)
                self._task = self._bars.add_task(self._words(), total=self.total)
                self._bars.start()
            self._bars.update(
                self._task, description=self._words() + self._left(), completed=self.done, total=self.total
            )
        elif self.done != self.total:
            self._plain_line()

    def _words(self) -> str:
        once = f"compiling, once: {self._kernels}" if self._kernels else ""
        return ", ".join(filter(None, [self.name, once]))

    def _left(self) -> str:
        """Return how long the running stage will take from now, at its pace so far; empty if it cannot be told."""
        taken_s = self.running_s
        if not self.total or not self.done or self._kernels or taken_s < _PACE_S:
            return ""
        left_s = taken_s * (self.total - self.done) / self.done
        return f", about {_rounded(left_s)} left" if left_s >= 1.0 else ""

    def _plain_line(self, *, at_once: bool = False) -> None:
        if not at_once and time.monotonic() - self._last_line < _PLAIN_LINE_EVERY_S:
            return
        self._last_line = time.monotonic()
        of = f" of {self.total:,}" if self.total else ""
        done = f": {self.done:,}{of}{self._left()}" if self.done and not self._kernels else ""
        self._console.print(f"{self._words()}{done or ' ...'}")

    def noted(self, text: str) -> None:
        """Print a note, above the bar if there is one."""
        self._console.print(f"note: {plain(text)}")

    def ended(self) -> None:
        """Remove the bar; if verbose, print the stage with its time."""
        if self._bars is not None:
            self._bars.stop()
            self._bars = None
        if self._verbose:
            self._console.print(f"{self.name}: {self.running_s:.1f} s")


def _rounded(seconds: float) -> str:
    """Return a time with the digits that an estimate deserves."""
    if seconds < 60.0:
        return f"{max(5 * round(seconds / 5.0), 1):.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


class _Counted(ProgressColumn):
    """How much is done, and of how much if that is known; nothing as long as nothing can be counted."""

    def render(self, task: Task) -> Text:
        """Return the text of the column."""
        of = "" if task.total is None else f" of {task.total:,.0f}"
        return Text(f"{task.completed:,.0f}{of}" if task.completed or of else "", style="progress.download")


def _bars_on(console: Console) -> Bars:
    """Return a bar that does not touch stdout, which may be a pipe for data."""
    return Bars(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
        _Counted(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        redirect_stdout=False,
    )
