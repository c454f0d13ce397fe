"""The code blocks of the documents, and a way to run them one after the other as a reader does."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from bimvox_cli.main import run

from docs.reference.__main__ import FOLDERS, pages

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "ARCHITECTURE.md",
    *(one for one in sorted((ROOT / "docs").rglob("*.md")) if one.relative_to(ROOT / "docs").parts[0] not in FOLDERS),
]
"""The pages that people write."""


def name_of(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


def text_of(name: str) -> str:
    """Return the text of a page by its path; that of a page of a command or format follows from the code."""
    in_docs = name.removeprefix("docs/")
    return pages()[in_docs] if in_docs.startswith(FOLDERS) and "/" in in_docs else (ROOT / name).read_text("utf-8")


def blocks(name: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text_of(name), re.M | re.S)


def commands(name: str) -> list[list[str]]:
    lines = [line for block in blocks(name, "sh") for line in block.splitlines()]
    return [words for words in (shlex.split(line, comments=True) for line in lines) if words]


def run_commands(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Run the commands of a document in a folder, which is the working directory."""
    for words in commands(name):
        line = shlex.join(words)
        if words[0] == "make":
            done = subprocess.run(["make", "-n", *words[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"{line}: {done.stderr}"
            continue
        assert words[0] == "bimvox", line
        if words[1] == "watch" and "--once" not in words:
            _watch_a_while(words, folder)
        else:
            assert run(words[1:]) == 0, f"{line}: {capsys.readouterr().err}"
        printed = capsys.readouterr().out
        if "--json" in words:
            assert isinstance(json.loads(printed), dict), line
        if "-o" in words:
            out = folder / words[words.index("-o") + 1]
            assert out.is_dir() or out.stat().st_size > 0, line


def _watch_a_while(words: list[str], folder: Path) -> None:
    """Run a watch until it has a plan, then end it as a user does."""
    program = [sys.executable, "-c", "import sys; from bimvox_cli.main import run; sys.exit(run())"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [*program, *words[1:], "--json"], cwd=folder, stdout=subprocess.PIPE, text=True, env=environment
    ) as watch:
        assert watch.stdout is not None
        first: dict[str, Any] = json.loads(watch.stdout.readline())
        watch.send_signal(signal.SIGINT)
        watch.stdout.read()
        assert watch.wait(60) == 0
    assert (folder / first["log"]).is_file()
