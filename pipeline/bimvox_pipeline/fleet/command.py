"""``bimvox sweep`` and ``bimvox plan`` of several sites."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bimvox.exporters.text import table
from bimvox.files import default_output, require_input, sha256_of, write_atomically
from bimvox.progress import Progress
from bimvox.rendering.report.many_sites import many_plans_page
from bimvox_pipeline.fleet.runs import FAILED, Wish, load_sweep, log_file, runs_of
from bimvox_pipeline.fleet.schedule import Execution, locked, records_of


def sweep(
    file: Path, out: Path | None = None, *, execution: Execution | None = None, progress: Progress
) -> dict[str, Any]:
    """Plan everything that a sweep file requests, and return the document of ``bimvox sweep --json``.

    ``out`` is the folder of logs, records and table; default: the file's name with ``-runs``, in the current folder.
    The other arguments are those of :func:`fleet`.

    Raises:
        InputError: If the sweep file or the folder cannot be used, or the backend is not installed.
    """
    require_input(file)
    return fleet(load_sweep(file), out or default_output(file, "-runs"), execution=execution, progress=progress)


def fleet(
    wishes: Sequence[Wish], folder: Path, *, execution: Execution | None = None, progress: Progress
) -> dict[str, Any]:
    """Plan many wishes into a folder; continues an interrupted call.

    A run is not planned again if the hash of its inputs and its log match its record. Failed runs are planned again.

    By default, the runs are executed in processes on this machine. Returns the document of ``bimvox sweep --json``:
    ``runs`` (a record each), ``table``, ``tables`` and ``page`` (files), ``failed`` (number of runs), ``infeasible``
    (number of lifts), ``verified``, ``kept`` (runs that existed already), ``seconds``.

    Raises:
        InputError: If the folder cannot be used, another fleet is writing to it, or the backend is not installed.
    """

    def is_whole(record: Mapping[str, Any]) -> bool:
        return bool(record["log_sha256"] == sha256_of(log_file(folder, record["run"])))

    with locked(folder):
        runs = runs_of(wishes)
        records = records_of(runs, folder, execution or Execution(), is_whole=is_whole, progress=progress)
        progress.stage("table")
        tables, page = write_tables(folder, records), write_page(folder, records)
        progress.finish()
    lost = sum(record["status"] == FAILED for record in records)
    return {
        "runs": records,
        "folder": str(folder),
        "table": str(tables[0]),
        "tables": [str(table) for table in tables],
        "page": str(page),
        "failed": lost,
        "infeasible": sum(record.get("infeasible", 0) for record in records),
        "verified": not lost and all(record["verified"] for record in records),
        "kept": sum(record["kept"] for record in records),
        "seconds": progress.seconds,
    }


# The page of a fleet: its table for people, with links to the files of its runs.

_FILE = "summary.html"
_LINKED = {"log": ".mcap", "page": ".html", "report": ".report.html", "report (PDF)": ".report.pdf"}
"""Files of a run that the page links to, by the end of their names: its log, and what commands make of it."""


def write_page(folder: Path, records: Sequence[dict[str, Any]]) -> Path:
    """Write the page of a fleet's records and return the file."""
    rows = [_row_of(record) for record in records]
    files = {row["run"]: _files(folder, row["run"]) for row in rows if row["log"] is not None}
    write_atomically(folder / _FILE, many_plans_page(rows, files))
    return folder / _FILE


def _files(folder: Path, run: str) -> dict[str, str]:
    return {what: f"{run}{end}" for what, end in _LINKED.items() if (folder / f"{run}{end}").exists()}


# The summary table of a fleet: one row per run, with the same bytes for every backend.

COLUMNS: dict[str, type] = {
    "run": str,
    "site": str,
    "obstructions": str,
    "seed": int,
    "status": str,
    "error": str,
    "verified": bool,
    "lifts": int,
    "planned": int,
    "infeasible": int,
    "policy": str,
    "policy_share": float,
    "retrained_share": float,
    "search_share": float,
    "moves": int,
    "shortest_moves": int,
    "moves_over_shortest": float,
    "crane_hours": float,
    "loaded_hours": float,
    "hook_travel_m": float,
    "critical_lifts": int,
    "remarks": int,
    "serious_remarks": int,
    "log": str,
    "log_sha256": str,
}
"""Columns and their contents. There are no computation times: the same inputs give the same table."""

_CSV_FILE, _PARQUET_FILE = "summary.csv", "summary.parquet"


def write_tables(folder: Path, records: Sequence[dict[str, Any]]) -> list[Path]:
    """Write the table as CSV, and as Parquet if pyarrow is installed; return the files."""
    rows = [_row_of(record) for record in records]
    files = {_CSV_FILE: _as_csv(rows)}
    try:
        files[_PARQUET_FILE] = _as_parquet(rows)
    except ImportError:
        # The extra is not installed. The table of an earlier sweep must not remain next to a newer one.
        (folder / _PARQUET_FILE).unlink(missing_ok=True)
    for name, data in files.items():
        write_atomically(folder / name, data)
    return [folder / name for name in files]


def _row_of(record: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a run; unknown values are None."""
    figures, error = record.get("figures") or {}, record["error"]
    shares = {f"{method}_share": share for method, share in figures.get("shares", {}).items()}
    known = record | figures | shares | {"error": f"{error['code']}: {error['message']}" if error else None}
    return {name: known.get(name) for name in COLUMNS}


def _as_csv(rows: Sequence[dict[str, Any]]) -> bytes:
    cells = ([str(value).lower() if isinstance(value, bool) else value for value in row.values()] for row in rows)
    return table(COLUMNS, cells).encode()


def _as_parquet(rows: Sequence[dict[str, Any]]) -> bytes:
    import pyarrow
    from pyarrow import parquet

    kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_()}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in COLUMNS.items()])
    out = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(list(rows), schema=schema), out)
    return out.getvalue()
