"""Executes runs in parallel, on any backend of joblib; those whose process or worker dies are tried again.

joblib starts the workers, gives them runs and says which are done. What no backend of it does is here: a run that dies
takes no other run with it (each worker has a process apart), and is tried again a bounded number of times.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal

from bimvox.errors import BimvoxError, FileError, InputError
from bimvox.files import reason_of
from bimvox.processes import ONE_THREAD, connection_of, end_with, processors, python_module, start_connected
from bimvox.progress import Progress
from bimvox_pipeline.fleet.runs import (
    FAILED,
    RECORDS,
    Run,
    Work,
    carry_out,
    digest_of,
    failed,
    planned,
    record_file,
    write_record,
)

Backend = Literal["loky", "ray", "dask"]


@dataclass(frozen=True, slots=True)
class Execution:
    """How the runs of a fleet are executed.

    Attributes:
        backend: ``loky`` for processes on this machine; ``ray`` or ``dask`` for a cluster.
        jobs: Number of runs in parallel; None: one per processor core.
        cluster: Address of a running cluster; None starts one on this machine.
        fresh: Whether runs that an earlier call has executed are executed again.
    """

    backend: Backend = "loky"
    jobs: int | None = None
    cluster: str | None = None
    fresh: bool = False


_RESTARTED = {"max_restarts": -1, "max_task_retries": 2}
"""Of the workers of Ray: one that dies is started again, and its run too; Dask does the same by itself."""


@contextmanager
def opened(backend: Backend, jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    """Open a backend, yield the arguments for ``joblib.parallel_config``, and close it at the end.

    Raises:
        InputError: If the backend is not installed, or its cluster cannot be reached.
    """
    with {"loky": _loky, "ray": _ray, "dask": _dask}[backend](jobs, address) as config:
        yield config


def _worker_lost(backend: Backend, error: BaseException) -> bool:
    """Return whether an error of a backend says that a worker died."""
    if backend == "loky":
        from joblib.externals.loky.process_executor import BrokenProcessPool

        return isinstance(error, BrokenProcessPool)
    if backend == "ray":
        from ray.exceptions import RayError

        return isinstance(error, RayError)
    from distributed import KilledWorker

    return isinstance(error, KilledWorker)


@contextmanager
def _loky(jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    if address is not None:
        raise InputError("processes of this machine have no --cluster", hint="add --backend ray or --backend dask")
    _start_workers("loky", jobs)
    yield {"backend": "loky", "n_jobs": jobs}


def _start_workers(backend: Backend, jobs: int) -> None:
    """Start the workers of an open backend, also after a lost one ended them all; clusters start their own."""
    from joblib import Parallel, delayed, parallel_config

    if backend == "loky":
        with _interrupts_held_back(), parallel_config(backend="loky", n_jobs=jobs):
            Parallel()(delayed(os.getpid)() for _ in range(jobs))  # joblib keeps the workers


@contextmanager
def _ray(jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    try:
        import ray
        from ray.util.joblib import register_ray
    except ImportError as error:
        raise _not_installed("ray", error) from error
    own: dict[str, Any] = {"include_dashboard": False} if address is None else {"address": address}
    if address is None:
        own["num_cpus"] = jobs
    try:
        ray.init(
            **own,
            log_to_driver=False,
            logging_level=logging.ERROR,
            configure_logging=True,
        )
    except Exception as error:
        raise _not_reached("ray", address, error) from error
    try:
        register_ray()
        yield {"backend": "ray", "n_jobs": jobs, "ray_remote_args": _RESTARTED}
    finally:
        ray.shutdown()


@contextmanager
def _dask(jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise _not_installed("dask", error) from error
    with dask.config.set({"distributed.logging.distributed": "critical"}):
        if address is not None:
            try:
                client = Client(address, timeout=20)
            except (OSError, ValueError, TimeoutError) as error:
                raise _not_reached("dask", address, error) from error
            with client:
                yield {"backend": "dask", "n_jobs": jobs}
            return
        with _interrupts_held_back():
            cluster = LocalCluster(
                n_workers=jobs,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
        with cluster, Client(cluster):
            yield {"backend": "dask", "n_jobs": jobs}


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Shield processes and threads started meanwhile from Ctrl-C, which a terminal sends to all of them.

    The command receives it, at the end of this context at the latest, and ends them.
    """
    if sys.platform == "win32":  # without masks of signals: a worker may print that it was interrupted
        yield
    else:
        resource_tracker.ensure_running()  # a later start would enable interrupts again
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _not_installed(backend: str, error: ImportError) -> InputError:
    return InputError(f"--backend {backend} is not installed ({error})", hint=f'pip install "bimvox[{backend}]"')


