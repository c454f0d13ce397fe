"""Loads on foundation and ground: from the load, and from the masses that the site file states."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from log_building import tiny_log
from named_cranes import default_luffing_crane
from opened_pages import revision_of

from bimvox.crane.carrier import BaseLoads, Carrier, Masses, Outriggers, Stand
from bimvox.crane.ground import pad_loads_n
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.card import _outrigger
from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.support import support, supports_of
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.template import site_toml


def revision(kind: str = "hammerhead", **stated: float) -> Revision:
    log = tiny_log(crane=True)
    crane = dataclasses.replace(log.plan.site.cranes[0], kind=kind)
    site = dataclasses.replace(log.plan.site, cranes=(crane,))
    made = revision_of(dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site)))
    config = SiteConfig.model_validate({"model": {"path": "a.ifc"}, "support": [stated] if stated else []})
    return dataclasses.replace(made, config=config)


def test_the_moment_of_the_load_is_the_largest_over_all_samples():
    made = revision()
    (found,) = supports_of(made)
    site, crane = made.plan.site, made.plan.site.cranes[0]
    hung = {m.order: site.components[m.component].mass_kg + crane.tackle_kg for m in made.motions}
    radius = {m.order: np.concatenate([m.raising.radius_m, m.loaded.radius_m]).max() for m in made.motions}
    moments = {order: 9.80665e-3 * hung[order] * radius[order] for order in hung}
    assert found["load_moment_knm"] == pytest.approx(max(moments.values()))
    assert found["load_moment_number"] == 1 + max(moments, key=moments.__getitem__)
    assert found["slewing_knm"] == pytest.approx(
        max(hung[order] * radius[order] ** 2 for order in hung) * crane.slewing.acceleration / 1e3
    )


def test_nothing_is_invented_that_nobody_states():
    made = revision("mobile")
    (found,) = supports_of(made)
    assert [found[key] for key in ("vertical_kn", "moment_knm", "outrigger_kn", "mat_kpa", "needed_m2")] == [None] * 5
    assert support(record_of(made)).count("from the manufacturer") == 3


def test_outrigger_and_mat_follow_from_what_is_stated():
    made = revision("mobile", crane_mass_kg=48_000.0, mat_m2=1.0, permitted_kpa=200.0)
    (found,) = supports_of(made)
    assert found["vertical_kn"] == pytest.approx((48_000.0 + found["hung_kg"]) * 9.80665e-3)
    assert found["outrigger_kn"] == pytest.approx(0.65 * found["vertical_kn"])
    assert found["needed_m2"] == pytest.approx(found["outrigger_kn"] / 200.0)
    assert "200 kPa are permitted" in support(record_of(made))
    tower = supports_of(revision(crane_mass_kg=48_000.0, back_moment_knm=1e4))[0]
    assert (tower["outrigger_kn"], tower["moment_knm"]) == (None, 1e4)


def test_the_table_is_written_back_as_it_was_read():
    text = '[model]\npath = "a.ifc"\n\n[[support]]\ncrane_mass_kg = 48000\nmat_m2 = 1.5\n'
    config = parse_site_config(text, "a.site.toml")
    assert parse_site_config(site_toml(config), "b.site.toml").support == config.support
    assert config.support[0].mat_m2 == 1.5


@pytest.mark.parametrize(("free_m", "words"), [(None, "from the"), (60.0, "none needed"), (5.0, "✕ needed")])
def test_ties_follow_from_the_stated_free_standing_height(free_m, words):
    made = revision(**({} if free_m is None else {"free_standing_m": free_m}))
    record = record_of(made)
    crane = made.plan.site.cranes[0]
    assert record["support"][0]["hook_m"] == pytest.approx(crane.highest_hook_m - crane.base_m[2])
    (ties,) = re.findall(r"<dt>Ties</dt><dd>(.*?)</dd>", support(record))
    assert words in ties


MASSES = Masses(24_000.0, 0.4, 9_000.0, -0.5, 7_000.0, 0.4, 3.4)


def on_outriggers(**stated: float) -> Revision:
    """Return a plan whose crane has a boom, outriggers and masses."""
    made = revision("mobile", **stated)
    site = made.plan.site
    base = Outriggers("full", 3.6, 3.2, 3.3, 3.3)
    carrier = Carrier(0.5, 12_000.0, base, rating="75 % of the tipping load, EN 13000", masses=MASSES)
    jib = default_luffing_crane("mobile-60t").luffing
    crane = dataclasses.replace(site.cranes[0], carrier=carrier, luffing=jib)
    plan = dataclasses.replace(made.plan, site=dataclasses.replace(site, cranes=(crane,)))
    return dataclasses.replace(made, plan=plan)


def test_pad_loads_follow_from_masses_at_every_sample_and_over_the_circle():
    made = on_outriggers(mat_m2=2.0)
    (found,) = supports_of(made)
    crane, pads = made.plan.site.cranes[0], found["pads"]
    loads = []
    for motion in made.motions:
        kg = made.plan.site.components[motion.component].mass_kg + crane.tackle_kg
        for part, hung in ((motion.raising, kg), (motion.loaded, kg), (motion.departure, crane.tackle_kg)):
            if part is not None:
                loads.append(pad_loads_n(crane.carrier, crane.luffing, part.slew_rad, part.radius_m, hung))
    most = np.concatenate(loads).max(axis=0) / 1e3
    assert all(pad["most_kn"] >= one - 1e-9 for pad, one in zip(pads["pads"], most, strict=True))
    assert found["outrigger_kn"] == max(pad["most_kn"] for pad in pads["pads"])
    assert found["mat_kpa"] == pytest.approx(found["outrigger_kn"] / 2.0)
    assert found["crane_mass_kg"] == 52_000.0
    assert found["vertical_kn"] == pytest.approx((52_000.0 + found["hung_kg"]) * 9.80665e-3)
    assert all(sum(row) == pytest.approx(sum(pads["circle_kn"][0])) for row in pads["circle_kn"])
    record = record_of(made)
    by_lift = {lift["order"]: lift for lift in record["lifts"] if "outrigger_kn" in lift}
    assert set(by_lift) == {motion.order for motion in made.motions}
    worst = max(by_lift.values(), key=lambda lift: lift["outrigger_kn"])
    assert worst["outrigger_kn"] == found["outrigger_kn"]
    assert worst["outrigger"] == max(pads["pads"], key=lambda pad: pad["most_kn"])["name"]
    html = support(record)
    assert "front left" in html
    assert "Mat kPa" in html
    assert "from the manufacturer" not in html


def test_what_a_tower_crane_stands_on_is_its_makers_and_the_rest_is_named():
    made = revision()
    stand = Stand("cross base 6 x 6 m", 6.0, 60_000.0, 52.0, BaseLoads(vertical_kn=900.0, moment_knm=2_500.0))
    site = made.plan.site
    crane = dataclasses.replace(site.cranes[0], stand=stand)
    plan = dataclasses.replace(made.plan, site=dataclasses.replace(site, cranes=(crane,)))
    record = record_of(dataclasses.replace(made, plan=plan))
    assert record["support"][0]["free_standing_m"] == 52.0
    html = support(record)
    assert "cross base 6 x 6 m" in html
    assert re.search(r"in service</dt><dd>vertical .*900 kN.*horizontal, slewing, largest corner: not stated", html)
    assert re.search(r"out of service</dt><dd>vertical, horizontal, overturning, slewing, largest corner: not", html)


def test_a_card_has_the_largest_load_on_an_outrigger():
    lift = {"outrigger_kn": 163.56, "outrigger": "rear left"}
    ((_, words),) = _outrigger(lift)
    assert "164" in words
    assert words.endswith("kN at most, rear left")
    assert "tip" in _outrigger(lift | {"outrigger_kn": None})[0][1]
    assert _outrigger({}) == []
