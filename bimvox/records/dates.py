"""The plan and its crews in calendar time: a view on its clock, which counts crane time. No motion changes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import date, datetime, timedelta
from heapq import heappop, heappush
from itertools import chain
from operator import itemgetter
from typing import Any

from bimvox.records.declared import Count, Maybe, Record
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.programme import PERCENTILES, TaskDates, Weather, added_ns
from bimvox.records.steps import NotLifted, Step, Steps, cured_ns
from bimvox.records.unloading import Unloading, is_unloaded_by_crane, unloading_by_lorry_s, unloading_of
from bimvox.site.component import Component
from bimvox.site.config.calendar import CalendarConfig, UncertaintyConfig, day_h
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.site.work import Work, work_of
from bimvox.site.working_hours import WorkingHours
from bimvox.units import NS_PER_S

_NS_PER_H = 3.6e12
_Span = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Crew:
    """People who work together."""

    name: str
    people: float


@dataclass(frozen=True, slots=True)
class _CrewHours:
    """The time of a crew.

    Attributes:
        crew: The crew.
        works_ns: How long it works.
        idle_ns: Working time from its first to its last work in which it has none.
    """

    crew: Crew
    works_ns: int
    idle_ns: int

    def document(self) -> dict[str, object]:
        """Return it for the JSON documents: hours of the crew, and those of its people together."""
        works_h, idle_h = self.works_ns / _NS_PER_H, self.idle_ns / _NS_PER_H
        return {
            "crew": self.crew.name,
            "people": self.crew.people,
            "works_h": round(works_h, 3),
            "idle_h": round(idle_h, 3),
            "man_hours": round(works_h * self.crew.people, 2),
            "idle_man_hours": round(idle_h * self.crew.people, 2),
        }


def erection_crews(site: Site, calendar: CalendarConfig) -> tuple[Crew, ...]:
    """Return the crew of each crane."""
    several = site.has_several_cranes
    names = [f"Erection crew, {one.name}" for one in site.cranes] if several else ["Erection crew"]
    return tuple(Crew(name, float(calendar.erection_people)) for name in names)


def crew_of(site: Site, component: Component) -> int:
    """Return the number of the erection crew that sets a part: that of its crane; a crane that moves has one."""
    return component.crane if site.has_several_cranes else 0


def unloading_crew(calendar: CalendarConfig) -> Crew | None:
    """Return the crew that unloads deliveries; None if the site file does not say how many people it has."""
    people = calendar.unloading_people
    return None if people is None else Crew("Unloading crew", float(people))


def casting_crew(site: Site) -> Crew:
    """Return the crew that casts in place."""
    return Crew("Casting crew", site.rules.casting.people)


def crew_hours(
    site: Site,
    calendar: CalendarConfig,
    lifts: Mapping[int, tuple[int, _Span]],
    cast: Sequence[_Span],
    deliveries: Sequence[_Span],
    work: WorkTime,
) -> tuple[_CrewHours, ...]:
    """Return the time of each crew of known size that has work.

    Where nobody else is stated, the first erection crew unloads.

    ``lifts``: component, start and release of each lift, by order, in nanoseconds of calendar time; ``cast`` and
    ``deliveries``: begin and end of the work at each part that is cast in place, and of the unloading of each
    delivery.
    """
    of_crane: dict[int, list[_Span]] = {}
    for component, span in lifts.values():
        of_crane.setdefault(crew_of(site, site.components[component]), []).append(span)
    unloading, found = unloading_crew(calendar), []
    for number, crew in enumerate(erection_crews(site, calendar)):
        if number in of_crane:
            # A lift is not interrupted: one that is longer than a shift is worked beyond it.
            lifted_ns = sum(end_ns - start_ns for start_ns, end_ns in of_crane[number])
            unloads = deliveries if unloading is None and number == min(of_crane) else ()
            unloaded_ns = sum(work.between(*span) for span in unloads)
            found.append(_hours(crew, [*of_crane[number], *unloads], lifted_ns + unloaded_ns, work))
    for other, spans in ((unloading, deliveries), (casting_crew(site), cast)):
        if other is not None and spans:
            found.append(_hours(other, spans, sum(work.between(*span) for span in spans), work))
    return tuple(found)


def _hours(crew: Crew, spans: Sequence[_Span], works_ns: int, work: WorkTime) -> _CrewHours:
    there_ns = work.between(min(span[0] for span in spans), max(span[1] for span in spans))
    return _CrewHours(crew, works_ns, max(0, there_ns - works_ns))


_NS_PER_US = 1000
_NIGHT_NS = 3 * 3600 * NS_PER_S
"""A shorter stop between two stretches of work is a break: a lorry waits for it on the site."""


@dataclass(frozen=True, slots=True)
class _Block:
    """Work of the cranes that is not interrupted: a lift, or several at the same time.

    Attributes:
        begins_ns: When it begins, on the site's clock.
        ends_ns: When it ends.
        orders: The lifts in it.
    """

    begins_ns: int
    ends_ns: int
    orders: tuple[int, ...]


class WorkTime:
    """The working time from a moment on, in nanoseconds after it.

    Args:
        hours: The working hours.
        begins: The moment, local time.
    """

    def __init__(self, hours: WorkingHours, begins: datetime) -> None:
        self.begins, self.hours = begins, hours
        self._spans: Iterator[tuple[datetime, datetime]] = hours.stretches(begins)
        self._starts: list[int] = []
        self._ends: list[int] = []
        self._longest_ns = hours.longest // timedelta(microseconds=1) * _NS_PER_US

    def worked(self, at_ns: int, work_ns: int) -> int:
        """Return when work ends that may be interrupted and is begun as soon as possible from a time on."""
        if work_ns <= 0:
            return at_ns
        n = self._stretch(at_ns)
        at_ns = max(at_ns, self._starts[n])
        while at_ns + work_ns > self._ends[n]:
            work_ns -= self._ends[n] - at_ns
            n = self._stretch(self._ends[n])
            at_ns = self._starts[n]
        return at_ns + work_ns

    def begun(self, until_ns: int, work_ns: int) -> int:
        """Return the latest time to begin work that may be interrupted and ends by a time; at the earliest 0."""
        n = self._stretch(until_ns)
        until_ns = max(until_ns, self._starts[n])
        while n > 0 and until_ns - self._starts[n] < work_ns:
            work_ns -= until_ns - self._starts[n]
            n -= 1
            until_ns = self._ends[n]
        return max(self._starts[n], until_ns - work_ns)

    def unloaded(self, at_ns: int, work_ns: int) -> _Span:
        """Return begin and end of unloading a lorry as soon as possible: overnight only if no day is enough."""
        begins_ns = self.fitting(at_ns, 0)
        morning_ns = self._morning_in(begins_ns, work_ns)
        if morning_ns is not None and self._morning_in(morning_ns, work_ns) is None:
            begins_ns = morning_ns
        return begins_ns, self.worked(begins_ns, work_ns)

    def unloaded_by(self, until_ns: int, work_ns: int) -> int:
        """Return the latest time to begin unloading a lorry so that it is empty by a time, in the same way."""
        begins_ns = self.begun(until_ns, work_ns)
        morning_ns = self._morning_in(begins_ns, work_ns)
        if morning_ns is not None:
            before_ns = self.begun(self._ends[self._stretch(morning_ns) - 1], work_ns)
            if self._morning_in(before_ns, work_ns) is None:
                return before_ns
        return begins_ns

    def _morning_in(self, begins_ns: int, work_ns: int) -> int | None:
        """Return when work goes on after the first night that interrupts it; None if none does."""
        first, last = self._stretch(begins_ns), self._stretch(self.worked(begins_ns, work_ns) - 1)
        mornings = (n for n in range(first + 1, last + 1) if self._starts[n] - self._ends[n - 1] >= _NIGHT_NS)
        return next((self._starts[n] for n in mornings), None)

    def days_before(self, at_ns: int, days: int) -> int:
        """Return when the working day begins that is so many working days before the day of a time."""
        n = self._stretch(at_ns)
        first, seen = n, {self._day(n)}
        while n > 0:
            n -= 1
            seen.add(self._day(n))
            if len(seen) > days + 1:
                break
            first = n
        return self._starts[first]

    def fitting(self, at_ns: int, work_ns: int) -> int:
        """Return the first time from ``at_ns`` on to begin work that no break and no end of a shift may interrupt.

        Work longer than every stretch begins with a stretch, and runs on beyond its end.
        """
        n = self._stretch(at_ns)
        while True:
            start_ns = max(at_ns, self._starts[n])
            at_start = start_ns == self._starts[n]
            if start_ns + work_ns <= self._ends[n] or (at_start and work_ns > self._longest_ns):
                return start_ns
            n = self._stretch(self._ends[n])

    def stretch_start(self, at_ns: int) -> int:
        """Return when the stretch of work begins that a time is in."""
        return self._starts[self._stretch(at_ns)]

    def between(self, at_ns: int, until_ns: int) -> int:
        """Return the working time between two times."""
        if until_ns <= at_ns:
            return 0
        last = self._stretch(until_ns)
        spans = zip(self._starts[: last + 1], self._ends[: last + 1], strict=True)
        return sum(max(0, min(high, until_ns) - max(low, at_ns)) for low, high in spans)

    def is_too_long(self, work_ns: int) -> bool:
        """Return whether work is longer than every uninterrupted stretch."""
        return work_ns > self._longest_ns

    def _stretch(self, at_ns: int) -> int:
        """Return the number of the first stretch that ends after a time."""
        while not self._ends or self._ends[-1] <= at_ns:
            first, last = next(self._spans)
            self._starts.append(self._ns(first))
            self._ends.append(self._ns(last))
        return bisect_right(self._ends, at_ns)

    def _day(self, n: int) -> date:
        return (self.begins + timedelta(microseconds=self._starts[n] // _NS_PER_US)).date()

    def _ns(self, moment: datetime) -> int:
        return (moment - self.begins) // timedelta(microseconds=1) * _NS_PER_US


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
    lorries: Mapping[int, tuple[_Span, ...]]
    setup: tuple[int, int] | None
    too_long: tuple[int, ...]
    blocks: tuple[tuple[_Block, int], ...] = field(repr=False)
    work: WorkTime = field(repr=False)
    is_unloaded_by_crane: bool = False
    later_ns: tuple[int, ...] = ()
    programme: tuple[TaskDates, ...] = ()
    crews: tuple[_CrewHours, ...] = ()
    unloading: Unloading | None = None
    crane_ns: int = 0
    is_dated: bool = True
    moves: Mapping[int, _Span] = field(default_factory=dict)

    @property
    def deliveries(self) -> dict[int, _Span]:
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

    def _moved(self, order: int, span: _Span) -> dict[str, object]:
        begins, ends = (self.moment(at_ns).isoformat() for at_ns in span)
        return {"number": order + 1, "begins": begins, "ends": ends}

    def _unloaded(self, span: _Span) -> dict[str, str]:
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
    return f"{dates.crane_ns / _NS_PER_H:,.1f} crane hours{more}"


TIME = Record(
    "PlanTime",
    "When a plan is carried out. Every other program and document shows the same numbers by the same names.",
    ("begins", str, "When the first work begins: date and clock, or the number of the working day and clock.",
     lambda it: it.in_words(it.first)),
    ("ends", str, "When the last work ends, in the same way.", lambda it: it.in_words(it.last)),
    ("working_days", Count, "Working days from the first to the last work."),
    ("crane_hours", float, "From the start of the first lift to the end of the last, without pauses.",
     lambda it: round(it.crane_ns / _NS_PER_H, 6)),
    ("unloading_hours", float, "Hours of the crane to unload deliveries, in addition.",
     lambda it: round((it.unloading.seconds if it.unloading else 0.0) / 3600.0, 6)),
    ("unloading", Maybe(dict[str, Any]), "The lorries and their unloading.",
     lambda it: it.unloading and asdict(it.unloading)),
    ("span_in_words", str, "Begin, end and working days in one line.", _span_in_words),
    ("hours_in_words", str, "The hours of the crane in one line.", _hours_in_words),
)  # fmt: skip


def dates_of(
    calendar: CalendarConfig,
    site: Site,
    lifts: Iterable[Lift],
    motions: Sequence[LiftMotion],
    steps: Steps,
    start: datetime | None = None,
    *,
    numbered: bool = False,
) -> PlanDates | None:
    """Return the dates of a plan; None if its start is not known, or it has no motions.

    Everything keeps its order in time: a lift waits for what carried before it in elapsed time, a step for the
    lifts before it, for its crew and for what carried. Waits run through nights and breaks, work does not.
    ``lifts`` are all of the plan; ``start`` is when work may begin, local time; None takes the calendar's. If neither
    is known, ``numbered`` asks for the times of a usual Monday on, whose working days are numbered.
    """
    lifts = list(lifts)
    is_dated = start is not None or calendar.start is not None
    calendar = calendar if is_dated or not numbered else calendar.usual
    begins = start or calendar.begins
    if begins is None or not motions:
        return None
    dates = _walked(calendar, site, lifts, motions, steps, begins)
    unloading = unloading_of(calendar, site, lifts)
    clock_ns = max(motion.end_ns for motion in motions) - min(motion.start_ns for motion in motions)
    dates = replace(dates, unloading=unloading, crane_ns=clock_ns, is_dated=is_dated)
    if not is_dated:
        return dates
    set_by_crane = {motion.order: (motion.component, dates.lifts[motion.order]) for motion in motions}
    cast = [
        dates.steps[step.order][:2] for step in steps.steps if site.components[step.component].means is Means.IN_SITU
    ]
    unloaded = [span for spans in dates.lorries.values() for span in spans]
    dates = replace(dates, crews=crew_hours(site, calendar, set_by_crane, cast, unloaded, dates.work))
    times: dict[Work, list[int]] = {}
    for motion in sorted(motions, key=lambda motion: motion.order):
        start_ns, released_ns = dates.lifts[motion.order]
        times.setdefault(work_of(site.components[motion.component]), []).append(released_ns - start_ns)
    days = (dates.first.date(), dates.last.date())
    weather = Weather(
        tuple(dates.hours.weather_shares(*days, calendar.days_lost)),
        sum(days[0] <= day <= days[1] for day in dates.hours.weather),
        round(day_h(calendar) * _NS_PER_H),
    )
    uncertainty = calendar.uncertainty or UncertaintyConfig()
    return replace(dates, later_ns=added_ns(uncertainty, times, unloading.deliveries, weather))


def hire_days(
    calendar: CalendarConfig, site: Site, lifts: Iterable[Lift], motions: Sequence[LiftMotion], steps: Steps
) -> int | None:
    """Return for how many days the crane of a plan is hired, see ``PlanDates.hire_days``; None without motions.

    If the calendar has no start, from a Monday on, with the mean of the days that wind takes.
    """
    known = calendar if calendar.start is not None else calendar.usual
    if not motions or known.begins is None:
        return None
    return _walked(known, site, lifts, motions, steps, known.begins).hire_days


def _walked(
    calendar: CalendarConfig,
    site: Site,
    lifts: Iterable[Lift],
    motions: Sequence[LiftMotion],
    steps: Steps,
    begins: datetime,
) -> PlanDates:
    return _Walk(calendar, site, WorkTime(calendar.hours_from(begins.date()), begins)).over(lifts, motions, steps)


def blocks_of(site: Site, motions: Iterable[LiftMotion]) -> tuple[_Block, ...]:
    """Return the lifts as blocks between which the cranes may stop; of several cranes, no load hangs then."""
    several = site.has_several_cranes
    spans = sorted(
        (motion.hooked_ns, motion.released_ns, motion.order)
        if several
        else (motion.start_ns, motion.end_ns, motion.order)
        for motion in motions
    )
    found: list[_Block] = []
    for begins_ns, ends_ns, order in spans:
        if found and begins_ns < found[-1].ends_ns:
            last = found.pop()
            found.append(_Block(last.begins_ns, max(last.ends_ns, ends_ns), (*last.orders, order)))
        else:
            found.append(_Block(begins_ns, ends_ns, (order,)))
    return tuple(found)


def in_words(moment: datetime) -> str:
    """Return a time: ``Thu 12 March 2026 14:10``."""
    return f"{moment:%a} {moment.day} {moment:%B %Y %H:%M}"


class _Walk:
    """Goes through a plan in elapsed time and gives everything its date."""

    def __init__(self, calendar: CalendarConfig, site: Site, work: WorkTime) -> None:
        self.calendar, self.site, self.work = calendar, site, work
        self.lifts: dict[int, tuple[int, int]] = {}
        self.steps: dict[int, tuple[int, int, int]] = {}
        self.lorries: dict[int, tuple[_Span, ...]] = {}
        self.starts_ns: list[int] = []
        self.moves: dict[int, _Span] = {}
        self._released: list[tuple[int, int]] = []  # of each lift: in the plan's elapsed time, in calendar time
        self._waits: list[tuple[int, int]] = []  # a heap, of the steps: when each carries, in both times
        self._carried_ns = 0
        self._crew_ns: dict[Means, int] = {}
        self._loads: dict[int, list[Lift]] = {}

    def over(self, lifts: Iterable[Lift], motions: Sequence[LiftMotion], planned: Steps) -> PlanDates:
        of_order = {motion.order: motion for motion in motions}
        delivery: dict[int, int] = {}
        for lift in lifts:
            if lift.place is not None:
                delivery[lift.order] = lift.place.delivery
                self._loads.setdefault(lift.place.delivery, []).append(lift)
        blocks, moves = blocks_of(self.site, motions), {move.order: move for move in planned.moves}
        # At the same time, a step comes first: it may carry at once.
        items: list[tuple[int, int, Step | _Block]] = [(step.begins_ns, 0, step) for step in planned.steps]
        items += [(planned.starting_ns(block.begins_ns), 1, block) for block in blocks]
        setup_ns = round(self.calendar.setup_h * 3600.0 * NS_PER_S)
        setup = (self.work.fitting(0, 0), self.work.worked(0, setup_ns)) if setup_ns else None
        end_ns = setup[1] if setup else 0
        clock_ns = min(motion.start_ns for motion in motions)
        for at_ns, _, item in sorted(items, key=lambda entry: entry[:2]):
            self._carry(at_ns)
            if isinstance(item, Step):
                self._step(item)
                continue
            end_ns = self.work.worked(end_ns, item.begins_ns - clock_ns)
            for order in item.orders:
                if (move := moves.get(order)) is not None:
                    begins_ns, end_ns = end_ns, self.work.worked(end_ns, move.ends_ns - move.begins_ns)
                    self.moves[order] = (self.work.fitting(begins_ns, 0), end_ns)
            coming = sorted({delivery[order] for order in item.orders if order in delivery} - self.lorries.keys())
            work_ns = {number: self._unloading_ns(number) for number in coming}
            ready_ns = end_ns
            for each_ns in chain.from_iterable(work_ns.values()):
                ready_ns = self.work.unloaded(ready_ns, each_ns)[1]
            start_ns = self.work.fitting(max(ready_ns, self._carried_ns), item.ends_ns - item.begins_ns)
            self._unload(work_ns, end_ns, start_ns)
            self.starts_ns.append(start_ns)
            for motion in sorted((of_order[order] for order in item.orders), key=lambda motion: motion.released_ns):
                self.lifts[motion.order] = at = self._lift(motion, start_ns - item.begins_ns)
                released_ns = planned.ending_ns(motion.released_ns)
                self._released.append((released_ns, at[1]))
                if (cured_at_ns := cured_ns(self.site, planned, motion)) is not None:
                    heappush(self._waits, (cured_at_ns, at[1] + cured_at_ns - released_ns))
            end_ns, clock_ns = start_ns + item.ends_ns - item.begins_ns, item.ends_ns
        long = (block for block in blocks if self.work.is_too_long(block.ends_ns - block.begins_ns))
        return PlanDates(
            self.calendar,
            self.work.begins,
            self.lifts,
            self.steps,
            self.lorries,
            setup,
            tuple(sorted(order for block in long for order in block.orders)),
            tuple(zip(blocks, self.starts_ns, strict=True)),
            self.work,
            is_unloaded_by_crane(self.calendar, self.site),
            moves=self.moves,
        )

    def _unloading_ns(self, number: int) -> tuple[int, ...]:
        """Return the working time to unload each lorry of a delivery, in the order in which they come."""
        times_s = unloading_by_lorry_s(self.calendar, self.site, self._loads[number])
        return tuple(round(time_s * NS_PER_S) for time_s in times_s if time_s)

    def _unload(self, work_ns: dict[int, tuple[int, ...]], from_ns: int, until_ns: int) -> None:
        """Note when lorries are unloaded: on the day of their delivery's first lift, or some working days earlier.

        One follows the other, and none stays overnight that can be unloaded in a day.

        ``work_ns``: the working time of each lorry of each delivery, in the order in which they come; ``from_ns``: when
        the yard is free for them; ``until_ns``: when the first lift of theirs starts.
        """
        earliest_ns = {}
        for number, lorries_ns in work_ns.items():
            earliest_ns[number] = from_ns
            for each_ns in lorries_ns:
                from_ns = self.work.unloaded(from_ns, each_ns)[1]
        for number, lorries_ns in reversed(work_ns.items()):
            if not lorries_ns:
                continue
            for each_ns in reversed(lorries_ns):
                until_ns = self.work.unloaded_by(until_ns, each_ns)
            at_ns = max(earliest_ns[number], self.work.days_before(until_ns, self.calendar.delivery_days))
            spans = []
            for each_ns in lorries_ns:
                spans.append(self.work.unloaded(at_ns, each_ns))
                at_ns = spans[-1][1]
            self.lorries[number] = tuple(spans)
            until_ns = spans[0][0]

    def _lift(self, motion: LiftMotion, shift_ns: int) -> tuple[int, int]:
        """Return start and release of a lift; the empty hook's way to it may begin after a break, not before it."""
        start_ns, hooked_ns = motion.work_starts_ns + shift_ns, motion.hooked_ns + shift_ns
        if self.site.has_several_cranes:
            start_ns = max(start_ns, min(self.work.stretch_start(hooked_ns), hooked_ns))
        return start_ns, motion.released_ns + shift_ns

    def _carry(self, at_ns: int) -> None:
        """Note what carries at a time, in the plan's elapsed time; the times that are asked for ascend."""
        while self._waits and self._waits[0][0] <= at_ns:
            self._carried_ns = max(self._carried_ns, heappop(self._waits)[1])

    def _step(self, step: Step) -> None:
        means = self.site.components[step.component].means
        earlier = bisect_right(self._released, step.begins_ns, key=itemgetter(0))
        released_ns = self._released[earlier - 1][1] if earlier else 0
        begins_ns = self.work.fitting(max(self._carried_ns, released_ns, self._crew_ns.get(means, 0)), 0)
        ends_ns = self.work.worked(begins_ns, step.ends_ns - step.begins_ns)
        if means is not Means.CRANE:  # one crew does one part after the other
            self._crew_ns[means] = ends_ns
        self.steps[step.order] = (begins_ns, ends_ns, ends_ns + step.carries_ns - step.ends_ns)
        heappush(self._waits, (step.carries_ns, self.steps[step.order][2]))
