"""The line of progress: what is done, and that compiling happens once."""

from __future__ import annotations

import io

import pytest
from bimvox_cli import live
from bimvox_cli.live import LiveProgress
from rich.console import Console

from bimvox.progress import compiling_one, told


def test_off_a_terminal_compiling_is_said_at_once_and_again_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bimvox.progress._compiles_begun", 0)
    out = io.StringIO()
    progress = LiveProgress(Console(file=out, width=80))
    with progress.stage("voxelize", 20), told(progress.compiling):
        progress.advance(3)
        with compiling_one():
            pass
        with compiling_one():
            pass
        assert out.getvalue() == "voxelize, compiling, once: 1 ...\n"
        monkeypatch.setattr(live, "_PLAIN_LINE_EVERY_S", 0.0)
        with compiling_one():
            pass
        progress.advance()
    assert out.getvalue().splitlines() == [
        "voxelize, compiling, once: 1 ...",
        "voxelize, compiling, once: 3 ...",
        "voxelize: 4 of 20",
    ]


def test_on_a_terminal_the_bar_names_the_stage_and_the_kernels() -> None:
    out = io.StringIO()
    progress = LiveProgress(Console(file=out, width=80, force_terminal=True))
    with progress.stage("voxelize", 20), told(progress.compiling):
        with compiling_one():
            assert progress._bars is not None
            (task,) = progress._bars.tasks
            assert task.description.startswith("voxelize, compiling, once: ")
        assert task.description == "voxelize"
