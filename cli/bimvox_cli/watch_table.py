"""The table of a watch on a terminal: every lift with its state, the last change, the latencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from bimvox.errors import listed
from bimvox.rendering.words import plain

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
    """A table of a watch that is updated in place.

    Args:
        console: The terminal.
        name: The watched file.
    """

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
        """Show a change.

        Args:
            document: The change.
            line: The change as one line.
        """
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
