"""Handles for the geometry processes: those that load the file, and the workers."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.reduction import send_handle
from pathlib import Path
from typing import Any

from bimvox.errors import IfcError
from bimvox.processes import CAN_FORK, python_module, start_connected, worker_environment

WORKER_COMMAND = tuple(python_module("bimvox.bim.ifc.worker"))
_START_LIMIT_S = 600.0
_CRASH_S = 0.5
"""Seconds between the end of a crashed worker's connection and the end of the worker, at most."""
ASLEEP = 20
"""A worker that neither answers nor uses up its processor time is ended after this many times its limit."""

Task = tuple[tuple[int, ...], str]
"""Step ids of products that share one shape, and the geometry library to mesh it with."""


class _Loader:
    """A process that loads the file in the background, and the connection to it."""

    def __init__(self, path: Path, command: Sequence[str]) -> None:
        self._path = path
        self.is_ready = False
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process that writes to it)
        # Threads do not survive a fork, and nothing here needs them.
        environment = {**worker_environment(), "OPENBLAS_NUM_THREADS": "1"}
        self.process, self.channel = start_connected(command, str(path), self._output, environment)

    def wait(self) -> None:
        """Return when the file is loaded.

        Raises:
            IfcError: If it cannot be loaded.
        """
        if not self.is_ready:
            try:
                if not self.channel.poll(_START_LIMIT_S):
                    raise self.lost(f"it is not ready after {_START_LIMIT_S:g} s")
                self.channel.recv()
            except (EOFError, OSError):
                raise self.lost() from None
            self.is_ready = True

    def end(self, patience_s: float) -> int:
        """Close the connection, kill the process if it does not end by itself, and return its exit status."""
        self.channel.close()
        try:
            self.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._output.close()
        return self.process.returncode

    def lost(self, why: str = "") -> IfcError:
        """Return the error for a process that has ended, with the end of its output."""
        try:
            self.process.wait(2.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
        code = self.process.wait()
        self._output.seek(0)
        output = self._output.read()[-2000:].decode("utf-8", "replace").strip()
        return IfcError(
            self._path, f"the geometry process did not start: {why or output or code}", hint="check the install"
        )


class GeometryServer:
    """The process that loads the file, in the background, and forks workers.

    Args:
        path: The IFC file.
        command: Command that starts it; the number of its socket and the path are appended.
    """

    def __init__(self, path: Path, command: Sequence[str]) -> None:
        self._loader = _Loader(path, command)

    @property
    def pid(self) -> int:
        """The process id of the server."""
        return self._loader.process.pid

    def new_worker(self) -> Worker:
        """Return a new worker.

        Raises:
            IfcError: If the server cannot start.
        """
        self._loader.wait()
        try:
            here, there = socket.socketpair()
            with there:
                self._loader.channel.send("fork")
                if sys.platform != "win32":
                    send_handle(self._loader.channel, there.fileno(), self.pid)
            return Worker(Connection(here.detach()), self._loader.channel.recv())
        except (EOFError, OSError):
            raise self._loader.lost() from None

    def bury(self, worker: Worker) -> int:
        """End a worker and return its exit status, negative for the signal that ended it.

        Raises:
            IfcError: If the server itself has ended.
        """
        worker.channel.close()
        try:
            self._loader.channel.send(worker.pid)
            return int(self._loader.channel.recv())
        except (EOFError, OSError):
            raise self._loader.lost() from None

    def stop(self) -> None:
        """End the server and all its workers."""
        self._loader.end(2.0 if self._loader.is_ready else 0.0)


class SeparateWorkers:
    """Workers that load the file themselves, for systems where no process can be forked.

    Args:
        path: The IFC file.
        command: Command that starts a worker; the number of its connection and the path are appended.
    """

    def __init__(self, path: Path, command: Sequence[str]) -> None:
        self._path, self._command = path, command
        self._next: _Loader | None = _Loader(path, command)  # loads the file in the background
        self._working: dict[int, _Loader] = {}

    def new_worker(self) -> Worker:
        """Return a new worker.

        Raises:
            IfcError: If it cannot start.
        """
        loader = self._next or _Loader(self._path, self._command)
        self._next = None
        self._working[loader.process.pid] = loader
        loader.wait()
        return Worker(loader.channel, loader.process.pid)

    def bury(self, worker: Worker) -> int:
        """End a worker and return its exit status."""
        return self._working.pop(worker.pid).end(_CRASH_S)

    def stop(self) -> None:
        """End all workers."""
        for loader in (*self._working.values(), *([self._next] if self._next else ())):
            loader.end(0.0)


def geometry_processes(path: Path, command: Sequence[str]) -> GeometryServer | SeparateWorkers:
    """Return what starts and ends workers on this system. It loads the file in the background."""
    return GeometryServer(path, command) if CAN_FORK else SeparateWorkers(path, command)


class Worker:
    """A worker: its socket and the tasks that it has not answered; the first is the one in progress.

    Args:
        channel: Its socket.
        pid: Its process id.
    """

    def __init__(self, channel: Connection, pid: int) -> None:
        self.channel = channel
        self.pid = pid
        self.tasks: deque[Task] = deque()
        self._limits_s: deque[float] = deque()
        self._since_s = 0.0

    @property
    def limit_s(self) -> float:
        """Seconds of processor time that the task in progress may take."""
        return self._limits_s[0]

    @property
    def deadline(self) -> float:
        """Time of the monotonic clock from which a worker with a task counts as asleep."""
        return self._since_s + ASLEEP * self.limit_s

    def give(self, task: Task, limit_s: float) -> None:
        """Send a task that may take ``limit_s`` seconds of processor time."""
        if not self.tasks:
            self._since_s = time.monotonic()
        self.tasks.append(task)
        self._limits_s.append(limit_s)
        try:
            self.channel.send((task, limit_s))
        except OSError:
            return  # it died while idle: reading its answer reports that

    def answer(self) -> tuple[Task, Any]:
        """Return the first task and its answer.

        Raises:
            EOFError: If it died.
            OSError: If it died.
        """
        answer = self.channel.recv()
        self._limits_s.popleft()
        self._since_s = time.monotonic()
        return self.tasks.popleft(), answer
