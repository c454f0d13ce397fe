"""A separate process for the runs of a worker: a crash of a library or lack of memory ends it, not the worker.

Clusters handle a lost worker differently, and some hang. So runs do not execute inside a worker. The process is reused
for further runs, so libraries and kernels are loaded once, and ends with its worker. A run that begins leaves a mark in
the fleet's folder: if it has no record in the end, its process or its worker died, and it is tried again.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from bimvox.errors import BimvoxError
from bimvox.processes import ONE_THREAD, end_with, python_module
from bimvox_pipeline.fleet.runs import Run
from bimvox_pipeline.fleet.work import RECORDS

Work = Callable[[Run, Path], None]

WORKER_ENDED = "its worker ended"

_child: subprocess.Popen[bytes] | None = None
_one_at_a_time = threading.Lock()


def carry_out_apart(work: Work, run: Run, folder: Path) -> None:
    """Execute a run with ``work``, a module-level function, in this worker's separate process.

    If the process dies, the mark of the run says how.

    Raises:
        FileError: If the run's record cannot be written, for example because the disk is full.
    """
    global _child
    mark = begun_file(folder, run.name)
    with _one_at_a_time:
        mark.write_text(WORKER_ENDED, encoding="utf-8")
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
            end_child()
            raise
        if failure is not None:
            raise failure


def begun_file(folder: Path, name: str) -> Path:
    """Return the path of the mark of a run that has begun; it contains how the run ends if it writes no record."""
    return folder / RECORDS / f"{name}.begun"


def end_child() -> None:
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
