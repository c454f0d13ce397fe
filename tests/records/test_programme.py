"""The plan's dates next to those of its programme: days late and early, the remark, and the table of the report."""

from __future__ import annotations

import dataclasses
from datetime import date, timedelta

import numpy as np
import pytest
import seeded_faults as faults
from hypothesis import given
from hypothesis import strategies as st
from log_building import tiny_log
from opened_pages import revision_of
from xer_files import xer_text

from bimvox.errors import ConfigError
from bimvox.log.plan_log import PlanLog, all_remarks, log_dates
from bimvox.records.programme import PERCENTILES, Weather, _WorkingDays, added_ns
from bimvox.remarks.table import LATE
from bimvox.rendering.report.page import programme
from bimvox.rendering.report.record import record_of
from bimvox.site.config.calendar import UncertaintyConfig
from bimvox.site.config.file import parse_site_config
from bimvox.site.work import Work
from bimvox.site.working_hours import WorkingHours

SITE = (
    b'[calendar]\nstart = 2026-03-13\nshifts = ["07:00-07:31"]\nbreaks = []\nunloading_s = 0\nholidays = [2026-03-16]\n'
)
"""Work begins on a Friday; the Monday after it is free."""


def log_with(*finishes: str, site: bytes = SITE) -> PlanLog:
    """Return the tiny plan with a programme that has a task for each part, by its name."""
    log = tiny_log(crane=True)
    parts = [log.plan.site.components[lift.component] for lift in log.plan.lifts]
    tasks = [
        (str(n), "11", part.name or part.id, "", finish)
        for n, (part, finish) in enumerate(zip(parts, finishes, strict=False), 1)
    ]
    files = {"site.toml": site, "programme.ours.xer": xer_text(tasks).encode()}
    return dataclasses.replace(log, attachments=files)


def test_tasks_are_late_by_working_days():
    log = log_with("2026-03-12 16:00", "2026-03-16 16:00", "2026-03-20 16:00")
    dates = log_dates(log)
    assert dates is not None
    for task in dates.programme:
        (order,) = task.orders
        assert (task.starts, task.ends) == dates.spans[order]
        low, high = sorted((task.task.finish.date(), task.ends.date()))
        days = sum(dates.calendar.hours.works(low + timedelta(days=n)) for n in range(1, (high - low).days + 1))
        assert task.late_days == (days if task.ends.date() >= task.task.finish.date() else -days)
    assert [task.late_days for task in dates.programme] == [1, -4]
    assert [one["late_working_days"] for one in dates.document()["programme"]] == [
        task.late_days for task in dates.programme
    ]


def test_what_is_late_is_a_remark_and_a_row_of_the_report():
    log = log_with("2026-03-12 16:00")
    (remark,) = (one for one in all_remarks(log) if one.kind == LATE.code)
    assert remark.text.startswith("1 of 1 tasks of the programme end later than it wants: Tower / Level 1 / ")
    assert remark.text.endswith("(1 working day)")
    assert LATE.code not in [one.kind for one in log.remarks]
    record = record_of(dataclasses.replace(revision_of(log), dates=log_dates(log)))
    html = programme(record)
    assert "Programme: 1 task of 1 later than it wants" in html
    assert "Thu 12 Mar 2026 16:00" in html and "1 late" in html
    early = log_with("2026-04-30 16:00")
    assert all(one.kind != LATE.code for one in all_remarks(early))
    assert "early" in programme(record_of(dataclasses.replace(revision_of(early), dates=log_dates(early))))


@pytest.mark.parametrize("site", [SITE.replace(b"start = 2026-03-13\n", b""), SITE])
def test_without_dates_or_without_a_finish_nothing_is_late(site):
    log = log_with("", "", "", site=site)
    dates = log_dates(log)
    assert all(one.kind != LATE.code for one in all_remarks(log))
    assert dates is None or [task.late_days for task in dates.programme] == [None] * 2
    assert programme(record_of(revision_of(log))) == ""


@given(st.lists(st.dates(date(2026, 1, 1), date(2026, 12, 31)), min_size=2, max_size=2))
def test_days_between_are_counted_as_one_by_one(days):
    first, last = days
    hours = WorkingHours.of(("Mon", "Wed", "Fri"), ("07:00-16:00",), (), (date(2026, 5, 1),))
    found = _WorkingDays(hours, days).between(first, last)
    low, high = min(days), max(days)
    one_by_one = sum(hours.works(low + timedelta(days=n)) for n in range(1, (high - low).days + 1))
    assert found == (one_by_one if last >= first else -one_by_one)


H_NS = 3600 * 10**9


ONCE = (1.0, 1.0, 1.0)
CERTAIN = {"crew": ONCE, "lift": ONCE, "haulier": ONCE, "season": ONCE, "learning": 1.0, "late_lorries": 0.0}


def test_fixed_factors_add_exactly_what_they_say():
    fixed = UncertaintyConfig(**CERTAIN | {"wall": (1.5, 1.5, 1.5)})
    assert added_ns(fixed, {Work.WALL: [2 * H_NS, 4 * H_NS], Work.SLAB: [H_NS]}) == (3 * H_NS,) * 3


