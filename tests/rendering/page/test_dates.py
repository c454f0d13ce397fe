"""The page's times have dates if the start of the work is known."""

from __future__ import annotations

import dataclasses
from datetime import datetime, timedelta

from log_building import tiny_log
from opened_pages import revision_of

from bimvox.log.plan_log import log_dates
from bimvox.rendering.page.document import document_of
from bimvox.rendering.page.source import PageSource


def test_blocks_of_lifts_have_the_dates_of_the_plan():
    site = b'[calendar]\nstart = 2026-03-13\nshifts = ["07:00-07:31"]\n'
    log = dataclasses.replace(tiny_log(crane=True), attachments={"site.toml": site})
    dates = log_dates(log)
    assert dates is not None
    record, _ = document_of(PageSource((dataclasses.replace(revision_of(log), dates=dates),)))
    blocks = record["revisions"][0]["dates"]
    assert len(blocks) == 2
    for begins_s, ends_s, local_s in blocks:
        middle_s = (begins_s + ends_s) / 2
        read = datetime(1970, 1, 1) + timedelta(seconds=local_s + middle_s - begins_s)
        assert abs(read - dates.at(round(middle_s * 1e9))) <= timedelta(seconds=1)
    without, _ = document_of(PageSource((revision_of(log),)))
    assert "days" not in record["revisions"][0]
    numbered = without["revisions"][0]
    assert len(numbered["dates"]) == len(blocks)
    midnight_s, first_s = numbered["days"][0], numbered["dates"][0][2]
    assert 0.0 < first_s - midnight_s < 86_400.0
    assert numbered["time"]["begins"] == "day 1 07:00"
    assert record["revisions"][0]["time"] == dates.time
