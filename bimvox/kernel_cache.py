"""Machine code of kernels that call each other, on disk, keyed by everything that it was compiled from.

This is a cache as numba's dispatchers ask for one (`numba.core.caching._Cache`): they decide when to load and to save,
numba serializes and rebuilds the machine code. Only the key and the files are ours, for what numba's own cache lacks:

- Its key is the text of the function's file. Machine code also contains the functions that it calls and the constants
  that it reads, from any file, so an edit elsewhere would leave stale machine code. Here the key is the content: the
  byte code of the kernel and of everything that it calls, and the values that they read. A comment or a docstring
  changes nothing; a constant changes only the kernels that read it. Numba reads its key when a function is defined,
  before those that it calls further down exist, so a numba locator cannot give ours.
- It lists the signatures of a function in an index file, which processes read, change and write without a lock. Here
  a file's name follows from its key, so there is no index.
- It lets processes compile the same. Here the first one locks the file and the others wait for it: compiling takes
  seconds. The lock is the operating system's, which releases it when a process ends for any reason.
- It trusts what is on the disk. Here a checksum comes with it.
- It stores in each file the code of all called kernels. Here each is stored once (`KernelCode`).

A wheel for a platform brings the machine code of the demo's kernels, compiled for a common processor (`COMMON`). What
this processor or these packages cannot use is compiled.
"""

from __future__ import annotations

import dis
import enum
import functools
import hashlib
import itertools
import os
import pickle
import sys
import types
import uuid
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
import platformdirs
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature

from bimvox.progress import compiling_one
from bimvox.undisturbed import uncollected

# Machine code of kernels that call each other, and its files: each kernel's code is in one file only.
#
# Numba copies into each kernel the code of all that it calls, and of all that these call, and optimizes and emits it
# again. Here a kernel calls the others by their symbols. What is small is inlined as before; nothing else is copied. A
# file names the files that must be loaded before it.

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


def _remember(result: Any, file: Path) -> None:
    """Take down the file of a kernel that this process compiled or loaded."""
    _FILES[result.fndesc.llvm_func_name] = f"{file.parent.name}/{file.name}"


def _file_content(result: Any) -> bytes:
    """Return what the file of a kernel that was compiled just now contains."""
    content: bytes = dumps((*result._reduce(), result.library.called()))
    return content + _checksum(content)


def _load(file: Path, target_context: Any) -> Any:
    """Return the kernel in a file; None if it, or one that it calls, is not there, damaged, or of other packages."""
    with suppress(OSError, EOFError, ImportError, AttributeError, pickle.UnpicklingError):
        content = file.read_bytes()
        if content[-_CHECKSUM_BYTES:] != _checksum(content[:-_CHECKSUM_BYTES]):
            return None  # a damaged disk: machine code with a wrong byte may do anything
        target_context.refresh()
        *state, called = pickle.loads(content)
        for symbol, name in called.items():  # a symbol that is nowhere would end the process
            if symbol not in _FILES and not any(
                _load(folder / name, target_context) is not None for folder in (cache_folder(), SHIPPED)
            ):
                return None
        result = CompileResult._rebuild(target_context, *state)
        _remember(result, file)
        return result
    return None


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


CALLEE = ".callee"
"""Ends the name of a kernel as other kernels call it; see `bimvox.compiled`."""

_DIGITS = 32
_FORMAT = "called by symbol"  # of the files
_LONGEST_WAIT_S = 300.0  # for a process that has stopped without ending
_SCALARS = (bool, int, float, complex, str, bytes, type(None), np.generic)


def cache_folder() -> Path:
    """Return the folder of the machine code: ``NUMBA_CACHE_DIR`` if set, otherwise the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    return Path(named) if named else Path(platformdirs.user_cache_dir("bimvox")) / "kernels"


SHIPPED = Path(__file__).with_name("machine_code")
"""The folder of the machine code that a wheel brings; a checkout has none."""

COMMON = (
    "x86-64-v3",
    "+avx,+avx2,+bmi,+bmi2,+cx16,+f16c,+fma,+lzcnt,+movbe,+popcnt,+sahf,+sse3,+sse4.1,+sse4.2,+ssse3",
)
"""Name and features of the processor for which a wheel's machine code is compiled, as LLVM has them."""


@functools.cache
def _fits_here() -> bool:
    """Return whether this processor can run what is compiled for the common one."""
    if not SHIPPED.is_dir() or numba.config.CPU_NAME is not None:
        return False
    here = llvmlite.binding.get_host_cpu_features()
    return all(here.get(feature.removeprefix("+"), False) for feature in COMMON[1].split(","))


