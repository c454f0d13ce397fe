"""The folder of an experiment: the names of its files, and reading them back.

::

    <folder>/experiment.json     settings and jobs
    <folder>/jobs/               one JSON file per job, with the network that it trained
    <folder>/results.json        all results
    <folder>/curves.csv          every test of every run
    <folder>/report.md           the report, with its pictures
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bimvox.errors import FileError
from bimvox.files import write_atomically
from bimvox.paper.experiment.jobs import Job
from bimvox.paper.experiment.results import ExperimentResults, results_of

MANIFEST = "experiment.json"
JOBS = "jobs"
RESULTS_FILE = "results.json"
CURVES_FILE = "curves.csv"
REPORT_FILE = "report.md"


def result_file(folder: Path, name: str) -> Path:
    """Return the file of a job's result; it exists once the job is done."""
    return folder / f"{name}.json"


def weights_file(folder: Path, name: str) -> Path:
    """Return the file of the network that a job trained."""
    return folder / f"{name}.safetensors"


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write a JSON file whole or not at all."""
    write_atomically(path, (json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n").encode())


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file of ours."""
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def load_results(folder: Path) -> ExperimentResults:
    """Read the results of an experiment so far.

    Raises:
        FileError: If the folder is not an experiment's.
    """
    manifest = folder / MANIFEST
    if not manifest.exists():
        raise FileError(manifest, "no such file", hint="name the folder that `bimvox experiment paper -o` wrote")
    plain = read_json(manifest)
    jobs = [Job(**job) for job in plain["jobs"]]
    files = {job.name: result_file(folder / JOBS, job.name) for job in jobs}
    return results_of(plain["settings"], jobs, {name: read_json(file) for name, file in files.items() if file.exists()})
