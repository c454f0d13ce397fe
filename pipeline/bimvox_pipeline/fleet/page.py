"""The page of a fleet: its table for people, with links to the files of its runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bimvox.files import write_atomically
from bimvox.rendering.report.many_plans import many_plans_page
from bimvox_pipeline.fleet.table import row_of

_FILE = "summary.html"
_LINKED = {"log": ".mcap", "page": ".html", "report": ".report.html", "report (PDF)": ".report.pdf"}
"""Files of a run that the page links to, by the end of their names: its log, and what commands make of it."""


def write_page(folder: Path, records: Sequence[dict[str, Any]]) -> Path:
    """Write the page of a fleet's records and return the file."""
    rows = [row_of(record) for record in records]
    files = {row["run"]: _files(folder, row["run"]) for row in rows if row["log"] is not None}
    write_atomically(folder / _FILE, many_plans_page(rows, files))
    return folder / _FILE


def _files(folder: Path, run: str) -> dict[str, str]:
    return {what: f"{run}{end}" for what, end in _LINKED.items() if (folder / f"{run}{end}").exists()}
