"""Reader of Primavera P6's exchange files (XER): tables of text, a row a line, its values between tabs.

The first word of a line says what it is: ``ERMHDR`` begins the file, ``%T`` a table, ``%F`` has its columns, ``%R`` a
row, ``%E`` ends the file; a quotation mark in a value is written twice.

The reader is our own because whoever verifies a log reads the programme in it again: PyP6XER drops letters that are not
UTF-8 and joins lines at quotation marks, xerparser and xer-reader are under the GPL, and MPXJ needs Java. ``make
check-log`` compares it with MPXJ.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime

from bimvox.bim.task_ranks import Link
from bimvox.site.programme_table import ProgrammeTable, Row, date_of

HEADER = "ERMHDR"
"""Begins a file."""

_LINKS = {"PR_FS": Link.FINISH_START, "PR_SS": Link.START_START, "PR_FF": Link.FINISH_FINISH}
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


def read_xer(data: bytes) -> ProgrammeTable:
    """Return the activities of a file, of all its projects, under their work breakdown structure.

    Raises:
        ValueError: If the file is not XER, was cut off, or has no activities.
    """
    tables = _tables(_text(data))
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
        start, finish = (_first_date(record, keys, where) for keys in (_STARTS, _FINISHES))
        words = " ".join((*record.values.values(), *more.get(record["task_id"], ())))
        own = _chain(over, of_id.get(record["wbs_id"]))
        rows.append(Row(name, own, words, start, finish, record["task_type"] in _SUMMARIES))
    number = {record["task_id"]: n for n, record in enumerate(tasks, start=len(parts))}
    links = []
    for record in tables.get("TASKPRED", []):
        first, then = number.get(record["pred_task_id"]), number.get(record["task_id"])
        kind = _LINKS.get(record["pred_type"] or "PR_FS")
        if first is not None and then is not None and kind is not None:
            links.append((first, then, kind))
    return ProgrammeTable(rows, links)


def _text(data: bytes) -> str:
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
    found: dict[str, list[str]] = {}
    for record in tables.get("UDFVALUE", ()):
        if record["udf_type_id"] in types:
            found.setdefault(record["fk_id"], []).append(record["udf_text"])
    for record in tables.get("TASKMEMO", ()):
        found.setdefault(record["task_id"], []).append(record["task_memo"])
    for record in tables.get("TASKACTV", ()):
        if (code := codes.get(record["actv_code_id"])) is not None:
            found.setdefault(record["task_id"], []).extend((code["short_name"], code["actv_code_name"]))
    return found


def _chain(over: list[int | None], at: int | None) -> tuple[int, ...]:
    """Return a row and the rows over it, the highest first; a row that is over itself ends the chain."""
    found: list[int] = []
    while at is not None and at not in found:
        found.append(at)
        at = over[at]
    return tuple(reversed(found))


def _first_date(record: _Record, keys: Iterable[str], where: str) -> datetime | None:
    key = next((key for key in keys if record[key]), "")
    return date_of(record[key], f"{where}: {key}") if key else None
