"""``bimvox sweep`` and ``bimvox plan`` of several sites."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError, FileError
from bimvox.files import default_output, reason_of, require_input, sha256_of, write_atomically
from bimvox.processes import processors
from bimvox.progress import Progress
from bimvox.rendering.report.many_sites import many_plans_page
from bimvox_pipeline.fleet.runs import FAILED, RECORDS, Run, Wish, digest_of, load_sweep, log_file, record_file, runs_of
from bimvox_pipeline.fleet.schedule import Backend, begun_file, carry_out_all

_LOCK, _PART = ".fleet.lock", ".bimvox-*.part"


def sweep(
    file: Path,
    out: Path | None = None,
    *,
    backend: Backend = "loky",
    jobs: int | None = None,
    cluster: str | None = None,
    fresh: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Plan everything that a sweep file requests, and return the document of ``bimvox sweep --json``.

    ``out`` is the folder of logs, records and table; default: the file's name with ``-runs``, in the current folder.
    The other arguments are those of :func:`fleet`.

    Raises:
        InputError: If the sweep file or the folder cannot be used, or the backend is not installed.
    """
    require_input(file)
    wishes = load_sweep(file)
    folder = out or default_output(file, "-runs")
    return fleet(wishes, folder, backend=backend, jobs=jobs, cluster=cluster, fresh=fresh, progress=progress)


def fleet(
    wishes: Sequence[Wish],
    folder: Path,
    *,
    backend: Backend = "loky",
    jobs: int | None = None,
    cluster: str | None = None,
    fresh: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Plan many wishes into a folder; continues an interrupted call.

    A run is not planned again if the hash of its inputs and its log match its record. Failed runs are planned again.

    Args:
        wishes: The runs to plan.
        folder: The output folder; created if it does not exist.
        backend: Name of the backend that executes the runs.
        jobs: Number of runs in parallel; default: one per processor core.
        cluster: Address of a running cluster; default: starts one on this machine.
        fresh: Plan again the runs that exist already.
        progress: Receives the stages.

    Returns:
        ``runs`` (a record each), ``table``, ``tables`` and ``page`` (files), ``failed`` (number of runs),
        ``infeasible`` (number of lifts), ``verified``, ``kept`` (runs that existed already), ``seconds``.

    Raises:
        InputError: If the folder cannot be used, another fleet is writing to it, or the backend is not installed.
    """
    runs = runs_of(wishes)
    with locked(folder):
        progress.stage("look", len(runs))
        kept = set()
        for run in runs:
            if not fresh and _is_there(run, folder):
                kept.add(run.name)
            else:
                record_file(folder, run.name).unlink(missing_ok=True)
            progress.advance()
        progress.finish()
        carry_out_all(
            [run for run in runs if run.name not in kept],
            folder,
            backend=backend,
            jobs=jobs or processors(),
            address=cluster,
            progress=progress,
        )
        records = [json.loads(record_file(folder, run.name).read_bytes()) for run in runs]
        progress.stage("table")
        tables, page = write_tables(folder, records), write_page(folder, records)
        progress.finish()
    for record in records:
        record["kept"] = record["run"] in kept
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
        "kept": len(kept),
        "seconds": progress.seconds,
    }


def _is_there(run: Run, folder: Path) -> bool:
    """Return whether an earlier call executed this same run, and its log is unchanged since."""
    file, log = record_file(folder, run.name), log_file(folder, run.name)
    if not (file.exists() and log.exists()):
        return False
    try:
        record = json.loads(file.read_bytes())
        return bool(
            record["status"] != FAILED
            and record["inputs"] == digest_of(run.wish)
            and record["log_sha256"] == sha256_of(log)
        )
    except (ValueError, KeyError, TypeError, BimvoxError):
        return False  # a changed record or a missing input: the run itself reports which


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a fleet's folder for this process, and delete files that a killed process left incomplete."""
    from filelock import FileLock, Timeout

    lock = FileLock(folder / _LOCK, timeout=0)
    try:
        (folder / RECORDS).mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout as error:
        raise FileError(
            folder, "another bimvox is planning into this folder", hint="wait for it, or choose another -o"
        ) from error
    except OSError as error:
        raise FileError(folder, f"cannot be used: {reason_of(error)}", hint="choose another -o") from error
    with lock:
        records = folder / RECORDS
        for left in (*folder.glob(_PART), *records.glob(_PART), *records.glob(begun_file(records, "*").name)):
            left.unlink(missing_ok=True)
        yield


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
    text = io.StringIO()
    writer = csv.DictWriter(text, list(COLUMNS), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: str(value).lower() if isinstance(value, bool) else value for name, value in row.items()})
    return text.getvalue().encode()


def _as_parquet(rows: Sequence[dict[str, Any]]) -> bytes:
    import pyarrow
    from pyarrow import parquet

    kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_()}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in COLUMNS.items()])
    out = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(list(rows), schema=schema), out)
    return out.getvalue()
