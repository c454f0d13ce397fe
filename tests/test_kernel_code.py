"""A kernel's machine code refers to the kernels that it calls; their files are loaded before it."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from bimvox.kernel_cache import COMMON

SCRIPT = """
import json, math, os, sys
from pathlib import Path
from bimvox import kernel_cache
from bimvox.compiled import kernel

if "SHIPPED" in os.environ:
    kernel_cache.SHIPPED = Path(os.environ["SHIPPED"])
if "FEATURES" in os.environ:
    kernel_cache.COMMON = (kernel_cache.COMMON[0], os.environ["FEATURES"])

def kernels(factor):
    @kernel
    def large(x):
        total = 0.0
        for n in range(50):
STEPS
        return total + 50 * factor

    @kernel
    def outer(x):
        return large(x) + large(x + 1.0)

    return large.callee(), outer

def defined(dispatcher):
    return [one.name for library in dispatcher.overloads.values() for one in library.library.get_defined_functions()]

for factor in sys.argv[1:]:
    large, outer = kernels(float(factor))
    value = outer(2.0) - 100 * float(factor)
    made = [sum(one.stats.cache_misses.values()) for one in (outer, large)]
    loaded = [sum(one.stats.cache_hits.values()) for one in (outer, large)]
    print(json.dumps([value, made, loaded, sum("large" in name for name in defined(outer))]))
"""
STEP = "            total += math.sin(x * {0}) * math.cos(x + n) + math.exp(-n * x) * math.atan(x - {0})"


def said(folder: Path, *factors: str, **names: str) -> list[list[Any]]:
    script = folder / "kernels_of_a_test.py"
    script.write_text(SCRIPT.replace("STEPS", "\n".join(STEP.format(k) for k in range(1, 8))))  # too large to inline
    command = [sys.executable, str(script), *factors]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "kernels")} | names
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.slow
def test_what_a_kernel_calls_is_not_in_its_file_but_loaded_before_it(tmp_path: Path) -> None:
    ((value, *made),) = said(tmp_path, "3")
    assert made == [[1, 1], [0, 0], 0]
    three = set(tmp_path.rglob("large.callee-*.nbc"))
    ((other, *made),) = said(tmp_path, "4")  # kernels with the same names and types
    assert made == [[1, 1], [0, 0], 0]
    assert abs(other - value) < 1e-6
    loaded = said(tmp_path, "3", "4")
    assert [one[1:3] for one in loaded] == [[[0, 0], [1, 0]]] * 2
    assert [one[0] for one in loaded] == [value, other]
    (file,) = three
    file.unlink()  # then its caller is compiled again as well, and no other kernel
    again = said(tmp_path, "3", "4")
    assert [one[1:3] for one in again] == [[[1, 1], [0, 0]], [[0, 0], [1, 0]]]
    assert [one[0] for one in again] == [value, other]


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the common processor is an x86-64")
def test_machine_code_of_the_wheel_is_used_if_processor_and_kernel_fit(
    tmp_path: Path,
) -> None:
    wheel, here = tmp_path / "wheel", tmp_path / "here"
    for folder in (wheel, here):
        folder.mkdir()
    name, features = COMMON
    ((value, *_),) = said(wheel, "3", NUMBA_CPU_NAME=name, NUMBA_CPU_FEATURES=features)
    shipped = {"SHIPPED": str(wheel / "kernels")}
    assert said(here, "3", **shipped) == [[value, [0, 0], [1, 0], 0]]
    assert not list(here.rglob("*.nbc"))
    ((_, *made),) = said(here, "4", **shipped)  # another kernel
    assert made == [[1, 1], [0, 0], 0]
    ((other, *made),) = said(here, "3", **shipped, FEATURES=f"{features},+of-another-processor")
    assert (other, made) == (value, [[1, 1], [0, 0], 0])


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the common processor is an x86-64")
def test_a_kernel_that_calls_one_of_the_wheel_is_loaded_again(tmp_path: Path) -> None:
    wheel, here = tmp_path / "wheel", tmp_path / "here"
    for folder in (wheel, here):
        folder.mkdir()
    name, features = COMMON
    ((value, *_),) = said(wheel, "3", NUMBA_CPU_NAME=name, NUMBA_CPU_FEATURES=features)
    (caller,) = wheel.rglob("outer-*.nbc")
    caller.unlink()
    shipped = {"SHIPPED": str(wheel / "kernels")}
    assert said(here, "3", **shipped) == [[value, [1, 0], [0, 1], 0]]
    assert [file.name.split("-")[0] for file in here.rglob("*.nbc")] == ["outer"]
    assert said(here, "3", **shipped) == [[value, [0, 0], [1, 0], 0]]
