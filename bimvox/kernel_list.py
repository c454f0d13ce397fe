"""The kernels that a first run needs and the types of their arguments, so that several processes can compile them.

``kernels.json`` holds them in the order of the acts of the demo; `benchmarks/cold.py --write` makes it from the machine
code that these acts left. It only saves time: a kernel that is not in it is compiled on first use.

``python -m bimvox.kernel_list [ACT] forwards|backwards`` compiles them, up to those of an act.
"""

from __future__ import annotations

import importlib
import json
import os
import pickle
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numba
from numba import types

from bimvox.kernel_cache import CALLEE, file_of, is_locked
from bimvox.processes import end_with

_LIST = Path(__file__).with_name("kernels.json")
Words: TypeAlias = Any  # a name (number), [name, dimensions, layout, may be written] (array), {"": ...} (tuple)


@dataclass(frozen=True, slots=True)
class Wanted:
    """A kernel and the types of its arguments.

    Attributes:
        dispatcher: The kernel.
        arguments: Their numba types.
        file: Where its machine code is, once compiled.
    """

    dispatcher: Any
    arguments: tuple[Any, ...]
    file: Path

    def compile(self) -> None:
        """Compile it, or load it if another process did."""
        self.dispatcher.compile(self.arguments)


def wanted(act: str | None = None) -> list[Wanted]:
    """Return the kernels of the demo, each after those that it calls.

    Args:
        act: Up to this act of the demo; None: all of them.

    Raises:
        ValueError: If the demo has no such act.
    """
    acts: dict[str, list[list[Words]]] = json.loads(_LIST.read_text("utf-8"))
    names = list(acts)
    chosen = names if act is None else names[: names.index(act) + 1]
    found = (_wanted(*entry) for name in chosen for entry in acts[name])
    return [one for one in found if one is not None]


def written(folder: Path, known: Sequence[Path]) -> list[list[Words]]:
    """Return the entries of the files of machine code in a folder, in the order in which they were made.

    Args:
        folder: The folder of machine code.
        known: Files to leave out.
    """
    files = sorted({*folder.rglob("*.nbc")} - {*known}, key=lambda file: file.stat().st_mtime_ns)
    entries = []
    for file in files:
        (described,) = (one for one in pickle.loads(file.read_bytes()) if hasattr(one, "argtypes"))
        callee = CALLEE if file.name.split("-")[0].endswith(CALLEE) else ""
        name = f"{described.modname}:{described.qualname}{callee}"
        entries.append([name, *(_words_of(one) for one in described.argtypes)])
    return entries


def _wanted(name: str, *arguments: Words) -> Wanted | None:
    with suppress(ImportError, AttributeError):
        dispatcher, given = _named(name.removesuffix(CALLEE)), tuple(_type_of(one) for one in arguments)
        if name.endswith(CALLEE):
            dispatcher = dispatcher.callee()
        if len(given) == dispatcher.py_func.__code__.co_argcount:
            return Wanted(dispatcher, given, file_of(dispatcher, given))
    return None


def _named(name: str) -> Any:
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _words_of(one: Any) -> Words:
    if isinstance(one, types.Array):
        return [str(one.dtype), one.ndim, one.layout, one.mutable]
    if isinstance(one, types.BaseTuple):
        kind = one.instance_class if isinstance(one, types.BaseNamedTuple) else None
        name = "" if kind is None else f"{kind.__module__}:{kind.__qualname__}"
        return {name: [_words_of(inner) for inner in one]}
    return str(one)


def _type_of(words: Words) -> Any:
    if isinstance(words, str):
        return types.boolean if words == "bool" else getattr(types, words)
    if isinstance(words, list):
        dtype, dimensions, layout, writable = words
        return types.Array(_type_of(dtype), dimensions, layout, readonly=not writable)
    ((name, inner),) = words.items()
    given = [_type_of(one) for one in inner]
    if not name:
        return types.Tuple.from_types(given)
    return types.BaseTuple.from_types(given, _named(name))


def _to_be_made(act: str | None, forwards: bool) -> Iterator[Wanted]:
    """Yield what is not on disk; from the end, without what another process is compiling now."""
    found = wanted(act)
    for one in found if forwards else reversed(found):
        if not one.file.is_file() and (forwards or not is_locked(one.file)):
            yield one


def compile_all(act: str | None = None, *, forwards: bool) -> None:
    """Compile what is not on disk.

    Args:
        act: Up to this act of the demo; None: all of them.
        forwards: From the first kernel on, waiting for what others compile; False: from the last on, leaving it out.
    """
    for one in _to_be_made(act, forwards):
        with suppress(numba.core.errors.NumbaError):  # the kernel takes other arguments by now
            one.compile()


if __name__ == "__main__":
    end_with(os.getppid())
    compile_all(sys.argv[1] if len(sys.argv) > 2 else None, forwards=sys.argv[-1] == "forwards")
