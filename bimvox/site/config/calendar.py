"""The ``[calendar]`` table of a site file: when work is done on the site."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from math import ceil
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from bimvox.site.config.validation import NotNegative, Positive, Table, Text, Whole
from bimvox.site.working_hours import SPAN, WorkingHours, day_of, public_holidays, span_min


def _ascending(factors: tuple[float, float, float]) -> tuple[float, float, float]:
    low, likely, high = factors
    if not low <= likely <= high:
        raise ValueError("must ascend: shortest, likely, longest")
    return factors


Factor = Annotated[Positive, Field(le=100.0)]
Factors = Annotated[tuple[Factor, Factor, Factor], AfterValidator(_ascending)]


class UncertaintyConfig(Table):
    """How much shorter or longer the plan may take, for the percentiles of its end. All defaults are assumed.

    Factors (shortest, likely, longest) of the planned time, of each lift by class of work, and of all lifts together.
    """

    crew: Factors = (0.9, 1.0, 1.3)
    """Of all work alike: how good, how large and how well led the crew is. One factor for the whole plan."""
    lift: Factors = (0.8, 1.0, 1.5)
    """Of each lift by itself; for the classes below that are not given."""
    footing: Factors | None = None
    """Footings, piles, base slabs."""
    column: Factors | None = None
    """Columns, upright slender parts."""
    wall: Factors | None = None
    """Walls, thin upright parts."""
    beam: Factors | None = None
    """Beams, long parts."""
    slab: Factors | None = None
    """Slabs, planks, roofs, flat parts."""
    stair: Factors | None = None
    """Flights, ramps, landings."""
    steel: Factors | None = None
    """All parts of steel."""
    other: Factors | None = None
    """All others."""
    learning: Annotated[Positive, Field(ge=0.5, le=1.0)] = 0.9
    """Share of its time that a lift takes when twice as many of its class have been set, until it takes the planned
    time. 1: nobody learns."""
    learned_after: Annotated[Whole, Field(ge=1, le=10_000)] = 8
    """With this lift of a class, a crew takes the planned time."""
    late_lorries: Annotated[NotNegative, Field(le=1.0)] = 0.2
    """Share of the deliveries that are late."""
    haulier: Factors = (0.25, 0.75, 2.0)
    """Of that share: how reliable the haulier is. One factor for the whole plan; the default is 1 on average."""
    late_h: Factors = (0.25, 0.5, 2.0)
    """Hours that a late delivery keeps crane and crew waiting: shortest, likely, longest."""
    season: Factors = (0.5, 1.0, 1.5)
    """Of the days that wind takes: how windy the season is. One factor for the whole plan."""
    samples: Annotated[Whole, Field(ge=100, le=100_000)] = 10_000
    """Number of simulated plans."""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """Seed of the simulation."""


# The ``[costs]`` table of a site file: what cranes, crew and lorries cost.
#
# Sources: ``person_hour``: Eurostat, hourly labour costs in construction, European Union, 2024: 30.0 EUR.
# ``mobile_hour``: the middle of 150 to 300 USD (engineerfix.com, "How much does it cost to rent or buy a crane"); one
# dollar counts as one euro. ``set_up``: four to five fitters for two days and a mobile crane (Liebherr in Capital
# Equipment News, July 2018), the same again to dismantle: 4 * 32 h * 30 + 32 h * 225, about 11,000. All else is
# assumed; the hire of a tower crane is between 3,000 and 15,000 USD a month (fmyly.com, "How much to hire a tower").
# Days of hire: it begins when the crane can work on the site (pobcranes.ie, terms and conditions), and is paid for
# each day on the site until its release, regardless of use, waits and weather too (championcrane.com, terms).

ERECTION_PEOPLE = 3
"""A crane's erection crew, if the calendar does not say: a slinger in the yard and two people at the place, of whom one
signals (professional judgement)."""

Period = Literal["day", "week", "month"]
Least = Annotated[Whole, Field(ge=1, le=1000)]


class MachineCosts(Table):
    """The offer for one machine. One of `day`, `week` and `month` is the hire, without operator."""

    name: Text
    """Its name, as in ``[crane] machine``."""
    day: NotNegative | None = None
    """Hire of a working day."""
    week: NotNegative | None = None
    """Hire of a working week."""
    month: NotNegative | None = None
    """Hire of a working month."""
    least: Least = 1
    """Least number of such periods that are paid."""
    set_up: NotNegative = 0.0
    """Transport, foundation, erecting and dismantling."""

    @model_validator(mode="after")
    def _one_period(self) -> Self:
        if len(self.periods) != 1:
            raise ValueError("give one of day, week and month")
        return self

    @property
    def periods(self) -> dict[Period, float]:
        """The hire of a period, by its name."""
        every: tuple[tuple[Period, float | None], ...] = (("day", self.day), ("week", self.week), ("month", self.month))
        return {name: hire for name, hire in every if hire is not None}


class CostsConfig(Table):
    """What cranes, crew and lorries cost, to compare set-ups. Defaults are rough: replace them by offers.

    Crew is paid for the hours on the hook, lifts and unloading. Hire is paid for every period that is begun from the
    crane's first day to its last, waits for concrete and days lost to wind included.
    """

    currency: Annotated[Text, Field(max_length=12)] = "EUR"
    """Currency of all amounts."""
    tower_month_per_tm: NotNegative = 30.0
    """Hire of a tower crane for a working month, for each tonne-metre of its largest load moment; assumed."""
    tower_period: Period = "week"
    """Period by which a tower crane is paid: `day`, `week` or `month`; assumed."""
    tower_least: Least = 4
    """Least number of such periods; assumed."""
    mobile_hour: NotNegative = 225.0
    """Hire of a mobile crane for an hour."""
    mobile_period: Period = "day"
    """Period by which a mobile crane is paid; assumed."""
    mobile_least: Least = 1
    """Least number of such periods; assumed."""
    mobile_set_up: NotNegative = 1500.0
    """Its way to and from the site, with counterweight and mats; assumed."""
    person_hour: NotNegative = 30.0
    """One person of the crew for an hour. The crew: ``calendar.erection_people`` and the operator."""
    set_up: NotNegative = 11_000.0
    """Erecting and dismantling a tower crane."""
    set_up_per_tm: NotNegative = 40.0
    """Its transport and foundation, for each tonne-metre; assumed."""
    lorry: NotNegative = 600.0
    """A lorry from the works to the site and back; assumed."""
    budget: NotNegative | None = None
    """The most that a set-up may cost. Default: no limit."""
    machine: Annotated[tuple[MachineCosts, ...], Field(max_length=1000)] = ()
    """Offers; they take the place of the rates above."""

    @property
    def source(self) -> str:
        """Where the rates come from, in words."""
        if self.model_fields_set - {"currency", "budget"}:
            return "rates of [costs] in the site file, otherwise typical ones"
        return "typical rates, partly assumed: replace them by offers ([costs] in the site file)"

    @model_validator(mode="after")
    def _each_machine_once(self) -> Self:
        names = [one.name for one in self.machine]
        for number, name in enumerate(names):
            if name in names[:number]:
                raise ValueError(f"machine[{number}].name: {name!r} is listed twice")
        return self


DayName = Literal["Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"]


def _span(text: str) -> str:
    span_min(text)
    return text


Span = Annotated[Text, Field(json_schema_extra={"pattern": SPAN}), AfterValidator(_span)]
Day = Annotated[date, Field(strict=True), AfterValidator(day_of)]
People = Annotated[Whole, Field(ge=1, le=10_000)]
Country = Annotated[Text, Field(pattern="^[A-Z]{2,3}$")]

WeatherDays = Annotated[NotNegative, Field(le=31.0)]
USUAL_WEATHER_DAYS = (2.0, 2.0, 1.5, 1.0, 1.0, 0.5, 0.5, 0.5, 1.0, 1.5, 2.0, 2.0)
"""Working days a month on which wind stops the cranes, if the site file does not say (professional judgement)."""

DEFAULT_SHIFT = "07:00-16:00"
DEFAULT_BREAKS = ("09:00-09:15", "12:00-12:45")
_USUAL_MONDAY = date(2026, 3, 2)
USUAL_UNLOADING_S = 1800.0
"""Working time to unload a lorry if nothing is known about it; assumed."""


class CalendarConfig(Table):
    """When work is done. The plan's own clock counts crane time; every date follows from this table.

    Without ``start`` and without ``--start`` there are no dates.
    """

    start: Day | None = Field(default=None, examples=[date(2026, 3, 9)])
    """First day of work; the first shift begins it."""
    days: Annotated[tuple[DayName, ...], Field(min_length=1, max_length=7)] = ("Mon", "Tue", "Wed", "Thu", "Fri")
    """Working days of a week."""
    shifts: Annotated[tuple[Span, ...], Field(min_length=1, max_length=24)] = (DEFAULT_SHIFT,)
    """Shifts of a working day. One that ends after midnight belongs to the day on which it begins."""
    breaks: Annotated[tuple[Span, ...], Field(max_length=24)] | None = Field(default=None, examples=[DEFAULT_BREAKS])
    """Breaks within the shifts. Default: 09:00-09:15 and 12:00-12:45, as far as they are within a shift."""
    country: Country | None = Field(default=None, examples=["DE"])
    """Country whose public holidays are free (ISO 3166). Default: none."""
    region: Text | None = Field(default=None, examples=["BY"])
    """Its region with holidays of its own."""
    holidays: Annotated[tuple[Day, ...], Field(max_length=10_000)] = Field(default=(), examples=[(date(2026, 12, 24),)])
    """More days without work."""
    setup_h: Annotated[NotNegative, Field(le=2e4)] = 0.0
    """Working hours to set up the crane, before the first lift."""
    unloading_s: Annotated[NotNegative, Field(le=864_000.0)] | None = Field(default=None, examples=[USUAL_UNLOADING_S])
    """Working time to unload a lorry, before the first lift of its delivery. Default: with ``areas.access`` the crane's
    time for its parts, otherwise 1800. 0: nothing is unloaded by the crane."""
    delivery_days: Annotated[Whole, Field(ge=0, le=60)] = 0
    """Working days that a delivery comes before the day of its first lift. In any case the yard must be free: all parts
    of the delivery before are set."""
    erection_people: People = ERECTION_PEOPLE
    """People of a crane's erection crew, slinger and signaller included, for whom the crew's times hold; assumed."""
    unloading_people: People | None = None
    """People who unload a delivery. Default: the erection crew unloads."""
    weather_days: Annotated[tuple[WeatherDays, ...], Field(min_length=12, max_length=12)] | None = Field(
        default=None, examples=[USUAL_WEATHER_DAYS]
    )
    """Working days a month, January first, on which wind stops the cranes: a statistic of the place, such as the days
    with gusts above the wind in which lifts are permitted. Each whole day that they add up to is free of work.
    Default: the example, for the north (assumed); twelve times 0: none."""
    weather_source: Text | None = Field(default=None, max_length=200, examples=["station, years, gusts above 9.8 m/s"])
    """Where `weather_days` come from."""
    uncertainty: UncertaintyConfig | None = None
    """How much shorter or longer the plan may take. Default: the defaults of this table."""

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
    def days_lost(self) -> tuple[float, ...]:
        """Working days that wind takes of each month, January first."""
        return USUAL_WEATHER_DAYS if self.weather_days is None else self.weather_days

    def hours_from(self, day: date) -> WorkingHours:
        """Return the working hours of work that begins on a day, less the days that wind takes."""
        return self.hours.less_weather(day, self.days_lost)

    @property
    def begins(self) -> datetime | None:
        """When work may begin: with the first shift of the first day; None if that is not given."""
        if self.start is None:
            return None
        return datetime.combine(self.start, time()) + timedelta(minutes=self.hours.shifts[0][0])

    @property
    def usual(self) -> Self:
        """The same from a usual Monday on, without holidays: wind takes as many days of each month."""
        lost = sum(self.days_lost) / 12.0
        update = {"start": _USUAL_MONDAY, "holidays": (), "country": None, "region": None, "weather_days": (lost,) * 12}
        return self.model_copy(update=update)

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
        week, given = ", ".join(self.days), self.model_fields_set
        parts = [
            f"{'Mon to Fri' if week == 'Mon, Tue, Wed, Thu, Fri' else week} {' and '.join(self.shifts)}",
            f"breaks {' and '.join(breaks)}" if breaks else "no breaks",
            public + (f" ({self.region})" if self.region else ""),
            *([f"{len(self.holidays)} more free days"] if self.holidays else []),
            self._weather_in_words(),
            f"set-up of the crane {self.setup_h:g} h",
            "unloading by the crane" if by_crane else f"unloading of a lorry {unloading_min:g} min",
            f"erection crew of {self.erection_people}" + ("" if "erection_people" in given else " (assumed)"),
            *([f"unloading crew of {self.unloading_people}"] if self.unloading_people else []),
        ]
        return ", ".join(parts)

    def _weather_in_words(self) -> str:
        if not any(self.days_lost):
            return "no days lost to wind"
        source = "assumed" if self.weather_days is None else self.weather_source or "no source is given"
        return f"wind takes {sum(self.days_lost):g} working days a year ({source})"


_WEEKS_A_MONTH = 52.0 / 12.0
_ROUNDING = 1e-9
_MOST_LOST = 0.9


@dataclass(frozen=True, slots=True)
class Hire:
    """The hire of a machine.

    Attributes:
        rate: For a period.
        days: Days of a period, of those days of the week on which the site works.
        least: Least number of periods.
    """

    rate: float
    days: float
    least: int = 1

    def total(self, days: float) -> float:
        """Return the hire for so many days: for every period that is begun."""
        return self.rate * max(self.least, ceil(days / self.days - _ROUNDING))


@dataclass(frozen=True, slots=True)
class Cost:
    """What the work of a plan costs, in the currency of the site.

    Attributes:
        set_up: Transport, foundation, erecting and dismantling of the cranes.
        crew: The crew, for all hours on the hook.
        hire: The cranes, for every period that is begun.
        lorries: All lorries.
        currency: The currency, if it is known.
        source: Where the rates come from, in words.
    """

    set_up: float
    crew: float
    hire: float
    lorries: float
    currency: str = ""
    source: str = ""

    @property
    def total(self) -> float:
        """All of it."""
        return self.set_up + self.lorries + self.crew + self.hire

    def document(self) -> dict[str, object]:
        """Return it for the JSON documents."""
        amounts = {key: round(getattr(self, key), 2) for key in ("crew", "hire", "lorries", "set_up", "total")}
        return {**amounts, "currency": self.currency, "source": self.source}


@dataclass(frozen=True, slots=True)
class Rates:
    """What the work with one machine costs, in the currency of the site.

    Attributes:
        set_up: Transport, foundation, erecting and dismantling, once.
        hour: The crew, for an hour on the hook.
        day_h: Working hours of a day.
        hires: The machine, or two.
        unloading_h: Hours on the hook besides those of the lifts.
        lorries: All lorries.
        waits_h: Working hours in which the crane stands idle, such as to wait for joints, by an estimate.
        lost: Share of the days that wind takes.
    """

    set_up: float
    hour: float
    day_h: float
    hires: tuple[Hire, ...] = ()
    unloading_h: float = 0.0
    lorries: float = 0.0
    waits_h: float = 0.0
    lost: float = 0.0

    def total(self, hours: float, hire_days: float | None = None) -> float:
        """Return all that so many hours of lifts cost; the arguments are those of ``cost``."""
        return self.cost(hours, hire_days).total

    def cost(self, hours: float, hire_days: float | None = None) -> Cost:
        """Return the cost of so many hours of lifts.

        Args:
            hours: The hours.
            hire_days: Days of hire, as ``bimvox.records.dates.hire_days`` counts them; None: by an estimate.
        """
        hook_h = hours + self.unloading_h
        days = (hook_h + self.waits_h) / self.day_h / (1.0 - self.lost) if hire_days is None else hire_days
        return Cost(self.set_up, self.hour * hook_h, sum(hire.total(days) for hire in self.hires), self.lorries)

    def with_another(self, other: Rates) -> Rates:
        """Return what this and another machine cost, if both are on the site for the same hours and deliveries."""
        return replace(
            self, set_up=self.set_up + other.set_up, hour=self.hour + other.hour, hires=(*self.hires, *other.hires)
        )

    def with_deliveries(self, unloading_h: float, lorries: float) -> Rates:
        """Return the same with other deliveries: the hours to unload them, and what all lorries cost."""
        return replace(self, unloading_h=unloading_h, lorries=lorries)


MOBILE_TM = 370.0
"""Load moment up to which ``mobile_hour`` holds: the generic machine of the 100 t class. Larger ones cost as much more
as they carry (professional judgement)."""


def rates_of(costs: CostsConfig, calendar: CalendarConfig, name: str, kind: str, load_moment_tm: float) -> Rates:
    """Return what a machine costs, without deliveries and waits.

    Args:
        costs: The rates of the site file.
        calendar: Its working hours, its crew, and the days that wind takes.
        name: Name of the machine.
        kind: ``hammerhead``, ``luffing`` or ``mobile``.
        load_moment_tm: Its size.
    """
    week = len(calendar.hours.days)
    days: dict[Period, float] = {"day": 1.0, "week": week, "month": week * _WEEKS_A_MONTH}
    lost = min(_MOST_LOST, sum(calendar.days_lost) / 12.0 / days["month"])
    person_hours = (calendar.erection_people + 1) * costs.person_hour
    rates = Rates(0.0, person_hours, day_h(calendar), lost=lost)
    for offer in costs.machine:
        if offer.name == name:
            hires = tuple(Hire(rate, days[period], offer.least) for period, rate in offer.periods.items())
            return replace(rates, set_up=offer.set_up, hires=hires)
    if kind == "mobile":
        period = days[costs.mobile_period]
        hour = costs.mobile_hour * max(1.0, load_moment_tm / MOBILE_TM)
        hire = Hire(hour * period * rates.day_h, period, costs.mobile_least)
        return replace(rates, set_up=costs.mobile_set_up, hires=(hire,))
    month, period = costs.tower_month_per_tm * load_moment_tm, days[costs.tower_period]
    hire = Hire(month * period / days["month"], period, costs.tower_least)
    return replace(rates, set_up=costs.set_up + costs.set_up_per_tm * load_moment_tm, hires=(hire,))


def day_h(calendar: CalendarConfig) -> float:
    """Return the working hours of a day."""
    return sum(end - start for start, end in calendar.hours.spans) / 60.0
