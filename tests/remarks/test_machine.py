"""Remarks on a crane that differs from the catalogue say what differs and by how much."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from named_cranes import BUILT_IN, HAMMERHEADS, reevings
from remarked_plans import plan_of

from bimvox.crane.kinematics import with_luffing_jib, with_reeving
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import Override, TowerCrane
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.remarks import remarks_of
from bimvox.site.fictitious import fictitious_machines

SMALL, LARGE = HAMMERHEADS[0], HAMMERHEADS[2]


def said_of(crane: TowerCrane) -> Remark:
    plan = plan_of([("part", (2.0, 2.0, 0.0), (3.0, 3.0, 3.0))], crane=crane)
    (found,) = (remark for remark in remarks_of(plan, ()) if remark.kind.startswith("crane_"))
    return found


def changed(crane: TowerCrane, **more: Any) -> TowerCrane:
    return dataclasses.replace(crane, **more)


@pytest.mark.parametrize("crane", BUILT_IN, ids=lambda crane: crane.name)
def test_machines_of_the_catalogue_are_a_note(crane: TowerCrane) -> None:
    elsewhere = changed(crane, base_m=(30.0, 3.0, 0.5), sling_m=4.0, rigging_mass_kg=350.0)
    assert said_of(elsewhere).severity is Severity.NOTE


def test_site_settings_are_not_an_alteration() -> None:
    assert said_of(changed(SMALL, jib_height_m=42.0)).kind == "crane_generic"
    assert said_of(changed(SMALL, name="north")).kind == "crane_generic"
    luffing = next(crane for crane in BUILT_IN if crane.kind == "luffing")
    assert luffing.luffing is not None
    taller = dataclasses.replace(luffing.luffing, pivot_height_m=60.0, tail_low_m=56.0)
    assert said_of(with_luffing_jib(luffing, taller)).kind == "crane_generic"
    for reeving in reevings(LARGE.name):
        assert said_of(with_reeving(LARGE, reeving)).kind == "crane_generic"


def test_a_small_machines_name_with_a_large_chart_is_serious_and_says_what_differs() -> None:
    remark = said_of(changed(LARGE, name=SMALL.name))
    assert (remark.kind, remark.severity) == ("crane_altered", Severity.SERIOUS)
    assert "jib 65 m instead of 30 m (+117 %)" in remark.text
    assert "chart 10.0 t instead of 4.7 t at 17.5 m (+113 %)" in remark.text
    assert "falls 4 instead of 2" in remark.text


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"chart": LoadChart(SMALL.chart.radius_m, tuple(100.0 * kg for kg in SMALL.chart.capacity_kg))}, "500.0 t"),
        ({"jib_length_m": 33.0}, "jib 33 m instead of 30 m (+10 %)"),
        ({"hook_block_kg": 0.0}, "hook block 0 kg instead of 150 kg (-100 %)"),
        ({"max_wind_m_s": 40.0}, "wind limit 40 m/s instead of 20 m/s (+100 %)"),
        ({"kind": "luffing"}, "kind luffing instead of hammerhead"),
    ],
)
def test_a_crane_that_does_more_than_its_entry_is_serious(more: dict[str, Any], said: str) -> None:
    remark = said_of(changed(SMALL, **more))
    assert remark.severity is Severity.SERIOUS
    assert said in remark.text


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"slewing": dataclasses.replace(SMALL.slewing, rate=100.0 * SMALL.slewing.rate)}, "slewing rate"),
        ({"hoist": dataclasses.replace(SMALL.hoist, acceleration=0.6)}, "hoist acceleration 0.6 instead of 0.3"),
        ({"gears": ()}, "gears up to 0 m/s"),
        ({"jib_length_m": 27.0}, "jib 27 m instead of 30 m (-10 %)"),
        ({"mast_size_m": 0.1}, "mast 0.1 m instead of 1.2 m"),
    ],
)
def test_any_other_alteration_is_minor(more: dict[str, Any], said: str) -> None:
    remark = said_of(changed(SMALL, **more))
    assert (remark.kind, remark.severity) == ("crane_altered", Severity.MINOR)
    assert said in remark.text


@pytest.mark.parametrize("crane", [machine.usual for machine in fictitious_machines()], ids=lambda crane: crane.name)
def test_scaled_machines_do_not_exist(crane: TowerCrane) -> None:
    remark = said_of(crane)
    assert (remark.kind, remark.severity) == ("crane_unknown", Severity.SERIOUS)
    assert "fictitious" in crane.name
    assert "is fictitious, it does not exist" in remark.text


def test_a_custom_crane_must_be_checked_and_no_crane_lifts_everything() -> None:
    own = changed(LARGE, name="LX 280", chart=LoadChart((20.0, 60.0), (12_000.0, 3000.0)))
    assert said_of(own).severity is Severity.MINOR
    assert "12.0 t up to 20 m, 3.0 t at 60 m" in said_of(own).text
    declared = changed(own, overrides=(Override("gears", "gears", "up to 1 m/s", "up to 2 m/s", "+100 %"),))
    assert "gears up to 2 m/s instead of up to 1 m/s (+100 %)" in said_of(declared).text
    giant = changed(own, chart=LoadChart((20.0, 60.0), (12e6, 3e6)))
    assert said_of(giant).severity is Severity.SERIOUS
