"""The dates of a plan next to those of its programme, and when it may end if its times are uncertain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.site.config.calendar import UncertaintyConfig
from bimvox.site.programme import PlannedPart, Programme, ProgrammeTask
from bimvox.site.work import Work
from bimvox.site.working_hours import FIRST_YEAR, LAST_YEAR, WorkingHours


@dataclass(frozen=True, slots=True)
class TaskDates:
    """A task of the programme, and when the plan does its parts.

    Attributes:
        task: The task.
        orders: Orders of the lifts and steps of its parts, ascending.
        starts: When the first of them starts in the plan, local time.
        ends: When the last of them ends.
        late_days: Working days from the day on which the task should end to the day on which it ends; negative if it
            ends earlier, None if the programme does not say.
    """

    task: ProgrammeTask
    orders: tuple[int, ...]
    starts: datetime
    ends: datetime
    late_days: int | None

    def document(self) -> dict[str, Any]:
        """Return it for the JSON documents."""
        wished = (self.task.start, self.task.finish)
        return {
            "task": self.task.path,
            "lifts": [order + 1 for order in self.orders],
            **{key: at and at.isoformat() for key, at in zip(("wished_start", "wished_end"), wished, strict=True)},
            "starts": self.starts.isoformat(),
            "ends": self.ends.isoformat(),
            "late_working_days": self.late_days,
        }


def against_programme(
    programme: Programme,
    parts: Mapping[int, PlannedPart],
    spans: Mapping[int, tuple[datetime, datetime]],
    hours: WorkingHours,
) -> tuple[TaskDates, ...]:
    """Return the tasks that have a part in the plan, in the order of the programme.

    ``parts`` by the order of their lift or step; ``spans``: start and end of each, by order.
    """
    orders: dict[ProgrammeTask, list[int]] = {}
    for order in sorted(spans):
        if (task := programme.task_of(parts[order])) is not None:
            orders.setdefault(task, []).append(order)
    ends = {task: max(spans[order][1] for order in own) for task, own in orders.items()}
    wished = {task: task.finish for task in orders if task.finish and FIRST_YEAR <= task.finish.year <= LAST_YEAR}
    days = _WorkingDays(hours, [at.date() for at in (*ends.values(), *wished.values())])
    return tuple(
        TaskDates(
            task,
            tuple(orders[task]),
            min(spans[order][0] for order in orders[task]),
            ends[task],
            days.between(wished[task].date(), ends[task].date()) if task in wished else None,
        )
        for task in dict.fromkeys(programme.tasks)
        if task in orders
    )


class _WorkingDays:
    """Counts working days between days that are given beforehand."""

    def __init__(self, hours: WorkingHours, days: list[date]) -> None:
        self._first = min(days, default=date.min)
        length = (max(days, default=date.min) - self._first).days + 1
        works = (hours.works(self._first + timedelta(days=n)) for n in range(length))
        self._upto = list(accumulate(works, initial=0))

    def between(self, first: date, last: date) -> int:
        """Return the number of working days after the first day until the last one; negative if that is earlier."""
        return self._upto[(last - self._first).days + 1] - self._upto[(first - self._first).days + 1]


PERCENTILES = (50, 80, 95)
_AT_ONCE = 64


def added_ns(uncertainty: UncertaintyConfig, lifts: Mapping[Work, Sequence[int]]) -> tuple[int, ...]:
    """Return the working time that the plan takes longer at each of ``PERCENTILES``; negative if it takes less.

    Each lift draws its own factor, triangular between the smallest and the largest of its class; the lifts follow
    each other, so their times add up. ``uncertainty``: the factors by class; ``lifts``: times of the lifts, ns, by
    class.
    """
    random = np.random.default_rng(uncertainty.seed)
    total: NDArray[np.float64] = np.zeros(uncertainty.samples)
    for work in Work:
        factors: tuple[float, float, float] | None = getattr(uncertainty, work.value)
        times = np.array(lifts.get(work, ()), np.float64)
        if factors is None or not len(times):
            continue
        low, likely, high = factors
        if low == high:
            total += (low - 1.0) * times.sum()
            continue
        for first in range(0, len(times), _AT_ONCE):
            own = times[first : first + _AT_ONCE]
            total += (random.triangular(low, likely, high, (len(total), len(own))) - 1.0) @ own
    return tuple(int(value) for value in np.percentile(total, PERCENTILES))
