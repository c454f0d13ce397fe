"""What the studio answers: sites opened, tried and saved, plans and watches, files put into its folder."""

from __future__ import annotations

import gc
import json
from pathlib import Path
from typing import IO, Any, TypeGuard

from starlette.responses import Response

from bimvox.errors import InputError
from bimvox.files import require_input
from bimvox_pipeline.studio.documents import DOCUMENTS
from bimvox_pipeline.studio.folder import Folder
from bimvox_pipeline.studio.jobs import Jobs
from bimvox_pipeline.studio.obstacles import boxes_of, file_of, write_boxes
from bimvox_pipeline.studio.opened import SITE_SUFFIX, ChangedMeanwhileError, Opened
from bimvox_pipeline.studio.plans import Plans
from bimvox_pipeline.studio.saving import save, save_variant
from bimvox_pipeline.studio.setup import read_setup
from bimvox_pipeline.studio.sites import Sites
from bimvox_pipeline.studio.uploading import put

_PICTURE_PX = (960, 640)
_MOST_DEG = 3600.0


class Studio:
    """What a studio knows between requests.

    Args:
        folder: The folder whose files it shows.
        token: What every request must carry.
    """

    def __init__(self, folder: Path, token: str) -> None:
        self.folder, self.token = Folder(folder), token
        self.jobs = Jobs(self.folder)
        self._sites = Sites(self.folder)
        self.plans = Plans(self.folder, self.jobs, self._sites)

    def open(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Open a site."""
        found = self._sites.opened(asked.get("path"), anew=True)
        model = found.site.parent / found.given.model.path
        document = found.document(self.folder.relative(found.site)) | {"model": self.folder.relative(model.resolve())}
        # What is open stays: without this, every collection looks at all of it, in the middle of a drag.
        gc.unfreeze()
        gc.collect()
        gc.freeze()
        return document

    def tried(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Try a set-up."""
        return self._sites.opened(asked.get("path")).tried(read_setup(asked.get("setup")))

    def picture(self, asked: dict[str, Any]) -> Response:
        """Draw a set-up in 3-D; a header says where its ground is."""
        turn_deg = asked.get("turn_deg", 0)
        if not _is_number(turn_deg) or not abs(turn_deg) <= _MOST_DEG:
            raise InputError("turn_deg is an angle in degrees")
        opened, wanted = self._sites.opened(asked.get("path")), read_setup(asked.get("setup"))
        png, ground = opened.picture(wanted, float(turn_deg), _PICTURE_PX)
        where = json.dumps({"size": _PICTURE_PX, "corners": ground})
        return Response(png, media_type="image/png", headers={"X-Bimvox-Ground": where})

    def save(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Save a set-up."""
        opened = self._sites.opened(asked.get("path"), anew=True)
        if asked.get("sha256") != opened.sha256:
            raise ChangedMeanwhileError(opened.site)
        return self._saved(*save(opened, read_setup(asked.get("setup"))))

    def variant(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Save a set-up as a new site file beside the one that is open; ``double``: another file holds it already."""
        opened, name = self._sites.opened(asked.get("path")), asked.get("name")
        name = name.strip() if isinstance(name, str) else ""
        if not name or Path(name).name != name or name[0] == "." or not name.isprintable():
            raise InputError("a variant needs a name of its own", hint="letters, digits, spaces, dots and dashes")
        target = opened.site.with_name(name.removesuffix(SITE_SUFFIX) + SITE_SUFFIX)
        saved = save_variant(opened, read_setup(asked.get("setup")), target)
        if isinstance(saved, Path):
            return {"path": self.folder.relative(saved), "double": True}
        return {**self._saved(*saved), "double": False}

    def _saved(self, opened: Opened, changed: list[str]) -> dict[str, Any]:
        self._sites.keep(opened)
        return {"path": self.folder.relative(opened.site), "sha256": opened.sha256, "changed": changed}

    def plan(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Start a plan."""
        return {"job": self.jobs.plan(self.folder.saved_site(asked))}

    def job(self, number: str) -> dict[str, Any]:
        """Return how far a plan is, and how it ended."""
        job = self.jobs.job(number)
        found: dict[str, Any] = {**job.now, "document": None}
        if job.is_running:
            return {"state": "running", **found}
        if "document" in job.end:
            page = f"/document/{self.folder.told(job.end['document']['out'])}" if job.kind == "document" else None
            return {"state": "done", **found, **self.folder.told(job.end), "page": page or self.plans.page_of(job.log)}
        if job.is_cancelled:
            return {"state": "cancelled", **found}
        return {"state": "failed", **found, **self.folder.told(job.error)}

    def cancel(self, number: str) -> dict[str, Any]:
        """Cancel a plan."""
        self.jobs.job(number).stop(gently=False)
        return self.job(number)

    def watch(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Start a watch."""
        site, speed = self.folder.saved_site(asked), asked.get("simulate")
        if speed is not None and not (_is_number(speed) and 0.001 <= speed <= 1e6):
            raise InputError("simulate is how many times as fast as real time, such as 60")
        return {"watch": self.jobs.watch(site, speed)}

    def news(self, number: str, after: int) -> dict[str, Any]:
        """Return what a watch reports from an event on; waits for some seconds if there is nothing."""
        job = self.jobs.job(number)
        events = job.events_after(after)
        state = "running" if job.has_events else "starting"
        if not job.is_running:
            state = "failed" if job.has_failed else "ended"
        error = job.error if state == "failed" else {}
        found = {"state": state, "stage": job.now["stage"], "events": events, "next": after + len(events)}
        return {**self.folder.told({**found, **error}), "page": self.plans.page_of(job.log)}

    def end_watch(self, number: str) -> dict[str, Any]:
        """End a watch."""
        self.jobs.job(number).stop(gently=True)
        return self.news(number, 0)

    def boxes(self, relative: object) -> dict[str, Any]:
        """Return the boxes of a site's obstruction file."""
        site = self.folder.path(relative, SITE_SUFFIX)
        return {"file": self.folder.relative(file_of(site)), **boxes_of(site)}

    def set_boxes(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Write the boxes of a site's obstruction file."""
        site = self.folder.saved_site(asked)
        written = write_boxes(site, asked.get("obstructions"), asked.get("sha256"))
        return {"file": self.folder.relative(file_of(site)), **written}

    def document(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Start to make a document of the plan of a site: its report or its schedule."""
        suffix = asked.get("suffix", DOCUMENTS[0])
        if suffix not in DOCUMENTS:
            raise InputError("there is no such document", hint=f"suffix is one of {', '.join(DOCUMENTS)}")
        return {"job": self.jobs.document(self.folder.saved_site(asked), suffix)}

    def document_file(self, relative: str) -> Path:
        """Return the file of a document.

        Raises:
            InputError: If it is no document of the folder.
        """
        return require_input(self.folder.path(relative, *DOCUMENTS))

    def upload(self, relative: object, data: IO[bytes], over: str | None) -> dict[str, Any]:
        """Put a file into the folder; see :func:`bimvox_pipeline.studio.uploading.put`."""
        return {"path": self.folder.relative(put(self.folder, relative, data, over))}


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)
