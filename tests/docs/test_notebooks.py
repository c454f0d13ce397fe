"""The notebooks run from top to bottom, and are kept without outputs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))


def _code_cells(notebook: Path) -> list[dict[str, object]]:
    return [cell for cell in json.loads(notebook.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]


def test_there_are_notebooks():
    assert [notebook.stem for notebook in NOTEBOOKS] == ["environments", "from_ifc_to_plan"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)
def test_a_notebook_is_kept_without_outputs(notebook: Path):
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in _code_cells(notebook))


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)
def test_a_notebook_runs(notebook: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.chdir(notebook.parent)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    program = "\n".join("".join(cell["source"]) for cell in _code_cells(notebook))
    names: dict[str, object] = {}
    exec(compile(program, notebook.name, "exec"), names)
