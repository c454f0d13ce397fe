"""The soak distinguishes grids, errors and defects; the comparison of kernels finds differences."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import kernels
from benchmarks.many_files import judged, summary

ROOT = Path(__file__).parents[2]
FRAME = ROOT / "sample_models" / "frame.ifc"


@pytest.mark.slow
def test_a_folder_of_good_and_bad_files(tmp_path: Path) -> None:
    folder, table = tmp_path / "models", tmp_path / "table.jsonl"
    folder.mkdir()
    shutil.copy(FRAME, folder / "good.ifc")
    (folder / "other.ifc").write_bytes(b"%PDF")
    command = [sys.executable, "-m", "benchmarks.many_files", str(folder), "--json", str(table), "--truncate", "1"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {row["file"]: row for row in map(json.loads, table.read_text().splitlines())}
    assert rows["good.ifc"]["outcome"] == "grid"
    assert rows["good.ifc"]["parts"] == 8
    assert rows["other.ifc"]["outcome"] == "error"
    assert [row["outcome"] for name, row in rows.items() if name.startswith("truncate:")] == ["error"]
    again = subprocess.run([*command, "--resume"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert "[1/" not in again.stdout
    assert "| error | 2 |" in again.stdout


@pytest.mark.parametrize(
    ("code", "said", "complained", "late_s", "why"),
    [
        (-11, "", "", None, "SIGSEGV"),
        (0, "", "", 5.0, "not done after 5 s"),
        (1, '{"error": {"code": "x"}}', "", None, "exit code 1"),
        (2, '{"error": {"code": "fault", "message": "oh"}}', "", None, "oh"),
        (2, '{"error": {"code": "ifc", "message": "m", "hint": "h"}}', "Traceback (most recent", None, "exit code 2"),
        (70, "no json", "boom", None, "boom"),
    ],
)
def test_what_counts_as_a_defect(code: int, said: str, complained: str, late_s: float | None, why: str) -> None:
    row = judged(code, said, complained, late_s)
    assert row["outcome"] == "DEFECT"
    assert why in row["why"]
    assert "DEFECT a.ifc" in summary([{"file": "a.ifc", "wall_s": 1.0, "peak_mb": 1, **row}])


def test_parts_are_compared_by_their_cells() -> None:
    ours = {"wall_s": 1.0, "cpu_s": 1.0, "cells": {"a": (5, "x"), "b": (6, "y")}}
    loop = {"wall_s": 4.0, "cpu_s": 3.0, "cells": {"a": (5, "x"), "b": (7, "z"), "c": (1, "w")}}
    row = {"file": "a.ifc", "ours": ours, "loop": loop, "iterator": {"why": "not done"}}
    assert kernels.differences(row) == (1, [(6, 7)])
    assert "wall time median 4.0x" in kernels.summary([row])
    assert "same cells: 1 of 3; 1 missing" in kernels.summary([row])
