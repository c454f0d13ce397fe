"""What a machine costs an hour, by the rates, the working month and the crew."""

import pytest

from bimvox.site.config.calendar import CalendarConfig, CostsConfig, MachineCosts, month_h, rates_of

COSTS = CostsConfig(tower_month_per_tm=10.0, mobile_hour=200.0, person_hour=50.0, set_up=1000.0, set_up_per_tm=5.0)
WEEK = CalendarConfig(days=("Mon", "Tue", "Wed"), shifts=("08:00-12:00",), breaks=())


def test_a_month_has_the_hours_of_the_calendar() -> None:
    assert month_h(WEEK) == pytest.approx(3 * 4 * 52 / 12)


def test_a_tower_crane_costs_by_its_size_a_mobile_one_by_the_hour() -> None:
    tower = rates_of(COSTS, WEEK, "t", "hammerhead", 100.0)
    assert tower.set_up == 1500.0
    assert tower.total(2.0) == pytest.approx(1500.0 + 2.0 * (1000.0 / 52.0 + 4 * 50.0))
    assert rates_of(COSTS, WEEK, "m", "mobile", 100.0).total(2.0) == pytest.approx(2.0 * (200.0 + 4 * 50.0))


def test_two_machines_are_both_paid_for_the_same_hours() -> None:
    tower, mobile = rates_of(COSTS, WEEK, "t", "hammerhead", 100.0), rates_of(COSTS, WEEK, "m", "mobile", 100.0)
    assert tower.with_another(mobile).total(3.0) == pytest.approx(tower.total(3.0) + mobile.total(3.0))


def test_an_offer_takes_the_place_of_the_rates_and_the_crew_is_the_calendars() -> None:
    costs = COSTS.model_copy(update={"machine": (MachineCosts(name="t", month=520.0, set_up=7.0),)})
    crew = WEEK.model_copy(update={"erection_people": 2})
    assert rates_of(costs, crew, "t", "hammerhead", 100.0).total(1.0) == pytest.approx(7.0 + 10.0 + 3 * 50.0)
