"""Recovers the complete lifts of a damaged log."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from bimvox.errors import LogFileError
from bimvox.log import schema as topics
from bimvox.log.mcap.reader import Contents, read_file, salvage_contents
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import log_of


@dataclasses.dataclass(frozen=True, slots=True)
class Recovered:
    """What was recovered of a damaged log.

    Attributes:
        messages: Number of messages recovered.
        lost: What was lost, one sentence each; empty for a sound log.
    """

    messages: int
    lost: tuple[str, ...]


def recover_log(path: Path | str) -> tuple[PlanLog, Recovered]:
    """Return the complete lifts of a damaged log, and what was lost.

    Raises:
        LogFileError: If the site or the plan did not survive, or no lift did.
    """
    path = Path(path)
    contents = _salvage(path)
    for name in (topics.SITE_FILE, topics.PLAN_FILE):
        if name not in contents.attachments:
            raise LogFileError(
                path,
                f"the attachment {name} did not survive, and nothing can replace it ({'; '.join(contents.lost)})",
                hint="plan again: bimvox plan SITE -o LOG.mcap",
            )
    log = log_of(contents, path)
    if not log.planned:
        raise LogFileError(path, "no complete lift survived")
    log = dataclasses.replace(log, recovered=bool(contents.lost))
    return log, Recovered(len(contents.messages), tuple(contents.lost))


def _salvage(path: Path) -> Contents:
    contents = salvage_contents(read_file(path), path)
    own = contents.metadata.get(topics.METADATA)
    if own is None:
        raise LogFileError(path, "the rest cannot be recognized as a bimvox log (its metadata is lost)")
    contents.metadata[topics.METADATA] = own | {topics.RECOVERED: "true"}
    known = {topic.name for topic in topics.topics_of(topics.MOST_CRANES)}
    contents.messages = [message for message in contents.messages if message.topic in known]
    return contents
