"""The day on which work starts, from what the model says of itself; never from today's date: a guess is repeatable."""

from __future__ import annotations

from datetime import date, timedelta

from bimvox.bim.building import Building
from bimvox.site.working_hours import FIRST_YEAR, LAST_YEAR

_FIRST_IFC = 1997
"""No IFC file is older: a program without a clock writes 1970."""


def start_of(building: Building) -> tuple[date | None, str]:
    """Return the first day of work, and what it was taken from.

    It is the first day of the schedule in the model. Without one it is assumed to be the first Monday after the day on
    which the model was written.

    Returns:
        None if the model says neither.
    """
    begins, written = _usable(building.starts_on), _usable(building.written_on)
    if begins is not None:
        return begins, "the first day of the schedule in the model"
    if written is not None and written.year >= _FIRST_IFC:
        monday = written + timedelta(days=7 - written.weekday())
        return monday, f"assumed, the first Monday after the model was written ({written})"
    return None, ""


def _usable(day: date | None) -> date | None:
    return day if day is not None and FIRST_YEAR <= day.year < LAST_YEAR else None
