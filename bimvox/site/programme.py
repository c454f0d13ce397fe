"""An existing programme of the site: which of its tasks sets a part, and the order of the tasks.

It is Microsoft Project's XML or Primavera's XER. A part has the task that names its
GlobalId in any field; otherwise the one that has its name; otherwise the one whose own name, with those of the tasks
above it, has the name of its storey and its class (``wall``, ``column``, ``slab`` ...). Of several tasks, the earliest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Protocol
from xml.etree import ElementTree

from bimvox.bim.task_ranks import Link, task_ranks
from bimvox.errors import ConfigError
from bimvox.site.work import Part, kind_of


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
        actual: When it was begun and ended; None for what has not been.
    """

    name: str
    above: tuple[int, ...]
    words: str
    start: datetime | None
    finish: datetime | None
    is_summary: bool = False
    actual: tuple[datetime | None, datetime | None] = (None, None)


@dataclass(frozen=True, slots=True)
class _ProgrammeTable:
    """All rows of a programme, and its links: (row, row that waits for it, how)."""

    rows: Sequence[Row]
    links: Sequence[tuple[int, int, Link]]


def _date_of(text: str, where: str) -> datetime | None:
    """Return a local time as a programme has it, such as ``2026-03-09T07:00:00``; None if empty."""
    if not text:
        return None
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        raise ValueError(f"{where}: {text[:40]!r} is not a date") from None


_MS_LINKS = {"0": Link.FINISH_FINISH, "1": Link.FINISH_START, "3": Link.START_START}


