"""The walk over the turns of a plan: the state before each, and the results of its steps, stored by what they read.

Planning a building is a fold. The state before turn n is what is in place and in the yard by then. A step is a pure
function of that state and of a task: it searches a path, makes a motion, proves a lift. The walk knows none of this. It
brings a state to a turn, has processes share the steps, and stores each result under the content that its step read, so
that no step is made twice and none of them remembers anything.

Three things are asked of a walk, and tested of each:

* its state before turn n is a function of ``roots`` and of ``passed[:n]``;
* ``step`` returns the same for the same state and task, whatever was done before;
* ``read`` names all that a step reads besides the state.

``BIMVOX_STORE=off`` turns the store off: every step is made anew, with the same results.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from hashlib import blake2b
from typing import Any, Generic, TypeVar, cast

import numpy as np

from bimvox.workers import Workers, in_chunks

State = TypeVar("State")
Task = TypeVar("Task")
Result = TypeVar("Result")
T = TypeVar("T")

_DIGEST_BYTES = 16
_PLAIN = (str, int, float, bool, bytes, type(None), Enum, np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class Shared:
    """What many steps read, in one object, so that its content is digested once and not for every step."""

    content: tuple[object, ...]


class Store:
    """Results of steps, by the digest of what they read.

    Objects that are equal only to themselves (a site, contacts, a network) count by their identity, and are kept alive
    for that; arrays, numbers, texts, tuples and dataclasses of these count by their content.
    """

    def __init__(self) -> None:
        self._is_on = os.environ.get("BIMVOX_STORE", "") != "off"
        self._results: dict[bytes, Any] = {}
        self._digests: dict[int, tuple[object, bytes]] = {}

    def key(self, *read: object) -> bytes:
        """Return the digest of what a step reads."""
        digest = blake2b(digest_size=_DIGEST_BYTES)
        for one in read:
            digest.update(self._content(one))
        return digest.digest()

    def once(self, key: bytes, make: Callable[[], T]) -> T:
        """Return what is stored under a key; if there is nothing, what is made now."""
        if not self._is_on:
            return make()
        if key not in self._results:
            self._results[key] = make()
        result: T = self.get(key)
        return result

    def has(self, key: bytes) -> bool:
        """Return whether something is stored under a key."""
        return key in self._results

    def get(self, key: bytes) -> Any:
        """Return what is stored under a key."""
        return self._results[key]

    def add(self, key: bytes, result: object) -> None:
        """Store a result under a key."""
        if self._is_on:
            self._results[key] = result

    @property
    def is_on(self) -> bool:
        """Whether anything is stored."""
        return self._is_on

    def itself(self, one: object) -> bytes:
        """Return what stands for an object by its identity, whatever it holds; it is kept alive."""
        self._digests.setdefault(-id(one), (one, b""))
        return f"at {id(one)};".encode()

    def _content(self, one: object) -> bytes:
        """Return bytes that are equal for equal contents."""
        if isinstance(one, _PLAIN):
            return f"{type(one).__name__}:{one!r};".encode()
        if isinstance(one, np.ndarray):
            return f"array:{one.dtype.str}{one.shape};".encode() + np.ascontiguousarray(one).tobytes()
        if isinstance(one, tuple | list):
            return f"{len(one)}(".encode() + b"".join(map(self._content, one)) + b")"
        if isinstance(one, dict):
            return b"{:" + self._content([*one.items()]) + b"}"
        if isinstance(one, frozenset | set):
            return b"{" + b"".join(sorted(map(self._content, one))) + b"}"
        return self._digest_of(one)

    def _digest_of(self, one: object) -> bytes:
        """Return the digest of an immutable object, made once; it is kept alive, so that its identity stays its own."""
        known = self._digests.get(id(one))
        if known is None:
            content: tuple[object, ...] = (self.itself(one),)
            if is_dataclass(one) and not isinstance(one, type):
                content = tuple(getattr(one, field.name) for field in fields(one))
            known = self._digests[id(one)] = (one, self.key(type(one).__qualname__, *content))
        return known[1]


class Walk(ABC, Generic[State, Task, Result]):
    """Steps at the turns of a plan, in ascending order.

    A walk is a dataclass, and is sent to each process once. What a process has walked so far is kept there, one state
    for each kind of walk: a walk that begins in the same way goes on from it.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process begins it anew: its fields, nothing else."""
        return type(self), tuple(getattr(self, one.name) for one in fields(cast(Any, self)))

    @property
    @abstractmethod
    def roots(self) -> tuple[object, ...]:
        """What the first state is made of; each is equal only to itself."""

    @property
    @abstractmethod
    def passed(self) -> Sequence[Hashable]:
        """By turn, what the state after it depends on besides the state before it."""

    @abstractmethod
    def begin(self) -> State:
        """Return the state before the first turn."""

    @abstractmethod
    def go_past(self, state: State, turn: int, until: int) -> None:
        """Move a state from before a turn to after it, on the way to a later turn."""

    @abstractmethod
    def turn_of(self, task: Task) -> int:
        """Return the turn of a task."""

    @abstractmethod
    def step(self, state: State, task: Task) -> Result:
        """Return the result at the turn of a task; the state is only used to go past that turn afterwards."""

    def read(self, task: Task) -> tuple[object, ...]:
        """Return all that the step of a task reads besides the state."""
        return (task,)

    @property
    def grounds(self) -> tuple[object, ...]:
        """What the steps read of the roots, each equal only to itself; other roots with the same give the same."""
        return self.roots

    def key(self, store: Store, task: Task) -> bytes:
        """Return the key of the result of a task."""
        return store.key(self._before(store, self.turn_of(task)), *self.read(task))

    def _before(self, store: Store, turn: int) -> bytes:
        """Return what stands for the state before a turn."""
        chain: list[bytes] = self.__dict__.setdefault("_chain", [])
        if not chain:
            chain.append(store.key(type(self).__qualname__, *map(store.itself, self.grounds)))
        for n in range(len(chain) - 1, turn):
            chain.append(store.key(chain[n], self.passed[n]))
        return chain[turn]

    def steps(self, tasks: Sequence[Task]) -> list[Result]:
        """Return the results of tasks, in ascending order of their turns, by this process."""
        return [self.step(self._state_before(self.turn_of(task)), task) for task in tasks]

    def results(
        self, tasks: Sequence[Task], store: Store, workers: Workers, done: Callable[[int, int], object] | None = None
    ) -> list[Result]:
        """Return the results of tasks, in ascending order of their turns.

        Args:
            tasks: The tasks.
            store: What is stored is not made again; what is made is stored.
            workers: Share the work.
            done: Called now and then with how much is done, and of how much.
        """
        keys = [self.key(store, task) for task in tasks] if store.is_on else [b""] * len(tasks)
        missing = [n for n, key in enumerate(keys) if not store.has(key)]
        calls = [(self, [tasks[n] for n in chunk]) for chunk in in_chunks(missing, workers.count)]
        report = None if done is None else lambda ended: done(ended, len(calls))
        with workers.knowing(self):
            made = iter([one for chunk in workers.run(Walk.steps, calls, report) for one in chunk])
        at_rest(type(self))
        new = {n: next(made) for n in missing}
        for n, one in new.items():
            store.add(keys[n], one)
        return [new[n] if n in new else store.get(key) for n, key in enumerate(keys)]

    def _state_before(self, turn: int) -> State:
        """Return the state before a turn."""
        stand = _STANDS.get(type(self))
        if stand is None or not stand.is_on_the_way_of(self, turn):
            stand = _STANDS[type(self)] = _Stand(self.roots, [], self.begin())
        for n in range(len(stand.passed), turn):
            self.go_past(stand.state, n, turn)
            stand.passed.append(self.passed[n])
        state: State = stand.state
        return state


def at_rest(kind: type[Walk[Any, Any, Any]]) -> None:
    """Forget the state of a kind of walk in this process: nobody goes on from there."""
    _STANDS.pop(kind, None)


class _Stand:
    """Where this process stands on its last walk of a kind."""

    def __init__(self, roots: tuple[object, ...], passed: list[Hashable], state: Any) -> None:
        self.roots, self.passed, self.state = roots, passed, state

    def is_on_the_way_of(self, walk: Walk[Any, Any, Any], turn: int) -> bool:
        """Return whether a walk passes here before a turn."""
        same = len(self.roots) == len(walk.roots) and all(a is b for a, b in zip(self.roots, walk.roots, strict=True))
        return same and len(self.passed) <= turn and self.passed == list(walk.passed[: len(self.passed)])


_STANDS: dict[type[Walk[Any, Any, Any]], _Stand] = {}
