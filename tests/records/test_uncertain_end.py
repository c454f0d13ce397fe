"""The end of a plan with uncertain times."""

from __future__ import annotations

import dataclasses

import pytest
import seeded_faults as faults

from bimvox.errors import ConfigError
from bimvox.log.dates import log_dates
from bimvox.records.uncertain_end import PERCENTILES, added_ns
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.uncertainty import UncertaintyConfig
from bimvox.site.work import Work

H_NS = 3600 * 10**9


def test_fixed_factors_add_exactly_what_they_say():
    fixed = UncertaintyConfig(wall=(1.5, 1.5, 1.5))
    assert added_ns(fixed, {Work.WALL: [2 * H_NS, 4 * H_NS], Work.SLAB: [H_NS]}) == (3 * H_NS,) * 3


def test_percentiles_are_those_of_a_triangle_ascend_and_are_deterministic():
    one = UncertaintyConfig(wall=(0.5, 1.0, 2.0), samples=100_000)
    found = added_ns(one, {Work.WALL: [H_NS]})
    # Above the mode, the triangle's distribution function is 1 - (2 - x)^2 / 1.5.
    wanted = [1.0 - (1.5 * (1.0 - share / 100.0)) ** 0.5 for share in PERCENTILES]
    assert [value / H_NS for value in found] == pytest.approx(wanted, abs=0.01)
    assert (
        found == added_ns(one, {Work.WALL: [H_NS]}) != added_ns(one.model_copy(update={"seed": 1}), {Work.WALL: [H_NS]})
    )
    many = added_ns(one, {Work.WALL: [H_NS // 100] * 100})
    assert many[2] - many[0] < (found[2] - found[0]) / 5


def test_the_end_moves_in_working_hours_and_is_told():
    log = faults.good_log()
    calendar = b'\n[calendar]\nstart = 2026-03-09\nshifts = ["07:00-09:00"]\nbreaks = []\n'

    def dated(more: bytes):
        made = dataclasses.replace(log, attachments={"site.toml": calendar + more})
        found = log_dates(made)
        assert found is not None
        return found

    every = ", ".join(f"{work.value} = [FACTOR, FACTOR, FACTOR]" for work in Work)
    plain = dated(b"")
    assert plain.percentiles == () and "percentiles" not in plain.document()
    same = dated(f"uncertainty = {{ {every.replace('FACTOR', '1')} }}\n".encode())
    assert {end for _, end in same.percentiles} == {plain.last}
    twice = dated(f"uncertainty = {{ {every.replace('FACTOR', '2')} }}\n".encode())
    (end,) = {end for _, end in twice.percentiles}
    assert end > plain.last
    assert 7 <= end.hour < 9 or (end.hour, end.minute, end.second) == (9, 0, 0)
    assert twice.document()["percentiles"]["P80"] == end.isoformat()
    assert "P95" in twice.notes[-1]


def test_factors_that_do_not_ascend_are_refused():
    text = '[model]\npath = "a.ifc"\n[calendar.uncertainty]\nwall = [1.2, 1.0, 1.4]\n'
    with pytest.raises(ConfigError, match="must ascend"):
        parse_site_config(text, "a.site.toml")
