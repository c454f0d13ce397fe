"""The heading of each lift, as tables, report and page state it."""

from __future__ import annotations

import csv
import io
import math

import pytest
from opened_pages import revision_of
from planned_sites import planned
from turning_sites import BESIDE_THE_PORTAL, turning_site

from bimvox.exporters.csv_json import lifts_csv
from bimvox.log.plan_log import PlanLog
from bimvox.records.track import heading_in_words
from bimvox.rendering.page.lifts import lift_record
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import record_of

QUARTER_S = 30.0


@pytest.fixture(scope="module")
def log() -> PlanLog:
    """Return the portal with a tower that leaves beam and slab no room to turn."""
    plan, motions = planned(turning_site(obstructions=BESIDE_THE_PORTAL))
    assert [lift.with_jib for lift in plan.lifts] == [True, True, False, False]
    return PlanLog(plan=plan, motions=motions)


def test_every_output_states_the_heading_of_each_lift(log: PlanLog) -> None:
    words = []
    for lift, motion in zip(log.plan.lifts, log.motions, strict=True):
        turned_ns = motion.turned_ns
        lasts_s = 0.0 if turned_ns is None else (turned_ns[1] - turned_ns[0]) / 1e9
        words.append(f"with jib, {lasts_s / QUARTER_S * 90:.0f} deg" if lift.with_jib else "kept")
    assert [heading_in_words(*both) for both in zip(log.plan.lifts, log.motions, strict=True)] == words
    assert [row["heading"] for row in csv.DictReader(io.StringIO(lifts_csv(log)))] == words
    revision = revision_of(log)
    assert [lift_record(revision, lift)["heading"] for lift in log.plan.lifts] == words
    report = report_page(record_of(revision), log.plan.site.cranes).decode()
    assert all(report.count(f"<br>{said}</td>") == words.count(said) for said in words)
    assert not math.isclose(float(words[0].split()[2]), 0.0)


def test_a_lift_without_a_motion_has_no_heading(log: PlanLog) -> None:
    assert heading_in_words(log.plan.lifts[0], None) is None
