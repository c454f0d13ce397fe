"""Who is told that a kernel is being compiled: the cache of kernels tells, a progress line shows it.

Imports nothing, so that a progress line does not load a compiler.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

Listener: TypeAlias = Callable[[int, bool], None]
"""Called with the number of kernels that this process has begun to compile, and whether one is being compiled."""

_listeners: list[Listener] = []
_begun = 0
_open = 0


@contextmanager
def compiling_one() -> Iterator[None]:
    """Tell the listeners that a kernel is compiled, or that another process compiles it, in the ``with`` block."""
    global _begun, _open
    _begun, _open = _begun + 1, _open + 1
    _tell()
    try:
        yield
    finally:
        _open -= 1
        _tell()


@contextmanager
def told(listener: Listener) -> Iterator[None]:
    """Call a listener in the ``with`` block whenever compiling begins or ends."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def _tell() -> None:
    for listener in tuple(_listeners):
        listener(_begun, _open > 0)
