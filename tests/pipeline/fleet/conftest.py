from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from fleet_work import carry_out_in_process

SAMPLES = Path(__file__).parents[3] / "sample_models"


@pytest.fixture
def sites(tmp_path: Path) -> Path:
    """Return a folder with the paper's site, an obstruction next to its column, and one on its target."""
    for name in ("paper.ifc", "paper.site.toml", "yard.glb", "yard.site.toml"):
        shutil.copy(SAMPLES / name, tmp_path)
    box = '{"version": 1, "obstructions": [{"id": "box", "box": {"min": [%s], "max": [%s]}}]}'
    (tmp_path / "beside.json").write_text(box % ("0.1, 0.1, 0.0", "0.9, 0.9, 0.9"))
    return tmp_path


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Carry out runs inside this process, one after the other, because starting a process takes seconds."""
    carry_out_in_process(monkeypatch)
