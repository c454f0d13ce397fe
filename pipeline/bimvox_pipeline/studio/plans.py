"""The plans of a studio: of what each is a plan, and its page, revisions and documents."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.files import require_input
from bimvox.progress import SilentProgress
from bimvox.site.config.file import load_site_config, read_site_file
from bimvox_pipeline.render.revisions import page_of_log
from bimvox_pipeline.studio.changes import changes_between, state_of_site
from bimvox_pipeline.studio.documents import DOCUMENTS
from bimvox_pipeline.studio.folder import Folder
from bimvox_pipeline.studio.jobs import Jobs
from bimvox_pipeline.studio.obstacles import file_of
from bimvox_pipeline.studio.on_disk import PlanOnDisk, plan_on_disk, sha256_or_none, when_written
from bimvox_pipeline.studio.opened import SITE_SUFFIX
from bimvox_pipeline.studio.setup import read_setup
from bimvox_pipeline.studio.sites import FileState, Kept, Sites, state_of_file
from bimvox_pipeline.studio.state import Planned, state_of
from bimvox_pipeline.watch.live import live_logs
from bimvox_pipeline.watch.log import newest_log, segments_on_disk


class Plans:
    """The plans that are on disk, read again when their files change.

    Args:
        folder: The folder of the studio.
        jobs: What is under way.
        sites: The sites that are open.
    """

    def __init__(self, folder: Folder, jobs: Jobs, sites: Sites) -> None:
        self._folder, self._jobs, self._sites = folder, jobs, sites
        self._lock, self._reading = threading.Lock(), threading.Lock()
        self._plans: Kept[tuple[FileState, ...], PlanOnDisk | None] = Kept()
        self._pages: Kept[tuple[FileState, ...], bytes] = Kept()

    def state(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Return the state of a site's plan, and the plan on disk.

        Without a set-up, the plan is compared with the site file as it is saved, otherwise also with what the page
        shows.
        """
        site = self._folder.path(asked.get("path"), SITE_SUFFIX)
        obstructions = self._folder.inside(file_of(site))
        there = {"sha256": sha256_or_none(site), "obstructions_sha256": sha256_or_none(obstructions)}
        log = self._folder.log_of(site)
        found = None if there["sha256"] is None else self._plan_on_disk(log)
        job = self._jobs.of(site)
        done = None if job is None else job.done
        if done is None:
            done = found.done if found else []
        plan: Planned | None = None
        changes: list[str] = []
        if job is not None and job.kind == "plan":
            plan = None if found is None else Planned(found.since, found.counts(len(done)))
            changes = self._unsaved(asked) if "setup" in asked else []
        elif found is not None:
            plan = self._planned(asked, site, there["sha256"], found, len(done))
        state = state_of(plan, None if job is None else job.state(changes))
        document = found and {**found.document, "page": self.page_of(log), "done": done}
        return {**there, **self._folder.told(state.to_dict()), "plan": document}

    def _planned(self, asked: dict[str, Any], site: Path, sha256: str | None, found: PlanOnDisk, done: int) -> Planned:
        """Return the plan on disk with what has changed since, on the screen and on disk."""
        obstructions, by_page = self._folder.inside(file_of(site)), "setup" in asked
        if not by_page and (same := self._of_same_files(site, found, done)) is not None:
            return same
        opened = self._sites.opened(asked.get("path"), anew=not by_page)
        wanted = read_setup(asked["setup"]) if by_page else opened.setup
        plan = found.planned(opened, wanted, obstructions, done)
        if wanted != opened.setup and not plan.changes:
            saved = found.planned(opened, opened.setup, obstructions, done).changes
            plan = replace(plan, changes=tuple(f"{words} in the saved file" for words in saved))
        more = []
        if by_page and not asked.get("sha256") == opened.sha256 == sha256:
            more.append("the site file on disk")
        if not self._sites.has_its_model(opened):
            more.append("the model on disk")
        return replace(plan, changes=(*more, *plan.changes))

    def _of_same_files(self, site: Path, found: PlanOnDisk, done: int) -> Planned | None:
        """Return a plan if its site file and model are byte by byte those on disk: no model has to be read for it."""
        content = read_site_file(site)
        given = load_site_config(site, content)
        model = given.model.path
        if not model.exists() or self._sites.hash_of(model) != found.record.plan.site.source["sha256"]:
            return None
        return found.planned_of_same(given, content, self._folder.inside(file_of(site)), done)

    def _unsaved(self, asked: dict[str, Any]) -> list[str]:
        """Return how the set-up on the screen differs from the saved file."""
        opened = self._sites.opened(asked.get("path"))
        both = (opened.setup, read_setup(asked["setup"]))
        return changes_between(*(state_of_site(opened.with_setup(one), "") for one in both))

    def found(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Return what the folder holds of a site: the state of its plan, its revisions and documents.

        ``against``: another site file of the same model; what this one differs in is said. ``whole``: also its set-up
        and how it serves the parts.
        """
        site = self._folder.saved_site(asked)
        state = self.state({"path": asked.get("path")})
        log, given = self._folder.log_of(site), load_site_config(site)
        document: dict[str, Any] = {"path": self._folder.relative(site), "name": given.name or _stem(site), **state}
        document["revisions"] = [
            {"revision": number, "page": self.page_of(file), "when": when_written(file)}
            for number, file in segments_on_disk(log).items()
        ]
        made = [self._folder.inside(log.with_name(log.stem + suffix)) for suffix in DOCUMENTS]
        there = [file for file in made if file.exists()]
        newest = newest_log(log) if there and log.exists() else None
        document["documents"] = [self._document(file, newest) for file in there]
        if asked.get("against") is not None:
            other = load_site_config(require_input(self._folder.path(asked["against"], SITE_SUFFIX)))
            document["differs"] = changes_between(*(state_of_site(one, "") for one in (other, given)))
        if asked.get("whole"):
            opened = self._sites.opened(asked.get("path"), anew=True)
            document |= {"setup": opened.setup_document, "answer": opened.tried(opened.setup)}
        return document

    def _document(self, file: Path, newest: Path | None) -> dict[str, Any]:
        """Return a document: where it is, when it was written, and whether it is of the newest plan."""
        if newest is None:
            is_of_plan = False
        elif file.suffix == ".html":
            is_of_plan = self._sites.hash_of(newest)[:16].encode() in file.read_bytes()
        else:
            is_of_plan = file.stat().st_mtime_ns >= newest.stat().st_mtime_ns
        address = f"/document/{self._folder.relative(file)}"
        return {"name": file.name, "page": address, "when": when_written(file), "is_of_plan": is_of_plan}

    def _plan_on_disk(self, log: Path) -> PlanOnDisk | None:
        """Return the newest plan of a log, read again if one of its files has changed."""
        files = [file for file in self._folder.with_revisions(log) if file.exists()]
        if not files:
            return None
        files += [self._folder.inside(file) for file in live_logs(log).values()]
        key = tuple(map(state_of_file, files))
        with self._reading:
            if key not in self._plans:
                self._plans[key] = plan_on_disk(log)
            return self._plans[key]

    def page_of(self, log: Path) -> str:
        """Return the address of the page of a log."""
        return f"/page/{self._folder.relative(log)}"

    def page(self, relative: str) -> bytes:
        """Return the page of a log and its later revisions, proven now."""
        log = self._folder.path(relative, ".mcap")
        if not log.exists():
            raise InputError(f"there is no {relative}", hint="plan the site first")
        files = self._folder.with_revisions(log)
        key = tuple(map(state_of_file, files))
        if key not in self._pages:
            made = page_of_log(log, proven=True, progress=SilentProgress())
            with self._lock:
                self._pages[key] = made
            return made
        return self._pages[key]


def _stem(site: Path) -> str:
    return site.name.removesuffix(SITE_SUFFIX)
