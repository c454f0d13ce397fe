"""The hours in which a site works: days, shifts, breaks and holidays. Local time; a change of the clocks is ignored."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from functools import cache
from typing import Self

from bimvox.errors import shown
from bimvox.extras import require

DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
FIRST_YEAR, LAST_YEAR = 1950, 2150
"""Years in which work may start."""

SPAN = r"^\d\d:\d\d-\d\d:\d\d$"
"""Pattern of the text of a span."""

_DAY_MIN = 1440
_MOST_FREE_DAYS = 3660
_WEATHER_DAYS = 1461
"""For so long, days lost to wind are laid out: work of more than four years has none after them."""
_ROUNDING = 1e-9

Span = tuple[int, int]
"""Two times of a day, in minutes after its midnight; the second one may be on the next day."""


@dataclass(frozen=True, slots=True)
class WorkingHours:
    """When a site works.

    Attributes:
        days: Working days of a week, Monday is 0.
        spans: Uninterrupted spans of work of a working day, ascending; they end with a break or a shift.
        shifts: Its shifts.
        free: Days without work.
        country: Country whose public holidays are free too; None for none.
        region: Its region.
        weather: Those of ``free`` that wind takes.
    """

    days: frozenset[int]
    spans: tuple[Span, ...]
    shifts: tuple[Span, ...]
    free: frozenset[date] = frozenset()
    country: str | None = None
    region: str | None = None
    weather: frozenset[date] = frozenset()

    @classmethod
    def of(
        cls,
        days: Iterable[str],
        shifts: Sequence[str],
        breaks: Sequence[str],
        free: Collection[date] = (),
        country: str | None = None,
        region: str | None = None,
        *,
        any_breaks: bool = False,
    ) -> Self:
        """Return the hours of texts such as ``Mon`` and ``07:00-16:00``.

        Args:
            days: Working days.
            shifts: Shifts of a working day.
            breaks: Breaks.
            free: Days without work.
            country: Country whose public holidays are free too.
            region: Its region.
            any_breaks: Whether breaks outside the shifts are left out.

        Raises:
            ValueError: If shifts overlap, a break is outside all shifts, or no time is left to work.
        """
        given = sorted(span_min(text) for text in shifts)
        for (_, end), (begin, _) in zip(given, [*given[1:], (given[0][0] + _DAY_MIN, 0)], strict=True):
            if end > begin:
                raise ValueError(f"shifts: {' and '.join(shifts)} overlap")
        hours = cls(frozenset(map(DAYS.index, days)), tuple(given), tuple(given), frozenset(free), country, region)
        kept = hours.within_shifts(breaks)
        if not any_breaks and len(kept) < len(breaks):
            outside = next(text for text in breaks if text not in kept)
            raise ValueError(f"breaks: {outside} is not within a shift ({', '.join(shifts)})")
        pauses = [one for text in kept for one in _both_days(span_min(text))]
        spans = tuple(one for shift in given for one in _without(shift, pauses))
        if not spans:
            raise ValueError("breaks: they leave no time to work")
        return cls(hours.days, spans, hours.shifts, hours.free, country, region)

    def within_shifts(self, breaks: Iterable[str]) -> tuple[str, ...]:
        """Return the breaks that are within a shift."""
        return tuple(
            text
            for text in breaks
            if any(
                begin <= low and high <= end for begin, end in self.shifts for low, high in _both_days(span_min(text))
            )
        )

    @property
    def longest(self) -> timedelta:
        """The longest uninterrupted work."""
        return timedelta(minutes=max(end - begin for begin, end in self.spans))

    def works(self, day: date) -> bool:
        """Return whether a day is a working day."""
        if day.weekday() not in self.days or day in self.free:
            return False
        return self.country is None or day not in public_holidays(self.country, self.region)

    def of_weekday(self, weekday: int) -> tuple[Span, ...]:
        """Return the spans of work of a day of the week, midnight to midnight; Monday is 0."""
        today = [(low, min(high, _DAY_MIN)) for low, high in self.spans if weekday in self.days and low < _DAY_MIN]
        night = [
            (max(low - _DAY_MIN, 0), high - _DAY_MIN)
            for low, high in self.spans
            if (weekday - 1) % 7 in self.days and high > _DAY_MIN
        ]
        return (*night, *today)

    def less_weather(self, first: date, days: Sequence[float]) -> WorkingHours:
        """Return the hours of work that begins on a day, free of work on so many working days of each month, evenly.

        What is less than a day is carried on: the first free day comes when a whole one has been lost.

        Args:
            first: First day of work.
            days: Of each month, January first.
        """
        if not any(days):
            return self
        lost: set[date] = set()
        owed, at = 0.0, first
        while at < first + timedelta(days=_WEATHER_DAYS):
            shares = self._share_of_month(at.year, at.month, days)
            while at.month == shares[0] and at < first + timedelta(days=_WEATHER_DAYS):
                if self.works(at):
                    if owed >= 1.0 - _ROUNDING:
                        lost.add(at)
                        owed -= 1.0
                    owed += shares[1]
                at += timedelta(days=1)
        return replace(self, free=self.free | lost, weather=frozenset(lost))

    def weather_shares(self, first: date, last: date, days: Sequence[float]) -> list[float]:
        """Return the share of each day that wind takes, of the days from ``first`` to ``last`` that may be worked."""
        plain = replace(self, free=self.free - self.weather, weather=frozenset())
        every = (first + timedelta(days=n) for n in range((last - first).days + 1))
        return [plain._share_of_month(day.year, day.month, days)[1] for day in every if plain.works(day)]

    def _share_of_month(self, year: int, month: int, days: Sequence[float]) -> tuple[int, float]:
        """Return the month and the share of its working days that is lost."""
        begin = date(year, month, 1)
        every = (begin + timedelta(days=n) for n in range(31))
        worked = sum(self.works(day) for day in every if day.month == month)
        return month, min(1.0, days[month - 1] / worked) if worked else 0.0

    def free_days(self, first: date, last: date) -> tuple[date, ...]:
        """Return the days from ``first`` to ``last`` that would be working days but for a holiday."""
        days = (first + timedelta(days=n) for n in range((last - first).days + 1))
        return tuple(day for day in days if day.weekday() in self.days and not self.works(day))

    def week_days(self, first: date, last: date) -> int:
        """Return how many of the days from ``first`` to ``last`` are working days of a week, free or not."""
        return sum((first + timedelta(days=n)).weekday() in self.days for n in range((last - first).days + 1))

    def next_day(self, day: date) -> date:
        """Return the first working day from a day on.

        Raises:
            ValueError: If there is none for ten years.
        """
        for n in range(_MOST_FREE_DAYS):
            if self.works(day + timedelta(days=n)):
                return day + timedelta(days=n)
        raise ValueError(f"no working day from {day} on for ten years")

    def stretches(self, begins: datetime) -> Iterator[tuple[datetime, datetime]]:
        """Yield the uninterrupted spans of work from a time on, ascending, without end; the first may be cut."""
        day = self.next_day(begins.date() - timedelta(days=1))
        while True:
            midnight = datetime.combine(day, time())
            for begin, end in self.spans:
                first, last = midnight + timedelta(minutes=begin), midnight + timedelta(minutes=end)
                if last > begins:
                    yield max(first, begins), last
            day = self.next_day(day + timedelta(days=1))


def span_min(text: str) -> Span:
    """Return a span such as ``22:00-06:00`` in minutes after midnight; its end may be on the next day.

    Raises:
        ValueError: If it is not one.
    """
    if not re.fullmatch(SPAN, text):
        raise ValueError(f"expected two times such as 07:00-16:00, got {shown(text)}")
    minutes = []
    for part in text.split("-"):
        hour, minute = int(part[:2]), int(part[3:])
        if minute > 59 or hour * 60 + minute > _DAY_MIN:
            raise ValueError(f"{shown(part)} is not a time of day")
        minutes.append(hour * 60 + minute)
    begin, end = minutes
    if begin in (end, _DAY_MIN):
        raise ValueError(f"{text} has no length")
    return begin, end if end > begin else end + _DAY_MIN


def day_of(day: date) -> date:
    """Return the day; raise a ValueError if its year is not one in which work may start."""
    if not FIRST_YEAR <= day.year <= LAST_YEAR:
        raise ValueError(f"{day} is not between {FIRST_YEAR} and {LAST_YEAR}")
    return day


@cache
def public_holidays(country: str, region: str | None) -> Collection[date]:
    """Return the public holidays of a country and its region, of every year that is asked for.

    Raises:
        ValueError: If the country or region is not known.
        MissingPackageError: If the package that knows them is not installed.
    """
    require("holidays", "[calendar] country")
    import holidays  # takes a third of a second, and only sites that name a country need it

    known = holidays.list_supported_countries(include_aliases=True)
    if country not in known:
        raise ValueError(f"country: no holidays are known of {shown(country)}; use its ISO code, such as DE")
    if region is not None and region not in known[country]:
        listed = ", ".join(known[country]) or "none"
        raise ValueError(f"region: no holidays are known of {shown(region)} in {country}; known: {listed}")
    result: Collection[date] = holidays.country_holidays(country, subdiv=region)
    return result


def _both_days(span: Span) -> tuple[Span, Span]:
    """Return a span on a shift's day, and on the day after it."""
    return span, (span[0] + _DAY_MIN, span[1] + _DAY_MIN)


def _without(shift: Span, pauses: Iterable[Span]) -> Iterator[Span]:
    at, end = shift
    for low, high in sorted(pauses):
        if high <= at or low >= end:
            continue
        if low > at:
            yield at, low
        at = max(at, high)
    if at < end:
        yield at, end
