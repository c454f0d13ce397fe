"""What the builder of the wheel says if there is none."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

from supply import wheel
from supply.machine_code import TAG

ROOT = Path(__file__).parents[2]
ME = ["-c", "user.name=Tester", "-c", "user.email=tester@example.org"]


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


def test_a_wheel_with_machine_code_is_for_this_platform_and_the_other_one_for_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compiled(folder: Path) -> int:
        (folder / "bimvox.grid").mkdir()
        (folder / "bimvox.grid" / "kernel-0.nbc").write_bytes(b"code")
        return 1

    root = tmp_path / "checkout"
    shutil.copytree(ROOT, root, ignore=lambda *_: {".git", ".venv", "dist", "build", "tests", "__pycache__", "docs"})
    for command in (["init", "--quiet"], ["add", "pyproject.toml"], [*ME, "commit", "--quiet", "--message", "one"]):
        subprocess.run(["git", *command], cwd=root, check=True)
    monkeypatch.setattr(wheel, "can_compile", lambda: True)
    monkeypatch.setattr(wheel, "compile_into", compiled)
    made = [file.name for file in wheel.build(root, [ROOT / "constraints.txt", ROOT / "constraints-cpu.txt"])]
    wheels = [name for name in made if name.endswith(".whl")]
    assert [f"{name}.cdx.json" in made for name in wheels] == [True, True]
    contents = [set(zipfile.ZipFile(root / "dist" / name).namelist()) for name in wheels]
    assert [name.split("-", 2)[2] for name in wheels] == [f"{TAG}.whl", "py3-none-any.whl"]
    assert contents[0] - contents[1] >= {"bimvox/machine_code/bimvox.grid/kernel-0.nbc"}
    assert not any("machine_code/" in name for name in contents[1])
    assert not (root / "bimvox" / "machine_code").exists()
