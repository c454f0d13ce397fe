"""Running the whole experiment."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from bimvox.errors import FileError
from bimvox.files import reason_of, write_atomically
from bimvox.progress import Progress
from bimvox_pipeline.paper.document import curves_csv, document_of
from bimvox_pipeline.paper.jobs import Job, jobs_of
from bimvox_pipeline.paper.results import JOBS, MANIFEST, ExperimentResults, load_results
from bimvox_pipeline.paper.scheduler import run_jobs
from bimvox_pipeline.paper.settings import PaperSettings, default_settings
from bimvox_pipeline.paper.work import write_json

RESULTS_FILE = "results.json"
CURVES_FILE = "curves.csv"


def run_experiment(
    folder: Path, *, settings: PaperSettings | None = None, processes: int = 2, progress: Progress
) -> ExperimentResults:
    """Run what is not there yet, and write ``results.json`` and ``curves.csv``.

    ::

        <folder>/experiment.json     settings and jobs
        <folder>/jobs/               one JSON file a job, the networks beside them
        <folder>/results.json        everything that the experiment came to
        <folder>/curves.csv          every test of every run

    Args:
        folder: Where to; made where it is missing. What an earlier run finished there is kept.
        settings: The experiment; None takes the whole one.
        processes: How many at a time.
        progress: Told of every job.

    Raises:
        FileError: The folder cannot be written to.
        BimvoxError: A process was killed.
    """
    settings = default_settings() if settings is None else settings
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
    write_results(results, folder)
    return results


def write_results(results: ExperimentResults, folder: Path) -> None:
    """Write ``results.json`` and ``curves.csv``."""
    write_json(folder / RESULTS_FILE, document_of(results))
    write_atomically(folder / CURVES_FILE, curves_csv(results).encode())
