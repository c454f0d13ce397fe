"""An existing programme of the site: which of its tasks sets a part, and the order of the tasks.

It is Microsoft Project's XML (schema http://schemas.microsoft.com/project). A part has the task that names its
GlobalId in any field; otherwise the one that has its name; otherwise the one whose own name, with those of the tasks
above it, has the name of its storey and its class (``wall``, ``column``, ``slab`` ...). Of several tasks, the earliest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Protocol
from xml.etree import ElementTree

from bimvox.bim.task_ranks import Link, task_ranks
from bimvox.errors import ConfigError
from bimvox.site.work import Part, kind_of

_KEY = "sequence.programme"
_HINT = "save the programme as Microsoft Project XML"
_GLOBAL_ID = re.compile(r"(?<![0-9A-Za-z_$])[0-3][0-9A-Za-z_$]{21}(?![0-9A-Za-z_$])")
_LINKS = {"0": Link.FINISH_FINISH, "1": Link.FINISH_START, "3": Link.START_START}
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
    """A task without subtasks.

    Attributes:
        name: Its name.
        rank: Its rank among all tasks, from 0; tasks that may run in parallel share one.
        path: Its name after those of the tasks above it.
        ids: GlobalIds in its fields.
    """

    name: str
    rank: int
    path: str
    ids: frozenset[str]


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
def read_programme(data: bytes, file: str, site_file: Path) -> Programme:
    """Return the programme in a file.

    Args:
        data: The file's bytes.
        file: Its name.
        site_file: The site file that names it, for messages.

    Raises:
        ConfigError: If it is not Microsoft Project XML in UTF-8, has a document type, or has no tasks.
    """

    def wrong(what: str) -> ConfigError:
        return ConfigError(site_file, _KEY, f"{file}: {what}", hint=_HINT)

    try:
        text = data.decode("utf-8-sig")
        if "<!DOCTYPE" in text:
            raise wrong("it has a document type; a programme has none")
        root = ElementTree.fromstring(text)
    except (UnicodeDecodeError, ElementTree.ParseError, ValueError) as error:
        raise wrong(f"not XML: {error}") from None
    entries = [task for task in _all(root, "Tasks", "Task") if _text(task, "IsNull") != "1"]
    if not entries or _local(root.tag) != "Project":
        raise wrong("it has no tasks of Microsoft Project")
    number = {_text(task, "UID"): n for n, task in enumerate(entries)}
    nested, above = _nesting(entries)
    links = []
    for n, task in enumerate(entries):
        for link in _all(task, "PredecessorLink"):
            first, kind = number.get(_text(link, "PredecessorUID")), _LINKS.get(_text(link, "Type") or "1")
            if first is not None and kind is not None:
                links.append((first, n, kind))
    starts = {n: start for n, task in enumerate(entries) if (start := _text(task, "Start"))}
    names = [_text(task, "Name") or f"task {_text(task, 'ID')}" for task in entries]
    ranks, notes = task_ranks(names, links, nested, starts)
    wholes = {whole for whole, _ in nested}
    tasks = tuple(
        ProgrammeTask(
            names[n], ranks[n], " / ".join(names[m] for m in (*above[n], n)),
            frozenset(_GLOBAL_ID.findall(" ".join(task.itertext()))),
        )
        for n, task in enumerate(entries)
        if n not in wholes and _text(task, "Summary") != "1"
    )  # fmt: skip
    return Programme(file, tasks, tuple(f"programme {file}: {note}" for note in notes))


def _nesting(entries: Sequence[ElementTree.Element]) -> tuple[list[tuple[int, int]], list[tuple[int, ...]]]:
    """Return (whole, part) pairs, and per task the tasks above it, from the outline levels."""
    nested, above, open_ = [], [], list[tuple[int, int]]()
    for n, task in enumerate(entries):
        text = _text(task, "OutlineLevel")
        level = int(text) if text.isdecimal() and len(text) < 9 else 1
        open_ = [(own, m) for own, m in open_ if own < level]
        above.append(tuple(m for _, m in open_))
        if open_:
            nested.append((open_[-1][1], n))
        open_.append((level, n))
    return nested, above


def _all(parent: ElementTree.Element, *names: str) -> Iterator[ElementTree.Element]:
    if not names:
        yield parent
        return
    for child in parent:
        if _local(child.tag) == names[0]:
            yield from _all(child, *names[1:])


def _text(parent: ElementTree.Element, name: str) -> str:
    return next(((child.text or "").strip() for child in parent if _local(child.tag) == name), "")


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]
