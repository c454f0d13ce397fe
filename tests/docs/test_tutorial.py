"""The tutorial runs, from the IFC file to the log and its exports, with the sample building that it names."""

import shutil
from pathlib import Path

import pytest
from doc_commands import ROOT, run_commands


@pytest.mark.slow
def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    shutil.copytree(ROOT / "sample_models", tmp_path / "sample_models", ignore=shutil.ignore_patterns("*.py"))
    monkeypatch.chdir(tmp_path)
    run_commands("docs/tutorial.md", tmp_path, capsys)
