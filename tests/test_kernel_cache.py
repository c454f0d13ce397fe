"""Machine code is reused only if everything that it was compiled from is the same."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from filelock import FileLock

from bimvox import kernel_cache
from bimvox.compiled import _NEEDLESS
from bimvox.kernel_cache import digest_of, file_of, is_locked
from bimvox.progress import told
from bimvox.voxelization import solid

MODULE = '''
"""A module of a kernel and its helper."""
from bimvox.compiled import inline_kernel, kernel
{constant}
@inline_kernel
def inner(x: int) -> int:
    {doc}
    return x * FACTOR{inner}

@kernel
def outer(x: int) -> int:
    return inner(x) + 1

@kernel
def apart(x: int) -> int:
    return x + 2
'''


def module_of(constant: str = "FACTOR = 3", doc: str = '"""Words."""', inner: str = "") -> dict[str, Any]:
    names: dict[str, Any] = {"__name__": "kernels_of_a_test"}
    exec(MODULE.format(constant=constant, doc=doc, inner=inner), names)
    return names


def digests(names: dict[str, Any]) -> tuple[str, str]:
    return digest_of(names["outer"]), digest_of(names["apart"])


def test_words_and_lines_change_nothing() -> None:
    assert digests(module_of()) == digests(module_of("\n\n# why\nFACTOR = 3", doc='"""Other words."""'))


@pytest.mark.parametrize("change", [{"constant": "FACTOR = 4"}, {"constant": "FACTOR = 3.0"}, {"inner": " - 1"}])
def test_what_a_called_kernel_reads_or_does_changes_its_callers_and_no_others(change: dict[str, str]) -> None:
    (outer, apart), (changed, same) = digests(module_of()), digests(module_of(**change))
    assert outer != changed
    assert apart == same


def test_a_constant_of_another_module_is_part_of_the_key() -> None:
    kernel = solid.fill_columns
    names = kernel.py_func.__globals__ | {"_SLAB": 1}
    changed = numba.njit(nogil=True)(FunctionType(kernel.py_func.__code__, names))
    changed.targetoptions = kernel.targetoptions
    changed.py_func.__module__, changed.py_func.__qualname__ = kernel.py_func.__module__, kernel.py_func.__qualname__
    assert digest_of(kernel) != digest_of(changed)


ATTRIBUTES = """
from typing import NamedTuple
from bimvox.compiled import kernel
from bimvox.grid import bricks

class Load(NamedTuple):
    mass: float

def mass():
    return {factor}

@kernel
def outer(load: Load) -> float:
    return load.mass + bricks.{constant}
