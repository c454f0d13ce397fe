"""A log, with the revisions next to it, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import InputError
from bimvox.progress import Progress
from bimvox_pipeline.render.revisions import Judged, JudgedAs, read_revisions, revisions_of

if TYPE_CHECKING:
    from bimvox.rendering.page.source import PageSource

REVISIONS = 10
"""Maximum number of revisions in a page: the newest ones."""


def page_of_log(log: Path, *, proven: bool, progress: Progress) -> bytes:
    """Return the page of a log; see ``source_of_log``."""
    from bimvox.rendering.page.page import page_of

    source = source_of_log(log, proven=proven, progress=progress)
    progress.stage("page")
    return page_of(source)


def source_of_log(
    log: Path, *, proven: bool, progress: Progress, known: dict[JudgedAs, Judged] | None = None
) -> PageSource:
    """Return the content of a log's page.

    Args:
        log: A log. Revisions of ``bimvox watch`` next to it are in the page as well.
        proven: Whether every revision is proven again now; otherwise the page says that it is not proven.
        progress: Receives the stages.
        known: What was found earlier about logs; new findings are added.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
        InputError: If it carries no lifts.
    """
    from bimvox.rendering.page.source import PageSource

    found = read_revisions(log, progress)
    if not found[-1].record.all_lifts:
        raise InputError(f"{log}: the log has no lifts", hint="bimvox plan SITE writes a log with lifts")
    left_out = max(0, len(found) - REVISIONS)
    revisions = tuple(revisions_of(found[left_out:], proven, progress, known))
    return PageSource(revisions, left_out=left_out)
