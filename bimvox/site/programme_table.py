"""What the readers of programmes have in common: tasks and summaries, the links between them, and their dates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from bimvox.bim.task_ranks import Link


@dataclass(frozen=True, slots=True)
class Row:
    """A task, or a summary of tasks.

    Attributes:
        name: Its name.
        above: Indices of the summaries above it, the highest first.
        words: The text of all its fields, in which GlobalIds are looked for.
        start: Its start, local time; None if it has none.
        finish: Its finish.
        is_summary: Whether it has tasks instead of work of its own.
    """

    name: str
    above: tuple[int, ...]
    words: str
    start: datetime | None
    finish: datetime | None
    is_summary: bool = False


@dataclass(frozen=True, slots=True)
class ProgrammeTable:
    """All rows of a programme, and its links: (row, row that waits for it, how)."""

    rows: Sequence[Row]
    links: Sequence[tuple[int, int, Link]]


def date_of(text: str, where: str) -> datetime | None:
    """Return a local time as a programme has it: ``2026-03-09T07:00:00`` or ``2026-03-09 07:00``; None if empty.

    Args:
        text: The text.
        where: What has this date, for the message.

    Raises:
        ValueError: If it is not a time.
    """
    if not text:
        return None
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        raise ValueError(f"{where}: {text[:40]!r} is not a date") from None
