"""Running the missing jobs of an experiment, each in a process."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from bimvox.errors import BimvoxError
from bimvox.paper.experiment.jobs import Job
from bimvox.processes import end_with
from bimvox_pipeline.paper.folder import result_file
from bimvox_pipeline.paper.work import do_job


def run_jobs(jobs: Sequence[Job], folder: Path, *, processes: int, done: Callable[[Job], None]) -> None:
    """Do every job whose result is missing, after the jobs whose results it needs.

    The processes write the results as files, so finished jobs survive an interruption. Each process does one job after
    the other. Jobs share nothing, so results do not depend on which process does which.

    Args:
        jobs: The jobs, each after those that it needs.
        folder: The folder of the results.
        processes: Number of jobs in parallel.
        done: Called for every finished job, earlier ones included.

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
                running[executor.submit(do_job, job, folder)] = job
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
