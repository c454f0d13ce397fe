"""What of a plan has been carried out, as a file says it: a table of parts, or a programme with actual dates."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from bimvox.errors import FileError, SelectionError
from bimvox.log.plan_log import PlanLog, chosen_lifts, task_name
from bimvox.log.segments import NOW_NS
from bimvox.records.done import DoneWork
from bimvox.records.lift import NOT_LIFTED
from bimvox.records.plan_dates import PlanDates
from bimvox.site.programme import HEADER, read_programme

_COLUMNS = {
    "part": ("part", "lift", "number", "global_id", "globalid", "component", "name"),
    "begins": ("begins", "begin", "begun", "start", "started", "actual_start"),
    "ends": ("ends", "end", "ended", "finish", "finished", "actual_finish", "done"),
}
_EXAMPLE = "part,begins,ends; then for example 3,2026-03-09T07:30,2026-03-09T07:52"
_MOST_NAMED = 5
_DOTTED = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4}) +(\d{1,2}:\d\d)")


class _Stated(NamedTuple):
    """A part of which something is stated: where, and when it was begun and ended."""

    where: str
    part: str
    begun: datetime | None
    ended: datetime | None


def read_done(file: Path, data: bytes, log: PlanLog, dates: PlanDates) -> tuple[DoneWork | None, tuple[str, ...]]:
    """Return what of a plan has been carried out, and what of the file is not used, one sentence each.

    The file is a table (CSV: part, begins, ends; separated by commas, semicolons or tabs), or a programme of Microsoft
    Project (XML) or Primavera (XER) whose tasks have a GlobalId and actual dates. A part is a lift's number, or the
    name, id or GlobalId. If only an end is stated, the beginning follows from the planned length.

    Args:
        file: The file's path, for messages and its kind.
        data: Its bytes.
        log: The log of the plan, whole.
        dates: The plan's dates.

    Raises:
        FileError: If the file cannot be read, or a date in it.
        ConfigError: If it is a damaged programme.
    """
    is_programme = data.lstrip(b"\xef\xbb\xbf \r\n\t").startswith((b"<", HEADER.encode()))
    rows = _of_programme(file, data, log) if is_programme else _of_table(file, data)
    begun, ended, unknown = dict[int, datetime](), dict[int, datetime](), list[str]()
    for row in rows:
        if row.begun is None and row.ended is None:
            continue
        try:
            orders = chosen_lifts(log, (row.part,))
        except SelectionError as error:
            unknown.append(f"{row.where}: {error.message}")
            continue
        if row.begun is not None and row.ended is not None and row.ended < row.begun:
            raise FileError(file, f"{row.where}: {row.part} ends before it begins")
        for order in orders:
            planned = dates.spans.get(order)
            if planned is None:
                unknown.append(f"{row.where}: {row.part} has no time in the plan")
                continue
            if row.ended is not None:
                ended[order] = row.ended
            begun[order] = row.begun or ended[order] - (planned[1] - planned[0])
    more = [f"and {len(unknown) - _MOST_NAMED} more"] if len(unknown) > _MOST_NAMED else []
    notes = tuple(f"{file.name}, not used: {sentence}" for sentence in (*unknown[:_MOST_NAMED], *more))
    return (DoneWork(begun, ended) if begun else None), notes


def done_until(log: PlanLog, dates: PlanDates) -> DoneWork | None:
    """Return what had been carried out when a simulated watch made its plan; None of any other log."""
    if (now := log.metadata.get(NOW_NS)) is None:
        return None
    now_ns, moments = int(now), dates.spans
    begun = {one.order: moments[one.order][0] for one in log.motions if one.work_starts_ns <= now_ns}
    ended = {one.order: moments[one.order][1] for one in log.motions if one.released_ns <= now_ns}
    for step in log.steps.steps:
        if log.steps.starting_ns(now_ns) >= step.ends_ns and step.order in moments:
            begun[step.order], ended[step.order] = moments[step.order]
    return DoneWork(begun, ended) if begun else None


def _of_programme(file: Path, data: bytes, log: PlanLog) -> Iterator[_Stated]:
    parts = {part.global_id: part.id for part in log.plan.site.components}
    names = {
        task_name(log.plan.site.components[lift.component], lift.number, is_lift=lift.status not in NOT_LIFTED): str(
            lift.number
        )
        for lift in log.plan.lifts
    }
    for task in read_programme(data, file.name, None).tasks:
        own = task.ids & parts.keys()
        if len(own) == 1:  # a task of several parts does not say when each was set
            yield _Stated(f"task {task.name!r}", parts[min(own)], *task.actual)
        elif not own and task.name in names:
            yield _Stated(f"task {task.name!r}", names[task.name], *task.actual)


def _of_table(file: Path, data: bytes) -> Iterator[_Stated]:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    lines = text.splitlines()
    first = next((n for n, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise FileError(file, "it is empty", hint=f"a line of names, then a line for each part: {_EXAMPLE}")
    separator = max(",;\t", key=lines[first].count)
    rows = csv.reader(lines[first:], delimiter=separator)
    names = [name.strip().casefold().replace(" ", "_") for name in next(rows)]
    at = {key: next((names.index(name) for name in known if name in names), None) for key, known in _COLUMNS.items()}
    if at["part"] is None or at["ends"] is None:
        lacking = "part" if at["part"] is None else "ends"
        raise FileError(file, f"line {first + 1}: no column {lacking!r}", hint=f"name the columns: {_EXAMPLE}")
    for number, row in enumerate(rows, start=first + 2):
        if any(value.strip() for value in row):
            part, begun, ended = (_value(row, at[key]) for key in ("part", "begins", "ends"))
            where = f"line {number}"
            yield _Stated(where, part, *(_moment(file, where, value) for value in (begun, ended)))


def _value(row: list[str], at: int | None) -> str:
    return row[at].strip() if at is not None and at < len(row) else ""


def _moment(file: Path, where: str, text: str) -> datetime | None:
    """Return a local date and time, as ISO 8601 has it or as ``9.3.2026 07:30``; None if there is none."""
    if not text:
        return None
    found = _DOTTED.fullmatch(text)
    try:
        moment = datetime.fromisoformat("{2}-{1:0>2}-{0:0>2} {3:0>5}".format(*found.groups()) if found else text)
    except ValueError:
        hint = "for example 2026-03-09T07:30 or 9.3.2026 07:30"
        raise FileError(file, f"{where}: {text!r} is not a date and time", hint=hint) from None
    return moment.replace(tzinfo=None, microsecond=0)
