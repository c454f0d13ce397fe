"""Handles for the geometry processes: the server that loads the file, and the workers that it forks."""

from __future__ import annotations

import socket
import subprocess
import tempfile
import time
from collections import deque
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from multiprocessing.reduction import send_handle
from pathlib import Path
from typing import Any

from bimvox.errors import IfcError
from bimvox.processes import python_module, worker_environment

WORKER_COMMAND = tuple(python_module("bimvox.bim.ifc.worker"))
_START_LIMIT_S = 600.0

Task = tuple[tuple[int, ...], str]
"""Step ids of products that share one shape, and the geometry library to mesh it with."""


class GeometryServer:
    """The process that loads the file, in the background, and forks workers.

    Args:
        path: The IFC file.
        command: Command that starts it; the number of its socket and the path are appended.
    """

    def __init__(self, path: Path, command: Sequence[str]) -> None:
        self._path = path
        self._ready = False
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process that writes to it)
        # Threads do not survive a fork, and nothing here needs them.
        environment = {**worker_environment(), "OPENBLAS_NUM_THREADS": "1"}
        here, there = socket.socketpair()
        self._control = Connection(here.detach())
        with there:
            self._process = subprocess.Popen(
                [*command, str(there.fileno()), str(path)],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._output,
                env=environment,
                pass_fds=[there.fileno()],
                start_new_session=True,  # Ctrl-C goes to this process, which ends the server
            )

    def fork(self) -> Worker:
        """Return a new worker.

        Raises:
            IfcError: If the server cannot start.
        """
        try:
            if not self._ready:
                if not self._control.poll(_START_LIMIT_S):
                    raise self._lost(f"it is not ready after {_START_LIMIT_S:g} s")
                self._control.recv()
                self._ready = True
            here, there = socket.socketpair()
            with there:
                self._control.send("fork")
                send_handle(self._control, there.fileno(), self._process.pid)
            return Worker(Connection(here.detach()), self._control.recv())
        except (EOFError, OSError):
            raise self._lost() from None

    def bury(self, worker: Worker) -> int:
        """End a worker and return its exit status, negative for the signal that ended it.

        Raises:
            IfcError: If the server itself has ended.
        """
        worker.channel.close()
        try:
            self._control.send(worker.pid)
            return int(self._control.recv())
        except (EOFError, OSError):
            raise self._lost() from None

    def stop(self) -> None:
        """End the server and all its workers."""
        self._control.close()
        try:
            self._process.wait(2.0 if self._ready else 0.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._output.close()

    def _lost(self, why: str = "") -> IfcError:
        """Return the error for a server that has ended, with the end of its output."""
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
        code = self._process.wait()
        self._output.seek(0)
        output = self._output.read()[-2000:].decode("utf-8", "replace").strip()
        return IfcError(
            self._path, f"the geometry process did not start: {why or output or code}", hint="check the install"
        )


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
        self.deadline = float("inf")

    def give(self, task: Task, limit_s: Callable[[Task], float]) -> None:
        """Send a task; its time starts when it becomes the first of the unanswered tasks."""
        if not self.tasks:
            self.deadline = time.monotonic() + limit_s(task)
        self.tasks.append(task)
        try:
            self.channel.send(task)
        except OSError:
            return  # it died while idle: reading its answer reports that

    def answer(self, limit_s: Callable[[Task], float]) -> tuple[Task, Any]:
        """Return the first task and its answer; the time of the next task starts.

        Raises:
            EOFError: If it died.
            OSError: If it died.
        """
        answer = self.channel.recv()
        task = self.tasks.popleft()
        if self.tasks:
            self.deadline = time.monotonic() + limit_s(self.tasks[0])
        return task, answer
