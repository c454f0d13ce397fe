"""What a set-up costs: hire, crew and setting up, by the rates of the site file."""

from __future__ import annotations

from dataclasses import dataclass

from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.costs import CREW, CostsConfig

_WEEKS_A_MONTH = 52.0 / 12.0


@dataclass(frozen=True, slots=True)
class Rates:
    """What one machine costs, in the currency of the site.

    Attributes:
        set_up: Once.
        hour: For an hour of work, crew included.
    """

    set_up: float
    hour: float

    def total(self, hours: float) -> float:
        """Return the cost of so many hours of work."""
        return self.set_up + self.hour * hours

    def with_another(self, other: Rates) -> Rates:
        """Return what this and another machine cost, if both are on the site for the same hours."""
        return Rates(self.set_up + other.set_up, self.hour + other.hour)


def rates_of(costs: CostsConfig, calendar: CalendarConfig, name: str, kind: str, load_moment_tm: float) -> Rates:
    """Return what a machine costs.

    Args:
        costs: The rates of the site file.
        calendar: Its working hours, which make a month, and its crew.
        name: Name of the machine.
        kind: ``hammerhead``, ``luffing`` or ``mobile``.
        load_moment_tm: Its size.
    """
    people = CREW if calendar.erection_people is None else calendar.erection_people + 1
    crew = people * costs.person_hour
    for offer in costs.machine:
        if offer.name == name:
            return Rates(offer.set_up, offer.month / month_h(calendar) + crew)
    if kind == "mobile":
        return Rates(0.0, costs.mobile_hour + crew)
    month = costs.tower_month_per_tm * load_moment_tm
    return Rates(costs.set_up + costs.set_up_per_tm * load_moment_tm, month / month_h(calendar) + crew)


def month_h(calendar: CalendarConfig) -> float:
    """Return the working hours of a month without holidays."""
    hours = calendar.hours
    day_min = sum(end - start for start, end in hours.spans)
    return len(hours.days) * day_min / 60.0 * _WEEKS_A_MONTH
