"""Executes runs in parallel, on any backend; those whose process or worker dies are tried again."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, Literal

from bimvox.errors import BimvoxError, InputError
from bimvox.processes import ONE_THREAD, end_with, python_module
from bimvox.progress import Progress
from bimvox_pipeline.fleet.runs import RECORDS, Run, carry_out, failed, record_file, write_record

Backend = Literal["loky", "ray", "dask"]

_RESTARTED = {"max_restarts": -1, "max_task_retries": 2}
"""Of the workers of Ray: one that dies is started again, and its run too; Dask does the same by itself."""


@contextmanager
def opened(backend: Backend, jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    """Open a backend and close it at the end.

    Args:
        backend: ``loky`` for processes on this machine; ``ray`` or ``dask`` for a cluster.
        jobs: Number of runs in parallel.
        address: Address of a running cluster; None starts one on this machine.

    Yields:
        The arguments for ``joblib.parallel_config``.

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


Work = Callable[[Run, Path], None]

_WORKER_ENDED = "its worker ended"

_child: subprocess.Popen[bytes] | None = None
_one_at_a_time = threading.Lock()


def _carry_out_apart(work: Work, run: Run, folder: Path) -> None:
    """Execute a run with ``work``, a module-level function, in this worker's separate process.

    If the process dies, the mark of the run says how.

    Raises:
        FileError: If the run's record cannot be written, for example because the disk is full.
    """
    global _child
    mark = begun_file(folder, run.name)
    with _one_at_a_time:
        mark.write_text(_WORKER_ENDED, encoding="utf-8")
        if _child is None or _child.poll() is not None:
            _child = _started()
        child = _child
        assert child.stdin is not None
        assert child.stdout is not None
        try:
            pickle.dump((work, run, folder), child.stdin)
            child.stdin.flush()
            failure = pickle.load(child.stdout)  # from our own process
        except (BrokenPipeError, EOFError, pickle.UnpicklingError):
            mark.write_text(f"its process ended ({_reason(child.wait())})", encoding="utf-8")
            return
        except BaseException:
            _end_child()
            raise
        if failure is not None:
            raise failure


def begun_file(folder: Path, name: str) -> Path:
    """Return the path of the mark of a run that has begun; it contains how the run ends if it writes no record."""
    return folder / RECORDS / f"{name}.begun"


def _end_child() -> None:
    """End this worker's separate process, if there is one."""
    global _child
    if _child is not None:
        _child.kill()
        _child.communicate()
        _child = None


def _started() -> subprocess.Popen[bytes]:
    path = os.pathsep.join(name for name in sys.path if name)
    return subprocess.Popen(
        python_module(__name__),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | ONE_THREAD | {"PYTHONPATH": path},
        start_new_session=True,  # Ctrl-C reaches only the command, which then ends the worker
    )


def _reason(code: int) -> str:
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def _serve() -> None:
    """Execute the runs that arrive on stdin, until it is closed or the worker has ended."""
    end_with(os.getppid())
    told = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # output of a library must not be read as an answer
    while True:
        try:
            work, run, folder = pickle.load(sys.stdin.buffer)  # from our own worker, over a pipe
        except EOFError:
            return
        failure: BimvoxError | None = None
        try:
            work(run, folder)
        except BimvoxError as error:
            failure = error
        told.write(pickle.dumps(failure))


if __name__ == "__main__":
    _serve()


_LOOK_EVERY_S = 0.3
_ALONE = (False, False, True)
"""By try, whether a run is executed alone: at last, no other run takes its memory or ends its worker."""


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

    Runs that train a policy come first, so that the others find it in the store. A run whose process or worker dies is
    tried again, at last alone; then it is recorded as failed.

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
    from joblib import parallel_config

    if not runs:
        return
    left, fleet = list(runs), _Fleet(folder, backend, jobs, work)
    try:
        with opened(backend, jobs, address) as config, _followed(runs, folder, progress), parallel_config(**config):
            for is_alone in _ALONE:
                parts = [[run] for run in left] if is_alone else [left]
                left = [run for part in parts for run in fleet.begun_in_vain(part)]
                for run in left:
                    progress.note(f"{run.name}: {fleet.why(run)} before it was done")
    finally:
        _end_child()
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

        try:
            for part in ([run for run in runs if run.leads], [run for run in runs if not run.leads]):
                Parallel(batch_size=1)(delayed(_carry_out_apart)(self.work, run, self.folder) for run in part)
        except Exception as error:
            if _worker_lost(self.backend, error):
                return error
            raise
        return None


@contextmanager
def _followed(runs: Sequence[Run], folder: Path, progress: Progress) -> Iterator[None]:
    """Report the number of records by listing the folder, which works for every backend and is quick for many runs."""
    done, names = threading.Event(), {record_file(folder, run.name).name for run in runs}

    def look() -> None:
        while not done.wait(_LOOK_EVERY_S):
            with os.scandir(folder / RECORDS) as files:
                recorded = sum(file.name in names for file in files)
            progress.report("runs", recorded, len(runs))

    progress.stage("runs", len(runs))
    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        progress.finish()
