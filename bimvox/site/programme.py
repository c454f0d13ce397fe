"""An existing programme of the site: which of its tasks sets a part, and the order of the tasks.

It is Microsoft Project's XML or Primavera's XER. A part has the task that names its
GlobalId in any field; otherwise the one that has its name; otherwise the one whose own name, with those of the tasks
above it, has the name of its storey and its class (``wall``, ``column``, ``slab`` ...). Of several tasks, the earliest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Protocol

from bimvox.bim.task_ranks import task_ranks
from bimvox.errors import ConfigError
from bimvox.site.programme_ms_project import read_ms_project
from bimvox.site.programme_table import ProgrammeTable
from bimvox.site.programme_xer import HEADER, read_xer
from bimvox.site.work import Part, kind_of

ATTACHED = "programme."
"""Begins the name of a programme's file among the files attached to a log."""

_KEY = "sequence.programme"
_HINT = "save the programme as Microsoft Project XML or Primavera XER"
_GLOBAL_ID = re.compile(r"(?<![0-9A-Za-z_$])[0-3][0-9A-Za-z_$]{21}(?![0-9A-Za-z_$])")
_XER = (".xer", HEADER.encode())
_NAMED = 5


class PlannedPart(Part, Protocol):
    """What a task is matched by."""

    @property
    def global_id(self) -> str:
        """Its GlobalId."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def storey(self) -> str | None:
        """Name of its storey."""


@dataclass(frozen=True, slots=True)
class ProgrammeTask:
    """A task, not a summary of tasks.

    Attributes:
        name: Its name.
        rank: Its rank among all tasks, from 0; tasks that may run in parallel share one.
        path: Its name after those of the tasks above it.
        ids: GlobalIds in its fields.
        start: When it starts, local time; None if the programme does not say.
        finish: When it ends.
    """

    name: str
    rank: int
    path: str
    ids: frozenset[str]
    start: datetime | None = None
    finish: datetime | None = None


@dataclass(frozen=True, slots=True)
class Programme:
    """The tasks of a programme.

    Attributes:
        file: Name of its file.
        tasks: In the order of the file.
        notes: What could not be used, one sentence each.
    """

    file: str
    tasks: tuple[ProgrammeTask, ...]
    notes: tuple[str, ...] = ()
    _by_id: dict[str, ProgrammeTask] = field(default_factory=dict, compare=False, repr=False)
    _by_name: dict[str, ProgrammeTask] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Make the tables; the earliest task comes first."""
        for task in sorted(self.tasks, key=lambda task: task.rank):
            for global_id in task.ids:
                self._by_id.setdefault(global_id, task)
            self._by_name.setdefault(task.name.casefold(), task)

    def task_of(self, part: PlannedPart) -> ProgrammeTask | None:
        """Return the task that sets a part; None if there is none."""
        found = self._by_id.get(part.global_id) or (self._by_name.get(part.name.casefold()) if part.name else None)
        if found is not None or not part.storey:
            return found
        return self._of_storey(part.storey, kind_of(part).value)

    def _of_storey(self, storey: str, kind: str) -> ProgrammeTask | None:
        words = (re.compile(rf"(?<!\w){re.escape(storey.casefold())}(?!\w)"), re.compile(rf"(?<!\w){kind}s?(?!\w)"))
        fitting = [
            task for task in self.tasks if not task.ids and all(word.search(task.path.casefold()) for word in words)
        ]
        return min(fitting, key=lambda task: task.rank, default=None)

    def notes_about(self, parts: Iterable[PlannedPart]) -> tuple[str, ...]:
        """Return how many parts have a task, and what matches nothing, one sentence each."""
        parts = list(parts)
        found = [self.task_of(part) for part in parts]
        used = {task for task in found if task is not None}
        unused = [task.path for task in self.tasks if task not in used]
        without = sum(task is None for task in found)
        told = f"programme {self.file}: {len(parts) - without:,} of {len(parts):,} parts have one of its tasks"
        if without:
            told += "; the others come after them"
        more = f" and {len(unused) - _NAMED:,} more" if len(unused) > _NAMED else ""
        rest = (f"programme {self.file}: tasks that match no part: {', '.join(unused[:_NAMED])}{more}",)
        return (*self.notes, told, *(rest if unused else ()))


@lru_cache(maxsize=8)
def read_programme(data: bytes, file: str, site_file: Path | None) -> Programme:
    """Return the programme in a file.

    Args:
        data: The file's bytes.
        file: Its name.
        site_file: The site file that names it, for messages; None if it was given without one.

    Raises:
        ConfigError: If it is not Microsoft Project XML in UTF-8 or Primavera XER, was cut off, or has no tasks; with
            the line.
    """
    table = programme_table(data, file, site_file)
    rows = table.rows
    names = [row.name for row in rows]
    nested = [(row.above[-1], n) for n, row in enumerate(rows) if row.above]
    starts = {n: row.start.isoformat() for n, row in enumerate(rows) if row.start is not None}
    ranks, notes = task_ranks(names, table.links, nested, starts)
    tasks = tuple(
        ProgrammeTask(
            row.name, ranks[n], " / ".join(names[m] for m in (*row.above, n)), frozenset(_GLOBAL_ID.findall(row.words)),
            row.start, row.finish,
        )
        for n, row in enumerate(rows)
        if not row.is_summary
    )  # fmt: skip
    return Programme(file, tasks, tuple(f"programme {file}: {note}" for note in notes))


def programme_table(data: bytes, file: str, site_file: Path | None) -> ProgrammeTable:
    """Return all rows of a programme and its links; arguments and errors are those of :func:`read_programme`."""
    is_xer = Path(file).suffix.lower() == _XER[0] or data.removeprefix(b"\xef\xbb\xbf").startswith(_XER[1])
    try:
        return read_xer(data) if is_xer else read_ms_project(data)
    except ValueError as error:
        where = (Path(file), None, str(error)) if site_file is None else (site_file, _KEY, f"{file}: {error}")
        raise ConfigError(*where, hint=_HINT) from None
