"""Worker processes that share the work of one plan; its results are the same with any number of them.

What the work is about (a site, a plan) is sent to a worker once; tasks refer to it. This process takes tasks too, and
does not wait for a worker that is still starting. A task that a worker fails, or does not finish because it dies, is
done again by this process, so an error is raised as if there were no workers.
"""

from __future__ import annotations

import io
import os
import pickle
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Generic, NamedTuple, TypeVar

from bimvox.processes import ONE_THREAD, connection_of, end_with, python_module, start_connected, worker_environment

T = TypeVar("T")

_MODULE = "bimvox.workers"
_PROTOCOL = 5  # keeps read-only arrays read-only: kernels are compiled for one kind
_NOT_PICKLED = (pickle.PicklingError, AttributeError, TypeError)
_END_S, _LOOK_EVERY_S = 2.0, 0.2
_CHUNKS_EACH, _MOST_IN_CHUNK = 6, 16
_AHEAD = 4
"""Tasks begun before their results are used: each process has something to do, and few results are kept."""


class Workers:
    """Worker processes, which start while this process goes on.

    Args:
        jobs: Number of processes that share the work, this one included.
        functions: What they will call: each worker imports the modules of these at once.
    """

    def __init__(self, jobs: int, functions: Sequence[Callable[..., Any]] = ()) -> None:
        self._known: list[Any] = []
        self._parcels = [_Parcel(0, _pickled(list(functions), self._known))]
        self._known += functions
        self._workers: list[_Worker] = []
        with suppress(OSError, RuntimeError):  # the system gives no further process or thread: these are enough
            for _ in range(jobs - 1):
                self._workers.append(_Worker(self._parcels[0]))

    @property
    def count(self) -> int:
        """Number of processes that share the work, this one included."""
        return 1 + sum(worker.is_alive for worker in self._workers)

    @contextmanager
    def knowing(self, *values: object) -> Iterator[None]:
        """Within the block, send values to each worker once, with the first task that it takes."""
        if self.count == 1:
            yield
            return
        known, sent = len(self._known), len(self._parcels)
        with suppress(*_NOT_PICKLED):  # otherwise each task that refers to them is done here
            self._parcels.append(_Parcel(known, _pickled(list(values), self._known)))
            self._known += values
        try:
            yield
        finally:
            del self._known[known:], self._parcels[sent:]

    def begin(self, function: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> Begun[T]:
        """Have the workers begin tasks, as ``run`` does them, while this process does something else."""
        work = _Work(function, tasks, self._parcels, self._known)
        for worker in self._workers:
            worker.works.put(work)
        return Begun(self, work)

    def run(
        self, function: Callable[..., T], tasks: Sequence[tuple[Any, ...]], done: Callable[[int], object] | None = None
    ) -> list[T]:
        """Return ``function(*task)`` of every task, in their order.

        Args:
            function: A function of a module, or of a class in one. It gives the same whatever was done before it.
            tasks: Arguments of each call; one that cannot be pickled is done by this process.
            done: Called now and then with the number of finished tasks.
        """
        return self.begin(function, tasks).finished(done)

    def each(self, function: Callable[..., T], tasks: Iterable[tuple[Any, ...]]) -> Iterator[T]:
        """Return ``function(*task)`` of every task, in order; workers begin at once, and do a few tasks ahead.

        ``tasks``: as for ``run``; they are taken when they are begun.
        """
        if self.count == 1:
            return (function(*task) for task in tasks)
        ahead = iter(tasks)
        begun = deque(self.begin(function, [task]) for task in islice(ahead, _AHEAD))
        return self._each(function, begun, ahead)

    def _each(
        self, function: Callable[..., T], begun: deque[Begun[T]], ahead: Iterator[tuple[Any, ...]]
    ) -> Iterator[T]:
        while begun:
            first = begun.popleft()
            first.help()
            for later in begun:
                if first.is_finished:
                    break
                later.help()
            (result,) = first.finished()
            begun.extend(self.begin(function, [task]) for task in islice(ahead, 1))
            yield result

    def close(self) -> None:
        """End the workers; this process does all tasks from now on."""
        for worker in self._workers:
            worker.close()


def in_chunks(items: Sequence[T], processes: int) -> list[Sequence[T]]:
    """Return items in chunks, in order: small enough that processes of different speed end together."""
    size = max(1, min(_MOST_IN_CHUNK, len(items) // (_CHUNKS_EACH * processes)))
    return [items[first : first + size] for first in range(0, len(items), size)]


class _Parcel(NamedTuple):
    """Pickled values, and the number of the first of them."""

    first: int
    content: bytes


class Begun(Generic[T]):
    """Tasks that workers have begun.

    Args:
        workers: The workers.
        work: The tasks.
    """

    def __init__(self, workers: Workers, work: _Work) -> None:
        self._workers, self._work = workers, work

    @property
    def is_finished(self) -> bool:
        """Whether the results of all tasks are there."""
        return len(self._work.results) == len(self._work.tasks)

    def help(self, done: Callable[[int], object] | None = None) -> None:
        """Do the tasks that no worker has taken."""
        work = self._work
        try:
            while (number := work.next()) is not None:
                work.finish(number, work.function(*work.tasks[number]))
                if done is not None:
                    done(len(work.results))
        except BaseException:
            self._workers.close()  # what they still answer is of this work
            raise

    def finished(self, done: Callable[[int], object] | None = None) -> list[T]:
        """Do the tasks that no worker has taken, wait for the others, and return all results in their order, once."""
        self.help(done)
        work = self._work
        try:
            for number in work.failed():
                work.finish(number, work.function(*work.tasks[number]))
        except BaseException:
            self._workers.close()
            raise
        results = [work.results[number] for number in range(len(work.tasks))]
        work.tasks, work.results = (), {}  # a worker that is busy with something else has it in its queue still
        return results


class _Work:
    """Tasks that several threads take, the first ones first."""

    def __init__(
        self,
        function: Callable[..., Any],
        tasks: Sequence[tuple[Any, ...]],
        parcels: Sequence[_Parcel],
        known: Sequence[Any],
    ) -> None:
        self.function, self.tasks, self.parcels, self.known = function, tasks, tuple(parcels), tuple(known)
        self.results: dict[int, Any] = {}
        self._waiting, self._failed = deque(range(len(tasks))), list[int]()
        self._changed = threading.Condition()

    def next(self) -> int | None:
        """Return the next task, None if all are taken."""
        try:
            return self._waiting.popleft()
        except IndexError:
            return None

    def finish(self, number: int, result: Any) -> None:
        """Keep the result of a task."""
        with self._changed:
            self.results[number] = result
            self._changed.notify()

    def fail(self, number: int) -> None:
        """Note that a worker did not finish a task."""
        with self._changed:
            self._failed.append(number)
            self._changed.notify()

    def failed(self) -> list[int]:
        """Wait until every task is finished or failed, and return those that failed."""
        with self._changed:
            while len(self.results) + len(self._failed) < len(self.tasks):
                self._changed.wait(_LOOK_EVERY_S)  # without a limit, Ctrl-C would not get through on Windows
        return sorted(self._failed)


class _Worker:
    """One worker process as the process that it works for sees it."""

    def __init__(self, first: _Parcel) -> None:
        with Path(os.devnull).open("wb") as nowhere:
            self._process, self._connection = start_connected(
                python_module(_MODULE), "", nowhere, worker_environment() | ONE_THREAD
            )
        self.works: SimpleQueue[_Work | None] = SimpleQueue()
        self.is_alive = True
        self._sent: list[_Parcel] = []
        try:
            threading.Thread(target=self._follow, args=(first,), name="worker", daemon=True).start()
        except RuntimeError:
            self.close()
            raise

    def close(self) -> None:
        """End the process, and the thread that follows it."""
        self.is_alive = False
        self.works.put(None)
        self._process.kill()
        with suppress(Exception):
            self._process.wait(_END_S)

    def _follow(self, first: _Parcel) -> None:
        """Have the process do tasks until it is ended or fails one."""
        number, work = None, None
        try:
            self._send(first)
            self._connection.recv_bytes()  # it is ready
            while (work := self.works.get()) is not None:
                while (number := work.next()) is not None:
                    try:
                        task = _pickled((work.function, work.tasks[number]), work.known)
                    except _NOT_PICKLED:
                        work.fail(number)
                    else:
                        work.finish(number, _Unpickler(self._answer(work, task), work.known).load())
                work = None  # what it is about is not kept
        except Exception:  # noqa: BLE001  (whatever it is: the process that it works for does the task, and sees it)
            self.is_alive = False
            if work is not None and number is not None:
                work.fail(number)
        finally:
            self.close()
            self._connection.close()

    def _answer(self, work: _Work, task: bytes) -> bytes:
        for parcel in work.parcels:
            if not any(parcel is one for one in self._sent):
                self._send(parcel)
        self._connection.send_bytes(b"")
        self._connection.send_bytes(task)
        return self._connection.recv_bytes()

    def _send(self, parcel: _Parcel) -> None:
        """Have the process know values, from a number on, instead of those that it knows by that number."""
        self._connection.send_bytes(parcel.first.to_bytes(8, "little"))
        self._connection.send_bytes(parcel.content)
        self._sent = [one for one in self._sent if one.first < parcel.first] + [parcel]


def _pickled(value: object, known: Sequence[Any]) -> bytes:
    stream = io.BytesIO()
    _Pickler(stream, {id(one): number for number, one in enumerate(known)}).dump(value)
    return stream.getvalue()


class _Pickler(pickle.Pickler):
    """Pickles known values as their numbers, so that they remain the same objects."""

    def __init__(self, stream: io.BytesIO, numbers: dict[int, int]) -> None:
        super().__init__(stream, _PROTOCOL)
        self._numbers = numbers

    def persistent_id(self, obj: object) -> int | None:
        """Return the number of a known value."""
        return self._numbers.get(id(obj))


class _Unpickler(pickle.Unpickler):
    def __init__(self, content: bytes, known: Sequence[Any]) -> None:
        super().__init__(io.BytesIO(content))
        self._known = known

    def persistent_load(self, pid: Any) -> Any:
        """Return a known value."""
        return self._known[pid]


ALONE = Workers(1)
"""This process alone."""


def _serve(connection: Connection) -> None:
    """Do tasks until one fails or the connection is closed."""
    known: list[Any] = []
    is_ready = False
    while True:
        first = connection.recv_bytes()
        content = connection.recv_bytes()
        if first:
            del known[int.from_bytes(first, "little") :]
            known += _Unpickler(content, known).load()
            if not is_ready:
                connection.send_bytes(b"ready")
                is_ready = True
            continue
        function, task = _Unpickler(content, known).load()
        connection.send_bytes(_pickled(function(*task), known))


def main() -> None:
    """Run a worker: ``python -m bimvox.workers CONNECTION``."""
    end_with(os.getppid())
    with suppress(EOFError, OSError), connection_of(int(sys.argv[1])) as connection:
        _serve(connection)


if __name__ == "__main__":
    main()