"""


def test_an_attribute_is_not_the_global_of_its_name() -> None:
    def digest(factor: int = 1, constant: str = "BRICK") -> str:
        names: dict[str, Any] = {"__name__": "kernels_of_a_test"}
        exec(ATTRIBUTES.format(factor=factor, constant=constant), names)
        return digest_of(names["outer"])

    assert digest() == digest(factor=2)
    assert digest() != digest(constant="NO_OWNER")


def test_a_value_without_a_digest_is_named() -> None:
    names = module_of("FACTOR = {1: 2}")
    with pytest.raises(TypeError, match="inner: FACTOR"):
        digest_of(names["outer"])


class Two(NamedTuple):
    a: float
    b: float


def test_named_tuples_differ_by_their_fields(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    class Turned(NamedTuple):
        b: float
        a: float

    turned: Any = Turned
    turned.__name__ = Two.__name__
    turned.__module__, turned.__qualname__ = Two.__module__, Two.__qualname__
    outer = module_of()["outer"]
    files = {file_of(outer, (numba.typeof(kind(1.0, 2.0)),)) for kind in (Two, turned)}
    assert len(files) == 2


def test_a_second_process_compiles_nothing(tmp_path: Path) -> None:
    script = tmp_path / "one.py"
    script.write_text(
        MODULE.format(constant="FACTOR = 3", doc='"""Words."""', inner="")
        + "\nassert outer(2) == 7\nseen = outer.stats\n"
        "print(sum(seen.cache_hits.values()), sum(seen.cache_misses.values()))\n"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    said = [
        subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert [one.split() for one in said] == [["0", "1"], ["1", "0"]]
    for file in (tmp_path / "kernels").rglob("*.nbc"):
        file.write_bytes(file.read_bytes()[:100])  # code that cannot be read is compiled again
    again = subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, check=True).stdout
    assert again.split() == ["0", "1"]


def test_a_damaged_file_is_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    def compiled() -> int:
        outer = module_of()["outer"]
        assert outer(2) == 7
        return sum(outer.stats.cache_misses.values())

    assert (compiled(), compiled()) == (1, 0)
    (file,) = tmp_path.rglob("outer-*.nbc")
    good = file.read_bytes()
    flipped = [bytearray(good) for _ in range(12)]
    for n, one in enumerate(flipped):
        one[n * (len(good) - 1) // 11] ^= 0x55
    for bad in (b"", good[:100], good[:-1], good + b"\n", bytes(len(good)), *map(bytes, flipped)):
        file.write_bytes(bad)
        assert (compiled(), file.read_bytes() != bad, compiled()) == (1, True, 0)


def test_a_folder_that_cannot_be_written_costs_only_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: tmp_path / "file" / "below")
    assert module_of()["outer"](np.int64(2)) == 7


SCRIPT = (
    MODULE.format(constant="FACTOR = 3", doc='"""Words."""', inner="")
    + "\nimport sys; print('ready', flush=True); sys.stdin.readline()\nassert outer(2) == 7\n"
    "print(sum(outer.stats.cache_misses.values()), sum(inner.callee().stats.cache_misses.values()))\n"
)


def test_two_processes_never_compile_the_same(tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text(SCRIPT)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    command = [sys.executable, str(tmp_path / "one.py")]
    processes = [
        subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    said = sorted(process.communicate()[0].split() for process in processes)
    assert [process.returncode for process in processes] == [0, 0]
    assert said == [["0", "0"], ["1", "1"]]


HOLD = """
import sys
from filelock import FileLock
with FileLock(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.readline()
"""


def test_a_process_that_was_killed_while_it_compiled_is_waited_for_no_longer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    outer = module_of()["outer"]
    file = file_of(outer, (numba.int64,))
    file.parent.mkdir(parents=True)
    lock = file.with_suffix(".lock")
    command = [sys.executable, "-c", HOLD, str(lock)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        # A process that has stopped is waited for, but not for ever.
        monkeypatch.setattr(kernel_cache, "_LONGEST_WAIT_S", 0.2)
        assert outer(2) == 7
        assert is_locked(file)
        file.unlink()
        threading.Timer(1.0, holder.kill).start()
        monkeypatch.setattr(kernel_cache, "_LONGEST_WAIT_S", 300.0)
        began = time.monotonic()
        assert module_of()["outer"](2) == 7
        assert 0.5 < time.monotonic() - began < 200
    assert file.is_file()
    assert not is_locked(file)


def test_compiling_is_told_and_loading_is_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    heard: list[tuple[int, bool]] = []
    with told(lambda begun, now: heard.append((begun, now))):
        module_of()["outer"](2)
        first = heard.copy()
        module_of()["outer"](2)
    assert [now for _, now in first] == [True, True, True, False]  # outer, and inner within it
    assert first[1][0] - first[0][0] == 1
    assert heard == first


def test_a_kernel_that_kernels_call_is_compiled_without_what_python_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    names = module_of()
    assert names["outer"](2) == 7

    def made() -> list[str]:
        return sorted(file.name.split("-")[0] for file in tmp_path.rglob("*.nbc"))

    assert made() == ["inner.callee", "outer"]
    (library,) = (one.library for one in names["inner"].callee().overloads.values())
    assert [one.name for one in library.get_defined_functions() if "cpython" in one.name] == []
    again = module_of()  # from the files
    assert again["outer"](2) == 7
    assert again["inner"](2) == 6  # Python may call it all the same
    assert made() == ["inner", "inner.callee", "outer"]


def test_numbas_passes_are_left_out_by_a_name_that_numba_has() -> None:
    class Asked(numba.core.compiler.CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            offered = numba.core.compiler.DefaultPassBuilder.define_nopython_pipeline(self.state).passes
            assert {*_NEEDLESS} < {one for one, _ in offered}
            return super().define_pipelines()

    @numba.njit(pipeline_class=Asked)
    def nothing() -> int:
        return 1

    with pytest.raises(NotImplementedError):
        nothing()


def test_a_kernel_that_cannot_be_compiled_leaves_no_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    outer = module_of()["outer"]
    with pytest.raises(numba.TypingError):
        outer("words")
    for lock in tmp_path.rglob("*.lock"):
        with FileLock(lock, timeout=0):
            pass
