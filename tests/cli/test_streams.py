"""stdout, stderr and stdin that are closed or full, and readers that leave: one sentence, one exit code."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full and a shell")

_NO_STDOUT = {">&-": "stdout is closed", "> /dev/full": "stdout cannot be written: no space left on device"}
_NO_STDERR = ("2>&-", "2> /dev/full", "2>&- <&-")
_RESULTS = ("--version", "schema site", "policy list --json")
_ERRORS = ("nosuch", "nosuch --json", "inspect none.ifc", "inspect none.ifc --json")
_MORE = (
    "--help",
    "plan --help",
    "policy --help",
    "schema log",
    "cranes",
    "cranes --json",
    "policy list",
    "--show-completion bash",
)


def bimvox(arguments: str, tmp_path: Path) -> subprocess.CompletedProcess[str]:
    """Run ``bimvox`` with arguments and redirections of a shell."""
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {sys.executable} -m bimvox_cli {arguments}"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={
            **os.environ,
            "BIMVOX_POLICIES": str(tmp_path / "policies"),
            "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
        },
        check=False,
    )


def _slow(arguments: tuple[str, ...]) -> list[object]:
    return [pytest.param(one, marks=pytest.mark.slow) for one in arguments]


@pytest.mark.parametrize("lost", _NO_STDOUT)
@pytest.mark.parametrize("arguments", [_RESULTS[0], *_slow((*_RESULTS[1:], *_MORE))])
def test_a_result_that_cannot_be_printed_is_one_sentence(arguments: str, lost: str, tmp_path: Path) -> None:
    done = bimvox(f"{arguments} {lost}", tmp_path)
    assert done.returncode == 2
    said = done.stderr.splitlines()
    assert said[0] == f"error: {_NO_STDOUT[lost]}; every output file is complete or unchanged"
    assert len(said) == 2


def test_nothing_to_print_needs_no_stdout(tmp_path: Path) -> None:
    done = bimvox("policy remove none -q >&-", tmp_path)
    assert done.returncode == 2
    assert "stdout" not in done.stderr


@pytest.mark.parametrize("lost", _NO_STDERR)
@pytest.mark.parametrize(
    ("arguments", "code"),
    [("--version", 0), (_ERRORS[0], 2), *(pytest.param(a, 2, marks=pytest.mark.slow) for a in _ERRORS[1:])],
)
def test_words_that_nobody_can_read_are_dropped(arguments: str, code: int, lost: str, tmp_path: Path) -> None:
    done = bimvox(f"{arguments} {lost}", tmp_path)
    assert done.returncode == code
    assert done.stderr == ""


@pytest.mark.parametrize("lost", ["<&- >&- 2>&-", "> /dev/full 2>&1"])
def test_without_any_stream_only_the_exit_code_is_left(lost: str, tmp_path: Path) -> None:
    assert bimvox(f"--version {lost}", tmp_path).returncode == 2


@pytest.mark.parametrize("arguments", ["--help", *_slow((*_RESULTS, *_MORE[1:]))])
@pytest.mark.parametrize("reader", ["| true", "2>&1 | true"])
def test_a_reader_that_leaves_ends_it_quietly(arguments: str, reader: str, tmp_path: Path) -> None:
    done = bimvox(f"{arguments} {reader}", tmp_path)
    assert done.returncode == 141
    assert done.stderr == ""


@pytest.mark.parametrize("arguments", [_ERRORS[1], *_slow((_ERRORS[0], *_ERRORS[2:]))])
@pytest.mark.parametrize("lost", ["| true", ">&-", "> /dev/full"])
def test_an_error_keeps_its_own_sentence_and_code(arguments: str, lost: str, tmp_path: Path) -> None:
    done = bimvox(f"{arguments} {lost}", tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: no")
    assert "stdout" not in done.stderr


def test_an_output_file_never_gets_the_number_of_a_closed_stream(tmp_path: Path) -> None:
    code = (
        "import os, sys; from bimvox_cli.main import run; run(['--version']); "
        "print(os.open(os.devnull, os.O_RDONLY), file=open('number', 'w'))"
    )
    subprocess.run(["bash", "-c", f'{sys.executable} -c "{code}" <&- >&- 2>&-'], cwd=tmp_path, check=False)
    assert int((tmp_path / "number").read_text()) > 2
