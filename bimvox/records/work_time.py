"""Working time: what a crew has of calendar time, in nanoseconds after a moment."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from datetime import date, datetime, timedelta

from bimvox.site.working_hours import WorkingHours
from bimvox.units import NS_PER_S

Span = tuple[int, int]
"""Begin and end, in nanoseconds after a moment."""

_NS_PER_US = 1000
_NIGHT_NS = 3 * 3600 * NS_PER_S
"""A shorter stop between two stretches of work is a break: a lorry waits for it on the site."""


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

    def unloaded(self, at_ns: int, work_ns: int) -> Span:
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
            self._starts.append(self.ns_of(first))
            self._ends.append(self.ns_of(last))
        return bisect_right(self._ends, at_ns)

    def _day(self, n: int) -> date:
        return (self.begins + timedelta(microseconds=self._starts[n] // _NS_PER_US)).date()

    def ns_of(self, moment: datetime) -> int:
        """Return a local time as nanoseconds after the moment from which on time is counted."""
        return (moment - self.begins) // timedelta(microseconds=1) * _NS_PER_US
