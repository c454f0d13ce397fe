"""The plan in calendar time: its properties for any calendar, and the dates of plans."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime, time, timedelta
from itertools import pairwise
from types import SimpleNamespace

import pytest
import seeded_faults as faults
from hypothesis import given, settings
from hypothesis import strategies as st
from two_cranes import two_crane_plan

from bimvox.records.crews import Crew, crew_hours
from bimvox.records.dates import blocks_of, dates_of, hire_days
from bimvox.records.done import DoneWork
from bimvox.records.plan_dates import PlanDates
from bimvox.records.steps import Pause, Step, Steps
from bimvox.records.unloading import Unloading
from bimvox.records.work_time import WorkTime
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.means import Means
from bimvox.site.working_hours import DAYS

MONDAY = date(2026, 3, 9)
S, H = 10**9, 3600 * 10**9
SITE = SimpleNamespace(
    has_several_cranes=False,
    access=None,
    cranes=(),
    components=[
        SimpleNamespace(means=means, crane=0, material=None, ifc_class="IfcWall", predefined_type=None)
        for means in (Means.IN_SITU, Means.BY_HAND)
    ],
    rules=SimpleNamespace(casting=SimpleNamespace(people=8.0), curing=None, yard=None, truckload_kg=0.0),
)


def lifts_of(lengths_s, delivery=None):
    """Return lifts one after the other, as far as dates look at them."""
    lifts, motions, at_ns = [], [], 0
    for order, length_s in enumerate(lengths_s):
        ends_ns = at_ns + length_s * S
        place = None if delivery is None else SimpleNamespace(delivery=delivery[order])
        lifts.append(SimpleNamespace(order=order, place=place, component=0))
        motions.append(
            SimpleNamespace(
                order=order,
                component=0,
                start_ns=at_ns,
                work_starts_ns=at_ns,
                hooked_ns=at_ns,
                released_ns=ends_ns,
                end_ns=ends_ns,
            )
        )
        at_ns = ends_ns
    return lifts, motions


def dated(calendar, lengths_s, steps=None, start=None, delivery=None, done=None) -> PlanDates:
    found = dates_of(calendar, SITE, *lifts_of(lengths_s, delivery), steps or Steps(), start, done=done)
    assert found is not None
    return found


def calendar_of(**keys) -> CalendarConfig:
    return CalendarConfig(start=MONDAY, **{"unloading_s": 0.0, "weather_days": (0.0,) * 12, **keys})


@st.composite
def calendars(draw) -> CalendarConfig:
    begin = draw(st.integers(0, 23))
    length = draw(st.integers(2, 12))
    pause = draw(st.one_of(st.none(), st.integers(1, length - 1)))
    clock = [f"{(begin + n) % 24:02d}" for n in range(length + 1)]
    return calendar_of(
        days=tuple(draw(st.sets(st.sampled_from(DAYS), min_size=1))),
        shifts=(f"{clock[0]}:00-{clock[-1]}:00",),
        breaks=() if pause is None else (f"{clock[pause]}:00-{clock[pause]}:20",),
        holidays=tuple(draw(st.sets(st.dates(MONDAY, MONDAY + timedelta(days=30)), max_size=5))),
        setup_h=draw(st.sampled_from((0.0, 0.5, 20.0))),
        unloading_s=draw(st.sampled_from((0.0, 900.0))),
    )


def is_working(found: PlanDates, low: datetime, high: datetime) -> bool:
    """Return whether a span is within a shift without a break, found minute by minute from the texts of the table."""
    calendar, at = found.calendar, low
    while at < high:
        inside = False
        for back in (0, 1):
            day = at.date() - timedelta(days=back)
            if DAYS[day.weekday()] not in calendar.days or day in calendar.holidays:
                continue
            inside |= any(_within(at, day, span) for span in calendar.shifts)
        if not inside or any(
            _within(at, at.date() - timedelta(days=back), span) for back in (0, 1) for span in calendar.breaks or ()
        ):
            return False
        at += timedelta(minutes=1)
    return True


def _within(at: datetime, day: date, span: str) -> bool:
    low, high = (
        datetime.combine(day, time()) + timedelta(hours=int(t[:2]), minutes=int(t[3:])) for t in span.split("-")
    )
    return low <= at < (high if high > low else high + timedelta(days=1))


LENGTHS = st.lists(st.integers(30, 2400), min_size=1, max_size=40)


@settings(max_examples=60, deadline=None)
@given(calendars(), LENGTHS)
def test_lifts_keep_their_order_and_length_and_never_run_into_a_break(calendar, lengths_s):
    found = dated(calendar, lengths_s, delivery=[n // 7 for n in range(len(lengths_s))])
    spans = [found.lifts[order] for order in range(len(lengths_s))]
    assert [end - start for start, end in spans] == [length * S for length in lengths_s]
    assert all(one[1] <= other[0] for one, other in pairwise(spans))
    assert found.too_long == ()
    for start, end in spans:
        assert is_working(found, found.moment(start), found.moment(end))


@settings(max_examples=60, deadline=None)
@given(calendars(), LENGTHS, st.lists(st.integers(0, 10**5), min_size=2, max_size=30))
def test_the_clock_in_calendar_time_ascends_and_agrees_with_the_lifts(calendar, lengths_s, times_s):
    found = dated(calendar, lengths_s)
    moments = [found.at(at_s * S) for at_s in sorted(times_s)]
    assert moments == sorted(moments)
    at_ns = 0
    for order, length_s in enumerate(lengths_s):
        assert found.at(at_ns) == found.moment(found.lifts[order][0])
        at_ns += length_s * S


@settings(max_examples=60, deadline=None)
@given(calendars(), LENGTHS, st.integers(60, 40_000), st.integers(0, 300))
def test_working_time_is_the_work_and_waits_run_on_through_nights(calendar, lengths_s, work_s, wait_h):
    at_ns = sum(lengths_s[: len(lengths_s) // 2]) * S
    step = Step(len(lengths_s), 0, at_ns, at_ns + work_s * S, at_ns + work_s * S + wait_h * H)
    found = dated(calendar, lengths_s, Steps((step,)))
    begin, end, carries = found.steps[step.order]
    assert carries - end == wait_h * H
    worked_ns = 0
    while begin < end:
        begin = found.work.fitting(begin, 0)
        low, begin = begin, min(end, found.work.worked(begin, 60 * S))
        assert is_working(found, found.moment(low), found.moment(low) + timedelta(seconds=1))
        worked_ns += min(60 * S, work_s * S - worked_ns)
    assert worked_ns == work_s * S


def test_a_lift_is_not_begun_that_does_not_end_before_the_break_or_the_shift():
    found = dated(calendar_of(), [3600 + 59 * 60, 120, 170 * 60, 180 * 60])
    at = [(found.moment(start), found.moment(end)) for start, end in found.lifts.values()]
    assert [start.strftime("%a %H:%M") for start, _ in at] == ["Mon 07:00", "Mon 09:15", "Mon 12:45", "Tue 12:45"]
    assert found.end_in_words == "Tue 10 March 2026 15:45, 2 working days"


def test_a_lift_longer_than_every_stretch_runs_on_and_is_named():
    found = dated(calendar_of(), [60, 4 * 3600, 60])
    assert found.too_long == (1,)
    assert [found.moment(start).strftime("%H:%M") for start, _ in found.lifts.values()] == ["07:00", "09:15", "13:15"]
    assert "run on into a break or beyond the shift: lift 2" in found.notes[1]


def test_weekends_holidays_and_own_days_are_free():
    found = dated(
        CalendarConfig(start=date(2026, 4, 2), country="DE", holidays=(date(2026, 4, 7),), unloading_s=0.0),
        [7000] * 5,
    )
    days = [found.moment(start).date().day for start, _ in found.lifts.values()]
    assert days == [2, 2, 2, 8, 8]  # Good Friday, the weekend, Easter Monday, and the own day
    assert found.working_days == 2


def test_the_crane_is_set_up_first_and_a_delivery_unloaded_before_its_first_lift():
    found = dated(calendar_of(setup_h=10.0, unloading_s=1800.0), [600, 600, 600], delivery=[0, 0, 1])
    starts = [found.moment(start).strftime("%a %H:%M") for start, _ in found.lifts.values()]
    assert starts == ["Tue 09:45", "Tue 09:55", "Tue 10:35"]
    assert [found.moment(end).strftime("%a %H:%M") for _, end in found.deliveries.values()] == [
        "Tue 09:45",
        "Tue 10:35",
    ]


def test_a_wait_runs_through_the_night_and_the_crane_waits_only_for_what_is_left():
    step = Step(1, 0, 600 * S, 4200 * S, 4200 * S + 16 * H)
    steps = Steps((step,), (Pause(2, 600 * S, 3600 * S + 16 * H),))
    found = dated(calendar_of(), [600, 600], steps)
    assert found.moment(found.steps[1][2]) == datetime(2026, 3, 10, 0, 10)
    assert found.moment(found.lifts[1][0]) == datetime(2026, 3, 10, 7, 0)


def waits_for_concrete(**keys) -> PlanDates:
    """Return the dates of two lifts; the second waits three weeks for what is cast after the first."""
    wait_ns = 21 * 24 * H
    steps = Steps((Step(1, 0, 600 * S, 4200 * S, 4200 * S + wait_ns),), (Pause(2, 600 * S, 3600 * S + wait_ns),))
    return dated(calendar_of(unloading_s=3600.0, **keys), [600, 600], steps, delivery=[0, 1])


def test_a_delivery_comes_on_the_day_of_its_first_lift_not_weeks_before():
    found = waits_for_concrete()
    begins, ends = (found.moment(at) for at in found.deliveries[1])
    assert ends <= found.moment(found.lifts[1][0])
    assert begins.date() == found.moment(found.lifts[1][0]).date() > MONDAY + timedelta(days=14)
    assert is_working(found, begins, ends)


@pytest.mark.parametrize("days", [1, 3])
def test_a_delivery_may_come_some_working_days_before_if_the_yard_is_free(days):
    found, late = waits_for_concrete(delivery_days=days), waits_for_concrete()
    assert found.lifts == late.lifts, "nothing else moves"
    first, usual = (one.moment(one.deliveries[1][0]).date() for one in (found, late))
    between = (first + timedelta(days=n) for n in range((usual - first).days))
    assert sum(found.calendar.hours.works(day) for day in between) == days
    assert found.deliveries[0] == late.deliveries[0], "the first one comes when work begins"
    far = waits_for_concrete(delivery_days=60)
    assert far.deliveries[1][0] >= far.lifts[0][1], "the yard is full until then"


LORRIES_S = st.lists(st.lists(st.integers(600, 4 * 3600), min_size=1, max_size=5), min_size=3, max_size=3)


@settings(max_examples=100, deadline=None)
@given(LORRIES_S, st.lists(st.integers(600, 7000), min_size=6, max_size=6), st.integers(0, 2))
def test_lorries_come_one_after_the_other_within_a_day_and_before_their_lifts(lorries_s, lengths_s, days):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "bimvox.records.dates.unloading_by_lorry_s",
            lambda calendar, site, lifts: lorries_s[lifts[0].place.delivery],
        )
        found = dated(calendar_of(delivery_days=days), lengths_s, delivery=[0, 0, 1, 1, 2, 2])
    at_ns = 0
    for number, times_s in enumerate(lorries_s):
        assert len(found.lorries[number]) == len(times_s)
        for (begins_ns, ends_ns), time_s in zip(found.lorries[number], times_s, strict=True):
            assert at_ns <= begins_ns, "the one before is empty, and the lifts of earlier deliveries are done"
            assert found.work.between(begins_ns, ends_ns) == time_s * S
            assert found.moment(begins_ns).date() == found.moment(ends_ns).date()
            assert is_working(found, found.moment(begins_ns), found.moment(begins_ns) + timedelta(minutes=1))
            at_ns = ends_ns
        assert at_ns <= found.lifts[2 * number][0]
        at_ns = found.lifts[2 * number + 1][1]
    for entry in found.document()["deliveries"]:
        assert len(entry["lorries"]) == len(lorries_s[entry["delivery"]])
        assert entry["arrives"] == entry["lorries"][0]["arrives"]
        assert entry["unloaded"] == entry["lorries"][-1]["unloaded"]


def test_a_lorry_that_takes_longer_than_a_day_stays_overnight():
    found = dated(calendar_of(unloading_s=12 * 3600.0), [600], delivery=[0])
    begins, ends = (found.moment(at) for at in found.deliveries[0])
    assert (begins.date(), ends.date()) == (MONDAY, MONDAY + timedelta(days=1))
    assert found.work.between(*found.deliveries[0]) == 12 * H


@given(first=st.dates(MONDAY, MONDAY + timedelta(days=365)), lost=st.floats(0.0, 6.0))
def test_wind_takes_its_days_of_each_month_evenly_and_nothing_of_short_work(first, lost):
    plain = calendar_of(country="DE").hours
    hours = plain.less_weather(first, (lost,) * 12)
    year = [first + timedelta(days=n) for n in range(365)]
    taken = [day for day in year if plain.works(day) and not hours.works(day)]
    assert set(taken) == {day for day in hours.weather if day <= year[-1]}
    assert len(taken) == pytest.approx(12 * lost, abs=2.5)
    if taken:
        shares = plain.weather_shares(first, taken[0] - timedelta(days=1), (lost,) * 12)
        assert sum(shares) >= 1.0 - 1e-6, "a whole day is lost before one is left free"
        assert sum(shares[:-1]) < 1.0


def test_a_plan_that_is_long_enough_leaves_days_to_the_wind():
    calm = dated(calendar_of(), [6 * 3600] * 30)
    windy = dated(calendar_of(weather_days=(4.0,) * 12), [6 * 3600] * 30)
    lost = sum(windy.first.date() <= day <= windy.last.date() for day in windy.hours.weather)
    assert lost >= 5 and windy.working_days == calm.working_days == 30
    assert windy.last > calm.last
    assert windy.percentiles[1][1] > calm.percentiles[1][1]


def test_the_crane_is_hired_for_waits_wind_and_holidays_but_not_for_weekends():
    monday = dated(calendar_of(), [6 * 3600] * 8)
    assert (monday.working_days, monday.hire_days) == (8, 8), "over a weekend"
    windy = dated(calendar_of(weather_days=(8.0,) * 12), [6 * 3600] * 8)
    lost = sum(windy.first.date() <= day <= windy.last.date() for day in windy.hours.weather)
    assert lost and windy.working_days == 8 and windy.hire_days == 8 + lost
    free = dated(calendar_of(holidays=(MONDAY + timedelta(days=1),)), [6 * 3600] * 8)
    assert (free.working_days, free.hire_days) == (8, 9)
    waits = waits_for_concrete()
    days = [waits.moment(min(waits.lifts[0][0], waits.deliveries[0][0])), waits.moment(waits.lifts[1][1])]
    assert waits.hire_days == waits.hours.week_days(*(day.date() for day in days)) > 1
    assert waits.document()["hire_days"] == waits.hire_days


def test_without_a_start_the_hire_is_that_from_a_usual_monday_on():
    made = SITE, *lifts_of([6 * 3600] * 30), Steps()
    undated = CalendarConfig(unloading_s=0.0, holidays=(date(2026, 3, 4),))
    lost = sum(undated.days_lost) / 12.0 / (52 / 12 * 5)
    assert hire_days(undated, *made) == pytest.approx(30 / (1.0 - lost), abs=1.0)
    assert hire_days(calendar_of(), *made) == dated(calendar_of(), [6 * 3600] * 30).hire_days
    assert hire_days(undated, SITE, [], [], Steps()) is None


def test_two_cranes_stop_only_while_no_load_hangs():
    plan, motions = two_crane_plan()
    found = dates_of(
        calendar_of(days=("Mon",), shifts=("07:00-07:06",), breaks=()), plan.site, plan.lifts, motions, Steps()
    )
    assert found is not None
    for block in blocks_of(plan.site, motions):
        inside = [m for m in motions if m.hooked_ns < block.ends_ns and m.released_ns > block.begins_ns]
        assert {m.order for m in inside} == set(block.orders)
    assert found.last.date() > MONDAY
    for motion in motions:
        start, end = found.lifts[motion.order]
        hangs = (motion.released_ns - motion.hooked_ns) / S
        assert abs((found.moment(end) - found.at(motion.hooked_ns)).total_seconds() - hangs) <= 1.0
        assert found.moment(start).date() == found.moment(end).date()
        assert is_working(found, found.moment(start), found.moment(end)) or motion.order in found.too_long


def test_without_a_start_there_are_no_dates():
    assert dates_of(CalendarConfig(), SITE, *lifts_of([60]), Steps()) is None
    assert dates_of(calendar_of(), SITE, [], [], Steps()) is None


@pytest.mark.parametrize("name", ["beam", "left"])
def test_cast_parts_of_a_plan_are_ready_before_what_rests_on_them(name):
    log = faults.log_cast(name)
    found = dates_of(calendar_of(), log.plan.site, log.plan.lifts, log.motions, log.steps)
    assert found is not None
    (step,) = log.steps.steps
    later = [motion for motion in log.motions if motion.order > step.order]
    assert all(
        found.lifts[m.order][0] >= found.steps[step.order][2]
        for m in later
        if step.carries_ns <= log.steps.starting_ns(m.start_ns)
    )
    assert found.first == datetime(2026, 3, 9, 7, 0)


HOUR = 3600 * 10**9
DAY = 24 * HOUR
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
    lifts = [(0, (0, 2 * HOUR)), (0, (4 * HOUR, 5 * HOUR)), (0, (DAY, DAY + HOUR))]
    (found,) = hours(site_of("only"), lifts, erection_people=4)
    assert found.crew == Crew("Erection crew", 4.0)
    assert (found.works_ns, found.idle_ns) == (4 * HOUR, 5 * HOUR)  # of 8 h on Monday, 3 with a lift; 1 h on Tuesday
    assert found.document() == {
        "crew": "Erection crew", "people": 4.0, "works_h": 4.0, "idle_h": 5.0,
        "man_hours": 16.0, "idle_man_hours": 20.0,
    }  # fmt: skip


def test_each_crane_has_its_crew_and_others_work_through_breaks_not_in_them():
    lifts = [(0, (0, HOUR)), (1, (HOUR, 3 * HOUR))]
    found = {
        one.crew.name: (one.works_ns, one.idle_ns, one.crew.people)
        for one in hours(
            site_of("west", "east"), lifts, [(4 * HOUR, 7 * HOUR)], [(0, HOUR), (2 * HOUR, 3 * HOUR)],
            erection_people=3, unloading_people=2,
        )
    }  # fmt: skip
    assert found == {
        "Erection crew, west": (HOUR, 0, 3.0),
        "Erection crew, east": (2 * HOUR, 0, 3.0),
        "Unloading crew": (2 * HOUR, HOUR, 2.0),
        "Casting crew": (2 * HOUR, 0, 8.0),
    }


def test_the_first_erection_crew_unloads_if_nobody_else_is_stated():
    lifts = [(0, (HOUR, 2 * HOUR)), (1, (2 * HOUR, 3 * HOUR))]
    found = hours(site_of("west", "east"), lifts, deliveries=[(0, HOUR), (4 * HOUR, 6 * HOUR)])
    assert [(one.crew.name, one.works_ns, one.idle_ns) for one in found] == [
        ("Erection crew, west", 3 * HOUR, 2 * HOUR), ("Erection crew, east", HOUR, 0)
    ]  # fmt: skip


def test_a_crew_without_work_has_no_line():
    assert hours(site_of("only"), [], erection_people=4, unloading_people=2) == ()


def test_the_time_of_a_plan_is_begin_end_working_days_and_hours_of_the_crane():
    found = dated(calendar_of(), [3600, 9 * 3600])
    assert found.time["begins"] == "Mon 9 March 2026 07:00"
    assert found.time["crane_hours"] == 10.0
    assert found.time["hours_in_words"] == "10.0 crane hours"
    assert found.time["span_in_words"] == f"Mon 9 March 2026 07:00 to {found.end_in_words}"


def test_without_a_start_working_days_are_numbered_and_weekends_are_none():
    calendar = CalendarConfig(unloading_s=0.0, weather_days=(0.0,) * 12)
    lifts, motions = lifts_of([3600] * 50)
    assert dates_of(calendar, SITE, lifts, motions, Steps()) is None
    found = dates_of(calendar, SITE, lifts, motions, Steps(), numbered=True)
    assert found is not None and not found.is_dated
    assert found.time["begins"] == "day 1 07:00"
    days = [found.span_in_words(order)[0].split()[1] for order in range(50)]
    assert sorted(set(map(int, days))) == list(range(1, found.working_days + 1))
    assert found.working_days > 5, "over a weekend"
    assert found.percentiles == ()
    assert found.time["ends_p80"] is None
    later = replace(found, later_ns=(0, HOUR, 2 * HOUR))
    assert later.time["ends_p80"] == later.in_words(dict(later.percentiles)[80])


def test_hours_to_unload_are_told_apart():
    unloading = Unloading(1, 1, None, None, None, None, seconds=1800.0, is_by_crane=False)
    found = replace(dated(calendar_of(), [3600]), unloading=unloading)
    assert found.time["hours_in_words"] == "1.0 crane hours to lift and 0.5 to unload"


def at(day: int, clock: str) -> datetime:
    return datetime.combine(date(2026, 3, day), time.fromisoformat(clock))


def test_what_is_done_has_its_dates_and_the_rest_follows_in_working_hours():
    done = DoneWork({0: at(9, "08:00"), 1: at(9, "15:00")}, {0: at(9, "14:30")})
    found = dated(calendar_of(), [3600, 3600, 3600], done=done)
    assert found.spans == {
        0: (at(9, "08:00"), at(9, "14:30")),
        1: (at(9, "15:00"), at(9, "16:00")),
        2: (at(10, "07:00"), at(10, "08:00")),
    }


def test_a_part_that_was_lifted_before_its_lorry_was_planned_had_come_by_then():
    early = DoneWork({0: at(9, "07:05")}, {0: at(9, "07:10")})
    found = dated(calendar_of(unloading_s=1800.0), [600, 600], delivery=[0, 1], done=early)
    assert [found.moment(end) for end in found.deliveries[0]] == [at(9, "07:00"), at(9, "07:05")]
    assert found.spans[1][0] == at(9, "07:40")


def test_what_was_done_out_of_turn_keeps_its_dates_and_nothing_begins_in_the_past():
    found = dated(calendar_of(), [3600, 3600], done=DoneWork({1: at(9, "09:00")}, {1: at(9, "10:00")}))
    assert found.spans == {0: (at(9, "10:00"), at(9, "11:00")), 1: (at(9, "09:00"), at(9, "10:00"))}


def test_a_late_floor_carries_later_and_its_delivery_comes_when_its_lift_does():
    cast = Step(7, 0, 3600 * S, 5 * 3600 * S, 29 * H)
    steps = Steps((cast,), (Pause(1, 3600 * S, 28 * H),))
    calendar, delivery = calendar_of(unloading_s=1800.0), [0, 1]
    planned = dated(calendar, [3600, 3600], steps, delivery=delivery)
    late = DoneWork({0: at(10, "07:00"), 7: at(10, "08:00")}, {0: at(10, "08:00"), 7: at(10, "13:00")})
    found = dated(calendar, [3600, 3600], steps, delivery=delivery, done=late)
    assert found.moment(found.steps[7][2]) == at(11, "13:00")
    assert planned.spans[1][0] < found.spans[1][0] == at(11, "13:00")
    assert [found.moment(end) for end in found.deliveries[1]] == [at(11, "07:00"), at(11, "07:30")]


@given(calendars(), st.lists(st.integers(60, 9000), min_size=1, max_size=8), st.integers(0, 8))
def test_a_plan_that_was_done_as_planned_keeps_its_dates(calendar, lengths_s, count):
    planned = dated(calendar, lengths_s)
    spans = {order: span for order, span in planned.spans.items() if order < count}
    if spans:
        done = DoneWork({n: low for n, (low, _) in spans.items()}, {n: high for n, (_, high) in spans.items()})
        assert dated(calendar, lengths_s, done=done).spans == planned.spans
