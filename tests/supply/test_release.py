"""A release, made in a temporary clone of the files of this checkout."""

from __future__ import annotations

import datetime
import hashlib
import subprocess
from pathlib import Path

import pytest

from supply.release import NotReleasedError, release

ROOT = Path(__file__).parents[2]
TODAY = datetime.date(2026, 12, 1)
LOCKS = [ROOT / "constraints.txt", ROOT / "constraints-cpu.txt"]


def _git(folder: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=Tester", "-c", "user.email=tester@example.org"]
    return subprocess.run(
        ["git", *identity, *arguments], cwd=folder, capture_output=True, text=True, check=True
    ).stdout.strip()


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a repository with the files of this checkout as they are now, in one commit."""
    for role in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{role}_NAME", "Tester")
        monkeypatch.setenv(f"GIT_{role}_EMAIL", "tester@example.org")
    folder = tmp_path / "clone"
    folder.mkdir()
    needed = ["bimvox", "pipeline", "cli", "pyproject.toml", "setup.py", "README.md", "LICENSE", "CHANGELOG.md"]
    listed = _git(ROOT, "ls-files", "--cached", "--others", "--exclude-standard", *needed, ".gitignore")
    for name in filter(None, listed.splitlines()):
        if (ROOT / name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes((ROOT / name).read_bytes())
    changelog = folder / "CHANGELOG.md"
    older = changelog.read_text("utf-8").removeprefix("# Changelog\n")
    changelog.write_text(f"# Changelog\n\n## 9.1.0 (unreleased)\n\n- **New.** A thing.\n{older}", "utf-8")
    _git(folder, "init", "--quiet", "--initial-branch", "main")
    _git(folder, "add", "--all")
    _git(folder, "commit", "--quiet", "--message", "Everything")
    return folder


@pytest.mark.slow
def test_version_changelog_wheel_sbom_checksums_and_tag(clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("supply.wheel.can_compile", lambda: False)
    made = release(clone, "9.1.0", LOCKS, TODAY)
    names = [file.name for file in made]
    assert names == ["bimvox-9.1.0-py3-none-any.whl", "bimvox-9.1.0-py3-none-any.whl.cdx.json", "SHA256SUMS"]
    for line in made[-1].read_text().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256((made[-1].parent / name).read_bytes()).hexdigest() == digest
    assert len(made[-1].read_text().splitlines()) == 2
    assert '__version__ = "9.1.0"' in (clone / "bimvox" / "version.py").read_text()
    assert "\n## 9.1.0 (2026-12-01)\n" in (clone / "CHANGELOG.md").read_text("utf-8")
    assert _git(clone, "status", "--porcelain") == ""
    assert _git(clone, "log", "-1", "--format=%s") == "Release 9.1.0"
    assert _git(clone, "rev-parse", "v9.1.0^{commit}") == _git(clone, "rev-parse", "HEAD")
    told = _git(clone, "tag", "--list", "v9.1.0", "--format=%(contents)")
    assert "**New.** A thing." in told
    assert "0.1.0" not in told
    with pytest.raises(NotReleasedError, match="released already"):
        release(clone, "9.1.0", LOCKS, TODAY)


@pytest.mark.parametrize(
    ("version", "spoil", "why"),
    [
        ("nine", "", "is not a version"),
        ("9.2.0", "", "no section"),
        ("9.1.0", "untracked.txt", "not clean"),
        ("9.1.0", "--branch", "branch other"),
        ("0.0.1", "CHANGELOG.md", "not before"),
    ],
)
def test_what_is_no_release_changes_nothing(clone: Path, version: str, spoil: str, why: str) -> None:
    if spoil == "--branch":
        _git(clone, "switch", "--quiet", "--create", "other")
    elif spoil == "CHANGELOG.md":
        text = (clone / spoil).read_text("utf-8").replace("## 9.1.0", "## 0.0.1")
        (clone / spoil).write_text(text, "utf-8")
        _git(clone, "commit", "--quiet", "--all", "--message", "Older")
    elif spoil:
        (clone / spoil).write_text("x")
    before = _git(clone, "rev-parse", "HEAD"), (clone / "bimvox" / "version.py").read_bytes()
    with pytest.raises(NotReleasedError, match=why):
        release(clone, version, LOCKS, TODAY)
    assert (_git(clone, "rev-parse", "HEAD"), (clone / "bimvox" / "version.py").read_bytes()) == before
    assert not (clone / "dist").exists()
    assert _git(clone, "tag", "--list") == ""
