"""Kernels compiled beforehand, by several processes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bimvox_pipeline.warm_up import Helper, warm_up

from bimvox.errors import BimvoxError
from bimvox.kernel_cache import cache_folder
from bimvox.kernel_list import wanted
from bimvox.progress import SilentProgress

SAMPLE = Path(__file__).parents[2] / "sample_models" / "prefab.ifc"
LEFT_OUT = ("rounded.", "_mixed.", "_numbered-")


@pytest.fixture
def nearly_warm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Use a folder with the machine code of the demo, without that of three small kernels."""
    for one in wanted():
        target = tmp_path / one.file.relative_to(cache_folder())
        if one.file.is_file() and not one.file.name.startswith(LEFT_OUT):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(one.file, target)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.mark.slow
def test_what_is_missing_is_compiled_and_the_second_time_nothing(nearly_warm: Path) -> None:
    missing = sum(not one.file.is_file() for one in wanted())
    assert missing >= len(LEFT_OUT)
    progress = SilentProgress()
    first = warm_up(processes=2, progress=progress)
    assert (first["compiled"], first["kernels"]) == (missing, len(wanted()))
    assert list(progress.seconds) == ["compiling, once"]
    assert all(one.file.is_file() for one in wanted())
    assert warm_up(progress=SilentProgress())["compiled"] == 0


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    monkeypatch.setattr("bimvox_pipeline.warm_up._started", lambda **_: subprocess.Popen([sys.executable, "-c", ""]))
    with pytest.raises(BimvoxError, match=r"no machine code could be stored in .*file"):
        warm_up(progress=SilentProgress())


def test_a_kernel_that_cannot_be_compiled_by_now_is_no_error(
    nearly_warm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bimvox_pipeline.warm_up._started", lambda **_: subprocess.Popen([sys.executable, "-c", ""]))
    document = warm_up(progress=SilentProgress())
    assert document["compiled"] == 0
    assert document["kernels"] > 0


def test_the_helper_starts_when_a_second_kernel_is_compiled_and_ends_with_its_act(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[tuple[str, ...]] = []
    processes: list[subprocess.Popen[bytes]] = []
    waits = [sys.executable, "-c", "import time; time.sleep(600)"]

    def start(*act: str, forwards: bool) -> subprocess.Popen[bytes]:
        assert not forwards
        started.append(act)
        processes.append(subprocess.Popen(waits))
        return processes[-1]

    monkeypatch.setattr("bimvox_pipeline.warm_up._started", start)
    monkeypatch.setattr("bimvox_pipeline.warm_up.processors", lambda: 2)
    helper = Helper("voxelize")
    helper.end()
    helper.compiling(5, True)  # an earlier command of this process compiled, too
    assert started == []  # one kernel is compiled faster than a process starts
    helper.compiling(6, True)
    helper.compiling(7, True)
    assert started == [("voxelize",)]
    helper.end()
    assert [one.returncode is not None for one in processes] == [True]


@pytest.mark.slow
def test_after_a_warm_up_the_demo_compiles_nothing(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}

    def run(*arguments: str) -> str:
        command = [sys.executable, "-m", "bimvox_cli", *arguments, "--json"]
        return subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True).stdout

    assert json.loads(run("warm-up"))["compiled"] == len(wanted())
    there = {*(tmp_path / "kernels").rglob("*.nbc")}
    run("voxelize", str(SAMPLE), "-o", "prefab.zarr.zip")
    run("init", str(SAMPLE), "-o", "prefab.site.toml")
    run("plan", "prefab.site.toml", "-o", "prefab.mcap")
    run("verify", "prefab.mcap")
    run("render", "prefab.mcap", "-o", "prefab.png")
    assert {*(tmp_path / "kernels").rglob("*.nbc")} == there
