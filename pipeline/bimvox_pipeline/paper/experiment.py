"""Running the whole experiment."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from bimvox.errors import FileError
from bimvox.files import reason_of, write_atomically
from bimvox.paper.experiment.document import curves_csv, document_of
from bimvox.paper.experiment.jobs import Job, jobs_of
from bimvox.paper.experiment.results import ExperimentResults
from bimvox.paper.experiment.settings import PaperSettings
from bimvox.progress import Progress
from bimvox_pipeline.paper.folder import CURVES_FILE, JOBS, MANIFEST, RESULTS_FILE, load_results, write_json
from bimvox_pipeline.paper.scheduler import run_jobs


def run_experiment(
    folder: Path, *, settings: PaperSettings, processes: int = 2, progress: Progress
) -> ExperimentResults:
    """Run the missing jobs, and write ``results.json`` and ``curves.csv``.

    Args:
        folder: Where to; created if missing. Results of an earlier run are kept.
        settings: Of the experiment.
        processes: Number of jobs in parallel.
        progress: Told of every job.

    Raises:
        FileError: The folder cannot be written to.
        BimvoxError: A process was killed.
    """
    try:
        (folder / JOBS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(folder, f"cannot be made: {reason_of(error)}", hint="choose another -o") from error
    jobs = jobs_of(settings)
    write_json(folder / MANIFEST, {"settings": settings.to_dict(), "jobs": [asdict(job) for job in jobs]})

    def done(job: Job) -> None:
        progress.advance()

    with progress.stage("paper", total=len(jobs)):
        run_jobs(jobs, folder / JOBS, processes=processes, done=done)
    results = load_results(folder)
    write_json(folder / RESULTS_FILE, document_of(results))
    write_atomically(folder / CURVES_FILE, curves_csv(results).encode())
    return results
