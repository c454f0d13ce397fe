"""The audit of installed packages finds packages that are not those of the lock file."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

import pytest

from supply.audit import findings, main
from supply.lock import Pin

PINS = {"thing": (Pin("thing", "1.0", ("sha256:aa",)), Pin("thing", "2.0", ("sha256:bb",)))}


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """Return a folder in which the package ``thing`` is installed."""
    info = tmp_path / "thing-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: Thing\nVersion: 1.0\n")
    rows = ["thing-1.0.dist-info/RECORD,,"]
    for name in ("thing.py", "thing.pth"):
        (tmp_path / name).write_text("made = 1\n")
        digest = base64.urlsafe_b64encode(hashlib.sha256(b"made = 1\n").digest()).rstrip(b"=").decode()
        rows.append(f"{name},sha256={digest},9")
    (info / "RECORD").write_text("\n".join(rows) + "\n")
    return tmp_path


def test_what_is_locked_and_unaltered_gives_no_finding(installed):
    assert list(findings(PINS, installed)) == []


def test_an_altered_file_is_found(installed):
    (installed / "thing.py").write_text("made = 2\n")
    assert list(findings(PINS, installed)) == ["thing: thing.py is not the file that was installed: its hash differs"]


def test_a_missing_file_is_found(installed):
    (installed / "thing.py").unlink()
    assert list(findings(PINS, installed)) == ["thing: thing.py cannot be read or is missing"]


def test_another_version_and_an_unknown_package_are_found(installed):
    (other,) = findings({"thing": PINS["thing"][1:]}, installed)
    assert other == "thing 1.0 is installed, but the lock file has 2.0"
    (unknown,) = findings({}, installed)
    assert unknown == "thing 1.0 is installed, but it is not in the lock file"


def test_a_build_of_the_locked_version_for_one_kind_of_processor_is_that_version(installed):
    metadata = installed / "thing-1.0.dist-info" / "METADATA"
    metadata.write_text("Metadata-Version: 2.1\nName: Thing\nVersion: 1.0+cpu\n")
    assert list(findings(PINS, installed)) == []
    metadata.write_text("Metadata-Version: 2.1\nName: Thing\nVersion: 1.1+cpu\n")
    (other,) = findings(PINS, installed)
    assert other == "thing 1.1+cpu is installed, but the lock file has 1.0 and 2.0"


@pytest.mark.parametrize("name", ["evil.pth", "sitecustomize.py", "usercustomize.py"])
def test_a_file_that_runs_at_start_up_and_is_of_no_package_is_found(installed, name):
    (installed / name).write_text("import os\n")
    assert list(findings(PINS, installed)) == [f"{name} runs at every start of Python and is of no installed package"]


def test_a_package_without_a_record_is_found(installed):
    (installed / "thing-1.0.dist-info" / "RECORD").unlink()
    first, *_ = findings(PINS, installed)
    assert first == "thing has no record of its files"


def test_a_lock_file_that_cannot_be_read_is_bad_input(tmp_path, capsys):
    assert main([str(tmp_path / "none.txt")]) == 2
    assert "none.txt" in capsys.readouterr().err
