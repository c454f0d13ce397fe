"""``bimvox sweep`` and ``bimvox plan`` of several sites."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError, FileError
from bimvox.files import default_output, reason_of, require_input, sha256_of
from bimvox.processes import processors
from bimvox.progress import Progress
from bimvox_pipeline.fleet.apart import begun_file
from bimvox_pipeline.fleet.backends import Backend
from bimvox_pipeline.fleet.page import write_page
from bimvox_pipeline.fleet.runs import Run, Wish, digest_of, runs_of
from bimvox_pipeline.fleet.schedule import carry_out_all
from bimvox_pipeline.fleet.sweep_file import load_sweep
from bimvox_pipeline.fleet.table import write_tables
from bimvox_pipeline.fleet.work import FAILED, RECORDS, log_file, record_file

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
