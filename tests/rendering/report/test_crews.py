"""The hours of the crews in the report."""

from __future__ import annotations

import dataclasses

import pytest
from log_building import tiny_log
from opened_pages import revision_of

from bimvox.log.plan_log import log_dates
from bimvox.rendering.report.page import crews
from bimvox.rendering.report.record import record_of


def record_with(text: bytes) -> dict:
    log = dataclasses.replace(
        tiny_log(crane=True), attachments={"site.toml": b"[calendar]\nstart = 2026-03-13\n" + text}
    )
    return record_of(dataclasses.replace(revision_of(log), dates=log_dates(log)))


def test_each_crew_has_a_row_and_all_have_a_sum():
    record = record_with(b"erection_people = 4\nunloading_people = 2\n")
    listed = record["totals"]["calendar"]["crews"]
    assert [(crew["crew"], crew["people"]) for crew in listed] == [("Erection crew", 4.0), ("Unloading crew", 2.0)]
    lifts = [lift["ends_s"] - lift["begins_s"] for lift in record["lifts"] if lift["begins_s"] is not None]
    assert 0.0 < listed[0]["works_h"] * 3600.0 <= sum(lifts) + 1e-3 * 3600.0
    shown = crews(record)
    assert "All crews" in shown
    assert f'value="{listed[0]["man_hours"]!r}" data-key="man_hours"' in shown


def test_without_a_stated_size_it_is_assumed_and_one_crew_lifts_and_unloads():
    record = record_with(b"")
    (crew,) = record["totals"]["calendar"]["crews"]
    assert (crew["crew"], crew["people"]) == ("Erection crew", 3.0)
    other = record_with(b"unloading_people = 2\n")["totals"]["calendar"]["crews"][0]
    unloading_h = record["totals"]["calendar"]["unloading"]["seconds"] / 3600.0
    assert crew["works_h"] == pytest.approx(other["works_h"] + unloading_h, abs=1e-3)
    assert any("erection crew of 3 (assumed)" in note for note in record["totals"]["calendar"]["notes"])
    assert "All crews" not in crews(record)
