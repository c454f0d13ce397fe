"""A log, and the revisions before it, as a page."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import InputError, LogFileError
from pipeline.progress import Progress
from pipeline.verify import prove

if TYPE_CHECKING:
    from bimvox.log.container import Contents
    from bimvox.log.plan_log import PlanLog
    from bimvox.planning.proof import Verification
    from bimvox.render.page.source import PageSource, Revision

REVISIONS = 10
"""How many revisions a page carries at most: the newest."""


def page_of_log(log: Path, *, proven: bool, progress: Progress) -> bytes:
    """Return the page of a log; see ``source_of_log``."""
    from bimvox.render.page.page import page_of

    source = source_of_log(log, proven=proven, progress=progress)
    progress.stage("page")
    return page_of(source)


def source_of_log(
    log: Path, *, proven: bool, progress: Progress, known: dict[str, Verification] | None = None
) -> PageSource:
    """Return what the page of a log shows.

    Args:
        log: A log. Where ``bimvox watch`` keeps earlier revisions beside it, they are in the page as well.
        proven: Whether every revision is proven again now; else the page says that it is not.
        progress: Told of the stages.
        known: Proofs made before, by the SHA-256 of their log; new ones are added.

    Raises:
        LogFileError: If it is damaged or not ours.
        InputError: If it carries no lifts.
    """
    from bimvox.render.page.source import PageSource

    newest = read_revision(log, progress)
    if not newest.record.all_lifts:
        raise InputError(f"{log}: it holds no lifts", hint="bimvox plan SITE writes a log with lifts")
    found = [newest]
    files = _earlier(log, newest.record.revision)
    for file in files[max(0, len(files) - REVISIONS + 1) :]:
        try:
            other = read_revision(file, progress)
        except LogFileError as error:
            progress.note(f"{file.name} is left out: {error.message}")
            continue
        if other.record.plan.site.fixed_digest == newest.record.plan.site.fixed_digest:
            found.append(other)
    found.sort(key=lambda read: read.record.revision)
    revisions = tuple(revision_of(read, proven, progress, known) for read in found)
    return PageSource(revisions, left_out=max(0, len(files) - REVISIONS + 1))


@dataclass(frozen=True, slots=True, eq=False)
class Read:
    """A log as read."""

    file: Path
    sha256: str
    contents: Contents
    record: PlanLog


def _earlier(log: Path, number: int) -> list[Path]:
    """The files of earlier revisions that a watch left beside a log, ascending."""
    pattern = re.compile(re.escape(re.sub(r"\.r\d{4,}$", "", log.stem)) + r"\.r(\d{4,})" + re.escape(log.suffix))
    matches = ((pattern.fullmatch(file.name), file) for file in log.resolve().parent.iterdir())
    numbered = [(int(match.group(1)), file) for match, file in matches if match]
    return [file for revision, file in sorted(numbered) if revision < number]


def read_revision(file: Path, progress: Progress) -> Read:
    """Read a log.

    Raises:
        LogFileError: If it is damaged or not ours.
    """
    from bimvox.log.container import read_contents, read_file
    from bimvox.log.reader import log_of
    from bimvox.log.verify import USED_TOPICS

    progress.stage("read")
    data = read_file(file)
    contents = read_contents(data, file, USED_TOPICS)
    return Read(file, hashlib.sha256(data).hexdigest(), contents, log_of(contents, file))


def revision_of(read: Read, proven: bool, progress: Progress, known: dict[str, Verification] | None = None) -> Revision:
    """Return a log that was read as a revision of a plan.

    Args:
        read: The log.
        proven: Whether it is proven again now.
        progress: Told of the stages.
        known: Proofs made before, by the SHA-256 of their log; a new one is added.
    """
    from bimvox.log.recorder import tracks_of
    from bimvox.log.topics import METADATA
    from bimvox.render.page.source import Revision

    record = read.record
    proof = (known or {}).get(read.sha256) if proven else None
    if proven and proof is None:
        proof = prove(read.contents, record, progress)
        if known is not None:
            known[read.sha256] = proof
    return Revision(
        number=record.revision,
        log=read.file.name,
        sha256=read.sha256,
        plan=record.plan,
        context=record.context,
        motions=record.motions,
        tracks=tracks_of(record),
        proof=proof,
        metadata=read.contents.metadata.get(METADATA, {}),
    )