class KernelCache(_Cache):  # type: ignore[misc]  # numba has no types
    """The machine code of one kernel, one file per signature.

    Args:
        dispatcher: The kernel as numba wraps it.
    """

    def __init__(self, dispatcher: Any) -> None:
        self._dispatcher = dispatcher
        self._digest: str | None = None
        self._is_enabled = True
        self._turns: list[ExitStack] = []

    @property
    def _stem(self) -> str:
        """What the names of this kernel's files begin with."""
        of_callee = CALLEE if self._dispatcher.targetoptions.get("no_cpython_wrapper") else ""
        return f"{self._dispatcher.py_func.__name__}{of_callee}"

    @property
    def cache_path(self) -> str:
        """The folder of this kernel's files."""
        return str(cache_folder() / self._dispatcher.py_func.__module__)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Make one call of the dispatcher's ``compile``; at its end its lock, if it took one, is released."""
        with global_compiler_lock, ExitStack() as turn:
            self._turns.append(turn)
            turn.callback(self._turns.pop)
            yield

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None if it is not on disk or cannot be read, so must be compiled."""
        if not self._is_enabled:
            return None
        codegen = target_context.codegen()
        found, file = _load(self.there(sig, codegen), target_context), self._file(sig, codegen)
        if found is None and self._turns:
            self._turns[-1].enter_context(compiling_one())
            self._turns[-1].enter_context(uncollected())  # looking for garbage took a tenth of the time of compiling
            if _lock(file, self._turns[-1]):  # another process may have compiled it by now
                found = _load(file, target_context)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for a signature; the file appears whole or not at all."""
        file = self._file(sig, data.codegen)
        _remember(data, file)
        if not self._is_enabled:
            return
        if any(not lifted.can_cache for lifted in data.lifted) or data.library.has_dynamic_globals:
            warnings.warn(f"the machine code of {self._dispatcher.py_func.__qualname__} cannot be stored", stacklevel=2)
            return
        part = file.with_name(f"{uuid.uuid4().hex}.part")
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(_file_content(data))
            part.replace(file)
        except OSError:  # disk full or folder not writable: the kernel is compiled again next time
            with suppress(OSError):
                part.unlink()

    def enable(self) -> None:
        """Use the files."""
        self._is_enabled = True

    def disable(self) -> None:
        """Use no files."""
        self._is_enabled = False

    def flush(self) -> None:
        """Remove this kernel's files."""
        for file in Path(self.cache_path).glob(f"{self._stem}-*.nbc"):
            file.unlink(missing_ok=True)

    def symbol_tag(self, arguments: tuple[Any, ...], codegen: Any) -> str:
        """Return what tells this machine code's symbol from all others, in every process: its file's digest."""
        return self._file(arguments, codegen).stem.rpartition("-")[2]

    def there(self, sig: Any, codegen: Any) -> Path:
        """Return the file with the machine code for a signature: the user's, or that of the wheel if only it exists."""
        file = self._file(sig, codegen)
        if _fits_here() and not file.is_file():
            shipped = SHIPPED / file.parent.name / self._file(sig, codegen, COMMON).name
            return shipped if shipped.is_file() else file
        return file

    def _file(self, sig: Any, codegen: Any, processor: tuple[str, str] | None = None) -> Path:
        if self._digest is None:  # on first use: the kernel may call functions defined below it
            self._digest = digest_of(self._dispatcher)
        arguments, _ = normalize_signature(sig)
        platform, *own = codegen.magic_tuple()
        machine = (platform, *(processor or own), numba.__version__, sys.version_info[:2])
        key = (_FORMAT, self._digest, str(arguments), *_fields_of(arguments), machine)
        return Path(self.cache_path) / f"{self._stem}-{_hashed(repr(key).encode())}.nbc"


def _lock(file: Path, turn: ExitStack, wait_s: float | None = None) -> bool:
    """Lock a file of machine code for a turn; False if that is impossible here, so that it may be compiled twice."""
    from filelock import FileLock

    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        turn.enter_context(FileLock(file.with_suffix(".lock"), timeout=_LONGEST_WAIT_S if wait_s is None else wait_s))
    except (OSError, NotImplementedError):
        return False
    return True


def file_of(dispatcher: Any, arguments: tuple[Any, ...]) -> Path:
    """Return the file that holds the machine code of a kernel for arguments of these types, once it is compiled."""
    cache: KernelCache = dispatcher._cache
    return cache.there(arguments, numba.core.registry.cpu_target.target_context.codegen())


