"""Starts and ends child processes: a command run to its end, the environment of workers, and their end.

Used by everything that starts a process; each user has its own way of communicating: the geometry workers use a socket,
the runs of a fleet use pipes, the paper's jobs and retraining use ``multiprocessing``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_LOOK_EVERY_S = 0.3
_ROOT = str(Path(__file__).resolve().parents[1])


@dataclass(frozen=True, slots=True)
class Finished:
    """A command that has ended.

    Attributes:
        code: Its exit status, negative for the signal that ended it.
        out: What it wrote to stdout.
        last_line: The last line that it wrote to stderr; empty if there is none.
    """

    code: int
    out: bytes
    last_line: str


def python_module(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a module with this Python."""
    return [sys.executable, "-m", name, *arguments]


def worker_environment() -> dict[str, str]:
    """Return an environment in which a worker imports this bimvox, and nothing from the current folder."""
    paths = [_ROOT, os.environ.get("PYTHONPATH")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "PYTHONSAFEPATH": "1"}


def run_to_end(command: Sequence[str], timeout_s: float) -> Finished | None:
    """Run a command and return its output; None if it was killed after ``timeout_s``."""
    try:
        done = subprocess.run(command, capture_output=True, timeout=timeout_s, env=worker_environment(), check=False)
    except subprocess.TimeoutExpired:
        return None
    said = done.stderr.decode("utf-8", "replace").strip().splitlines()
    return Finished(done.returncode, done.stdout, said[-1] if said else "")


def end_with(parent: int) -> None:
    """From now on, end this process when the process with the id ``parent`` ends for any reason."""
    threading.Thread(target=_look, args=(parent,), name="parent", daemon=True).start()


def _look(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_EVERY_S)
    os._exit(1)
