"""The time for unloading: that of the site file, otherwise the crane's for every part, otherwise the usual one."""

import dataclasses
from datetime import date

import pytest
from planned_sites import planned, portal_crane, portal_site, rectangle

from bimvox.records import unloading
from bimvox.records.dates import dates_of
from bimvox.records.steps import Steps
from bimvox.records.unloading import (
    is_unloaded_by_crane,
    unloading_by_lorry_s,
    unloading_lifts,
    unloading_of,
    unloading_s,
)
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times
from bimvox.site.default_rules import YardRules

CALENDAR = CalendarConfig.model_validate({"start": date(2026, 3, 9)})


@pytest.fixture(scope="module")
def site():
    site = portal_site(portal_crane())
    access = rectangle(site, 6.0, 7.0, 20.0, 10.0)
    return dataclasses.replace(site, access=access, yard=site.yard & ~access)


@pytest.fixture(scope="module")
def plan(site):
    return planned(site)


def test_every_part_takes_the_crew_and_two_ways_of_the_crane(site, plan):
    lifts = plan[0].lifts
    crew_s = sum(
        times.hook_on_s + TRIAL_LIFT_S + times.hook_off_s
        for times in (crew_times(site.rules, part) for part in site.components)
    )
    found_s = unloading_s(CALENDAR, site, lifts)
    at_once = {
        axis: dataclasses.replace(getattr(site.cranes[0], axis), rate=1e6, acceleration=1e9, jerk=1e12)
        for axis in ("hoist", "slewing", "trolley")
    }
    no_way = dataclasses.replace(site, cranes=(dataclasses.replace(site.cranes[0], **at_once),))
    assert unloading_s(CALENDAR, no_way, lifts) == pytest.approx(crew_s, abs=0.1)
    assert found_s > crew_s + 10.0 * len(lifts)


def test_a_nearer_truck_is_unloaded_sooner(site, plan):
    lifts = plan[0].lifts
    far = dataclasses.replace(site, access=rectangle(site, 16.0, 9.5, 20.0, 10.0))
    assert unloading_s(CALENDAR, far, lifts) > unloading_s(CALENDAR, site, lifts)


def test_the_time_of_the_site_file_counts(site, plan):
    given = CALENDAR.model_copy(update={"unloading_s": 600.0})
    assert unloading_s(given, site, plan[0].lifts) == 600.0
    assert not is_unloaded_by_crane(given, site)


def test_without_an_access_it_is_the_usual_time(site, plan):
    bare = dataclasses.replace(site, access=None)
    assert unloading_s(CALENDAR, bare, plan[0].lifts) == 1800.0


def test_the_time_of_a_delivery_is_that_of_its_lorries(site, plan):
    """The last one comes first: what is needed first lies on top."""
    yard = dataclasses.replace(site.rules.yard or YardRules(), lorries=9)
    small = dataclasses.replace(site, rules=dataclasses.replace(site.rules, yard=yard, truckload_kg=1.0))
    lifts = plan[0].lifts
    assert len(times_s := unloading_by_lorry_s(CALENDAR, small, lifts)) == len(lifts) > 1
    each_s = [one.duration_s for one in unloading_lifts(small, lifts)]
    assert times_s == tuple(reversed(each_s))
    assert sum(unloading_by_lorry_s(CALENDAR, site, lifts)) == pytest.approx(unloading_s(CALENDAR, site, lifts))


@pytest.mark.parametrize("access", [False, True])
def test_the_lorries_of_a_delivery_are_counted_once(site, plan, monkeypatch, access):
    """Also where the time follows from their number."""
    counted, real = [], unloading.lorries_of
    monkeypatch.setattr(unloading, "lorries_of", lambda *given: counted.append(given) or real(*given))
    found = unloading_of(CALENDAR, site if access else dataclasses.replace(site, access=None), plan[0].lifts)
    assert found.deliveries == len(counted) >= 1
    assert found.seconds == (unloading_s(CALENDAR, site, plan[0].lifts) if access else 1800.0 * found.lorries)


def test_the_dates_follow_from_it(site, plan):
    lift_plan, motions = plan
    dates = dates_of(CALENDAR, site, lift_plan.lifts, motions, Steps())
    first = [lift for lift in lift_plan.lifts if lift.place.delivery == 0]
    begin_ns, end_ns = dates.deliveries[0]
    assert (end_ns - begin_ns) / 1e9 == pytest.approx(unloading_s(CALENDAR, site, first))
    assert any("unloading by the crane" in note for note in dates.notes)
