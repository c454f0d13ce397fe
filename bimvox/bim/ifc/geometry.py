"""Mesh the products of an IFC file in worker processes, and survive hangs and crashes of the geometry kernel."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import send_handle
from pathlib import Path
from types import TracebackType
from typing import Any

from bimvox.bim.ifc.answer import OUT_OF_TIME, PlacedShape, Selected
from bimvox.errors import IfcError, SelectionError, shown
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


class _GeometryServer:
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


class _SeparateWorkers:
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


def _geometry_processes(path: Path, command: Sequence[str]) -> _GeometryServer | _SeparateWorkers:
    """Return what starts and ends workers on this system. It loads the file in the background."""
    return _GeometryServer(path, command) if CAN_FORK else _SeparateWorkers(path, command)


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


FAST_LIBRARY = "hybrid-cgal-simple-opencascade"
PLAIN_LIBRARY = "opencascade"
_FAST_SHARE = 1 / 3
"""Share of the time limit that the fast library gets; after that, the plain library tries."""
_PATIENCE = 5
"""After this many time limits lost to shapes that hang, each shape gets a tenth of the limit."""
_TASKS_AHEAD = 4
"""Tasks sent to a worker before it answers the first, so that it never waits for this process."""
_TASKS_A_WORKER = 16
"""Tasks that justify forking another worker."""
_NOTHING = object()
SELECT_LIMIT_S = 30.0
"""Seconds of processor time that a selection may take."""
_SLOW = "simplify its patterns: a repetition within a repetition, such as (a+)+, may take for ever"


@dataclass(frozen=True, slots=True, eq=False)
class Meshed:
    """The shapes that the kernel made from a file.

    Attributes:
        shapes: By step id.
        failures: Reason by step id, for every product without a shape.
        retried: Step ids that only the second library could mesh.
    """

    shapes: Mapping[int, PlacedShape]
    failures: Mapping[int, str]
    retried: tuple[int, ...]


class GeometryPool:
    """Worker processes for one file. Start it early: it opens the file in the background.

    Args:
        path: The IFC file.
        timeout_s: Seconds of processor time a worker may spend on one shape; less after many shapes of the file hung.
        processes: Largest number of workers; it does not change the shapes.
        command: Command for the process that forks the workers (tests of hangs and crashes replace it).
    """

    def __init__(
        self,
        path: Path,
        *,
        timeout_s: float,
        processes: int = 1,
        command: Sequence[str] = WORKER_COMMAND,
    ) -> None:
        self._path = path
        self._timeout_s = timeout_s
        self._processes = processes
        self._command = tuple(command)
        self._workers: list[Worker] = []
        self._lost_s = 0.0

    def __enter__(self) -> GeometryPool:
        self._server = _geometry_processes(self._path, self._command)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for worker in self._workers:
            worker.channel.close()
        self._server.stop()

    def mesh(
        self,
        groups: Sequence[tuple[int, ...]],
        on_done: Callable[[int], None] = lambda done: None,
        *,
        plain: Set[int] = frozenset(),
        meanwhile: Iterable[object] = (),
    ) -> Meshed:
        """Return the shapes of products. One that hangs, crashes or fails is tried once more with the other library.

        Args:
            groups: Step ids of the products to mesh; each group shares one shape.
            on_done: Called with the number of products finished.
            plain: Products to mesh with the plain library first, because the fast one is too coarse for them.
            meanwhile: Other work in small steps, done while the workers are busy.

        Raises:
            IfcError: If no worker can be started.
        """
        shapes: dict[int, PlacedShape] = {}
        other_work = iter(meanwhile)
        failures: dict[int, str] = {}
        retried: list[int] = []
        todo = deque((tuple(group), _first_library(group, plain)) for group in groups)
        while todo or any(worker.tasks for worker in self._workers):
            self._staff(todo)
            for (step_ids, library), answer in self._answers(todo, other_work):
                if isinstance(answer, str):
                    if library == _first_library(step_ids, plain):
                        todo.append((step_ids, PLAIN_LIBRARY if library == FAST_LIBRARY else FAST_LIBRARY))
                        continue
                    failures.update(dict.fromkeys(step_ids, answer))
                else:
                    shape, placements = answer
                    for step_id, placement in zip(step_ids, placements, strict=True):
                        shapes[step_id] = PlacedShape(shape, placement)
                    retried += step_ids if library != _first_library(step_ids, plain) else ()
                on_done(len(shapes) + len(failures))
        return Meshed(shapes, failures, tuple(sorted(retried)))

    def select(self, query: str) -> frozenset[int]:
        """Return the step ids of the products that a query matches.

        Raises:
            SelectionError: If the query is malformed, matches nothing or takes too long.
            IfcError: If no worker can be started.
        """
        answer = self.select_each([query])[0]
        if isinstance(answer, SelectionError):
            raise answer
        return answer

    def select_each(self, queries: Sequence[str]) -> list[Selected]:
        """Return what each query matches, or the error about it. A worker finds it: a pattern may never end."""
        result: list[Selected] = []
        worker = None
        for query in queries:
            worker = worker or self._server.new_worker()
            answer: Selected | None = None
            is_late = False
            try:
                worker.channel.send((query, SELECT_LIMIT_S))
                is_late = not worker.channel.poll(ASLEEP * SELECT_LIMIT_S)
                answer = None if is_late else worker.channel.recv()
            except (EOFError, OSError):
                pass
            if answer is None:
                is_late |= self._server.bury(worker) == OUT_OF_TIME
                worker = None
                why = f"not finished within {SELECT_LIMIT_S:g} s" if is_late else "the selector crashed"
                hint = _SLOW if is_late else "simplify the query"
                answer = SelectionError(f"select {shown(query)}: {why}", hint=hint)
            result.append(answer)
        if worker is not None:
            self._server.bury(worker)
        return result

    def _staff(self, todo: deque[Task]) -> None:
        """Fork workers if there is work for them, and keep each of them busy."""
        wanted = min(self._processes, 1 + len(todo) // _TASKS_A_WORKER) if todo else 0
        while len(self._workers) < wanted:
            self._workers.append(self._server.new_worker())
        for ahead in range(1, _TASKS_AHEAD + 1):
            for worker in self._workers:
                if todo and len(worker.tasks) < ahead:
                    worker.give(todo[0], self._limit_s(todo.popleft()))

    def _answers(self, todo: deque[Task], other_work: Iterator[object]) -> list[tuple[Task, Any]]:
        """Wait for an event; return each finished task with its shape, or with the reason why it failed."""
        busy = [worker for worker in self._workers if worker.tasks]
        channels = [worker.channel for worker in busy]
        speaking = wait(channels, 0.0)
        if not speaking and next(other_work, _NOTHING) is _NOTHING:
            speaking = wait(channels, max(0.0, min(worker.deadline for worker in busy) - time.monotonic()))
        finished: list[tuple[Task, Any]] = []
        for worker in busy:
            if worker.channel in speaking:
                try:
                    finished.append(worker.answer())
                except (EOFError, OSError):
                    finished.append(self._bury(worker, todo))
            elif time.monotonic() >= worker.deadline:
                finished.append(self._bury(worker, todo, is_asleep=True))
        return finished

    def _limit_s(self, task: Task) -> float:
        """Return how much processor time a task may take, seconds."""
        share = _FAST_SHARE if task[1] == FAST_LIBRARY else 1.0
        return self._timeout_s * share * (1.0 if self._lost_s < _PATIENCE * self._timeout_s else 0.1)

    def _bury(self, worker: Worker, todo: deque[Task], *, is_asleep: bool = False) -> tuple[Task, str]:
        """End a worker; return its current task and why it has no shape. Its other tasks go back to the queue."""
        self._workers.remove(worker)
        task = worker.tasks.popleft()
        todo.extendleft(reversed(worker.tasks))
        status = self._server.bury(worker)
        if is_asleep or status == OUT_OF_TIME:
            self._lost_s += worker.limit_s
            return task, f"no result from the geometry kernel within {worker.limit_s:g} s of processor time"
        died = f"signal {-status}" if status < 0 else f"exit status {status}"
        return task, f"the geometry kernel crashed ({died})"


def _first_library(step_ids: Sequence[int], plain: Set[int]) -> str:
    """Return the library to try first for products that share a shape."""
    return FAST_LIBRARY if plain.isdisjoint(step_ids) else PLAIN_LIBRARY
