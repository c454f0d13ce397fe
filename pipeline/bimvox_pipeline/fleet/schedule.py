"""Executes runs in parallel, on any backend; those whose process or worker dies are tried again."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bimvox.errors import BimvoxError
from bimvox.processes import ONE_THREAD, end_with, python_module
from bimvox.progress import Progress
from bimvox_pipeline.fleet.backends import Backend, opened, start_workers, worker_lost
from bimvox_pipeline.fleet.runs import RECORDS, Run, carry_out, failed, record_file, write_record

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
            start_workers(self.backend, self.jobs)
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
            if worker_lost(self.backend, error):
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
