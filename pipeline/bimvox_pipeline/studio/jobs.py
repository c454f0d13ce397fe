"""Plans and watches under way, each in a process of its own, so that they can be ended without loss."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES
from bimvox.errors import InputError
from bimvox.files import default_output
from bimvox.processes import python_module, worker_environment
from bimvox_pipeline.studio.obstacles import file_of
from bimvox_pipeline.studio.opened import SITE_SUFFIX
from bimvox_pipeline.watch.log import segments_on_disk

_MOST_FILES = 1000
_DEEPEST = 4


class Folder:
    """A folder.

    Args:
        root: The folder; it exists.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()

    def path(self, relative: object, *suffixes: str) -> Path:
        """Return the path of a file below the folder, links followed.

        Raises:
            InputError: If it is outside, or ends otherwise than with one of the suffixes.
        """
        if not isinstance(relative, str) or not relative or "\0" in relative:
            raise InputError("no file is named", hint="give its path in the folder of the studio")
        found = self.inside(self.root / relative)
        if suffixes and not found.name.lower().endswith(suffixes):
            raise InputError(f"{relative} is not a file of this kind", hint=f"it ends with {' or '.join(suffixes)}")
        return found

    def inside(self, path: Path) -> Path:
        """Return a path, links followed.

        Raises:
            InputError: If it leads out of the folder.
        """
        try:
            found = path.resolve()
        except (OSError, RuntimeError, ValueError):
            raise InputError(f"{path.name} cannot be used: a loop of links, or no name of a file") from None
        if not found.is_relative_to(self.root):
            raise InputError(
                f"{path.name or path} is outside the folder of the studio",
                hint=f"it shows {self.root.name} alone; put the file itself into it, without a link",
            )
        return found

    def log_of(self, site: Path) -> Path:
        """Return the log of a site file; errors as of :meth:`with_revisions`."""
        return self.with_revisions(site.parent / default_output(site, ".mcap"))[0]

    def with_revisions(self, log: Path) -> list[Path]:
        """Return a log, and the revisions next to it.

        Raises:
            InputError: If one of them leads out of the folder.
        """
        found = self.inside(log)
        return [found, *(self.inside(file) for file in segments_on_disk(found).values())]

    def relative(self, path: Path) -> str:
        """Return a path as the page has it."""
        return path.relative_to(self.root).as_posix()

    def told(self, value: Any) -> Any:
        """Return a text, or the texts of a JSON value, with paths below the folder as the page has them."""
        if isinstance(value, str):
            near = value.replace(f"{self.root}{os.sep}", "").replace(str(self.root), self.root.name)
            return near.replace(f"{self.root.parent}{os.sep}", f"..{os.sep}") if self.root.parent.name else near
        if isinstance(value, dict):
            return {key: self.told(own) for key, own in value.items()}
        return [self.told(own) for own in value] if isinstance(value, list) else value

    def files(self) -> list[dict[str, Any]]:
        """Return models, site files and logs, sorted, at most a thousand."""
        found = []
        for path in _below(self.root, 0):
            name = path.name.lower()
            kind = (
                "site" if name.endswith(SITE_SUFFIX)
                else "model" if name.endswith((*IFC_SUFFIXES, *MESH_SUFFIXES))
                else "log" if name.endswith(".mcap")
                else None
            )  # fmt: skip
            if kind is not None:
                found.append({"path": self.relative(path), "kind": kind})
            if len(found) >= _MOST_FILES:
                break
        return found


def _below(folder: Path, depth: int) -> Iterator[Path]:
    """Yield the files of a folder, then those of its folders; links and hidden names are left out."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return
    seen = [entry for entry in entries if not entry.name.startswith(".") and not entry.is_symlink()]
    yield from (Path(entry.path) for entry in seen if entry.is_file())
    if depth < _DEEPEST:
        for entry in seen:
            if entry.is_dir():
                yield from _below(Path(entry.path), depth + 1)


_KEPT = 20
_GRACE_S = 5.0
_LAST_LOG_S = 60.0
"""A watch that is ended writes the whole log first."""
_NEWS_S = 10.0


class _Job:
    """A process that plans or watches a site.

    Args:
        kind: ``plan`` or ``watch``.
        folder: The folder of the studio.
        site: The site file.
        speed: Of a watch: how many times as fast as real time the plan is carried out, as text; empty: it is not.
    """

    def __init__(self, kind: str, folder: Folder, site: Path, speed: str = "") -> None:
        self.site = site
        self.log = folder.log_of(site)
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
                *map(str, (folder.root, site, self.log, folder.inside(file_of(site)))),
                speed,
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

    def _start(self, kind: str, site: Path, speed: str = "") -> str:
        with self._lock:
            if any(job.is_running and job.site == site for job in self._jobs.values()):
                raise InputError(f"{site.name} is being planned or watched already", hint="wait for it, or end it")
            number, self._next = str(self._next), self._next + 1
            self._jobs[number] = _Job(kind, self._folder, site, speed)
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
