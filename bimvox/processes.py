"""Starts and ends child processes: a command run to its end, the environment of workers, and their end.

Used by everything that starts a process; each user has its own way of communicating: the geometry workers use a socket,
the runs of a fleet and the workers of a plan use pipes, the paper's jobs and retraining use ``multiprocessing``.
"""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO

CAN_FORK = hasattr(os, "fork")
"""Whether a process can be forked; Windows cannot."""

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of planning processes, set before a library reads it: with two processes, two threads each are slower
than one."""

_LOOK_EVERY_S = 0.3
_ROOT = str(Path(__file__).resolve().parents[1])


@dataclass(frozen=True, slots=True)
class _Finished:
    """A command that has ended.

    Attributes:
        code: Its exit status, negative for the signal that ended it.
        out: What it wrote to stdout.
        last_line: The last line that it wrote to stderr; empty if there is none.
    """

    code: int
    out: bytes
    last_line: str


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def python_module(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a module with this Python."""
    return [sys.executable, "-m", name, *arguments]


def worker_environment() -> dict[str, str]:
    """Return an environment in which a worker imports this bimvox, and nothing from the current folder."""
    paths = [_ROOT, os.environ.get("PYTHONPATH")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "PYTHONSAFEPATH": "1"}


def run_to_end(command: Sequence[str], timeout_s: float) -> _Finished | None:
    """Run a command and return its output; None if it was killed after ``timeout_s``."""
    try:
        done = subprocess.run(command, capture_output=True, timeout=timeout_s, env=worker_environment(), check=False)
    except subprocess.TimeoutExpired:
        return None
    said = done.stderr.decode("utf-8", "replace").strip().splitlines()
    return _Finished(done.returncode, done.stdout, said[-1] if said else "")


def start_connected(
    command: Sequence[str], last: str, output: IO[bytes], environment: dict[str, str]
) -> tuple[subprocess.Popen[bytes], Connection]:
    """Return a process and the connection to it; Ctrl-C reaches only this process, which then ends the other.

    Args:
        command: What to run. The number of its end of the connection, for :func:`connection_of`, is appended.
        last: The last argument, after that number.
        output: Receives what it prints.
        environment: Its environment variables.
    """
    here, there = multiprocessing.Pipe()
    number = there.fileno()
    with there:
        if sys.platform == "win32":
            os.set_handle_inheritable(number, True)
            process = subprocess.Popen(
                [*command, str(number), last],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env=environment,
                startupinfo=subprocess.STARTUPINFO(lpAttributeList={"handle_list": [number]}),
                creationflags=subprocess.CREATE_NEW_PROCESS_GROUP,
            )
        else:
            process = subprocess.Popen(
                [*command, str(number), last],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env=environment,
                pass_fds=[number],
                start_new_session=True,
            )
    return process, here  # type: ignore[return-value,unused-ignore]  # a PipeConnection on Windows, with the same methods


def connection_of(number: int) -> Connection:
    """Return this end of a connection, by its number on the command line."""
    if sys.platform == "win32":
        from multiprocessing.connection import PipeConnection

        return PipeConnection(number)  # type: ignore[return-value]
    else:  # noqa: RET505  (mypy would call the last line unreachable)
        return Connection(number)


def end_with(parent: int) -> None:
    """From now on, end this process when the process with the id ``parent`` ends for any reason."""
    threading.Thread(target=_look, args=(parent,), name="parent", daemon=True).start()


def _look(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_EVERY_S)
    os._exit(1)
