"""Plans under way, each in a process of its own, so that they can be cancelled without loss."""

from __future__ import annotations

import json
import subprocess
import threading
from collections import deque
from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.files import default_output
from bimvox.processes import python_module, worker_environment

_KEPT = 20
_GRACE_S = 5.0


class Job:
    """One plan.

    Args:
        site: The site file; its log is written beside it.
    """

    def __init__(self, site: Path) -> None:
        self.site = site
        self.log = site.parent / default_output(site, ".mcap")
        self._now: dict[str, Any] = {"stage": None, "done": None, "of": None}
        self._end: dict[str, Any] = {}
        self._cancelled = False
        self._tail: deque[str] = deque(maxlen=20)
        self._process = subprocess.Popen(
            python_module("bimvox_pipeline.studio.work", str(site), str(self.log)),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=worker_environment(),
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
            if "stage" in found:
                self._now = found
            else:
                self._end = found
        self._process.wait()

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        self._tail.extend(self._process.stderr)

    @property
    def is_running(self) -> bool:
        """Whether it still runs."""
        return self._readers[0].is_alive()

    def cancel(self) -> None:
        """End it; a log is written whole or not at all."""
        self._cancelled = True
        self._process.terminate()
        try:
            self._process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
        for reader in self._readers:
            reader.join(_GRACE_S)

    def document(self) -> dict[str, Any]:
        """Return how far it is, and how it ended."""
        if self.is_running:
            return {"state": "running", **self._now, "document": None}
        if "document" in self._end:
            return {"state": "done", **self._now, "document": self._end["document"]}
        if self._cancelled:
            return {"state": "cancelled", **self._now, "document": None}
        said = self._tail[-1].strip() if self._tail else "it ended without a word"
        error = self._end.get("error") or {"error": f"the plan failed: {said}", "where": None, "hint": None}
        return {"state": "failed", **self._now, "document": None, **error}


class Jobs:
    """The plans of a studio, by number."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()
        self._next = 1

    def start(self, site: Path) -> str:
        """Start a plan and return its number.

        Raises:
            InputError: If this site is being planned.
        """
        with self._lock:
            if any(job.is_running and job.site == site for job in self._jobs.values()):
                raise InputError(f"{site.name} is being planned already", hint="wait for it, or cancel it")
            number, self._next = str(self._next), self._next + 1
            self._jobs[number] = Job(site)
            for old in [name for name, job in self._jobs.items() if not job.is_running][:-_KEPT]:
                del self._jobs[old]
            return number

    def job(self, number: str) -> Job | None:
        """Return a plan; None if there is none of that number."""
        return self._jobs.get(number)

    def end(self) -> None:
        """Cancel all that run."""
        for job in list(self._jobs.values()):
            if job.is_running:
                job.cancel()
