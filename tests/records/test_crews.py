"""The hours of crews: work, and working time without work between the first and the last of it."""

from __future__ import annotations

from datetime import date, datetime
from types import SimpleNamespace

from bimvox.records.dates import Crew, WorkTime, crew_hours
from bimvox.site.config.calendar import CalendarConfig

H = 3600 * 10**9
DAY = 24 * H
BEGINS = datetime(2026, 3, 9, 7)  # a Monday


def site_of(*cranes: str) -> SimpleNamespace:
    return SimpleNamespace(
        has_several_cranes=len(cranes) > 1,
        cranes=[SimpleNamespace(name=name) for name in cranes],
        components=[SimpleNamespace(crane=number) for number in range(len(cranes))],
        rules=SimpleNamespace(casting=SimpleNamespace(people=8.0)),
    )


def hours(site, lifts, cast=(), deliveries=(), **people):
    calendar = CalendarConfig(start=date(2026, 3, 9), shifts=("07:00-16:00",), breaks=("12:00-13:00",), **people)
    return crew_hours(site, calendar, dict(enumerate(lifts)), cast, deliveries, WorkTime(calendar.hours, BEGINS))


def test_idle_is_working_time_between_first_and_last_work_without_the_night_and_the_break():
    lifts = [(0, (0, 2 * H)), (0, (4 * H, 5 * H)), (0, (DAY, DAY + H))]
    (found,) = hours(site_of("only"), lifts, erection_people=4)
    assert found.crew == Crew("Erection crew", 4.0)
    assert (found.works_ns, found.idle_ns) == (4 * H, 5 * H)  # of 8 h on Monday, 3 with a lift; 1 h on Tuesday
    assert found.document() == {
        "crew": "Erection crew", "people": 4.0, "works_h": 4.0, "idle_h": 5.0,
        "man_hours": 16.0, "idle_man_hours": 20.0,
    }  # fmt: skip


def test_each_crane_has_its_crew_and_others_work_through_breaks_not_in_them():
    lifts = [(0, (0, H)), (1, (H, 3 * H))]
    found = {
        one.crew.name: (one.works_ns, one.idle_ns, one.crew.people)
        for one in hours(
            site_of("west", "east"), lifts, [(4 * H, 7 * H)], [(0, H), (2 * H, 3 * H)],
            erection_people=3, unloading_people=2,
        )
    }  # fmt: skip
    assert found == {
        "Erection crew, west": (H, 0, 3.0),
        "Erection crew, east": (2 * H, 0, 3.0),
        "Unloading crew": (2 * H, H, 2.0),
        "Casting crew": (2 * H, 0, 8.0),
    }


def test_a_crew_without_work_has_no_line():
    assert hours(site_of("only"), [], erection_people=4, unloading_people=2) == ()
