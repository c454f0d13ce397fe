"""A schedule as an outline: summaries by storey and class, what each row waits for, and what is critical."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import count

from bimvox.bim.task_ranks import Link
from bimvox.exporters.lift_schedule import LiftSchedule, LiftTask, Preparation
from bimvox.units import NS_PER_S

_KINDS = {"other": "Other parts", "steel": "Steel"}

Waits = tuple[int, Link, timedelta]
"""What a row waits for: the number of that row, how, and the time between."""


@dataclass(frozen=True, slots=True)
class Row:
    """A row of an outline.

    Attributes:
        uid: Its number, from 1; the summary of everything has 0.
        level: Its level, from 1.
        name: Its name.
        times: Start and finish.
        task: Its work; None for a summary.
    """

    uid: int
    level: int
    name: str
    times: tuple[datetime, datetime]
    task: LiftTask | Preparation | None = None

    @property
    def is_delivery(self) -> bool:
        """Whether it is the unloading of a delivery."""
        return isinstance(self.task, Preparation) and self.task.is_delivery


@dataclass(frozen=True, slots=True)
class Outline:
    """A schedule as rows.

    Attributes:
        rows: The rows, each summary before what it sums up.
        waits: What a row waits for, by its number.
        critical: The numbers of what moves the end if it takes longer.
    """

    rows: tuple[Row, ...]
    waits: Mapping[int, tuple[Waits, ...]]
    critical: frozenset[int]

    def nested(self) -> dict[int, list[int]]:
        """Return the numbers of the rows directly below each summary."""
        found: dict[int, list[int]] = {}
        above: list[Row] = []
        for row in self.rows:
            above = [one for one in above if one.level < row.level]
            if above:
                found.setdefault(above[-1].uid, []).append(row.uid)
            above.append(row)
        return found


def outline_of(schedule: LiftSchedule) -> Outline:
    """Return a schedule as an outline.

    Lifts and other work have the numbers from 1 in their order, then preparations, then summaries. A delivery follows
    the last lift of the one before, which frees the yard.
    """
    first = len(schedule.tasks) + 1
    preparing = {first + n: one for n, one in enumerate(schedule.preparations)}
    rows = tuple(_rows(schedule, preparing))
    waits = {row.uid: tuple(_waits(schedule, preparing, row)) for row in rows}
    return Outline(rows, waits, _critical(schedule, rows, waits))


def _rows(schedule: LiftSchedule, preparing: Mapping[int, Preparation]) -> Iterator[Row]:
    """Yield the rows: preparations, then the parts by storey and class, each with a summary."""
    uids = count(len(schedule.tasks) + len(preparing) + 1)
    yield Row(0, 1, f"Assembly of {schedule.name}", (schedule.starts, schedule.finishes))
    yield from (
        Row(uid, 2, one.name, schedule.times(one), one) for uid, one in preparing.items() if not one.is_delivery
    )
    unloading = [Row(uid, 3, one.name, schedule.times(one), one) for uid, one in preparing.items() if one.is_delivery]
    if unloading:
        yield Row(next(uids), 2, "Deliveries", _span(unloading))
        yield from unloading
    groups: dict[str, dict[str, list[Row]]] = {}
    for number, task in enumerate(schedule.tasks, start=1):
        own = groups.setdefault(task.storey or "No storey", {}).setdefault(task.kind, [])
        own.append(Row(number, 4, task.name, schedule.times(task), task))
    for storey, kinds in groups.items():
        yield Row(next(uids), 2, storey, _span([row for rows in kinds.values() for row in rows]))
        for kind, rows in kinds.items():
            yield Row(next(uids), 3, _KINDS.get(kind, f"{kind.capitalize()}s"), _span(rows))
            yield from rows


def _span(rows: Sequence[Row]) -> tuple[datetime, datetime]:
    return min(row.times[0] for row in rows), max(row.times[1] for row in rows)


def _waits(schedule: LiftSchedule, preparing: Mapping[int, Preparation], row: Row) -> Iterator[Waits]:
    start, finish = row.times
    if isinstance(row.task, Preparation):
        yield from _before_preparation(schedule, preparing, row.task)
    if not isinstance(row.task, LiftTask):
        return
    for before, is_start in schedule.before(row.uid - 1):
        gap = (start if is_start else finish) - schedule.times(schedule.tasks[before])[1]
        yield before + 1, Link.FINISH_START if is_start else Link.FINISH_FINISH, gap
    for uid, one in preparing.items():
        if one.first == row.task.number and schedule.times(one)[1] <= start:
            yield uid, Link.FINISH_START, start - schedule.times(one)[1]


def _before_preparation(
    schedule: LiftSchedule, preparing: Mapping[int, Preparation], own: Preparation
) -> Iterator[Waits]:
    """Yield what a delivery follows: the last lift before its first one, and the preparation before it.

    A move of the crane follows the lift before it; the set-up of the crane follows nothing.
    """
    if not own.is_delivery and not own.cranes:
        return
    start = schedule.times(own)[0]
    lifts = [n for n, task in enumerate(schedule.tasks) if task.crane is not None and task.number < own.first]
    ends = [schedule.times(schedule.tasks[n])[1] for n in lifts[-1:]]
    if ends and (ends[0] <= start or not own.is_delivery):
        yield lifts[-1] + 1, Link.FINISH_START, start - ends[0]
    earlier = [
        (uid, schedule.times(one)[1])
        for uid, one in preparing.items()
        if own.is_delivery and one.first <= own.first and schedule.times(one)[1] <= start
    ]
    yield from ((uid, Link.FINISH_START, start - end) for uid, end in earlier[-1:])


def _critical(schedule: LiftSchedule, rows: Sequence[Row], waits: Mapping[int, Sequence[Waits]]) -> frozenset[int]:
    """Return the numbers of what moves the end if it takes longer: what ends last, and what that waits for, in turn.

    A lag is what the plan needs, so a link without slack is critical. A delivery that is unloaded working time before
    its first lift has slack. A summary is critical if a task in it is.
    """
    tasks = {row.uid: row.task for row in rows if row.task is not None}
    last = max((row.times[1] for row in rows if row.task is not None), default=None)
    found = [row.uid for row in rows if row.task is not None and row.times[1] == last]
    known = set(found)
    for uid in found:
        for before, *_ in waits[uid]:
            if before not in known and not _has_slack(schedule, tasks[before], tasks[uid]):
                known.add(before)
                found.append(before)
    critical = set(found)
    above: list[Row] = []
    for row in rows:
        above = [one for one in above if one.level < row.level]
        if row.uid in critical:
            critical.update(one.uid for one in above)
        if row.task is None:
            above.append(row)
    return frozenset(critical)


def _has_slack(schedule: LiftSchedule, before: LiftTask | Preparation, task: LiftTask | Preparation) -> bool:
    if schedule.dates is None or not isinstance(before, Preparation):
        return False
    end_ns, start_ns = (round(at_s * NS_PER_S) for at_s in (before.finish_s, task.start_s))
    return schedule.dates.work.between(end_ns, start_ns) > NS_PER_S