def _not_reached(backend: str, address: str | None, error: BaseException) -> InputError:
    where = f"the cluster at {address}" if address else "a cluster on this machine"
    first = (str(error).splitlines() or [type(error).__name__])[0]
    return InputError(f"--backend {backend}: {where} cannot be used: {first}", hint="check --cluster")


_WORKER_ENDED = "its worker ended"

_child: tuple[subprocess.Popen[bytes], Connection] | None = None
_one_at_a_time = threading.Lock()


def _carry_out_apart(work: Work, run: Run, folder: Path) -> bool:
    """Execute a run in this worker's separate process; return False if it died, then the mark of the run says how.

    Raises:
        FileError: If the run's record cannot be written, for example because the disk is full.
    """
    global _child
    mark = begun_file(folder, run.name)
    with _one_at_a_time:
        mark.write_text(_WORKER_ENDED, encoding="utf-8")
        if _child is None or _child[0].poll() is not None:
            _end_child()
            _child = _started()
        process, connection = _child
        try:
            connection.send((work, run, folder))
            failure: BimvoxError | None = connection.recv()
        except (EOFError, OSError):
            mark.write_text(f"its process ended ({_reason(process.wait())})", encoding="utf-8")
            return False
        except BaseException:
            _end_child()
            raise
        if failure is not None:
            raise failure
        return True


def begun_file(folder: Path, name: str) -> Path:
    """Return the path of the mark of a run that has begun; it contains how the run ends if it writes no record."""
    return folder / RECORDS / f"{name}.begun"


def _end_child() -> None:
    """End this worker's separate process, if there is one."""
    global _child
    if _child is not None:
        process, connection = _child
        process.kill()
        process.wait()
        connection.close()
        _child = None


def _started() -> tuple[subprocess.Popen[bytes], Connection]:
    path = os.pathsep.join(name for name in sys.path if name)
    with open(2, "wb", closefd=False) as errors:
        return start_connected(python_module(__name__), "", errors, os.environ | ONE_THREAD | {"PYTHONPATH": path})


def _reason(code: int) -> str:
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def _serve(connection: Connection) -> None:
    """Execute the runs that arrive, until the connection is closed or the worker has ended."""
    while True:
        work, run, folder = connection.recv()
        failure: BimvoxError | None = None
        try:
            carry_out(work, run, folder)
        except BimvoxError as error:
            failure = error
        connection.send(failure)


if __name__ == "__main__":
    end_with(os.getppid())
    with suppress(EOFError, OSError), connection_of(int(sys.argv[1])) as own_end:
        _serve(own_end)


_LOCK, _PART = ".fleet.lock", ".bimvox-*.part"
_ALONE = (False, False, True)
"""By try, whether a run is executed alone: at last, no other run takes its memory or ends its worker."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a fleet's folder for this process, and delete files that a killed process left incomplete.

    Raises:
        FileError: If the folder cannot be used, or another fleet is writing to it.
    """
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


