"""The first day of work, from what a model says of itself."""

from dataclasses import replace
from datetime import date

import pytest
from box_buildings import frame_house

from bimvox.site.start_guess import start_of


@pytest.mark.parametrize(
    ("written", "monday"),
    [
        (date(2026, 3, 2), date(2026, 3, 9)),  # a Monday itself
        (date(2026, 3, 8), date(2026, 3, 9)),
        (date(2026, 12, 31), date(2027, 1, 4)),
        (date(1970, 1, 1), None),  # a program without a clock
        (date(2150, 12, 31), None),
        (None, None),
    ],
)
def test_it_is_the_monday_after_the_model_was_written(written: date | None, monday: date | None) -> None:
    found, why = start_of(replace(frame_house(), written_on=written))
    assert found == monday
    assert ("assumed" in why) == (monday is not None)


def test_the_schedule_of_the_model_counts_before() -> None:
    house = replace(frame_house(), written_on=date(2026, 3, 2), starts_on=date(2026, 5, 6))
    assert start_of(house) == (date(2026, 5, 6), "the first day of the schedule in the model")
