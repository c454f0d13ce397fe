"""What moves on a terminal: the line of progress, which disappears at the end, and the table of a watch.

Elsewhere progress is a plain line now and then.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, ProgressColumn, SpinnerColumn, Task, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

from bimvox.errors import listed
from bimvox.progress import SilentProgress
from bimvox.rendering.words import plain

_PLAIN_LINE_EVERY_S = 10.0
_PACE_S = 3.0
"""From then on the pace of a stage tells how long it will take."""


class LiveProgress(SilentProgress):
    """Shows the running stage on stderr; if verbose, also every stage, when it ends, with its time."""

    def __init__(self, console: Console, *, verbose: bool = False) -> None:
        super().__init__()
        self._verbose = verbose
        self._console = console
        self._animated = console.is_terminal and not console.is_dumb_terminal
        self._last_line = time.monotonic()
        self._bars: Bars | None = None
        self._task = TaskID(0)
        self._kernels = 0
        self.held: list[str] | None = None
        """Notes that are not printed for now; None: each is printed as it comes."""

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
        if self.held is not None:
            self.held.append(text)
        else:
            self._console.print(f"note: {plain(text)}")

    def released(self) -> None:
        """Print the notes that were held."""
        notes, self.held = self.held or (), None
        for text in notes:
            self.noted(text)

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


# The table of a watch: every lift with its state, the last change, the latencies.

_STATES = {
    "infeasible": ("infeasible", "red"),
    "pending": ("being planned", "yellow"),
    "replanned": ("new path", "green"),
    "retimed": ("new motion", "cyan"),
    "kept": ("unchanged", "dim"),
}
_UNBUILT, _HANGS = "unbuilt", ("in_transit", "arrived")
_ROWS_LEFT_FREE = 8
_LATENCIES_KEPT = 200


class WatchTable:
    """The table of a watch of the file ``name``, updated in place."""

    def __init__(self, console: Console, name: str) -> None:
        self._console, self._name = console, name
        self._latencies_ms: list[float] = []
        self._reasons: dict[str, str] = {}
        self._doing: dict[str, str] = {}
        self._last: Mapping[str, Any] | None = None
        self._lines = ["", ""]
        self._live = Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False)
        self._live.start()

    def show(self, document: Mapping[str, Any], line: str) -> None:
        """Show a change, given as a document and as one line."""
        if document["event"] == "state":
            self._doing[document["component"]] = document["state"]
            self._lines[1] = line
        else:
            self._last, self._lines[0] = document, line
            if document["event"] in ("replanned", "continued"):
                self._latencies_ms = [*self._latencies_ms, float(document["latency_ms"])][-_LATENCIES_KEPT:]
            if "blocked" in document:
                self._reasons = {
                    entry["component"]: listed([entry["reason"], *entry["blocked_by_names"]])
                    for entry in document["blocked"]
                }
        if self._last is not None:
            self._live.update(Group(self._table(self._last), Text(self._footer())), refresh=True)

    def close(self) -> None:
        """Leave the last table on the terminal."""
        self._live.stop()

    def _table(self, document: Mapping[str, Any]) -> Table:
        states = states_of(document)
        room = max(3, self._console.height - _ROWS_LEFT_FREE)
        table = Table(title=f"{self._name}, revision {document['revision']}", title_justify="left", expand=True)
        table.add_column("lift", no_wrap=True)
        table.add_column("state", no_wrap=True)
        if self._doing:
            table.add_column("part", no_wrap=True)
        table.add_column("why", overflow="ellipsis", no_wrap=True, ratio=1)
        order = list(_STATES)
        shown = sorted(states, key=lambda name: (name not in self._on_the_hook, order.index(states[name])))
        for name in shown[:room]:
            text, style = _STATES[states[name]]
            doing = [self._doing.get(name, _UNBUILT)] if self._doing else []
            table.add_row(plain(name), Text(plain(text), style=style), *doing, plain(self._reasons.get(name, "")))
        if len(shown) > room:
            table.add_row(f"and {len(shown) - room:,} more")
        return table

    @property
    def _on_the_hook(self) -> set[str]:
        return {name for name, state in self._doing.items() if state in _HANGS}

    def _footer(self) -> str:
        line = "\n".join(filter(None, self._lines))
        if not self._latencies_ms:
            return line
        ordered = sorted(self._latencies_ms)
        middle, high = ordered[len(ordered) // 2], ordered[int(0.95 * (len(ordered) - 1))]
        return (
            f"{line}\nlatency: median {middle:.0f} ms, 95 % below {high:.0f} ms ({len(ordered)} changes); Ctrl-C ends"
        )


def states_of(document: Mapping[str, Any]) -> dict[str, str]:
    """Return the state of every lift by id; if a lift is in several lists, the first of ``_STATES`` counts."""
    states: dict[str, str] = {}
    for state in reversed(_STATES):
        for name in document.get(state, ()):
            states[name] = state
    return states