def is_locked(file: Path) -> bool:
    """Whether a process is making a file of machine code now."""
    with ExitStack() as stack:
        return not _lock(file, stack, wait_s=0.0)


def digest_of(kernel: Any) -> str:
    """Return a digest of everything that determines the machine code of a kernel, except its argument types.

    Args:
        kernel: A numba dispatcher.

    Raises:
        TypeError: If the kernel reads a global value of a kind that has no digest.
    """
    found: dict[int, bytes] = {}
    waiting = [kernel]
    while waiting:
        one = waiting.pop()
        if id(one) in found:
            continue
        function, read, called = one.py_func, [], []
        for name, value in _read_by(function):
            if hasattr(value, "py_func"):
                called.append(value)
                read.append(f"{name} calls {value.py_func.__module__}.{value.py_func.__qualname__}".encode())
            else:
                read.append(name.encode() + b" is " + _content_of(value, f"{function.__qualname__}: {name}"))
        options = sorted((key, value) for key, value in one.targetoptions.items())
        found[id(one)] = b"\0".join(
            [f"{function.__module__}.{function.__qualname__} {options}".encode(), *_code(function), *read]
        )
        waiting += reversed(called)
    return _hashed(b"\1".join(found.values()))


def _read_by(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Yield the names and values that a function reads from its module and its closure, in a fixed order.

    For a module, yields the members that the function reads: ``samples.SAMPLES``, not ``samples``.
    """
    for name, members in _globals_of(function).items():
        value = function.__globals__.get(name, _ABSENT)
        if isinstance(value, types.ModuleType):
            if value.__name__.startswith("bimvox"):
                yield from ((f"{name}.{member}", getattr(value, member)) for member in members)
        elif value is not _ABSENT:
            yield name, value
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _globals_of(function: types.FunctionType) -> dict[str, dict[str, None]]:
    """Return the global names that a function reads, and the attributes that it reads of each, by its byte code."""
    names: dict[str, dict[str, None]] = {}
    for code in _codes(function.__code__):
        steps = [step for step in dis.get_instructions(code) if step.opname != "EXTENDED_ARG"]
        for step, following in itertools.pairwise(steps):
            if step.opname == "LOAD_GLOBAL":
                members = names.setdefault(step.argval, {})
                if following.opname in {"LOAD_ATTR", "LOAD_METHOD"}:
                    members[following.argval] = None
    return names


_ABSENT = object()


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _code(function: types.FunctionType) -> Iterator[bytes]:
    """Yield byte code, names and constants of a function, without docstring and line numbers."""
    for code in _codes(function.__code__):
        constants = [one for one in code.co_consts if not isinstance(one, types.CodeType) and one != function.__doc__]
        yield repr((code.co_code, code.co_names, code.co_varnames, code.co_freevars, constants)).encode()
    yield repr(function.__defaults__).encode()


def _content_of(value: Any, where: str) -> bytes:
    """Return bytes that differ if two values would give different machine code."""
    if isinstance(value, enum.Enum):
        return repr((type(value).__qualname__, value.name, value.value)).encode()
    if isinstance(value, _SCALARS):
        return repr((type(value).__name__, value)).encode()
    if isinstance(value, np.ndarray):
        return repr((value.dtype.str, value.shape)).encode() + np.ascontiguousarray(value).tobytes()
    if isinstance(value, tuple):
        return b"(" + b",".join(_content_of(one, where) for one in value) + b")"
    if isinstance(value, type) and issubclass(value, enum.Enum):
        return repr([(one.name, one.value) for one in value]).encode()
    if isinstance(value, type):
        return repr((value.__module__, value.__qualname__, getattr(value, "_fields", ()))).encode()
    if isinstance(value, types.BuiltinFunctionType | np.ufunc | numba.types.Type):
        return repr(value).encode()
    if isinstance(value, types.FunctionType) and value.__module__.split(".")[0] in {"numba", "numpy"}:
        return f"{value.__module__}.{value.__qualname__}".encode()
    raise TypeError(f"{where}: a kernel reads a global {type(value).__name__}, for which there is no digest")


def _fields_of(arguments: tuple[Any, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the class and field names of named tuples among argument types; the types' own names omit them."""
    for argument in arguments:
        if isinstance(argument, numba.types.BaseTuple):
            yield from _fields_of(tuple(argument))
        if isinstance(argument, numba.types.BaseNamedTuple):
            one = argument.instance_class
            yield (one.__module__, one.__qualname__, *argument.fields)


def _hashed(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]