def read_ms_project(data: bytes) -> _ProgrammeTable:
    """Return the tasks of a file.

    Raises:
        ValueError: If it is not Microsoft Project XML in UTF-8, was cut off, has a document type, or has no tasks.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"line {_line(data, error.start)}: not UTF-8 text") from None
    if "<!DOCTYPE" in text:
        at = text[: text.index("<!DOCTYPE")].count("\n") + 1
        raise ValueError(f"line {at}: it has a document type; a programme has none")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, _ = error.position
        cut = line >= text.count("\n") + 1 and "no element found" in str(error) and bool(text.strip())
        told = f"line {line}: it was cut off: the XML ends too early" if cut else f"line {line}: not XML: {error}"
        raise ValueError(told) from None
    except ValueError as error:
        raise ValueError(f"not XML: {error}") from None
    entries = [task for task in _all(root, "Tasks", "Task") if _text(task, "IsNull") != "1"]
    if not entries or _local(root.tag) != "Project":
        raise ValueError("it has no tasks of Microsoft Project")
    number = {_text(task, "UID"): n for n, task in enumerate(entries)}
    above = _above(entries)
    wholes = {one for own in above for one in own[-1:]}
    links = []
    for n, task in enumerate(entries):
        for link in _all(task, "PredecessorLink"):
            first, kind = number.get(_text(link, "PredecessorUID")), _MS_LINKS.get(_text(link, "Type") or "1")
            if first is not None and kind is not None:
                links.append((first, n, kind))
    rows = []
    for n, task in enumerate(entries):
        name = _text(task, "Name") or f"task {_text(task, 'ID')}"
        start, finish, begun, ended = (
            _date_of(_text(task, key), f"task {name!r}: {key}")
            for key in ("Start", "Finish", "ActualStart", "ActualFinish")
        )
        is_summary = n in wholes or _text(task, "Summary") == "1"
        rows.append(Row(name, above[n], " ".join(task.itertext()), start, finish, is_summary, (begun, ended)))
    return _ProgrammeTable(rows, links)


def _above(entries: Sequence[ElementTree.Element]) -> list[tuple[int, ...]]:
    """Return the tasks above each, from the outline levels."""
    above, open_ = [], list[tuple[int, int]]()
    for n, task in enumerate(entries):
        text = _text(task, "OutlineLevel")
        level = int(text) if text.isdecimal() and len(text) < 9 else 1
        open_ = [(own, m) for own, m in open_ if own < level]
        above.append(tuple(m for _, m in open_))
        open_.append((level, n))
    return above


def _line(data: bytes, at: int) -> int:
    return data[:at].count(b"\n") + 1


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


# Reader of Primavera P6's exchange files (XER): tables of text, a row a line, its values between tabs.
#
# The first word of a line says what it is: ``ERMHDR`` begins the file, ``%T`` a table, ``%F`` has its columns, ``%R`` a
# row, ``%E`` ends the file; a quotation mark in a value is written twice.
#
# The reader is our own because whoever verifies a log reads the programme in it again: PyP6XER drops letters that are
# not UTF-8 and joins lines at quotation marks, xerparser and xer-reader are under the GPL, and MPXJ needs Java. ``make
# check-log`` compares it with MPXJ.

HEADER = "ERMHDR"
"""Begins a file."""

_XER_LINKS = {"PR_FS": Link.FINISH_START, "PR_SS": Link.START_START, "PR_FF": Link.FINISH_FINISH}
_SUMMARIES = ("TT_WBS", "TT_LOE")
"""Types of activities whose dates follow from those of others: summaries and level of effort."""
_STARTS = ("act_start_date", "restart_date", "early_start_date", "target_start_date")
_FINISHES = ("act_end_date", "reend_date", "early_end_date", "target_end_date")
"""What is done, then what remains, then what was planned: the first that an activity has."""
_NEEDED = {
    "TASK": ("task_id", "task_name"),
    "PROJWBS": ("wbs_id", "wbs_name"),
    "TASKPRED": ("task_id", "pred_task_id"),
}


@dataclass(frozen=True, slots=True)
class _Record:
    """A row of a table: its line in the file, and its values by column."""

    line: int
    values: Mapping[str, str]

    def __getitem__(self, key: str) -> str:
        return self.values.get(key, "")


def read_xer(data: bytes) -> _ProgrammeTable:
    """Return the activities of a file, of all its projects, under their work breakdown structure.

    Raises:
        ValueError: If the file is not XER, was cut off, or has no activities.
    """
    tables = _tables(_xer_text(data))
    parts, tasks = tables.get("PROJWBS", []), tables.get("TASK", [])
    if not tasks:
        raise ValueError("it has no activities (table TASK)")
    of_id = {record["wbs_id"]: n for n, record in enumerate(parts)}
    over = [of_id.get(record["parent_wbs_id"]) for record in parts]
    rows = [
        Row(record["wbs_name"] or f"WBS {record['wbs_id']}", _chain(over, over[n]), "", None, None, is_summary=True)
        for n, record in enumerate(parts)
    ]
    more = _texts(tables)
    for record in tasks:
        name, where = record["task_name"] or f"activity {record['task_code']}", f"line {record.line}: activity"
        start, finish, begun, ended = (
            _first_date(record, keys, where) for keys in (_STARTS, _FINISHES, _STARTS[:1], _FINISHES[:1])
        )
        words = " ".join((*record.values.values(), *more.get(record["task_id"], ())))
        own = _chain(over, of_id.get(record["wbs_id"]))
        rows.append(Row(name, own, words, start, finish, record["task_type"] in _SUMMARIES, (begun, ended)))
    number = {record["task_id"]: n for n, record in enumerate(tasks, start=len(parts))}
    links = []
    for record in tables.get("TASKPRED", []):
        first, then = number.get(record["pred_task_id"]), number.get(record["task_id"])
        kind = _XER_LINKS.get(record["pred_type"] or "PR_FS")
        if first is not None and then is not None and kind is not None:
            links.append((first, then, kind))
    return _ProgrammeTable(rows, links)


def _xer_text(data: bytes) -> str:
    """Return the text: UTF-8, otherwise the code page of Western Windows, in which Primavera writes."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _tables(text: str) -> dict[str, list[_Record]]:
    """Return the rows of all tables by the table's name."""
    lines = text.replace("\r\n", "\n").split("\n")
    if lines[0].split("\t")[0] != HEADER:
        raise ValueError(f"line 1: not a file of Primavera P6: it does not begin with {HEADER}")
    tables: dict[str, list[_Record]] = {}
    table, columns, records = "", list[str](), list[_Record]()
    for number, line in enumerate(lines[1:], start=2):
        kind, *values = line.replace('""', '"').split("\t")
        if kind == "%E":
            return tables
        if kind == "%T":
            table, columns = (values[0].strip() if values else ""), []
            records = tables.setdefault(table, [])
        elif kind == "%F":
            columns = [value.strip() for value in values]
            missing = [key for key in _NEEDED.get(table, ()) if key not in columns]
            if missing:
                raise ValueError(f"line {number}: table {table} has no column {missing[0]}")
        elif kind == "%R":
            if not columns:
                raise ValueError(f"line {number}: a row before the columns of its table (%F)")
            if len(values) > len(columns):
                raise ValueError(
                    f"line {number}: a row of {len(values)} values; its table {table} has {len(columns)} columns"
                )
            records.append(_Record(number, dict(zip(columns, values, strict=False))))
        elif line.strip() and not records:
            raise ValueError(f"line {number}: it begins with {kind[:20]!r} instead of %T, %F, %R or %E")
        # Any other line continues a note of the row before it.
    raise ValueError(f"line {len(lines)}: it was cut off: the mark of its end (%E) is missing")


