from __future__ import annotations

import dataclasses

import pytest
from log_building import tiny_log
from opened_pages import revision_of
from report_reading import ReadReport

from bimvox.library.attached_files import config_in
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import record_of

SITE = """
[model]
path = "tiny.ifc"
[areas]
plot = [[-30, -30], [30, -30], [30, 30], [-30, 30]]
"""


def report_of(site_file: str, foundation_m2: float | None = None) -> ReadReport:
    log = tiny_log(crane=True)
    cranes = tuple(dataclasses.replace(crane, foundation_m2=foundation_m2) for crane in log.plan.site.cranes)
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(log.plan.site, cranes=cranes))
    log = dataclasses.replace(log, plan=plan, attachments={"site.toml": site_file.encode()})
    revision = dataclasses.replace(revision_of(log), config=config_in(log))
    return ReadReport(report_page(record_of(revision), log.plan.site.cranes))


def test_clear_distances_of_the_crane_are_in_the_record_and_in_a_table() -> None:
    read = report_of(SITE, 9.0)
    (around,) = read.record["distances"]
    (crane,) = tiny_log(crane=True).plan.site.cranes
    assert around["base"] == {"edge_m": 3.0, "stated": True}
    assert around["least_m"] == 0.5
    found = {(one["from"], one["to"]): one["distance_m"] for one in around["distances"]}
    x, y, _ = crane.base_m
    inside_m = 30.0 - max(abs(x), abs(y))
    assert found["mast", "boundary"] == pytest.approx(inside_m - crane.mast_size_m / 2.0)
    assert found["tail", "boundary"] == pytest.approx(inside_m - around["tail"]["radius_m"], abs=1e-3)
    assert found["mast", "building"] >= 0.0
    shown = {row["words"].split("  ")[0].strip() for row in read.rows["clear-distances"]}
    assert any(words.startswith("boundary of the plot") for words in shown)


def test_a_foundation_that_nobody_states_is_said_to_be_assumed() -> None:
    read = report_of("[model]\npath = 'tiny.ifc'\n")
    assert read.record["distances"][0]["base"]["stated"] is False
    assert "assumed, four times the mast" in read.text
    assert not [one for one in read.record["distances"][0]["distances"] if one["to"] == "boundary"]
    assert "foundation, assumed" in read.text  # the legend of the drawings
