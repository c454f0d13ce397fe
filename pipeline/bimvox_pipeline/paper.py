"""``bimvox experiment paper``: run, draw, report."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import BimvoxError, FileError, InputError
from bimvox.extras import require
from bimvox.files import reason_of, write_atomically
from bimvox.paper.experiment.document import curves_csv, document_of
from bimvox.paper.experiment.jobs import ALL_MODES, Job, PaperSettings, default_settings, jobs_of, quick_settings
from bimvox.paper.experiment.pictures import pictures_of
from bimvox.paper.experiment.report import report_of
from bimvox.paper.experiment.results import ExperimentResults, results_of
from bimvox.processes import end_with
from bimvox.progress import Progress

if TYPE_CHECKING:
    from bimvox.paper.experiment.work import JobResult
    from bimvox.paper.policy.network import ValueNetwork


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

    ``seeds`` is the number of runs of everything, ``modes`` are of ``ALL_MODES``, ``processes`` is the number of jobs
    in parallel, and ``quick`` uses tiny budgets. Results of an earlier run in the folder are kept. Returns the document
    of ``bimvox experiment paper --json``.

    Raises:
        InputError: If the folder cannot be used.
        MissingPackageError: If torch, stable-baselines3 or matplotlib is not installed.
        BimvoxError: If a process was killed.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is not a folder", hint="name a folder with -o")
    require("train", "the experiment")
    require("plots", "the experiment")
    settings = (quick_settings if quick else default_settings)(seeds, modes)
    results = run_experiment(folder, settings=settings, processes=processes, progress=progress)
    progress.stage("draw")
    document = document_of(results)
    pictures = pictures_of(results, document)
    for name, data in pictures.items():
        write_atomically(folder / name, data)
    write_atomically(folder / _REPORT_FILE, report_of(document, pictures).encode())
    progress.finish()
    return {
        **document,
        "out": str(folder),
        "report": str(folder / _REPORT_FILE),
        "pictures": sorted(pictures),
        "seconds": progress.seconds,
    }


def run_experiment(
    folder: Path, *, settings: PaperSettings, processes: int = 2, progress: Progress
) -> ExperimentResults:
    """Run the missing jobs with these budgets and seeds, and write ``results.json`` and ``curves.csv``.

    Raises:
        FileError: If the folder cannot be written to.
        BimvoxError: If a process was killed.
    """
    try:
        (folder / _JOBS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(folder, f"cannot be made: {reason_of(error)}", hint="choose another -o") from error
    jobs = jobs_of(settings)
    _write_json(folder / MANIFEST, {"settings": settings.to_dict(), "jobs": [asdict(job) for job in jobs]})
    with progress.stage("paper", total=len(jobs)):
        run_jobs(jobs, folder / _JOBS, processes=processes, done=lambda _: progress.advance())
    results = load_results(folder)
    _write_json(folder / _RESULTS_FILE, document_of(results))
    write_atomically(folder / _CURVES_FILE, curves_csv(results).encode())
    return results


def run_jobs(jobs: Sequence[Job], folder: Path, *, processes: int, done: Callable[[Job], None]) -> None:
    """Do every job whose result is missing, after the jobs whose results it needs.

    The processes write the results as files, so finished jobs survive an interruption. Each process does one job after
    the other. Jobs share nothing, so results do not depend on which process does which.

    ``jobs`` come each after those that it needs; ``done`` is called for every finished job, earlier ones included.

    Raises:
        BimvoxError: If a process was killed.
    """
    there = {job.name for job in jobs if result_file(folder, job.name).exists()}
    for job in jobs:
        if job.name in there:
            done(job)
    waiting = [job for job in jobs if job.name not in there]
    if not waiting:
        return
    context = multiprocessing.get_context("spawn")
    before = set(multiprocessing.active_children())
    executor = ProcessPoolExecutor(processes, mp_context=context, initializer=_follow_the_parent)
    running: dict[Future[None], Job] = {}
    try:
        while waiting or running:
            for job in [job for job in waiting if set(job.needs.values()) <= there]:
                if len(running) >= processes:
                    break
                waiting.remove(job)
                running[executor.submit(_do_job, job, folder)] = job
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                job = running.pop(future)
                future.result()
                there.add(job.name)
                done(job)
    except BrokenProcessPool as error:
        raise BimvoxError(
            "a process of the experiment was killed, perhaps because memory ran out",
            hint="run the command again: finished results are kept",
        ) from error
    except BaseException:
        # Do not wait for jobs whose results are no longer needed.
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


def _follow_the_parent() -> None:
    """Leave Ctrl-C to the parent, which ends the processes; end if the parent was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with(os.getppid())


# One job in its process: from the files of the results that it needs to the file of its own.


def _do_job(job: Job, folder: Path) -> None:
    """Do a job whose needs are in the folder, and write its result there."""
    from bimvox.paper.experiment.work import result_of
    from bimvox.paper.policy.network import network_to_bytes

    checkpoint = folder / f"{job.name}.checkpoint.safetensors"

    def keep(network: ValueNetwork) -> None:
        write_atomically(checkpoint, network_to_bytes(network))

    wall, cpu = time.perf_counter(), time.process_time()
    result = result_of(job, {role: _read(folder, name) for role, name in job.needs.items()}, keep)
    if result.network is not None:
        write_atomically(_weights_file(folder, job.name), network_to_bytes(result.network))
    checkpoint.unlink(missing_ok=True)
    document = {
        "part": job.part,
        "mode": job.mode,
        "seed": job.seed,
        **result.document,
        "seconds": round(time.perf_counter() - wall, 3),
        "cpu_seconds": round(time.process_time() - cpu, 3),
    }
    _write_json(result_file(folder, job.name), document)


def _read(folder: Path, name: str) -> JobResult:
    from bimvox.paper.experiment.work import JobResult
    from bimvox.paper.policy.network import network_from_bytes

    weights = _weights_file(folder, name)
    network = network_from_bytes(weights.read_bytes()) if weights.exists() else None
    return JobResult(_read_json(result_file(folder, name)), network)


# The folder of an experiment.

MANIFEST = "experiment.json"  # settings and jobs
_JOBS = "jobs"  # a folder: one JSON file per job, with the network that it trained
_RESULTS_FILE = "results.json"
_CURVES_FILE = "curves.csv"  # every test of every run
_REPORT_FILE = "report.md"  # with its pictures


def result_file(folder: Path, name: str) -> Path:
    """Return the file of a job's result; it exists once the job is done."""
    return folder / f"{name}.json"


def _weights_file(folder: Path, name: str) -> Path:
    """Return the file of the network that a job trained."""
    return folder / f"{name}.safetensors"


def _write_json(path: Path, document: dict[str, Any]) -> None:
    write_atomically(path, (json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n").encode())


def _read_json(path: Path) -> dict[str, Any]:
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
    plain = _read_json(manifest)
    jobs = [Job(**job) for job in plain["jobs"]]
    files = {job.name: result_file(folder / _JOBS, job.name) for job in jobs}
    return results_of(
        plain["settings"], jobs, {name: _read_json(file) for name, file in files.items() if file.exists()}
    )
