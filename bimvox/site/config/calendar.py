"""The ``[calendar]`` table of a site file: when work is done on the site."""

from __future__ import annotations

from datetime import date, datetime, time, timedelta
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from bimvox.site.config.uncertainty import UncertaintyConfig
from bimvox.site.config.validation import NotNegative, Table, Text, Whole
from bimvox.site.working_hours import SPAN, WorkingHours, day_of, public_holidays, span_min

DayName = Literal["Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"]


def _span(text: str) -> str:
    span_min(text)
    return text


Span = Annotated[Text, Field(json_schema_extra={"pattern": SPAN}), AfterValidator(_span)]
Day = Annotated[date, Field(strict=True), AfterValidator(day_of)]
People = Annotated[Whole, Field(ge=1, le=10_000)]
Country = Annotated[Text, Field(pattern="^[A-Z]{2,3}$")]

DEFAULT_SHIFT = "07:00-16:00"
DEFAULT_BREAKS = ("09:00-09:15", "12:00-12:45")
USUAL_UNLOADING_S = 1800.0
"""Working time to unload a delivery if nothing is known about it; assumed."""


class CalendarConfig(Table):
    """When work is done. The plan's own clock counts crane time; every date follows from this table.

    Without ``start`` and without ``--start`` there are no dates.
    """

    start: Day | None = None
    """First day of work, such as ``2026-03-09``; the first shift begins it."""
    days: Annotated[tuple[DayName, ...], Field(min_length=1, max_length=7)] = ("Mon", "Tue", "Wed", "Thu", "Fri")
    """Working days of a week."""
    shifts: Annotated[tuple[Span, ...], Field(min_length=1, max_length=24)] = (DEFAULT_SHIFT,)
    """Shifts of a working day. One that ends after midnight belongs to the day on which it begins."""
    breaks: Annotated[tuple[Span, ...], Field(max_length=24)] | None = None
    """Breaks within the shifts. Default: 09:00-09:15 and 12:00-12:45, as far as they are within a shift."""
    country: Country | None = None
    """Country whose public holidays are free, such as ``DE`` (ISO 3166). Default: none."""
    region: Text | None = None
    """Its region with holidays of its own, such as ``BY``."""
    holidays: Annotated[tuple[Day, ...], Field(max_length=10_000)] = ()
    """More days without work."""
    setup_h: Annotated[NotNegative, Field(le=2e4)] = 0.0
    """Working hours to set up the crane, before the first lift."""
    unloading_s: Annotated[NotNegative, Field(le=864_000.0)] | None = None
    """Working time to unload a delivery, before its first lift. Default: 1800, or with ``areas.access`` the crane's
    time for its parts."""
    erection_people: People | None = None
    """People of a crane's erection crew, slinger and signaller included. Default: not stated."""
    unloading_people: People | None = None
    """People who unload a delivery. Default: not stated."""
    uncertainty: UncertaintyConfig | None = None
    """How much shorter or longer lifts may take; with it, the end is given as percentiles too."""

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.region is not None and self.country is None:
            raise ValueError("region: give the country too")
        if self.country is not None:
            public_holidays(self.country, self.region)
        hours = self.hours
        if self.start is not None:
            hours.next_day(self.start)
        return self

    @property
    def hours(self) -> WorkingHours:
        """The working hours."""
        breaks = DEFAULT_BREAKS if self.breaks is None else self.breaks
        return WorkingHours.of(
            self.days, self.shifts, breaks, self.holidays, self.country, self.region, any_breaks=self.breaks is None
        )

    @property
    def begins(self) -> datetime | None:
        """When work may begin: with the first shift of the first day; None if that is not given."""
        if self.start is None:
            return None
        return datetime.combine(self.start, time()) + timedelta(minutes=self.hours.shifts[0][0])

    @property
    def is_default(self) -> bool:
        """Whether the site file says nothing about it but when work starts."""
        return not self.model_fields_set - {"start"}

    def in_words(self, *, by_crane: bool = False) -> str:
        """Return it in one line: ``Mon, Tue 07:00-16:00, breaks 12:00-12:45, no public holidays``.

        Args:
            by_crane: Whether the time for unloading is that of the crane's lifts.
        """
        unloading_min = (USUAL_UNLOADING_S if self.unloading_s is None else self.unloading_s) / 60.0
        breaks = self.breaks if self.breaks is not None else self.hours.within_shifts(DEFAULT_BREAKS)
        public = "no public holidays" if self.country is None else f"public holidays of {self.country}"
        week = ", ".join(self.days)
        parts = [
            f"{'Mon to Fri' if week == 'Mon, Tue, Wed, Thu, Fri' else week} {' and '.join(self.shifts)}",
            f"breaks {' and '.join(breaks)}" if breaks else "no breaks",
            public + (f" ({self.region})" if self.region else ""),
            *([f"{len(self.holidays)} more free days"] if self.holidays else []),
            f"set-up of the crane {self.setup_h:g} h",
            "unloading by the crane" if by_crane else f"unloading of a delivery {unloading_min:g} min",
            *([f"erection crew of {self.erection_people}"] if self.erection_people else []),
            *([f"unloading crew of {self.unloading_people}"] if self.unloading_people else []),
        ]
        return ", ".join(parts)
