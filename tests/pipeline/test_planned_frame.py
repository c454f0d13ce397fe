"""The checked-in plan that many tests read is what its command makes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from planned_frame import FILES, FOLDER, make


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the last digits of a log may differ between systems")
def test_the_command_still_makes_the_same_bytes(own_store: Path, tmp_path: Path) -> None:
    make(tmp_path)
    for name in FILES:
        same = (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()
        assert same, f"{name} is of an earlier version: run python -m tests.support.planned_frame"
