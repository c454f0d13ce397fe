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
from bimvox.units import NS_PER_H


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


@dataclass(frozen=True, slots=True)
class Weather:
    """The days on which wind may stop the cranes.

    Attributes:
        shares: Of each working day of the plan, how likely it is lost.
        planned: How many of them the plan leaves free.
        day_ns: Working time of a day.
    """

    shares: tuple[float, ...] = ()
    planned: int = 0
    day_ns: int = 0


def added_ns(
    uncertainty: UncertaintyConfig,
    lifts: Mapping[Work, Sequence[int]],
    deliveries: int = 0,
    weather: Weather | None = None,
) -> tuple[int, ...]:
    """Return the working time that the plan takes longer at each of ``PERCENTILES``; negative if it takes less.

    Each lift draws its own factor, triangular between the smallest and the largest of its class, and takes longer until
    its class is learned; all lifts of a plan have one factor of the crew in common. The lifts follow each other, so
    their times add up. Late lorries and days lost to wind come on top, with one factor each of how likely they are: all
    deliveries have the same haulier, all days are of the same season.

    Args:
        uncertainty: The factors.
        lifts: Times of the lifts, ns, by class, in the order of the lifts.
        deliveries: How many deliveries come.
        weather: The days that wind may take; None: none.
    """
    random = np.random.default_rng(uncertainty.seed)
    planned, taken = 0.0, np.zeros(uncertainty.samples)
    for work in Work:
        own = np.array(lifts.get(work, ()), np.float64)
        planned += float(own.sum())
        factors = getattr(uncertainty, work.value) or uncertainty.lift
        own *= _learning(uncertainty, len(own))
        for first in range(0, len(own), _AT_ONCE):
            some = own[first : first + _AT_ONCE]
            taken += _drawn(random, factors, (len(taken), len(some))) @ some
    added = taken * _drawn(random, uncertainty.crew, (len(taken),)) - planned
    if deliveries and uncertainty.late_lorries:
        share = uncertainty.late_lorries * _drawn(random, uncertainty.haulier, (len(taken), 1))
        late = random.random((len(taken), deliveries)) < share
        added += (late * _drawn(random, uncertainty.late_h, late.shape)).sum(axis=1) * NS_PER_H
    if weather is not None:
        shares = np.array(weather.shares) * _drawn(random, uncertainty.season, (len(taken), 1))
        lost = (random.random((len(taken), len(weather.shares))) < shares).sum(axis=1)
        added += (lost - weather.planned) * weather.day_ns
    return tuple(int(value) for value in np.percentile(added, PERCENTILES))


def _learning(uncertainty: UncertaintyConfig, count: int) -> NDArray[np.float64]:
    """Return (count,) how many times as long as planned the lifts of a class take, by the power law of learning."""
    done = np.arange(1, count + 1) / uncertainty.learned_after
    result: NDArray[np.float64] = np.maximum(1.0, done ** np.log2(uncertainty.learning))
    return result


def _drawn(
    random: np.random.Generator, factors: tuple[float, float, float], shape: tuple[int, ...]
) -> NDArray[np.float64]:
    low, likely, high = factors
    return np.full(shape, low) if low == high else random.triangular(low, likely, high, shape)
