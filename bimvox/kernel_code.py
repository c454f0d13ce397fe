"""Machine code of kernels that call each other, and its files: each kernel's code is in one file only.

Numba copies into each kernel the code of all that it calls, and of all that these call, and optimizes and emits it
again. Here a kernel calls the others by their symbols. What is small is inlined as before; nothing else is copied. A
file names the files that must be loaded before it.
"""

from __future__ import annotations

import hashlib
import pickle
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

_CHECKSUM_BYTES = 32
_LARGE = 80  # blocks; each ends in a branch, and to inline one costs LLVM more than it allows
_FILES: dict[str, str] = {}  # of each kernel that this process compiled or loaded: its symbol and file


class KernelCode(JITCodeLibrary):  # type: ignore[misc]  # numba has no types
    """The machine code of one kernel, without that of the kernels which it calls."""

    _linking_libraries: list[Any]

    def finalize(self) -> None:
        """Link, optimize and emit it."""
        self._own = {one.name for one in self._final_module.functions if not one.is_declaration}
        self._linking_libraries = [one for one in self._linking_libraries if not _is_large(one)]
        super().finalize()

    def _optimize_final_module(self) -> None:
        for one in self._final_module.functions:
            if one.name in _FILES and one.name not in self._own and not one.is_declaration:
                one.linkage = "available_externally"  # to be inlined, not to be emitted
        super()._optimize_final_module()

    def called(self) -> dict[str, str]:
        """Return the symbols and files of the kernels that it calls."""
        functions = self._final_module.functions
        return {one.name: _FILES[one.name] for one in functions if one.name in _FILES and one.name not in self._own}


def _is_large(library: Any) -> bool:
    """Return whether a library is a kernel that LLVM would inline nowhere."""
    kernels = [one for one in library._get_module_for_linking().functions if one.name in _FILES]
    return any(sum(1 for _ in one.blocks) > _LARGE and not _is_always_inlined(one) for one in kernels)


def _is_always_inlined(function: Any) -> bool:
    return any(b"alwaysinline" in words for words in function.attributes)


def remember(result: Any, file: Path) -> None:
    """Take down the file of a kernel that this process compiled or loaded."""
    _FILES[result.fndesc.llvm_func_name] = f"{file.parent.name}/{file.name}"


def content_of(result: Any) -> bytes:
    """Return what the file of a kernel that was compiled just now contains."""
    content: bytes = dumps((*result._reduce(), result.library.called()))
    return content + _checksum(content)


def load(file: Path, target_context: Any) -> Any:
    """Return the kernel in a file; None if it, or one that it calls, is not there, damaged, or of other packages."""
    with suppress(OSError, EOFError, ImportError, AttributeError, pickle.UnpicklingError):
        content = file.read_bytes()
        if content[-_CHECKSUM_BYTES:] != _checksum(content[:-_CHECKSUM_BYTES]):
            return None  # a damaged disk: machine code with a wrong byte may do anything
        target_context.refresh()
        *state, called = pickle.loads(content)
        for symbol, name in called.items():  # a symbol that is nowhere would end the process
            if symbol not in _FILES and load(file.parents[1] / name, target_context) is None:
                return None
        result = CompileResult._rebuild(target_context, *state)
        remember(result, file)
        return result
    return None


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()
