"""Executes runs in parallel, on any backend."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from bimvox.progress import Progress
from bimvox_pipeline.fleet.apart import Work, carry_out_apart, end_child
from bimvox_pipeline.fleet.backends import Backend, opened
from bimvox_pipeline.fleet.runs import Run
from bimvox_pipeline.fleet.work import carry_out, record_file

_LOOK_EVERY_S = 0.3


def carry_out_all(
    runs: Sequence[Run],
    folder: Path,
    *,
    backend: Backend,
    jobs: int,
    address: str | None,
    progress: Progress,
    work: Work = carry_out,
) -> None:
    """Execute runs until each has a record.

    Runs that train a policy come first, so that the others find it in the store.

    Args:
        runs: The runs.
        folder: The fleet's folder; workers must reach it under this path.
        backend: Name of the backend.
        jobs: Number of runs in parallel.
        address: Address of a running cluster, or None.
        progress: Receives the number of records.
        work: The function that executes a run.

    Raises:
        InputError: If the backend cannot be used.
    """
    from joblib import Parallel, delayed, parallel_config

    if not runs:
        return
    try:
        with opened(backend, jobs, address) as config, _followed(runs, folder, progress), parallel_config(**config):
            for part in ([run for run in runs if run.leads], [run for run in runs if not run.leads]):
                Parallel(batch_size=1)(delayed(carry_out_apart)(work, run, folder) for run in part)
    finally:
        end_child()


@contextmanager
def _followed(runs: Sequence[Run], folder: Path, progress: Progress) -> Iterator[None]:
    """Report the number of records by polling the folder, which works for every backend."""
    done = threading.Event()

    def look() -> None:
        while not done.wait(_LOOK_EVERY_S):
            progress.report("runs", sum(record_file(folder, run.name).exists() for run in runs), len(runs))

    progress.stage("runs", len(runs))
    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        progress.finish()
