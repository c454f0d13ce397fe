"""What a machine costs, by hire, set-up, crew and lorries."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.site.config.calendar import CalendarConfig, CostsConfig, Hire, MachineCosts, Rates, rates_of

COSTS = CostsConfig(
    tower_month_per_tm=10.0, tower_period="week", tower_least=2, mobile_hour=200.0, mobile_set_up=300.0,
    person_hour=50.0, set_up=1000.0, set_up_per_tm=5.0,
)  # fmt: skip
WEEK = CalendarConfig(days=("Mon", "Tue", "Wed"), shifts=("08:00-12:00",), breaks=(), weather_days=(0.0,) * 12)
WEEK_HIRE = 1000.0 * 12 / 52


def test_hire_is_for_days_on_the_site_and_the_crew_for_hours() -> None:
    tower, mobile = rates_of(COSTS, WEEK, "t", "hammerhead", 100.0), rates_of(COSTS, WEEK, "m", "mobile", 100.0)
    assert tower.total(2.0, 7.0) == pytest.approx(1500.0 + 3 * WEEK_HIRE + 2.0 * 4 * 50.0), "the third week has begun"
    assert mobile.total(2.0, 7.0) == pytest.approx(300.0 + 7 * 4 * 200.0 + 2.0 * 4 * 50.0), "all seven days"


def test_a_cost_is_its_parts_together() -> None:
    found = rates_of(COSTS, WEEK, "t", "hammerhead", 100.0).with_deliveries(3.0, 1200.0).cost(2.0, 7.0)
    assert (found.set_up, found.lorries) == (1500.0, 1200.0)
    assert (found.hire, found.crew) == (pytest.approx(3 * WEEK_HIRE), 5.0 * 4 * 50.0)
    assert found.total == pytest.approx(found.set_up + found.lorries + found.hire + found.crew)


def test_where_rates_come_from_is_said() -> None:
    assert CostsConfig().source.startswith("typical rates")
    assert CostsConfig(budget=5.0, currency="USD").source.startswith("typical rates")
    assert COSTS.source.startswith("rates of [costs] in the site file")


def test_a_month_is_the_twelfth_of_52_weeks() -> None:
    offer = COSTS.model_copy(update={"machine": (MachineCosts(name="t", month=900.0),)})
    rates = rates_of(offer, WEEK, "t", "hammerhead", 100.0)
    assert [rates.total(0.0, days) for days in (1.0, 13.0, 14.0, 26.0, 27.0)] == [900.0, 900.0, 1800.0, 1800.0, 2700.0]


def test_waits_and_wind_lengthen_the_estimated_hire_but_not_the_crews_hours() -> None:
    rates = rates_of(COSTS, WEEK, "m", "mobile", 100.0)
    assert replace(rates, waits_h=4.0).total(4.0) == pytest.approx(rates.total(4.0) + 4 * 200.0)
    windy = WEEK.model_copy(update={"weather_days": (6.5,) * 12})
    assert rates_of(COSTS, windy, "m", "mobile", 100.0).total(4.0) == pytest.approx(rates.total(4.0) + 4 * 200.0)


def test_a_tower_crane_is_paid_by_the_week_and_its_size_a_mobile_one_by_the_day() -> None:
    tower, mobile = rates_of(COSTS, WEEK, "t", "hammerhead", 100.0), rates_of(COSTS, WEEK, "m", "mobile", 100.0)
    assert tower.set_up == 1500.0
    assert tower.total(2.0) == pytest.approx(1500.0 + 2 * WEEK_HIRE + 2.0 * 4 * 50.0), "two weeks at least"
    assert tower.total(25.0) == pytest.approx(1500.0 + 3 * WEEK_HIRE + 25.0 * 4 * 50.0), "the third has begun"
    assert mobile.total(4.0) == pytest.approx(300.0 + 4 * 200.0 + 4.0 * 4 * 50.0)
    assert mobile.total(4.5) == pytest.approx(300.0 + 8 * 200.0 + 4.5 * 4 * 50.0)


def test_two_machines_are_both_paid_for_the_same_hours_and_lorries_come_once() -> None:
    tower, mobile = rates_of(COSTS, WEEK, "t", "hammerhead", 100.0), rates_of(COSTS, WEEK, "m", "mobile", 100.0)
    assert tower.with_another(mobile).total(3.0) == pytest.approx(tower.total(3.0) + mobile.total(3.0))
    both = tower.with_deliveries(1.0, 700.0).with_another(mobile.with_deliveries(1.0, 700.0))
    assert both.total(3.0) == pytest.approx(700.0 + tower.total(4.0) + mobile.total(4.0))


def test_an_offer_takes_the_place_of_the_rates_and_the_crew_is_the_calendars() -> None:
    offer = MachineCosts(name="t", day=40.0, least=3, set_up=7.0)
    costs = COSTS.model_copy(update={"machine": (offer,)})
    crew = WEEK.model_copy(update={"erection_people": 2})
    found = rates_of(costs, crew, "t", "hammerhead", 100.0)
    assert found.total(1.0) == pytest.approx(7.0 + 3 * 40.0 + 3 * 50.0)
    assert found.total(17.0) == pytest.approx(7.0 + 5 * 40.0 + 17.0 * 3 * 50.0)


@given(st.floats(0.0, 500.0), st.floats(0.0, 500.0), st.integers(1, 10))
def test_more_hours_never_cost_less(first: float, second: float, least: int) -> None:
    rates = Rates(10.0, 30.0, 8.0, (Hire(500.0, 1.0, least),), 3.0, 600.0)
    low, high = sorted((rates.total(first), rates.total(second)))
    assert rates.total(min(first, second)) == low >= 610.0 + least * 500.0
    assert rates.total(max(first, second)) == high
