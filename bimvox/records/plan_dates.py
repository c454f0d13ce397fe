"""A plan and its crews in calendar time, as a value, and in words."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime, timedelta
from typing import Any

from bimvox.records.crews import CrewHours
from bimvox.records.declared import Count, Maybe, Record
from bimvox.records.programme import PERCENTILES, TaskDates
from bimvox.records.steps import NotLifted
from bimvox.records.unloading import Unloading
from bimvox.records.work_time import Span, WorkTime
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.working_hours import WorkingHours
from bimvox.units import NS_PER_H, NS_PER_S


@dataclass(frozen=True, slots=True)
class Block:
    """Work of the cranes that is not interrupted: a lift, or several at the same time.

    Attributes:
        begins_ns: When it begins, on the site's clock.
        ends_ns: When it ends.
        orders: The lifts in it.
    """

    begins_ns: int
    ends_ns: int
    orders: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class PlanDates:
    """When everything of a plan is done, in nanoseconds after ``begins``.

    Attributes:
        calendar: The calendar.
        begins: When work may begin, local time.
        lifts: Start and release of each lift, by order.
        steps: Begin, end and when it carries of each step of work that the crane does not do, by order.
        lorries: Begin and end of the unloading of each lorry of each delivery, by its number; none if that takes no
            time.
        setup: Begin and end of the set-up of the crane; None if that takes no time.
        too_long: Orders of the lifts that are longer than every uninterrupted stretch of work: they run on beyond it.
        blocks: What is not interrupted, ascending, and when each begins.
        work: The working time.
        is_unloaded_by_crane: Whether the time for unloading is that of the crane's lifts.
        later_ns: Working time that the plan takes longer at each of ``PERCENTILES``; none if nothing is uncertain.
        programme: The tasks of the programme, each with the dates of its parts; none without a programme.
        crews: The hours of each crew; none if the size of none is known.
        unloading: The unloading of all deliveries.
        crane_ns: From the start of the first lift to the end of the last on the site's clock, which stands in pauses.
        is_dated: Whether the day of the start is known; otherwise its working days are numbered.
        moves: Begin and end of each move of a crane to another set-up, by the order of the first lift after it.
    """

    calendar: CalendarConfig
    begins: datetime
    lifts: Mapping[int, tuple[int, int]]
    steps: Mapping[int, tuple[int, int, int]]
    lorries: Mapping[int, tuple[Span, ...]]
    setup: tuple[int, int] | None
    too_long: tuple[int, ...]
    blocks: tuple[tuple[Block, int], ...] = field(repr=False)
    work: WorkTime = field(repr=False)
    is_unloaded_by_crane: bool = False
    later_ns: tuple[int, ...] = ()
    programme: tuple[TaskDates, ...] = ()
    crews: tuple[CrewHours, ...] = ()
    unloading: Unloading | None = None
    crane_ns: int = 0
    is_dated: bool = True
    moves: Mapping[int, Span] = field(default_factory=dict)

    @property
    def deliveries(self) -> dict[int, Span]:
        """Begin and end of the unloading of each delivery, by its number; none if that takes no time."""
        return {number: (spans[0][0], spans[-1][1]) for number, spans in self.lorries.items()}

    @property
    def hours(self) -> WorkingHours:
        """The working hours, less the days that wind takes."""
        return self.work.hours

    def at(self, clock_ns: int) -> datetime:
        """Return the local time of a time on the site's clock; it ascends, and is in working hours during a lift."""
        n = bisect_right(self.blocks, clock_ns, key=lambda one: one[0].begins_ns) - 1
        block, start_ns = self.blocks[max(n, 0)]
        if clock_ns <= block.ends_ns:
            before_ns = min(self.work.stretch_start(start_ns), start_ns) if n < 0 else start_ns
            return self.moment(max(before_ns, start_ns + clock_ns - block.begins_ns))
        at_ns = self.work.worked(start_ns + block.ends_ns - block.begins_ns, clock_ns - block.ends_ns)
        return self.moment(min([at_ns, *(start_ns for _, start_ns in self.blocks[n + 1 : n + 2])]))

    def moment(self, after_ns: int) -> datetime:
        """Return the local time of nanoseconds after ``begins``, to the second, rounded half up."""
        return self.begins + timedelta(seconds=(after_ns + NS_PER_S // 2) // NS_PER_S)

    @property
    def spans(self) -> dict[int, tuple[datetime, datetime]]:
        """Start and end of each lift and step, local time, by order."""
        every = [*self.lifts.items(), *((order, at[:2]) for order, at in self.steps.items())]
        return {order: (self.moment(begin_ns), self.moment(end_ns)) for order, (begin_ns, end_ns) in sorted(every)}

    def span(self, order: int) -> tuple[str | None, str | None]:
        """Return start and end of a lift or step, local time as ISO 8601 has it; None if it has none."""
        found = self.lifts.get(order) or self.steps.get(order)
        return (None, None) if found is None else (self.moment(found[0]).isoformat(), self.moment(found[1]).isoformat())

    def of_work(self, orders: Iterable[int]) -> tuple[datetime, datetime, datetime] | None:
        """Return when work that the crane does not do begins, ends and carries, all of it; None if it has no time."""
        found = [self.steps[order] for order in orders if order in self.steps]
        if not found:
            return None
        begins_ns, ends_ns, carries_ns = zip(*found, strict=True)
        return self.moment(min(begins_ns)), self.moment(max(ends_ns)), self.moment(max(carries_ns))

    def with_dates(self, group: NotLifted) -> dict[str, object]:
        """Return a group of parts that the crane does not lift for the JSON documents, with its dates and in words."""
        found = self.of_work(lift.order for lift in group.lifts) or ()
        times = dict(zip(("begins", "ends", "carries"), found, strict=False))
        return {
            **group.to_dict(),
            **({f"{name}_at": at.isoformat() for name, at in times.items()} if self.is_dated else {}),
            **{f"{name}_in_words": self.in_words(at) for name, at in times.items()},
            "needed_by_in_words": self.clock_in_words(group.needed_by_ns),
        }

    @property
    def first(self) -> datetime:
        """When the first work begins."""
        return self.moment(min((at[0] for at in self._all()), default=0))

    @property
    def last(self) -> datetime:
        """When the last lift, or the last work, ends."""
        return self.moment(max((at[1] for at in self._all()), default=0))

    @property
    def working_days(self) -> int:
        """Number of working days from the first to the last work."""
        first, last, hours = self.first.date(), self.last.date(), self.hours
        return sum(hours.works(first + timedelta(days=n)) for n in range((last - first).days + 1))

    def in_words(self, moment: datetime) -> str:
        """Return a time: ``Thu 12 March 2026 14:10``; if the day of the start is not known, ``day 4 14:10``."""
        if self.is_dated:
            return in_words(moment)
        days = (moment.date() - self.begins.date()).days + 1
        day = sum(self.hours.works(self.begins.date() + timedelta(days=n)) for n in range(days))
        return f"day {max(day, 1):,} {moment:%H:%M}"

    def span_in_words(self, order: int) -> tuple[str, str] | None:
        """Return start and end of a lift or step in words; None if it has none."""
        found = self.lifts.get(order) or self.steps.get(order)
        return None if found is None else (self.in_words(self.moment(found[0])), self.in_words(self.moment(found[1])))

    def clock_in_words(self, clock_ns: int | None) -> str | None:
        """Return a time on the site's clock in words; None stays None."""
        return None if clock_ns is None else self.in_words(self.at(clock_ns))

    @property
    def time(self) -> dict[str, Any]:
        """When the plan is carried out, in the words and numbers that everybody is shown: ``TIME``."""
        return TIME.of(self)

    @property
    def hire_days(self) -> int:
        """For how many days the crane is hired: from its first work, unloading included, to its last, used or not.

        Those days of the week count on which the site works: days lost to wind and holidays too, weekends not.
        """
        spans = [*self.lifts.values(), *self.deliveries.values()]
        first, last = min(span[0] for span in spans), max(span[1] for span in spans)
        return max(1, self.hours.week_days(self.moment(first).date(), self.moment(last).date()))

    @property
    def end_in_words(self) -> str:
        """When the plan ends: ``Thu 12 March 2026 14:10, 3 working days``."""
        return f"{in_words(self.last)}, {_counted(self.working_days, 'working day')}"

    @property
    def percentiles(self) -> tuple[tuple[int, datetime], ...]:
        """Percentile and end of the plan if the times of its lifts are uncertain; none if they are not."""
        if not self.later_ns:
            return ()
        first_ns, last_ns = min(at[0] for at in self._all()), max(at[1] for at in self._all())
        planned_ns = self.work.between(first_ns, last_ns)
        ends = (self.work.worked(first_ns, max(0, planned_ns + later_ns)) for later_ns in self.later_ns)
        return tuple((share, self.moment(end_ns)) for share, end_ns in zip(PERCENTILES, ends, strict=True))

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the dates must know."""
        default = " (the default; [calendar] in the site file changes it)" if self.calendar.is_default else ""
        told = [f"calendar{default}: {self.calendar.in_words(by_crane=self.is_unloaded_by_crane)}"]
        if self.too_long:
            numbers = ", ".join(str(order + 1) for order in self.too_long)
            told.append(
                f"longer than any uninterrupted stretch of work, so that they run on into a break or beyond the shift: "
                f"lift{'' if len(self.too_long) == 1 else 's'} {numbers}"
            )
        if ends := self.percentiles:
            words = ", ".join(f"P{share} {in_words(end)}" for share, end in ends)
            assumed = "assumed, " if self.calendar.uncertainty is None else ""
            told.append(
                f"the end by simulation ({assumed}[calendar.uncertainty]: crew, learning, single lifts, late lorries, "
                f"wind): {words}"
            )
        return tuple(told)

    def document(self) -> dict[str, object]:
        """Return begin, end, working days and notes for the JSON documents."""
        ends = {f"P{share}": end.isoformat() for share, end in self.percentiles}
        return {
            "begins": self.first.isoformat(),
            "ends": self.last.isoformat(),
            "begins_in_words": in_words(self.first),
            "ends_in_words": self.end_in_words,
            "working_days": self.working_days,
            "hire_days": self.hire_days,
            "deliveries": [
                {
                    "delivery": number,
                    **self._unloaded((spans[0][0], spans[-1][1])),
                    "lorries": [self._unloaded(span) for span in spans],
                }
                for number, spans in sorted(self.lorries.items())
            ],
            **({"moves": [self._moved(*one) for one in sorted(self.moves.items())]} if self.moves else {}),
            "notes": list(self.notes),
            **({} if self.unloading is None else {"unloading": asdict(self.unloading)}),
            **({"percentiles": ends} if ends else {}),
            **({"crews": [crew.document() for crew in self.crews]} if self.crews else {}),
            **({"programme": [task.document() for task in self.programme]} if self.programme else {}),
        }

    def _moved(self, order: int, span: Span) -> dict[str, object]:
        begins, ends = (self.moment(at_ns).isoformat() for at_ns in span)
        return {"number": order + 1, "begins": begins, "ends": ends}

    def _unloaded(self, span: Span) -> dict[str, str]:
        return {"arrives": self.moment(span[0]).isoformat(), "unloaded": self.moment(span[1]).isoformat()}

    def _all(self) -> Iterator[tuple[int, int]]:
        yield from self.lifts.values()
        yield from self.deliveries.values()
        yield from () if self.setup is None else (self.setup,)
        yield from (at[:2] for at in self.steps.values())


def _counted(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def _span_in_words(dates: PlanDates) -> str:
    days = _counted(dates.working_days, "working day")
    return f"{dates.in_words(dates.first)} to {dates.in_words(dates.last)}, {days}"


def _hours_in_words(dates: PlanDates) -> str:
    more_s = 0.0 if dates.unloading is None else dates.unloading.seconds
    more = f" to lift and {more_s / 3600.0:,.1f} to unload" if more_s else ""
    return f"{dates.crane_ns / NS_PER_H:,.1f} crane hours{more}"


TIME = Record(
    "PlanTime",
    "When a plan is carried out. Every other program and document shows the same numbers by the same names.",
    ("begins", str, "When the first work begins: date and clock, or the number of the working day and clock.",
     lambda it: it.in_words(it.first)),
    ("ends", str, "When the last work ends, in the same way.", lambda it: it.in_words(it.last)),
    ("working_days", Count, "Working days from the first to the last work."),
    ("ends_p80", Maybe(str), "The end that 80 of 100 simulations keep; null if no time is uncertain.",
     lambda it: next((it.in_words(end) for share, end in it.percentiles if share == 80), None)),
    ("crane_hours", float, "From the start of the first lift to the end of the last, without pauses.",
     lambda it: round(it.crane_ns / NS_PER_H, 6)),
    ("unloading_hours", float, "Hours of the crane to unload deliveries, in addition.",
     lambda it: round((it.unloading.seconds if it.unloading else 0.0) / 3600.0, 6)),
    ("unloading", Maybe(dict[str, Any]), "The lorries and their unloading.",
     lambda it: it.unloading and asdict(it.unloading)),
    ("span_in_words", str, "Begin, end and working days in one line.", _span_in_words),
    ("hours_in_words", str, "The hours of the crane in one line.", _hours_in_words),
)  # fmt: skip


def in_words(moment: datetime) -> str:
    """Return a time: ``Thu 12 March 2026 14:10``."""
    return f"{moment:%a} {moment.day} {moment:%B %Y %H:%M}"
