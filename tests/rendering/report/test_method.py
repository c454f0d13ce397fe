from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from log_building import box_cells, tiny_log
from opened_pages import revision_of
from report_reading import ReadReport

from bimvox.grid.frame import Label
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import blind_lifts, method_of, record_of
from bimvox.rendering.report.statement import NOT_STATED
from bimvox.site.catalogue import catalogue
from bimvox.site.site import Blocker


def with_wall(log, low, high):
    """Return the log with one more obstruction."""
    site, cells = log.plan.site, box_cells(low, high)
    labels = site.labels.copy()
    labels[tuple(cells.T)] = Label.OBSTRUCTION
    blockers = (*site.blockers, Blocker("screen", "obstruction", cells))
    site = dataclasses.replace(site, labels=labels, blockers=blockers)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))


def read(log, **crane) -> ReadReport:
    if crane:
        own = dataclasses.replace(log.plan.site.cranes[0], **crane)
        log = dataclasses.replace(
            log, plan=dataclasses.replace(log.plan, site=dataclasses.replace(log.plan.site, cranes=(own,)))
        )
    return ReadReport(report_page(record_of(revision_of(log)), log.plan.site.cranes))


def test_the_times_of_a_class_are_those_of_its_motions():
    log = tiny_log(crane=True)
    rows = {row["data-work"]: row for row in read(log).rows["method"][1:]}
    assert set(rows) == {"column", "beam"}
    for motion, work in zip(log.motions, ("column", "beam"), strict=True):
        component = log.plan.site.components[motion.component]
        assert rows[work]["heaviest_kg"] == component.mass_kg
        assert rows[work]["lifts"] == 1
        for phase in motion.phases:
            if phase.name.value != "approach":
                assert rows[work][f"{phase.name.value}_from_s"] == (phase.end_ns - phase.start_ns) / 1e9
    (column, beam) = method_of(revision_of(log))
    assert (column["upended"], beam["upended"]) == (1, 0)


def test_a_wall_between_cab_and_place_makes_a_lift_blind_and_one_elsewhere_does_not():
    log = tiny_log(crane=True)
    assert blind_lifts(revision_of(log)) == []
    away = with_wall(log, (0, 9, 1), (1, 10, 8))
    assert blind_lifts(revision_of(away)) == []
    # The crane's eye is at (9.5, -2.5, 13.8): a high screen stands between it and the building, not the yard.
    screen = with_wall(log, (8, 2, 4), (11, 4, 9))
    found = {one["number"]: one["hidden"] for one in blind_lifts(revision_of(screen))}
    assert found
    assert all("set" in hidden for hidden in found.values())
    text = read(screen)
    assert text.totals["blind_lifts"] == len(found)
    assert "signaller" in text.text


def test_the_part_that_governs_the_wind_is_the_one_with_the_least():
    log = tiny_log(crane=True)
    report = read(log)
    winds = [lift["lifting"]["permitted_wind_m_s"] for lift in report.record["lifts"] if lift["status"] == "planned"]
    assert report.totals["least_wind_m_s"] == min(winds)


def test_the_areas_below_loads_and_jib_are_measured():
    log = tiny_log(crane=True)
    report, site = read(log), log.plan.site
    crane = site.cranes[0]
    sweep = shapely.Point(crane.base_m[:2]).buffer(crane.jib_length_m + crane.mast_size_m / 2.0, quad_segs=64)
    columns = site.yard | (site.labels[:, :, 0] == Label.CONSTRUCTION_AREA)
    own = shapely.union_all([shapely.box(x - 2.0, y - 3.0, x - 1.0, y - 2.0) for x, y in np.argwhere(columns)])
    assert report.totals["oversail_m2"] == pytest.approx(sweep.difference(own).area, abs=0.1)
    assert 0.0 < report.totals["below_outside_m2"] < report.totals["below_loads_m2"]


def test_the_chart_has_its_source_and_what_nobody_states_is_to_be_filled_in():
    log = tiny_log(crane=True)
    own = read(log)
    assert own.record["crane"]["about"] is None
    assert "Out of service" in own.text
    assert own.text.count(NOT_STATED) >= 8
    machine = catalogue()[0]
    named = read(log, machine=machine.name)
    assert machine.about in named.text
