"""``bimvox watch``: a plan kept true to an obstruction file.

Every accepted content of the file makes a revision: a whole log of its own, ``LOG.rNNNN.mcap``, and ``LOG.mcap`` is
replaced by the newest. Lifts whose path still holds are kept as they are. Content that cannot be used changes nothing:
the last good plan stands and the next good content is taken.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bimvox.errors import BimvoxError, LogFileError
from bimvox.site.obstructions import EMPTY, ObstructionSet
from pipeline.artifacts import check_output, default_output
from pipeline.file_watch import FileState, changes, state_of
from pipeline.load_site import LoadedSite, load_obstructions, load_site
from pipeline.plan import (
    document_of,
    log_of,
    obstructed,
    policy_of,
    prepared,
    seed_of,
    write_log_file,
)
from pipeline.policy_choice import PolicyInUse
from pipeline.progress import Progress, SilentProgress
from pipeline.prove import Planned, plan_and_prove

if TYPE_CHECKING:
    from bimvox.planning.assembly import Preparation
    from bimvox.planning.lift import LiftPlan
    from bimvox.site.site import Site


def watch(
    obstructions: Path,
    *,
    site: Path,
    out: Path | None = None,
    once: bool = False,
    seed: int | None = None,
    policy: str | None = None,
    steps: int | None = None,
    progress: Progress,
    stop: threading.Event | None = None,
) -> Iterator[dict[str, Any]]:
    """Plan a site, and plan it again whenever the obstruction file changes.

    Args:
        obstructions: The file; where it does not exist, nothing is in the way.
        site: The site file.
        out: The log; default: the site's name with ``.mcap``, in the current folder. Where it exists and belongs to
            this site, its plan is taken up.
        once: Look once and leave.
        seed: Seed of the training; default: the site file's.
        policy: Id of a policy of the store.
        steps: Training budget in environment steps.
        progress: Told of the stages of the first plan.
        stop: Ends the watch.

    Yields:
        One document per change, see ``bimvox watch --json``.
    """
    target = out or default_output(site, ".mcap")
    check_output(target, inputs=[site, obstructions])
    loaded = load_site(site, progress)
    check_output(target, inputs=[site, obstructions, loaded.config.model.path])
    preparation = prepared(loaded.site, progress)
    chosen = policy_of(loaded, loaded.site, preparation, policy=policy, seed=seed, steps=steps, progress=progress)
    watcher = _Watcher(loaded, preparation, chosen, obstructions, target, seed_of(loaded, seed), progress)
    start = state_of(obstructions)
    yield from watcher.take_up(start)
    if once:
        return
    quiet = SilentProgress()
    watcher.progress = quiet
    start = state_of(obstructions, watcher.files) if watcher.files else start
    try:
        for state in changes(obstructions, lambda: watcher.files, stop or threading.Event(), start):
            yield watcher.change(state)
    except KeyboardInterrupt:  # how a watch is meant to end: every revision is whole on disk already
        progress.note("stopped; the last revision stands")


@dataclass(frozen=True, slots=True, eq=False)
class _Current:
    """The plan that stands."""

    site: Site
    planned: Planned


class _Watcher:
    def __init__(
        self,
        loaded: LoadedSite,
        preparation: Preparation,
        policy: PolicyInUse,
        file: Path,
        target: Path,
        seed: int,
        progress: Progress,
    ) -> None:
        self._loaded, self._preparation, self._policy = loaded, preparation, policy
        self._file, self._target, self._seed = file, target, seed
        self.progress = progress
        self.files: tuple[Path, ...] = ()
        self._revision = _last_revision(target)
        self._current: _Current | None = None

    def take_up(self, state: FileState) -> Iterator[dict[str, Any]]:
        """The first plan: the one in the log where it is of this site and of these obstructions, else a new one."""
        started_s = time.monotonic()
        before = self._plan_in_log()
        try:
            wanted = self._read(state)
        except BimvoxError as error:
            if before is None:
                raise
            self._current = _Current(before.plan.site, before)
            yield self._event("rejected", started_s, message=str(error))
            return
        site = obstructed(self._loaded.site, wanted, self.progress)
        if before is not None and before.plan.site.digest == site.digest:
            self._current = _Current(site, before)
            yield self._event("unchanged", started_s)
            return
        yield self._revise(
            site, before.plan if before else None, started_s, "planned" if before is None else "replanned"
        )

    def change(self, state: FileState) -> dict[str, Any]:
        """What the file holds now, planned; or why the last good plan stands."""
        if state.digest is None:
            return self._event("missing", state.seen_s, message="the file is gone; the last good plan stands")
        try:
            site = obstructed(self._loaded.site, self._read(state), self.progress)
        except BimvoxError as error:
            return self._event("rejected", state.seen_s, message=str(error))
        if self._current is not None and self._current.site.digest == site.digest:
            return self._event("unchanged", state.seen_s)
        previous = self._current.planned.plan if self._current else None
        try:
            return self._revise(site, previous, state.seen_s, "replanned")
        except BimvoxError as error:
            return self._event("failed", state.seen_s, message=str(error))

    def _read(self, state: FileState) -> ObstructionSet:
        if state.digest is None:
            self.progress.note(f"{self._file} does not exist yet: nothing is in the way")
            return EMPTY
        found = load_obstructions(self._file, self._loaded.site)
        self.files = found.files
        return found

    def _revise(self, site: Site, previous: LiftPlan | None, started_s: float, event: str) -> dict[str, Any]:
        planned = plan_and_prove(site, self._preparation, self._policy, previous=previous, progress=self.progress)
        files = dict(self._loaded.files)
        if self._file.exists():
            files[f"obstructions{self._file.suffix.lower()}"] = self._file.read_bytes()
        self._revision += 1
        record = log_of(planned, self._loaded, self._policy, files, seed=self._seed, revision=self._revision)
        history = revision_file(self._target, self._revision)
        write_log_file(history, record, inputs=[])
        write_log_file(self._target, record, inputs=[])
        changed = _changed_cells(self._current.site if self._current else self._loaded.site, site)
        self._current = _Current(site, planned)
        return self._event(event, started_s, previous=previous, changed_cells=changed)

    def _event(
        self,
        event: str,
        started_s: float,
        *,
        previous: LiftPlan | None = None,
        changed_cells: int = 0,
        message: str | None = None,
    ) -> dict[str, Any]:
        document: dict[str, Any] = {
            "event": event,
            "revision": self._revision,
            "changed_cells": changed_cells,
            "kept": [],
            "replanned": [],
            "infeasible": [],
            "log": str(self._target),
        }
        if self._current is not None:
            document |= _outcome(self._current.planned, previous, unchanged=event not in ("planned", "replanned"))
        document["latency_ms"] = round((time.monotonic() - started_s) * 1000.0, 1)
        if message:
            document["message"] = message
        if self._current is not None and event in ("planned", "replanned"):
            document["blocked"] = document_of(self._current.planned, self._policy)["infeasible"]
        return document

    def _plan_in_log(self) -> Planned | None:
        """The plan of an earlier run, if the log is there and its site is this one, obstructions aside."""
        from bimvox.log.reader import read_log

        if not self._target.exists():
            return None
        try:
            record = read_log(self._target)
        except LogFileError as error:
            self.progress.note(f"{self._target} is not taken up: {error.message}")
            return None
        if record.plan.site.fixed_digest != self._loaded.site.fixed_digest:
            self.progress.note(f"{self._target} is of another site; it will be replaced")
            return None
        self._revision = max(self._revision, record.revision)
        return Planned(record.plan, record.motions)


def revision_file(log: Path, revision: int) -> Path:
    """Return where a revision of a log is kept."""
    return log.with_name(f"{log.stem}.r{revision:04d}{log.suffix}")


def _last_revision(log: Path) -> int:
    """The highest revision on disk, so that a restarted watch never writes over history; -1 where there is none."""
    pattern = re.compile(re.escape(log.stem) + r"\.r(\d{4,})" + re.escape(log.suffix))
    found = [int(m.group(1)) for p in log.resolve().parent.iterdir() if (m := pattern.fullmatch(p.name))]
    return max(found, default=-1)


def _changed_cells(before: Site, after: Site) -> int:
    from bimvox.grid.labels import Label

    return int(np.count_nonzero((before.labels == Label.OBSTRUCTION) != (after.labels == Label.OBSTRUCTION)))


def _outcome(planned: Planned, previous: LiftPlan | None, *, unchanged: bool) -> dict[str, Any]:
    """Which lifts were kept as they were, planned anew, or are infeasible."""
    from bimvox.planning.lift import Status

    names = planned.plan.site.components
    before = {lift.component: lift for lift in previous.lifts} if previous else {}
    kept, replanned, infeasible = [], [], []
    for lift in planned.plan.lifts:
        name = names[lift.component].id
        if lift.status is Status.INFEASIBLE:
            infeasible.append(name)
        elif unchanged or _same_path(before.get(lift.component), lift):
            kept.append(name)
        else:
            replanned.append(name)
    return {"kept": kept, "replanned": replanned, "infeasible": infeasible}


def _same_path(before: Any, now: Any) -> bool:
    return before is not None and before.path_vox is not None and np.array_equal(before.path_vox, now.path_vox)
