"""Running the whole experiment."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from bimvox.errors import FileError
from bimvox.files import reason_of, write_atomically
from bimvox.paper.experiment.document import curves_csv, document_of
from bimvox.paper.experiment.jobs import PaperSettings, jobs_of
from bimvox.paper.experiment.results import ExperimentResults
from bimvox.progress import Progress
from bimvox_pipeline.paper.folder import CURVES_FILE, JOBS, MANIFEST, RESULTS_FILE, load_results, write_json
from bimvox_pipeline.paper.scheduler import run_jobs


def run_experiment(
    folder: Path, *, settings: PaperSettings, processes: int = 2, progress: Progress
) -> ExperimentResults:
    """Run the missing jobs, and write ``results.json`` and ``curves.csv``.

    Args:
        folder: The output folder; created if missing. Results of an earlier run in it are kept.
        settings: The budgets and seeds of the experiment.
        processes: Number of jobs in parallel.
        progress: Receives every job.

    Raises:
        FileError: If the folder cannot be written to.
        BimvoxError: If a process was killed.
    """
    try:
        (folder / JOBS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(folder, f"cannot be made: {reason_of(error)}", hint="choose another -o") from error
    jobs = jobs_of(settings)
    write_json(folder / MANIFEST, {"settings": settings.to_dict(), "jobs": [asdict(job) for job in jobs]})
    with progress.stage("paper", total=len(jobs)):
        run_jobs(jobs, folder / JOBS, processes=processes, done=lambda _: progress.advance())
    results = load_results(folder)
    write_json(folder / RESULTS_FILE, document_of(results))
    write_atomically(folder / CURVES_FILE, curves_csv(results).encode())
    return results
