"""``bimvox experiment paper``: run, draw, report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.files import write_atomically
from bimvox.paper.experiment.document import document_of
from bimvox.paper.experiment.jobs import ALL_MODES, default_settings, quick_settings
from bimvox.paper.experiment.pictures import pictures_of
from bimvox.paper.experiment.report import report_of
from bimvox.progress import Progress
from bimvox_pipeline.paper.experiment import run_experiment
from bimvox_pipeline.paper.folder import REPORT_FILE


def run_paper(
    folder: Path,
    *,
    seeds: int = 10,
    modes: tuple[str, ...] = ALL_MODES,
    processes: int = 2,
    quick: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Run the missing jobs of the paper's experiments, and write results, curves, pictures and the report.

    Args:
        folder: The output folder; created if missing. Results of an earlier run in it are kept.
        seeds: Number of runs of everything.
        modes: Of ``ALL_MODES``.
        processes: Number of jobs in parallel.
        quick: Use tiny budgets.
        progress: Receives every job.

    Returns:
        The document of ``bimvox experiment paper --json``: the results, and ``out, report, pictures, seconds``.

    Raises:
        InputError: If the folder cannot be used.
        BimvoxError: If a process was killed.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is not a folder", hint="name a folder with -o")
    settings = (quick_settings if quick else default_settings)(seeds, modes)
    results = run_experiment(folder, settings=settings, processes=processes, progress=progress)
    progress.stage("draw")
    document = document_of(results)
    pictures = pictures_of(results, document)
    for name, data in pictures.items():
        write_atomically(folder / name, data)
    write_atomically(folder / REPORT_FILE, report_of(document, pictures).encode())
    progress.finish()
    return {
        **document,
        "out": str(folder),
        "report": str(folder / REPORT_FILE),
        "pictures": sorted(pictures),
        "seconds": progress.seconds,
    }