def _texts(tables: Mapping[str, Iterable[_Record]]) -> dict[str, list[str]]:
    """Return the notes, own fields and codes of activities, by the activity's id."""
    types = {record["udf_type_id"] for record in tables.get("UDFTYPE", ()) if record["table_name"] == "TASK"}
    codes = {record["actv_code_id"]: record for record in tables.get("ACTVCODE", ())}
    result: dict[str, list[str]] = {}
    for record in tables.get("UDFVALUE", ()):
        if record["udf_type_id"] in types:
            result.setdefault(record["fk_id"], []).append(record["udf_text"])
    for record in tables.get("TASKMEMO", ()):
        result.setdefault(record["task_id"], []).append(record["task_memo"])
    for record in tables.get("TASKACTV", ()):
        if (code := codes.get(record["actv_code_id"])) is not None:
            result.setdefault(record["task_id"], []).extend((code["short_name"], code["actv_code_name"]))
    return result


def _chain(over: list[int | None], at: int | None) -> tuple[int, ...]:
    """Return a row and the rows over it, the highest first; a row that is over itself ends the chain."""
    found: list[int] = []
    while at is not None and at not in found:
        found.append(at)
        at = over[at]
    return tuple(reversed(found))


def _first_date(record: _Record, keys: Iterable[str], where: str) -> datetime | None:
    key = next((key for key in keys if record[key]), "")
    return _date_of(record[key], f"{where}: {key}") if key else None


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
        actual: When it was begun and ended; None for what has not been.
    """

    name: str
    rank: int
    path: str
    ids: frozenset[str]
    start: datetime | None = None
    finish: datetime | None = None
    actual: tuple[datetime | None, datetime | None] = (None, None)


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
        result = self._by_id.get(part.global_id) or (self._by_name.get(part.name.casefold()) if part.name else None)
        if result is not None or not part.storey:
            return result
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

    ``site_file``: the site file that names it, for messages; None if it was given without one.

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
            row.start, row.finish, row.actual,
        )
        for n, row in enumerate(rows)
        if not row.is_summary
    )  # fmt: skip
    return Programme(file, tasks, tuple(f"programme {file}: {note}" for note in notes))


def programme_table(data: bytes, file: str, site_file: Path | None) -> _ProgrammeTable:
    """Return all rows of a programme and its links; arguments and errors are those of :func:`read_programme`."""
    is_xer = Path(file).suffix.lower() == _XER[0] or data.removeprefix(b"\xef\xbb\xbf").startswith(_XER[1])
    try:
        return read_xer(data) if is_xer else read_ms_project(data)
    except ValueError as error:
        where = (Path(file), None, str(error)) if site_file is None else (site_file, _KEY, f"{file}: {error}")
        raise ConfigError(*where, hint=_HINT) from None
