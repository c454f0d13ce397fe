"""Runs whose process or worker dies are tried again, a bounded number of times, at last alone."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.fleet.runs import RECORDS, Run, Wish, Work, carry_out, failed, record_file
from bimvox_pipeline.fleet.schedule import Execution, begun_file, carry_out_all

from bimvox.progress import SilentProgress


class WorkerLostError(Exception):
    """What a backend raises if a worker is lost."""


class Backend:
    """A backend in this process: ``deaths`` are how often a run dies, ``breaks`` those that take the backend along."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, deaths: dict[str, int], breaks: Sequence[str] = ()) -> None:
        self.deaths, self.breaks, self.tries, self.starts = deaths, breaks, Counter[str](), 0
        monkeypatch.setattr("bimvox_pipeline.fleet.schedule._carry_out_apart", self.carry_out)
        monkeypatch.setattr("bimvox_pipeline.fleet.schedule.opened", self.open)
        monkeypatch.setattr("bimvox_pipeline.fleet.schedule._start_workers", self.start)
        monkeypatch.setattr(
            "bimvox_pipeline.fleet.schedule._worker_lost", lambda _, error: isinstance(error, WorkerLostError)
        )

    @contextmanager
    def open(self, *_: object) -> Iterator[dict[str, Any]]:
        yield {"backend": "sequential", "n_jobs": 1}

    def start(self, *_: object) -> None:
        self.starts += 1

    def carry_out(self, work: Work, run: Run, folder: Path) -> bool:
        if run.name == "never":
            raise WorkerLostError
        self.tries[run.name] += 1
        begun_file(folder, run.name).write_text("its process ended (SIGKILL)")
        if self.tries[run.name] > self.deaths.get(run.name, 0):
            carry_out(work, run, folder)
            return True
        if run.name in self.breaks:
            raise WorkerLostError
        return False


def tried(run: Run, folder: Path) -> dict[str, Any]:
    return failed(run, "tried", "", None)


def codes(folder: Path, names: str | list[str], progress: SilentProgress | None = None) -> dict[str, str]:
    """Carry out runs and return the codes of their records."""
    (folder / RECORDS).mkdir()
    runs = [Run(name, Wish(Path(name)), leads=True) for name in names]
    carry_out_all(runs, folder, Execution(jobs=2), work=tried, progress=progress or SilentProgress())
    assert not list(folder.glob("runs/*.begun"))
    return {name: json.loads(record_file(folder, name).read_bytes())["error"]["code"] for name in names}


def test_runs_that_die_are_tried_again_and_at_last_recorded_as_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    backend, progress = Backend(monkeypatch, {"b": 1, "c": 2, "d": 9, "e": 9}), SilentProgress()
    assert codes(tmp_path, "abcdef", progress) == dict(
        zip("abcdef", ["tried"] * 3 + ["died"] * 2 + ["tried"], strict=True)
    )
    assert backend.tries == {"a": 1, "b": 2, "c": 3, "d": 3, "e": 3, "f": 1}
    assert backend.starts == 0
    assert "b: its process ended (SIGKILL) before it was done" in progress.notes
    error = json.loads(record_file(tmp_path, "d").read_bytes())["error"]
    assert error["message"] == "its process ended (SIGKILL) before it was done, 3 times: out of memory, or a crash"


def test_if_a_lost_worker_ends_the_backend_the_others_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    backend = Backend(monkeypatch, {"a": 9, "c": 1}, breaks="ac")
    assert codes(tmp_path, "abcd") == {"a": "died", "b": "tried", "c": "tried", "d": "tried"}
    assert backend.tries == {"a": 3, "b": 1, "c": 2, "d": 1}
    assert backend.starts == 4


def test_a_backend_that_begins_nothing_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    Backend(monkeypatch, {})
    with pytest.raises(WorkerLostError):
        codes(tmp_path, ["never"])


def test_progress_counts_the_runs_with_a_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    Backend(monkeypatch, {"b": 1, "c": 9})
    progress = SilentProgress()
    seen: list[tuple[int, int | None]] = []
    monkeypatch.setattr(progress, "shown", lambda: seen.append((progress.done, progress.total)))
    codes(tmp_path, "abc", progress)
    assert sorted({*seen}) == [(0, 3), (1, 3), (2, 3)]
