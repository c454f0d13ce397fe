"""What ends later than the programme wants."""

from __future__ import annotations

from collections.abc import Iterable

from bimvox.errors import listed
from bimvox.records.programme_dates import TaskDates
from bimvox.records.remark import Remark, Severity

LATE = "late"
_NAMED = 5


def late(tasks: Iterable[TaskDates]) -> tuple[Remark, ...]:
    """Return one remark about the tasks of a programme that end on a later day than it wants; the latest first."""
    tasks = tuple(tasks)
    found = sorted(
        ((task.late_days or 0, task) for task in tasks if (task.late_days or 0) > 0), key=lambda one: -one[0]
    )
    if not found:
        return ()
    named = listed((f"{task.task.path} ({_days(days)})" for days, task in found), _NAMED)
    said = f"{len(found):,} of {len(tasks):,} tasks of the programme end later than it wants: {named}"
    return (Remark(LATE, Severity.MINOR, said),)


def _days(days: int) -> str:
    return f"{days:,} working day{'' if days == 1 else 's'}"
