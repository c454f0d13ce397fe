"""The revisions of a plan that a page shows: the files of a watch, each as a whole plan.

A watch writes a segment per revision, with the lifts that are new in it (``bimvox.log.segments``). The whole plan of a
revision is composed of the last whole log and the segments after it.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import InputError, LogFileError
from bimvox.library.verify import prove, prove_plan, with_claims
from bimvox.progress import Progress
from bimvox_pipeline.sensible_log import require_sense
from bimvox_pipeline.watch.log import segments_on_disk

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bimvox.log.mcap.reader import Contents
    from bimvox.log.plan_log import PlanLog
    from bimvox.records.proof import Remark, Verification
    from bimvox.rendering.page.source import PageSource, Revision


_NUMBER = re.compile(r"\.r(\d{4,})$")


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    """A revision as read.

    Attributes:
        file: Its last log file.
        sha256: SHA-256 of that file.
        contents: Contents of that file if it holds the whole revision; None if several files were composed.
        record: The revision's whole plan.
    """

    file: Path
    sha256: str
    contents: Contents | None
    record: PlanLog

    @property
    def judged_as(self) -> JudgedAs:
        """What proof and remarks depend on: a segment's file alone, or its revision's whole plan."""
        return self.sha256, self.contents is None


JudgedAs = tuple[str, bool]
"""SHA-256 of a log, and whether the logs before it belong to the plan as well."""


@dataclass(frozen=True, slots=True)
class Judged:
    """What was found about a plan.

    Attributes:
        proof: The proof; None if none was wanted.
        remarks: The remarks.
    """

    proof: Verification | None
    remarks: tuple[Remark, ...]


def _read_revision(file: Path, progress: Progress) -> _Read:
    """Read a log.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
    """
    from bimvox.log.mcap.reader import read_contents, read_file
    from bimvox.log.reader import log_of

    progress.stage("read")
    data = read_file(file)
    contents = read_contents(data, file)
    return _Read(file, hashlib.sha256(data).hexdigest(), contents, log_of(contents, file))


def _read_revisions(log: Path, progress: Progress) -> list[_Read]:
    """Read a log and the revisions of its plan next to it.

    Args:
        log: A whole log, a segment of a watch, or an extract.
        progress: Receives notes about files left out.

    Returns:
        Revisions of one site, except for obstructions, ascending. The last one is that of ``log``, or that of the
        newest segment if a watch is ahead of its whole log.

    Raises:
        LogFileError: If ``log`` is damaged or not a bimvox log.
    """
    own = _read_revision(log, progress)
    number = _NUMBER.search(log.stem)
    whole = log.with_name(_NUMBER.sub("", log.stem) + log.suffix)
    limit = int(number.group(1)) if number else None
    files = {n: file for n, file in segments_on_disk(whole).items() if limit is None or n <= limit}
    chain = _Chain(own.record.plan.site.fixed_digest)
    found: dict[int, _Read] = {}
    for revision, file in files.items():
        try:
            read = own if file.name == log.name else _read_revision(file, progress)
        except LogFileError as error:
            progress.note(f"{file.name} is left out: {error.message}")
            chain.cut()
            continue
        joined = chain.put(read)
        if joined is not None:
            found[revision] = joined
    if limit is None or own.record.revision not in found:
        found[own.record.revision] = own
    return [found[revision] for revision in sorted(found)]


def read_whole_plan(log: Path, progress: Progress) -> _Read:
    """Read a log; for a segment of a watch, the whole plan of its revision.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
    """
    own = _read_revision(log, progress)
    if not own.record.context or _NUMBER.search(log.stem) is None:
        return own
    return _read_revisions(log, progress)[-1]


class _Chain:
    """Composes segments in turn."""

    def __init__(self, fixed_digest: str) -> None:
        self._digest = fixed_digest
        self._newest: PlanLog | None = None

    def cut(self) -> None:
        """Drop the base: segments after an unusable one depend on it."""
        self._newest = None

    def put(self, read: _Read) -> _Read | None:
        """Return the whole plan of a segment's revision; None if its base is missing."""
        from bimvox.log.segments import first_plan_of, newest

        record = read.record
        if record.plan.site.fixed_digest != self._digest:
            self.cut()
            return None
        if not record.context:
            self._newest = record
            return read
        if self._newest is None or first_plan_of(record) != first_plan_of(self._newest):
            return None
        self._newest = newest(self._newest, [record])
        return _Read(read.file, read.sha256, None, _without_pending(self._newest))


def _without_pending(record: PlanLog) -> PlanLog:
    """Return a plan in which pending lifts, which have no path yet, are context."""
    orders = {lift.order for lift in record.planned if lift.path_vox is None}
    return record.extract({lift.order for lift in record.plan.lifts} - orders) if orders else record


def revisions_of(
    found: list[_Read], proven: bool, progress: Progress, known: dict[JudgedAs, Judged] | None = None
) -> Iterator[Revision]:
    """Yield the read logs as revisions of a plan.

    ``known``: what was found earlier about logs; new findings are added.

    Raises:
        LogFileError: If values of a log make no sense: nothing can be drawn from them.
    """
    from bimvox.library.attached_files import config_in
    from bimvox.log.moving import tracks_of
    from bimvox.log.plan_log import log_dates
    from bimvox.log.schema import METADATA
    from bimvox.rendering.page.source import Revision

    for read in found:
        record = read.record
        judged = (known or {}).get(read.judged_as)
        if judged is None:
            judged = _judged(read, proven, progress)
            if known is not None:
                known[read.judged_as] = judged
        yield Revision(
            number=record.revision,
            log=read.file.name,
            sha256=read.sha256,
            plan=record.plan,
            context=record.context,
            motions=record.motions,
            tracks=tracks_of(record),
            proof=judged.proof,
            remarks=judged.remarks,
            config=config_in(record),
            metadata=record.metadata if read.contents is None else read.contents.metadata.get(METADATA, {}),
            dates=log_dates(record),
        )


def _judged(read: _Read, proven: bool, progress: Progress) -> Judged:
    record, proof = require_sense(read.record, read.file), None
    if proven:
        if read.contents is None:
            proof = with_claims(prove_plan(record, progress), record)
        else:
            proof = prove(read.contents, record, progress)
    from bimvox.log.plan_log import all_remarks

    return Judged(proof, all_remarks(record))


# A log, with the revisions next to it, as a page.

_REVISIONS = 10
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

    Revisions of ``bimvox watch`` next to it are in the page as well. With ``proven`` every revision is proven again
    now. ``known``: what was found earlier about logs; new findings are added.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
        InputError: If it carries no lifts.
    """
    from bimvox.rendering.page.source import PageSource

    found = _read_revisions(log, progress)
    if not found[-1].record.all_lifts:
        raise InputError(f"{log}: the log has no lifts", hint="bimvox plan SITE writes a log with lifts")
    left_out = max(0, len(found) - _REVISIONS)
    revisions = tuple(revisions_of(found[left_out:], proven, progress, known))
    return PageSource(revisions, left_out=left_out)
