"""Plans and watches under way, each in a process of its own, so that they can be ended without loss."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.processes import python_module, worker_environment
from bimvox.site.component import ConstructionState
from bimvox_pipeline.studio import state
from bimvox_pipeline.studio.folder import Folder
from bimvox_pipeline.studio.obstacles import file_of
from bimvox_pipeline.studio.on_disk import sha256_or_none

_KEPT = 20
_GRACE_S = 5.0
_LAST_LOG_S = 60.0
"""A watch that is ended writes the whole log first."""
_NEWS_S = 10.0
_STUCK = ("rejected", "failed", "missing")
"""Events of a watch after which the last good plan stays."""
_SET = ConstructionState.ASSEMBLED.value


class _Job:
    """A process that plans or watches a site.

    Args:
        kind: ``plan``, ``watch`` or ``document``.
        folder: The folder of the studio.
        site: The site file.
        how: Of a watch: how many times as fast as real time the plan is carried out; empty: it is not. Of a document:
            its suffix, of :data:`DOCUMENTS`.
    """

    def __init__(self, kind: str, folder: Folder, site: Path, how: str = "") -> None:
        self.kind, self.site, self.since = kind, site, datetime.now().astimezone()
        self.log = folder.log_of(site)
        self._files = (site, folder.inside(file_of(site)))
        self._began_with = self._hashes
        self.now: dict[str, Any] = {"stage": None, "done": None, "of": None}
        self.end: dict[str, Any] = {}
        self.is_cancelled = False
        self._events: list[dict[str, Any]] = []
        self._news = threading.Condition()
        self._tail: deque[str] = deque(maxlen=20)
        self._process = subprocess.Popen(
            python_module(
                "bimvox_pipeline.studio.work",
                kind,
                *map(str, (folder.root, site, self.log, self._files[1])),
                how,
            ),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=worker_environment(),
            start_new_session=sys.platform != "win32",  # Ctrl-C reaches the studio alone, which ends its processes
        )
        self._readers = [threading.Thread(target=read, daemon=True) for read in (self._read, self._read_errors)]
        for reader in self._readers:
            reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                found = json.loads(line)
            except ValueError:
                continue
            with self._news:
                if "event" in found:
                    self._events.append(found["event"])
                elif "stage" in found:
                    self.now = found
                else:
                    self.end = found
                self._news.notify_all()
        self._process.wait()
        with self._news:
            self._news.notify_all()

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        self._tail.extend(self._process.stderr)

    @property
    def is_running(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None or self._readers[0].is_alive()

    def stop(self, *, gently: bool) -> None:
        """End it; a log is written whole or not at all. ``gently``: a watch writes the whole log first."""
        self.is_cancelled = True
        if gently and sys.platform != "win32":
            self._process.send_signal(signal.SIGINT)
        else:
            self._process.terminate()
        try:
            self._process.wait(_LAST_LOG_S if gently else _GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
        for reader in self._readers:
            reader.join(_GRACE_S)

    def events_after(self, number: int) -> list[dict[str, Any]]:
        """Return the events from a number on, and wait some seconds for one if there is none."""
        until_s = time.monotonic() + _NEWS_S
        with self._news:
            while len(self._events) <= number and self.is_running and (left_s := until_s - time.monotonic()) > 0.0:
                self._news.wait(min(left_s, 0.5))
            return self._events[number:]

    @property
    def has_events(self) -> bool:
        """Whether anything has happened."""
        return bool(self._events)

    @property
    def _hashes(self) -> tuple[str | None, ...]:
        return tuple(map(sha256_or_none, self._files))

    def state(self, changes: Iterable[str]) -> state.Job:
        """Return what it means for the state of the plan; ``changes``: how the screen differs from the saved file."""
        told = [event for event in self._events if event.get("revision") is not None and event["event"] != "state"]
        if self.kind == "watch" and told:
            last = told[-1]
            return state.Job(self.since, False, bool(last.get("pending")), last["event"] in _STUCK)
        named = ("the site file on disk", "the obstructions")
        differ = zip(named, self._began_with, self._hashes, strict=True)
        return state.Job(self.since, True, changes=(*changes, *(name for name, was, now in differ if was != now)))

    @property
    def done(self) -> list[str] | None:
        """The ids of the parts that a watch has set; None if it carries nothing out."""
        seen = [event for event in self._events if event["event"] in ("state", "clock")]
        found = dict.fromkeys(event["component"] for event in seen if event.get("state") == _SET)
        return list(found) if seen else None

    @property
    def error(self) -> dict[str, Any]:
        """Why it failed."""
        said = self._tail[-1].strip() if self._tail else "it ended without a word"
        return self.end.get("error") or {"error": f"the process failed: {said}", "where": None, "hint": None}

    @property
    def has_failed(self) -> bool:
        """Whether it ended by itself and not well."""
        return not self.is_running and not self.is_cancelled and ("error" in self.end or self._process.returncode != 0)


class Jobs:
    """The plans and watches of a studio, by number.

    Args:
        folder: The folder of the studio.
    """

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._jobs: dict[str, _Job] = {}
        self._lock = threading.Lock()
        self._next = 1

    def plan(self, site: Path) -> str:
        """Start a plan and return its number.

        Raises:
            InputError: If this site is being planned or watched.
        """
        return self._start("plan", site)

    def watch(self, site: Path, speed: float | None) -> str:
        """Start a watch and return its number; ``speed``: carry the plan out, so many times as fast as real time.

        Raises:
            InputError: If this site is being planned or watched.
        """
        return self._start("watch", site, "" if speed is None else f"{speed:g}")

    def document(self, site: Path, suffix: str) -> str:
        """Start to make a document of the newest plan of a site and return its number; ``suffix``: of its file.

        Raises:
            InputError: If there is no plan, or this site is being planned or watched, or a document of it is made.
        """
        if not self._folder.log_of(site).exists():
            raise InputError(f"{site.name} has no plan yet", hint="plan it first")
        return self._start("document", site, suffix)

    def of(self, site: Path) -> _Job | None:
        """Return the plan or the watch that runs for a site; None if there is none."""
        running = (job for job in list(self._jobs.values()) if job.site == site and job.is_running)
        return next((job for job in running if job.kind != "document"), None)

    def _start(self, kind: str, site: Path, how: str = "") -> str:
        with self._lock:
            if any(job.is_running and job.site == site for job in self._jobs.values()):
                raise InputError(
                    f"{site.name} is being planned or watched, or a document of it is made",
                    hint="wait for it, or end it",
                )
            number, self._next = str(self._next), self._next + 1
            self._jobs[number] = _Job(kind, self._folder, site, how)
            for old in [name for name, job in self._jobs.items() if not job.is_running][:-_KEPT]:
                del self._jobs[old]
            return number

    def job(self, number: str) -> _Job:
        """Return the process of a number.

        Raises:
            InputError: If there is none.
        """
        if number not in self._jobs:
            raise InputError(f"there is no plan or watch {number}")
        return self._jobs[number]

    def end(self) -> None:
        """End all that run."""
        for job in list(self._jobs.values()):
            if job.is_running:
                job.stop(gently=False)
