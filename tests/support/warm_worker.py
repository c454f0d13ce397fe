"""Geometry processes forked from one that has imported their libraries.

In all tests but those of the start itself they take the place of ``python -m bimvox.bim.ifc.worker``: the same program,
without 0.4 s of imports for each IFC file that a test reads.
"""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Any

from bimvox.bim.ifc.geometry import WORKER_COMMAND
from bimvox.processes import start_connected

PRELOADED = ["bimvox.bim.ifc.worker", "bimvox.bim.ifc.select"]
CAN_PRELOAD = "forkserver" in multiprocessing.get_all_start_methods()


class _Process:
    """A forked process, with the methods of ``subprocess.Popen`` that its caller uses."""

    def __init__(self, process: Any) -> None:
        self._process = process
        self.pid: int = process.pid
        self.kill = process.kill

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("worker", timeout or 0.0)
        return self._process.exitcode


def start_warm(
    command: Sequence[str], last: str, output: IO[bytes], environment: Mapping[str, str]
) -> tuple[Any, Connection]:
    """Do as ``bimvox.processes.start_connected``, which starts all other commands."""
    if tuple(command) != WORKER_COMMAND or not CAN_PRELOAD:
        return start_connected(command, last, output, dict(environment))
    context: Any = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    here, there = context.Pipe()
    said = Connection(os.dup(output.fileno()), readable=False)  # a connection can be sent
    with there, said:
        process = context.Process(target=_work, args=(there, said, last, dict(environment), Path.cwd()), daemon=True)
        process.start()
    return _Process(process), here


def _work(channel: Connection, said: Connection, last: str, environment: Mapping[str, str], folder: Path) -> None:
    """Be the geometry process of a file."""
    from bimvox.bim.ifc.worker import main

    os.setsid()
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    os.dup2(said.fileno(), 1)
    os.dup2(said.fileno(), 2)
    sys.argv = ["worker", str(os.dup(channel.fileno())), last]
    channel.close()
    main()
