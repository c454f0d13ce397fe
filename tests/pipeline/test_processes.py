"""The grid file does not depend on the number of processes that mesh the model."""

import hashlib
from pathlib import Path

import pytest
from bimvox_cli.main import run

from bimvox.bim.options import MOST_PROCESSES, ReadOptions, default_processes

PREFAB = Path(__file__).parents[2] / "sample_models" / "prefab.ifc"


def test_grid_files_of_one_two_and_three_processes_are_the_same_bytes(tmp_path: Path) -> None:
    digests = []
    for processes in (1, 2, 3):
        out = tmp_path / f"{processes}.zarr.zip"
        options = ["--voxel-size", "0.2", "--processes", str(processes), "-o", str(out), "-q"]
        assert run(["voxelize", str(PREFAB), *options]) == 0
        digests.append(hashlib.sha256(out.read_bytes()).hexdigest())
    assert len(set(digests)) == 1


def test_the_number_may_come_from_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked = []
    monkeypatch.setattr("bimvox.bim.read.read_building", lambda path, options, report: asked.append(options) or 1 / 0)
    for value in ("3", "1"):
        monkeypatch.setenv("BIMVOX_PROCESSES", value)
        run(["voxelize", str(PREFAB), "-o", str(tmp_path / "grid.zarr.zip"), "-q"])
    monkeypatch.setenv("BIMVOX_PROCESSES", "0")
    assert run(["voxelize", str(PREFAB), "-o", str(tmp_path / "grid.zarr.zip"), "-q"]) == 2
    assert [options.processes for options in asked] == [3, 1]


def test_the_default_is_a_few() -> None:
    assert 1 <= default_processes() <= MOST_PROCESSES
    assert ReadOptions().processes == default_processes()
