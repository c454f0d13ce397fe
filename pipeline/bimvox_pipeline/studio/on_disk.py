"""The newest plan of a site on disk: what it is of, its lifts, and what differs from the files now."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError, InputError
from bimvox.files import sha256_of
from bimvox.library.site import MACHINE, load_obstructions, rasterise, survey_in
from bimvox.log.plan_log import PlanLog, attached_programme, log_times
from bimvox.log.reader import read_log
from bimvox.log.segments import NOW_NS, REPLAN_EVENT, first_plan_of
from bimvox.motion.figures import plan_figures
from bimvox.progress import SilentProgress
from bimvox.site.build import with_obstructions
from bimvox.site.config.file import SITE_FILE, parse_site_config
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.guess import complete_config
from bimvox.site.obstructions.obstruction_set import EMPTY
from bimvox.site.programme import ATTACHED
from bimvox.site.site import Blocker, Site
from bimvox_pipeline.plan import figures_document, infeasible_lifts
from bimvox_pipeline.studio.changes import SiteState, changes_between, changes_of_obstructions, state_of_site
from bimvox_pipeline.studio.opened import Opened
from bimvox_pipeline.studio.setup import Setup
from bimvox_pipeline.studio.state import Counts, Planned, in_words
from bimvox_pipeline.watch.live import driven_until_ns
from bimvox_pipeline.watch.log import read_newest, segment_file
from bimvox_pipeline.watch.simulate import changes_of

_FIGURES = ("crane_hours", "critical_lifts", "highest_utilisation")
_SITE_CHANGED = "the site file"


@dataclass(frozen=True, eq=False)
class PlanOnDisk:
    """The newest plan of a log and the revisions next to it.

    Attributes:
        record: The plan.
        log: The log.
        since: When it was written.
    """

    record: PlanLog
    log: Path
    since: datetime

    @cached_property
    def version(self) -> str:
        """What differs between two plans: the plan with which it began, and the number of its revision."""
        return f"{self._first[:16]}-{self.record.revision}"

    @cached_property
    def _first(self) -> str:
        return first_plan_of(self.record)

    @cached_property
    def _states(self) -> list[SiteState | None]:
        return []

    @cached_property
    def _placed(self) -> dict[str, tuple[Blocker, ...]]:
        return {}

    @cached_property
    def document(self) -> dict[str, Any]:
        """Its figures, and what became of its parts, as JSON."""
        plan, motions = self.record.plan, self.record.motions
        figures = figures_document(plan_figures(plan, motions))
        times = None if self.record.remarks is None else log_times(self.record)  # of values that make sense
        refused = infeasible_lifts(plan, motions)
        return {
            "version": self.version,
            "revision": self.record.revision,
            "figures": {key: figures[key] for key in _FIGURES},
            "time": times.time if times else None,
            "refused": refused,
            **self.revised,
        }

    @cached_property
    def revised(self) -> dict[str, Any]:
        """What its newest revision changed: ``obstructions``, ids of parts ``replanned`` and ``retimed``."""
        made: set[str] = set()
        newest: dict[str, str] = {}
        for number in range(self.record.revision, 0, -1):
            file = segment_file(self.log, number)
            segment = None
            with suppress(BimvoxError):
                segment = read_log(file) if file.exists() else None
            if segment is None or first_plan_of(segment) != self._first:
                break
            said = next((dict(event.fields) for event in segment.events if event.kind == REPLAN_EVENT), None)
            if said is None:
                break
            newest = newest or said
            made |= {segment.plan.site.components[lift.component].id for lift in segment.plan.lifts}
            if said.get("event") != "continued":
                break
        # Ids are separated by spaces, and may have some.
        replanned = [name for name in self._planned if f" {name} " in f" {newest.get('replanned', '')} "]
        retimed = [name for name in self._planned if name in made.difference(replanned)]
        return {
            "obstructions": newest.get("obstructions", "").split(),
            "replanned": replanned,
            "retimed": retimed,
        }

    @cached_property
    def _planned(self) -> list[str]:
        components = self.record.plan.site.components
        return [components[lift.component].id for lift in self.record.planned if lift.path_vox is not None]

    @cached_property
    def done(self) -> list[str]:
        """The ids of the parts that were set when a watch last carried it out."""
        until_ns = int(self.record.metadata.get(NOW_NS, 0))
        with suppress(OSError):
            until_ns = max(until_ns, driven_until_ns(self.log, self._first))
        components = self.record.plan.site.components
        found = [motion for motion in self.record.motions if changes_of(motion)[-1][0] <= until_ns]
        return [components[motion.component].id for motion in found]

    def counts(self, done: int) -> Counts:
        """Return how many lifts have which outcome; ``done``: how many are carried out."""
        refused, waiting = len(self.document["refused"]), len(self.record.planned) - len(self._planned)
        replanned = len(self.revised["replanned"])
        return Counts(len(self._planned), refused, replanned, done, waiting, self.record.revision)

    def planned(self, opened: Opened, wanted: Setup, obstructions: Path, done: int) -> Planned:
        """Return it with what has changed since.

        Args:
            opened: The site that is open.
            wanted: The set-up on the screen.
            obstructions: The obstruction file.
            done: How many lifts are carried out.
        """
        about = self.since, self.counts(done)
        if self.record.plan.site.source["sha256"] != opened.building.source.sha256:
            return Planned(*about, changes=("the model",))
        try:
            config = opened.with_setup(wanted)
        except InputError:
            return Planned(*about, changes=("the set-up",))  # nothing can be planned with it
        if (was := self._state(opened)) is None:
            return Planned(*about, changes=(_SITE_CHANGED,))
        shown = state_of_site(config, opened.building.source.sha256)
        return Planned(*about, self.changed_obstructions(obstructions), tuple(changes_between(was, shown)))

    def planned_of_same(self, given: SiteConfig, content: bytes, obstructions: Path, done: int) -> Planned | None:
        """Return it with what has changed since, if that is the obstructions alone; None if other files differ.

        Neither the model nor what is guessed about it is looked at.

        Args:
            given: The site file as it gives its values.
            content: Its bytes.
            obstructions: The obstruction file.
            done: How many lifts are carried out.
        """
        files = {SITE_FILE: content} | {MACHINE + name: data for name, data in given.machine_files.items()}
        if given.programme_file is not None:
            files[f"{ATTACHED}{given.programme_name}"] = given.programme_file
        if not files.items() <= self.record.attachments.items():
            return None
        return Planned(self.since, self.counts(done), self.changed_obstructions(obstructions))

    def changed_obstructions(self, file: Path) -> tuple[str, ...]:
        """Return the obstructions of a file that differ from those of the plan, in words."""
        try:
            there = self._there(file)
        except BimvoxError:
            return (f"{file.name}, which cannot be used",)
        return tuple(changes_of_obstructions(_blockers(self.record.plan.site), there))

    def _state(self, opened: Opened) -> SiteState | None:
        """Return the state of which it is a plan, from the files that it carries; None if they cannot be read."""
        if not self._states:
            given, model_sha256 = self.record.attachments, opened.building.source.sha256
            try:
                files = {name.removeprefix(MACHINE): data for name, data in given.items() if name.startswith(MACHINE)}
                text = given.get(SITE_FILE, b"").decode("utf-8-sig")
                config = parse_site_config(text, opened.site, files, attached_programme(self.record))
                config = complete_config(config, opened.building)
                self._states.append(state_of_site(config, model_sha256))
            except (BimvoxError, UnicodeDecodeError):
                self._states.append(None)
        return self._states[0]

    def _there(self, file: Path) -> tuple[Blocker, ...]:
        """Return the obstructions of a file on the plan's site.

        Raises:
            InputError: If it cannot be used.
        """
        site = self.record.plan.site
        if not file.exists():
            return _blockers(with_obstructions(site, EMPTY, rasterise))
        found = load_obstructions(file, site, survey_in(self.record))
        if found.digest not in self._placed:
            self._placed.clear()
            self._placed[found.digest] = _blockers(with_obstructions(site, found, rasterise))
        return self._placed[found.digest]


def plan_on_disk(log: Path) -> PlanOnDisk | None:
    """Return the newest plan of a log; None if there is none, or none that can be read."""
    if (found := read_newest(log, None, SilentProgress())) is None:
        return None
    files = [file for file in (log, segment_file(log, found.log.revision)) if file.exists()]
    written_s = max(file.stat().st_mtime for file in files)
    return PlanOnDisk(found.log, log, datetime.fromtimestamp(written_s).astimezone())


def when_written(file: Path) -> str:
    """Return the date and clock time at which a file was written, in words."""
    return in_words(datetime.fromtimestamp(file.stat().st_mtime).astimezone())


def sha256_or_none(file: Path) -> str | None:
    """Return the hash of a file; None if it is not there."""
    return sha256_of(file) if file.exists() else None


def _blockers(site: Site) -> tuple[Blocker, ...]:
    return tuple(one for one in site.blockers if one.kind == "obstruction")
