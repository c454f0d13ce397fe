"""What the builder of the wheel says if there is none."""

from __future__ import annotations

from pathlib import Path

import pytest

from supply import wheel


def test_without_a_wheel_or_an_sbom_there_is_a_sentence_and_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(root: Path, locks: object) -> list[Path]:
        raise wheel.NotBuiltError("no SBOM is written: torch 1.0 is not in the lock file")

    monkeypatch.setattr(wheel, "build", refused)
    monkeypatch.chdir(tmp_path)
    assert wheel.main(["constraints.txt"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("no SBOM is written: torch 1.0")
    assert len(err.splitlines()) == 1
