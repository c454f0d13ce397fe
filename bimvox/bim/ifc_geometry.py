"""Mesh the products of an IFC file in worker processes, and outlive the kernel's hangs and crashes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import IfcError

FAST_LIBRARY = "hybrid-cgal-simple-opencascade"
PLAIN_LIBRARY = "opencascade"
_START_LIMIT_S = 600.0
_PRODUCTS_PER_PROCESS = 64


@dataclass(frozen=True, slots=True, eq=False)
class ProductShape:
    """Triangles of one product.

    Attributes:
        vertices_m: (V, 3) float64 in the product's own frame.
        faces: (F, 3) int32.
        placement: (4, 4) float64, product to world, metres.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    placement: NDArray[np.float64]

    def world_m(self, origin_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the vertices relative to a world point; subtracted first, so that a far placement costs nothing."""
        shift: NDArray[np.float64] = self.placement[:3, 3] - origin_m
        return self.vertices_m @ self.placement[:3, :3].T + shift


@dataclass(frozen=True, slots=True, eq=False)
class Meshed:
    """What the kernel made of a file.

    Attributes:
        shapes: By step id.
        failures: Reason by step id, for every product without a shape.
        retried: Step ids that only the plain library could mesh.
    """

    shapes: Mapping[int, ProductShape]
    failures: Mapping[int, str]
    retried: tuple[int, ...]


class GeometryPool:
    """Worker processes on one file; start it early, it opens the file while the caller does other things.

    Args:
        path: The IFC file.
        timeout_s: Seconds a worker may spend on one product.
        processes: Most workers to run at once.
        command: How to start a worker (replaced by tests that need one that hangs or crashes).
    """

    def __init__(
        self, path: Path, *, timeout_s: float, processes: int = 1, command: Sequence[str] | None = None
    ) -> None:
        self._path = path
        self._timeout_s = timeout_s
        self._processes = processes
        self._command = tuple(command or (sys.executable, "-m", "bimvox.bim.ifc_worker"))
        self._workers: list[_Worker] = []

    def __enter__(self) -> GeometryPool:
        self._workers.append(_Worker(self._command, self._path))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for worker in self._workers:
            worker.stop()

    def mesh(self, step_ids: Sequence[int], on_done: Callable[[int], None] = lambda done: None) -> Meshed:
        """Mesh products; one that hangs, crashes or fails is tried again with the plain library, then given up.

        Args:
            step_ids: Products to mesh.
            on_done: Called with the number of products finished.

        Raises:
            IfcError: If no worker can be started.
        """
        shapes: dict[int, ProductShape] = {}
        failures: dict[int, str] = {}
        retried: list[int] = []
        todo = deque((step_id, FAST_LIBRARY) for step_id in step_ids)
        while todo or any(worker.task for worker in self._workers):
            self._staff(todo)
            for worker, answer in self._answers():
                step_id, library = worker.take_task()
                if isinstance(answer, str) and library == FAST_LIBRARY:
                    todo.append((step_id, PLAIN_LIBRARY))
                    continue
                if isinstance(answer, str):
                    failures[step_id] = answer
                else:
                    shapes[step_id] = ProductShape(*answer)
                    if library == PLAIN_LIBRARY:
                        retried.append(step_id)
                on_done(len(shapes) + len(failures))
        return Meshed(shapes, failures, tuple(sorted(retried)))

    def _staff(self, todo: deque[tuple[int, str]]) -> None:
        """Start workers where there is work for them, and hand out tasks to the idle."""
        wanted = min(self._processes, 1 + len(todo) // _PRODUCTS_PER_PROCESS) if todo else 0
        while len(self._workers) < wanted:
            self._workers.append(_Worker(self._command, self._path))
        for worker in self._workers:
            if todo and worker.ready and worker.task is None:
                worker.give_task(todo.popleft(), self._timeout_s)

    def _answers(self) -> list[tuple[_Worker, Any]]:
        """Wait for something to happen; return (worker, shape or reason) of the finished tasks."""
        waiting = [worker for worker in self._workers if worker.task or not worker.ready]
        pause = max(0.0, min(worker.deadline for worker in waiting) - time.monotonic())
        speaking = wait([worker.answers for worker in waiting], pause)
        finished: list[tuple[_Worker, Any]] = []
        for worker in waiting:
            if worker.answers in speaking:
                try:
                    answer = worker.answers.recv()
                except (EOFError, OSError):
                    answer = self._bury(worker, patience_s=2.0)
                if worker.task is None:
                    worker.ready = True
                else:
                    finished.append((worker, answer))
            elif time.monotonic() >= worker.deadline:
                self._bury(worker, patience_s=0.0)
                finished.append((worker, f"no result from the geometry kernel within {self._timeout_s:g} s"))
        return finished

    def _bury(self, worker: _Worker, patience_s: float) -> str:
        """Stop a worker for good and return why it died; one that never got ready is everybody's trouble."""
        self._workers.remove(worker)
        code, said = worker.stop(patience_s)
        if not worker.ready:
            raise IfcError(self._path, f"the geometry worker did not start: {said or code}", hint="check the install")
        return f"the geometry kernel crashed ({f'signal {-code}' if code < 0 else f'exit status {code}'})"


class _Worker:
    """One worker process and the pipes to it."""

    def __init__(self, command: Sequence[str], path: Path) -> None:
        self.ready = False
        self.task: tuple[int, str] | None = None
        self.deadline = time.monotonic() + _START_LIMIT_S
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process that writes to it)
        root = str(Path(__file__).resolve().parents[2])
        # The library is found where this file lies, and nothing in the current folder can shadow a module.
        python_path = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
        environment = {**os.environ, "PYTHONPATH": python_path, "PYTHONSAFEPATH": "1"}
        self._process = subprocess.Popen(
            [*command, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env=environment,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests = Connection(os.dup(self._process.stdin.fileno()), readable=False)
        self.answers = Connection(os.dup(self._process.stdout.fileno()), writable=False)
        self._process.stdin.close()
        self._process.stdout.close()

    def give_task(self, task: tuple[int, str], timeout_s: float) -> None:
        """Send a task; its time starts now."""
        self.task, self.deadline = task, time.monotonic() + timeout_s
        try:
            self._requests.send(task)
        except BrokenPipeError:
            return  # it died idle: reading its answer reports that

    def take_task(self) -> tuple[int, str]:
        """Return the task it had, and free it for the next."""
        assert self.task is not None
        task, self.task = self.task, None
        return task

    def stop(self, patience_s: float = 0.0) -> tuple[int, str]:
        """End the process, one that is ending by itself after ``patience_s``; return its exit status and last words."""
        self._requests.close()
        self.answers.close()
        try:
            self._process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
        code = self._process.wait()
        self._said.seek(0)
        said = self._said.read()[-2000:].decode("utf-8", "replace").strip()
        self._said.close()
        return code, said
