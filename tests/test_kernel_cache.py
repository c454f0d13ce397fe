"""Machine code is reused only if everything that it was compiled from is the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from bimvox import kernel_cache
from bimvox.kernel_cache import KernelCache, digest_of
from bimvox.voxelization import columns

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
    kernel = columns.fill_columns
    names = kernel.py_func.__globals__ | {"_SLAB": 1}
    changed = numba.njit(nogil=True)(FunctionType(kernel.py_func.__code__, names))
    changed.targetoptions = kernel.targetoptions
    changed.py_func.__module__, changed.py_func.__qualname__ = kernel.py_func.__module__, kernel.py_func.__qualname__
    assert digest_of(kernel) != digest_of(changed)


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
    cache = KernelCache(module_of()["outer"])
    machine = numba.core.registry.cpu_target.target_context.codegen()
    files = {cache._file((numba.typeof(kind(1.0, 2.0)),), machine) for kind in (Two, turned)}
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


def test_a_folder_that_cannot_be_written_costs_only_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: tmp_path / "file" / "below")
    assert module_of()["outer"](np.int64(2)) == 7
