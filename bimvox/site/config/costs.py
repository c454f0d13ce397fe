"""The ``[costs]`` table of a site file: what a crane and its crew cost.

Sources: ``person_hour``: Eurostat, hourly labour costs in construction, European Union, 2024: 30.0 EUR.
``mobile_hour``: the middle of 150 to 300 USD (engineerfix.com, "How much does it cost to rent or buy a crane"); one
dollar counts as one euro. ``set_up``: four to five fitters for two days and a mobile crane (Liebherr in Capital
Equipment News, July 2018), the same again to dismantle: 4 * 32 h * 30 + 32 h * 225, about 11,000. All else is assumed;
the hire of a tower crane is between 3,000 and 15,000 USD a month (fmyly.com, "How much to hire a tower").
"""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from bimvox.site.config.validation import NotNegative, Table, Text

CREW = 4
"""People who are paid while the crane works, its operator included; assumed if the calendar states no erection crew."""


class MachineCosts(Table):
    """The offer for one machine."""

    name: Text
    """Its name, as in ``[crane] machine``."""
    month: NotNegative
    """Hire of a working month, without operator."""
    set_up: NotNegative = 0.0
    """Transport, foundation, erecting and dismantling."""


class CostsConfig(Table):
    """What cranes and crew cost, to compare set-ups. Defaults are rough: replace them by offers.

    Hire and crew are paid for the hours of the crane's work alone.
    """

    currency: Annotated[Text, Field(max_length=12)] = "EUR"
    """Currency of all amounts."""
    tower_month_per_tm: NotNegative = 30.0
    """Hire of a tower crane for a working month, for each tonne-metre of its largest load moment; assumed."""
    mobile_hour: NotNegative = 225.0
    """Hire of a mobile crane for an hour."""
    person_hour: NotNegative = 30.0
    """One person of the crew for an hour. The crew: ``calendar.erection_people`` and the operator, or four people."""
    set_up: NotNegative = 11_000.0
    """Erecting and dismantling a tower crane."""
    set_up_per_tm: NotNegative = 40.0
    """Its transport and foundation, for each tonne-metre; assumed."""
    budget: NotNegative | None = None
    """The most that a set-up may cost. Default: no limit."""
    machine: Annotated[tuple[MachineCosts, ...], Field(max_length=1000)] = ()
    """Offers; they take the place of the rates above."""

    @model_validator(mode="after")
    def _each_machine_once(self) -> Self:
        names = [one.name for one in self.machine]
        for number, name in enumerate(names):
            if name in names[:number]:
                raise ValueError(f"machine[{number}].name: {name!r} is listed twice")
        return self
