from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest
from log_building import tiny_log
from opened_pages import passed_proof, revision_of
from report_reading import ReadReport

from bimvox.crane.choose_rig import choose_rig
from bimvox.crane.gear import Gear, GearKind
from bimvox.exporters.csv_json import json_bytes
from bimvox.log.plan_log import PlanLog
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.rigging import gear_list
from bimvox.site.component import Lifting
from bimvox.site.config.gear_file import gear_catalogue


def with_rigs(log: PlanLog, apart_m: float) -> PlanLog:
    """Return a log whose parts hang on two points this far apart."""
    site, parts = log.plan.site, []
    points = ((-apart_m / 2.0, 0.0, 0.0), (apart_m / 2.0, 0.0, 0.0))
    for part in site.components:
        rig = choose_rig(
            part.mass_kg, points, usual_m=2.0, step_m=0.5, most_angle_rad=0.5235987755982988,
            attached_by=GearKind.SHACKLE, gear=Gear(gear_catalogue()),
        )  # fmt: skip
        parts.append(dataclasses.replace(part, lifting=Lifting(points, "assumed", 0, rig)))
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(site, components=tuple(parts)))
    return dataclasses.replace(log, plan=plan)


def page_of(log: PlanLog) -> str:
    record = record_of(revision_of(log, passed_proof()), critical_share=0.75)
    return report_page(record, log.plan.site.cranes, None).decode()


@pytest.mark.parametrize(("apart_m", "kind"), [(3.0, "2_legs"), (8.0, "spreader_2")])
def test_every_kind_of_rig_is_listed_with_limits_and_drawn(apart_m, kind):
    log = with_rigs(tiny_log(crane=True), apart_m)
    page = page_of(log)
    record = record_of(revision_of(log, passed_proof()), critical_share=0.75)
    assert {one["rig"]["kind"] for one in record["rigs"]} == {kind}
    orders = sorted(order for one in record["rigs"] for order in one["orders"])
    assert orders == [lift["order"] for lift in record["lifts"] if lift["status"] == "planned"]
    assert page.count('class="rig"') == len(record["rigs"])
    assert ('class="spreader"' in page) == (kind == "spreader_2")
    for lift in record["lifts"]:
        if lift["status"] == "planned":
            assert f"rig {lift['rig']}" in page
    rows = [row for row in ReadReport(page.encode()).rows["rigs"] if "gear_used" in row]
    for row, one in zip(rows, record["rigs"], strict=True):
        assert row["gear_used"] == one["used"] <= 1.0


def test_the_legs_are_drawn_at_their_angle():
    page = page_of(with_rigs(tiny_log(crane=True), 3.0))
    drawing = re.search(r'<svg[^>]*class="rig".*?</svg>', page, re.DOTALL)
    assert drawing is not None
    line = re.search(r'<line x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)" class="rope"', drawing[0])
    assert line is not None
    x1, y1, x2, y2 = map(float, line.groups())
    angle_deg = float(re.search(r"m, (\d+)°", drawing[0])[1])
    assert np.degrees(np.arctan2(abs(x2 - x1), y2 - y1)) == pytest.approx(angle_deg, abs=0.6)


def test_the_site_needs_of_each_piece_what_one_lift_of_each_crane_needs():
    def one(crane: int, *pieces: tuple[str, int]) -> dict:
        parts = [{"what": what, "count": count, "mass_kg": 1.0} for what, count in pieces]
        return {"crane": crane, "rig": {"parts": parts}}

    found = gear_list([one(0, ("a", 2), ("b", 1)), one(0, ("a", 4)), one(1, ("a", 1), ("c, span 3 m", 1))])
    assert {(piece["what"], piece["count"]) for piece in found} == {("a", 5), ("b", 1), ("c", 1)}


def test_a_plan_on_described_rigging_has_no_such_section_but_its_mass():
    log = tiny_log(crane=True)
    assert 'id="rigging"' not in page_of(log)
    (lift, *_) = json.loads(json_bytes(log))["lifts"]
    assert (lift["rigging"], lift["rigging_mass_kg"]) == (None, log.plan.site.cranes[0].rigging_mass_kg)
    (lift, *_) = json.loads(json_bytes(with_rigs(log, 3.0)))["lifts"]
    assert re.fullmatch(r"1 x chain sling, grade 8, .* mm, 2 legs of 4 m; 2 x bow shackle .* t", lift["rigging"])
    assert lift["leg_angle_deg"] == pytest.approx(np.degrees(np.arctan2(1.5, 3.0)), abs=0.01)