def test_percentiles_are_those_of_a_triangle_ascend_and_are_deterministic():
    one = UncertaintyConfig(**CERTAIN | {"wall": (0.5, 1.0, 2.0), "samples": 100_000})
    found = added_ns(one, {Work.WALL: [H_NS]})
    # Above the mode, the triangle's distribution function is 1 - (2 - x)^2 / 1.5.
    wanted = [1.0 - (1.5 * (1.0 - share / 100.0)) ** 0.5 for share in PERCENTILES]
    assert [value / H_NS for value in found] == pytest.approx(wanted, abs=0.01)
    assert (
        found == added_ns(one, {Work.WALL: [H_NS]}) != added_ns(one.model_copy(update={"seed": 1}), {Work.WALL: [H_NS]})
    )
    many = added_ns(one, {Work.WALL: [H_NS // 100] * 100})
    assert many[2] - many[0] < (found[2] - found[0]) / 5


def test_what_lifts_have_in_common_does_not_average_out():
    lifts = {Work.WALL: [H_NS // 100] * 100}
    alone = added_ns(UncertaintyConfig(**CERTAIN | {"lift": (0.8, 1.0, 1.4)}), lifts)
    common = added_ns(UncertaintyConfig(**CERTAIN | {"crew": (0.8, 1.0, 1.4)}), lifts)
    assert common[2] - common[0] > 5 * (alone[2] - alone[0])
    one = added_ns(UncertaintyConfig(**CERTAIN | {"crew": (0.8, 1.0, 1.4)}), {Work.WALL: [H_NS]})
    assert common == pytest.approx(one)


def test_the_first_lifts_of_a_class_take_longer_until_it_is_learned():
    learning = UncertaintyConfig(**CERTAIN | {"learning": 0.8, "learned_after": 4})
    assert added_ns(learning, {Work.WALL: [H_NS] * 6})[0] / H_NS == pytest.approx(
        (1 / 0.64 - 1) + (1 / 0.8 - 1) + ((3 / 4) ** np.log2(0.8) - 1)
    )
    assert added_ns(learning, {Work.WALL: [H_NS], Work.SLAB: [H_NS]})[0] / H_NS == pytest.approx(2 * (1 / 0.64 - 1))


def test_late_lorries_and_wind_come_on_top():
    late = UncertaintyConfig(**CERTAIN | {"late_lorries": 1.0, "late_h": (2.0, 2.0, 2.0)})
    assert added_ns(late, {Work.WALL: [H_NS]}, 3) == (6 * H_NS,) * 3
    sure = UncertaintyConfig(**CERTAIN)
    assert added_ns(sure, {Work.WALL: [H_NS]}, 3, Weather((1.0, 0.0, 1.0), 1, 8 * H_NS)) == (8 * H_NS,) * 3
    low, _, high = added_ns(sure, {Work.WALL: [H_NS]}, 0, Weather((0.1,) * 20, 2, 8 * H_NS))
    assert low == 0 and high in (2 * 8 * H_NS, 3 * 8 * H_NS), "of 20 days 2 are lost on average, 4 or 5 with P95"


def test_a_haulier_moves_all_deliveries_together_and_a_season_all_days():
    late = CERTAIN | {"late_lorries": 0.2, "late_h": (1.0, 1.0, 1.0)}
    windy = Weather((0.2,) * 200, 40, H_NS)
    for more, factor, deliveries, weather in ((late, "haulier", 200, None), (CERTAIN, "season", 0, windy)):
        alone = added_ns(UncertaintyConfig(**more), {}, deliveries, weather)
        common = added_ns(UncertaintyConfig(**more | {factor: (0.25, 0.75, 2.0)}), {}, deliveries, weather)
        assert common[2] - common[0] > 2 * (alone[2] - alone[0])
        assert alone[0] == pytest.approx(common[0], abs=4 * H_NS), "as many on average"


def test_the_end_moves_in_working_hours_and_is_told():
    log = faults.good_log()
    calendar = b'\n[calendar]\nstart = 2026-03-09\nshifts = ["07:00-09:00"]\nbreaks = []\n'

    def dated(more: bytes):
        made = dataclasses.replace(log, attachments={"site.toml": calendar + more})
        found = log_dates(made)
        assert found is not None
        return found

    every = "learning = 1, late_lorries = 0, lift = [1, 1, 1], crew = [FACTOR, FACTOR, FACTOR]"
    plain = dated(b"")
    ends = [end for _, end in plain.percentiles]
    assert plain.last < ends[0] <= ends[1] <= ends[2], "assumed, and said"
    assert "by simulation (assumed" in plain.notes[-1]
    same = dated(f"uncertainty = {{ {every.replace('FACTOR', '1')} }}\nweather_days = {[0] * 12}\n".encode())
    assert {end for _, end in same.percentiles} == {plain.last}
    twice = dated(f"uncertainty = {{ {every.replace('FACTOR', '2')} }}\nweather_days = {[0] * 12}\n".encode())
    (end,) = {end for _, end in twice.percentiles}
    assert end > plain.last
    assert 7 <= end.hour < 9 or (end.hour, end.minute, end.second) == (9, 0, 0)
    assert twice.document()["percentiles"]["P80"] == end.isoformat()
    assert "P95" in twice.notes[-1]


def test_factors_that_do_not_ascend_are_refused():
    text = '[model]\npath = "a.ifc"\n[calendar.uncertainty]\nwall = [1.2, 1.0, 1.4]\n'
    with pytest.raises(ConfigError, match="must ascend"):
        parse_site_config(text, "a.site.toml")