def records_of(
    runs: Sequence[Run],
    folder: Path,
    execution: Execution,
    *,
    is_whole: Callable[[Mapping[str, Any]], bool],
    work: Work = planned,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Return the records of runs, in their order; a run that an earlier call has executed is kept.

    The folder is locked. ``is_whole`` says of the record of an earlier call whether what that run wrote next to it is
    still there; ``work`` executes a run. A record has ``kept``, whether it is of an earlier call.

    Raises:
        InputError: If the backend cannot be used.
    """
    progress.stage("look", len(runs))
    kept = set()
    for run in runs:
        if not execution.fresh and _is_kept(run, folder, is_whole):
            kept.add(run.name)
        else:
            record_file(folder, run.name).unlink(missing_ok=True)
        progress.advance()
    progress.finish()
    carry_out_all([run for run in runs if run.name not in kept], folder, execution, work=work, progress=progress)
    records = [json.loads(record_file(folder, run.name).read_bytes()) for run in runs]
    return [{**record, "kept": record["run"] in kept} for record in records]


def _is_kept(run: Run, folder: Path, is_whole: Callable[[Mapping[str, Any]], bool]) -> bool:
    """Return whether an earlier call executed this same run, and its result is unchanged since."""
    try:
        record = json.loads(record_file(folder, run.name).read_bytes())
        return bool(record["status"] != FAILED and record["inputs"] == digest_of(run.wish) and is_whole(record))
    except (OSError, ValueError, KeyError, TypeError, BimvoxError):
        return False  # no record, a changed record or a missing input: the run itself reports which


def carry_out_all(
    runs: Sequence[Run], folder: Path, execution: Execution, *, work: Work = planned, progress: Progress
) -> None:
    """Execute runs until each has a record.

    Runs that train a policy come first, so that the others find it in the store. A run whose process or worker dies is
    tried again, at last alone; then it is recorded as failed. The arguments are those of :func:`records_of`; workers
    must reach the folder under this path.

    Raises:
        InputError: If the backend cannot be used.
    """
    from joblib import parallel_config

    if not runs:
        return
    jobs = execution.jobs or processors()
    left, fleet = list(runs), _Fleet(folder, execution.backend, jobs, work, progress)
    progress.stage("runs", len(runs))
    try:
        with opened(execution.backend, jobs, execution.cluster) as config, parallel_config(**config):
            for is_alone in _ALONE:
                parts = [[run] for run in left] if is_alone else [left]
                left = [run for part in parts for run in fleet.begun_in_vain(part)]
                for run in left:
                    progress.note(f"{run.name}: {fleet.why(run)} before it was done")
    finally:
        _end_child()
        progress.finish()
    for run in left:
        why = f"{fleet.why(run)} before it was done, {len(_ALONE)} times: out of memory, or a crash"
        write_record(folder, failed(run, "died", why, "try it alone with bimvox plan, with more memory"))
    for run in runs:
        begun_file(folder, run.name).unlink(missing_ok=True)


@dataclass(frozen=True, slots=True)
class _Fleet:
    """An open backend and what its workers execute."""

    folder: Path
    backend: Backend
    jobs: int
    work: Work
    progress: Progress

    def begun_in_vain(self, runs: Sequence[Run]) -> list[Run]:
        """Execute runs, and return those that began and have no record in the end.

        If a lost worker ends all workers, new ones execute the runs that have not begun.
        """
        for run in runs:
            begun_file(self.folder, run.name).unlink(missing_ok=True)
        waiting = list(runs)
        while waiting:
            lost = self._executed(waiting)
            left = [run for run in waiting if not self._has_begun(run)]
            if lost is None:
                break
            if len(left) == len(waiting):
                raise lost
            _start_workers(self.backend, self.jobs)
            waiting = left
        return [run for run in runs if not record_file(self.folder, run.name).exists()]

    def why(self, run: Run) -> str:
        """Return how a run ended that has no record."""
        return begun_file(self.folder, run.name).read_text(encoding="utf-8")

    def _has_begun(self, run: Run) -> bool:
        return record_file(self.folder, run.name).exists() or begun_file(self.folder, run.name).exists()

    def _executed(self, runs: Sequence[Run]) -> Exception | None:
        """Execute runs until the end, or until a lost worker ends all workers; that error is returned."""
        from joblib import Parallel, delayed

        parallel = Parallel(batch_size=1, return_as="generator_unordered")
        try:
            for part in ([run for run in runs if run.leads], [run for run in runs if not run.leads]):
                with closing(parallel(delayed(_carry_out_apart)(self.work, run, self.folder) for run in part)) as done:
                    for is_recorded in done:
                        if is_recorded:
                            self.progress.advance()
        except Exception as error:
            if _worker_lost(self.backend, error):
                return error
            raise
        return None
