"""Local dates in the report, if the start of the work is known."""

from __future__ import annotations

import dataclasses
import json
import re
from datetime import date
from pathlib import Path

import pytest
import seeded_faults as faults
from log_building import tiny_log
from opened_pages import revision_of

from bimvox.exporters.csv_json import json_bytes
from bimvox.log.plan_log import log_dates, log_times
from bimvox.records.plan_dates import in_words
from bimvox.rendering.page.document import document_of
from bimvox.rendering.page.lifts import lift_record
from bimvox.rendering.page.source import PageSource
from bimvox.rendering.report.gantt import gantt_chart
from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.sections import heading, not_lifted
from bimvox.site.config.site_config import ModelConfig, SiteConfig


def test_head_notes_and_gantt_chart_have_the_dates():
    site_file = b'[calendar]\nstart = 2026-03-13\nshifts = ["07:00-07:31"]\n'
    log = dataclasses.replace(tiny_log(crane=True), attachments={"site.toml": site_file})
    dates = log_dates(log)
    assert dates is not None
    assert dates.first.date() == date(2026, 3, 13)
    record = record_of(dataclasses.replace(revision_of(log), dates=dates))
    assert f"Fri 13 March 2026 07:00 to {dates.end_in_words}" in heading(record)
    assert record["notes"][0] == dates.notes[0]
    timed = [lift for lift in record["lifts"] if lift["begins_s"] is not None]
    assert [lift["begins_at"] for lift in timed] == [dates.span(lift["order"])[0] for lift in timed]
    chart = gantt_chart(record["lifts"])
    first = dates.moment(dates.lifts[timed[0]["order"]][0])
    assert re.findall(r'class="tick"[^>]*>([^<]*)<', chart)[0] == f"{first:%a} {first.day} {first:%b %H:%M}"


def test_without_a_start_there_are_none():
    record = record_of(revision_of(tiny_log(crane=True)))
    assert record["totals"]["calendar"] is None
    assert "Dates" not in heading(record)


def test_head_says_begin_end_working_days_and_crane_hours_with_unloading_apart():
    site_file = b"[calendar]\nstart = 2026-03-13\n"
    log = dataclasses.replace(tiny_log(crane=True), attachments={"site.toml": site_file})
    dates = log_dates(log)
    assert dates is not None and dates.unloading is not None
    assert dates.unloading.seconds == 1800.0 * dates.unloading.lorries > 0.0
    html = heading(record_of(dataclasses.replace(revision_of(log), dates=dates)))
    assert f"<dt>Time</dt><dd>{dates.time['span_in_words']}</dd>" in html
    assert re.sub("<[^>]*>", "", html).count(str(dates.time["hours_in_words"])) == 1
    assert dates.unloading.in_words in html


def test_console_report_page_and_exports_have_the_same_numbers_from_one_function():
    site_file = b"[calendar]\nstart = 2026-03-13\n"
    log = dataclasses.replace(tiny_log(crane=True), attachments={"site.toml": site_file})
    for one in (log, tiny_log(crane=True)):
        times, dates = log_times(one), log_dates(one)
        assert times is not None
        revision = dataclasses.replace(revision_of(one), dates=dates)
        assert record_of(revision)["totals"]["time"] == times.time
        assert document_of(PageSource((revision,)))[0]["revisions"][0]["time"] == times.time
        exported = json.loads(json_bytes(one, dates))
        assert exported["time"] == times.time
        timed = [lift for lift in exported["lifts"] if lift["start_s"] is not None]
        shown = [lift for lift in record_of(revision)["lifts"] if lift["begins_s"] is not None]
        assert [lift["begins_in_words"] for lift in timed] == [lift["begins_in_words"] for lift in shown]
        assert [lift["begins_in_words"] for lift in timed] == [times.span_in_words(n["order"])[0] for n in timed]


def test_without_a_start_the_same_is_told_by_numbered_working_days():
    log = tiny_log(crane=True)
    record = record_of(revision_of(log))
    assert record["totals"]["time"]["begins"] == "day 1 07:00"
    assert "<dt>Time</dt><dd>day 1 07:00 to day 1 " in heading(record)
    timed = [lift for lift in record["lifts"] if lift["begins_s"] is not None]
    assert all(lift["begins_in_words"].startswith("day 1 ") and lift["begins_at"] is None for lift in timed)
    assert re.findall(r'class="tick"[^>]*>([^<]*)<', gantt_chart(record["lifts"]))[0] == timed[0]["begins_in_words"]


def test_the_key_figures_have_the_costs_with_where_their_rates_come_from():
    own = SiteConfig(model=ModelConfig(path=Path("model.ifc")))
    record = record_of(dataclasses.replace(revision_of(tiny_log(crane=True)), config=own))
    cost = record["totals"]["cost"]
    assert cost["total"] == pytest.approx(sum(cost[key] for key in ("crew", "hire", "lorries", "set_up")), abs=0.02)
    html = heading(record)
    assert f"{cost['total']:,.0f}</data> EUR: crew" in html
    assert "typical rates, partly assumed" in html
    assert record_of(revision_of(tiny_log(crane=True)))["totals"]["cost"] is None, "a log without a site file"


def test_with_dates_nothing_is_told_in_elapsed_time():
    site_file = b"[calendar]\nstart = 2026-03-13\n"
    log = dataclasses.replace(faults.log_cast("beam"), attachments={"site.toml": site_file})
    dates = log_dates(log)
    assert dates is not None
    revision = revision_of(log)
    dated = dataclasses.replace(revision, dates=dates)
    record, without = record_of(dated), record_of(revision)
    (group,) = record["not_lifted"]
    (step,) = log.steps.steps
    begins, ends, carries = (dates.moment(at_ns) for at_ns in dates.steps[step.order])
    assert (group["begins_at"], group["carries_at"]) == (begins.isoformat(), carries.isoformat())
    html = heading(record) + not_lifted(record)
    assert in_words(begins) in html and in_words(ends) in html and in_words(carries) in html
    assert "elapsed" not in html.lower()
    assert "elapsed" not in not_lifted(without) and "begins_at" not in without["not_lifted"][0]
    assert without["not_lifted"][0]["carries_in_words"] in not_lifted(without)
    assert without["not_lifted"][0]["carries_in_words"].startswith("day ")
    cast = next(lift for lift in dated.lifts if lift.order == step.order)
    assert lift_record(dated, cast)["step"]["in_words"] == [in_words(at) for at in (begins, ends, carries)]
    assert all(words.startswith("day ") for words in lift_record(revision, cast)["step"]["in_words"])
