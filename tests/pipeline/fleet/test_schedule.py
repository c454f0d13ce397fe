"""Runs whose process or worker dies are tried again, a bounded number of times, at last alone."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.fleet.runs import RECORDS, Run, Wish, failed, record_file, write_record
from bimvox_pipeline.fleet.schedule import Work, begun_file, carry_out_all

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

    def carry_out(self, work: Work, run: Run, folder: Path) -> None:
        if run.name == "never":
            raise WorkerLostError
        self.tries[run.name] += 1
        begun_file(folder, run.name).write_text("its process ended (SIGKILL)")
        if self.tries[run.name] > self.deaths.get(run.name, 0):
            work(run, folder)
        elif run.name in self.breaks:
            raise WorkerLostError


def recorded(run: Run, folder: Path) -> None:
    write_record(folder, failed(run, "tried", "", None))


def codes(folder: Path, names: str | list[str], progress: SilentProgress | None = None) -> dict[str, str]:
    """Carry out runs and return the codes of their records."""
    (folder / RECORDS).mkdir()
    runs = [Run(name, Wish(Path(name)), leads=True) for name in names]
    carry_out_all(
        runs,
        folder,
        backend="loky",
        jobs=2,
        address=None,
        progress=progress or SilentProgress(),
        work=recorded,
    )
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


def test_progress_counts_the_records_of_these_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    Backend(monkeypatch, {})
    monkeypatch.setattr("bimvox_pipeline.fleet.schedule._LOOK_EVERY_S", 0.01)
    (tmp_path / RECORDS).mkdir()
    write_record(tmp_path, failed(Run("other", Wish(Path("other")), leads=True), "tried", "", None))
    seen: list[tuple[str, int, int]] = []
    progress = SilentProgress()
    monkeypatch.setattr(progress, "report", lambda *told: seen.append(told))

    def recorded_and_seen(run: Run, folder: Path) -> None:
        recorded(run, folder)
        until = time.monotonic() + 10.0
        while ("runs", "ab".index(run.name) + 1, 2) not in seen and time.monotonic() < until:
            time.sleep(0.005)

    runs = [Run(name, Wish(Path(name)), leads=True) for name in "ab"]
    carry_out_all(runs, tmp_path, backend="loky", jobs=2, address=None, progress=progress, work=recorded_and_seen)
    assert set(seen) >= {("runs", 1, 2), ("runs", 2, 2)}
    assert not any(done > 2 for _, done, _ in seen)
