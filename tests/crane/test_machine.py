"""What differs between a crane and its machine, by key of the site file and in words."""

from __future__ import annotations

import dataclasses

import pytest
from named_cranes import default_crane, default_luffing_crane

from bimvox.crane.kinematics import with_luffing_jib
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.machine import differences, does_more, is_same, same_chart

SMALL = default_crane("hammerhead-30")


@pytest.mark.parametrize(
    ("more", "key", "said"),
    [
        ({"jib_length_m": 33.0}, "jib_length_m", "jib 33 m instead of 30 m (+10 %)"),
        ({"min_radius_m": 5.0}, "min_radius_m", "smallest radius 5 m instead of 2.5 m (+100 %)"),
        ({"hook_block_kg": 0.0}, "hook_block_kg", "hook block 0 kg instead of 150 kg (-100 %)"),
        ({"gears": ()}, "gears", "gears up to 0 m/s instead of up to 1.6667 m/s (-100 %)"),
        ({"falls": 4}, "falls", "falls 4 instead of 2 (+100 %)"),
        ({"kind": "mobile"}, "kind", "kind mobile instead of hammerhead"),
        ({"chart": LoadChart((16.5, 30.0), (5000.0, 1000.0))}, "chart", "chart 1.0 t instead of 2.6 t at 30 m (-62 %)"),
        (
            {"trolley": dataclasses.replace(SMALL.trolley, rate=2.0)},
            "trolley",
            "trolley rate 2 instead of 1.267 (+58 %)",
        ),
    ],
)
def test_each_key_of_a_machine_is_compared(more, key, said):
    (found,) = differences(dataclasses.replace(SMALL, **more), SMALL)
    assert (found.key, str(found)) == (key, said)
    assert not is_same(dataclasses.replace(SMALL, **more), SMALL)
    assert found.to_dict().keys() == {"key", "catalogue", "site"}


def test_what_belongs_to_the_site_is_not_a_difference():
    more = {"base_m": (9.0, 9.0, 1.0), "jib_height_m": 50.0, "sling_m": 9.0, "rigging_mass_kg": 9.0, "name": "west"}
    assert differences(dataclasses.replace(SMALL, **more), SMALL) == ()
    assert is_same(dataclasses.replace(SMALL, **more), SMALL)
    nearly = dataclasses.replace(SMALL.slewing, rate=round(SMALL.slewing.rate, 4))
    assert differences(dataclasses.replace(SMALL, slewing=nearly), SMALL) == ()


def test_a_chart_that_leaves_out_radii_of_the_machine_is_the_machines():
    """A site file of an earlier version lists the catalogue's charts at fewer radii."""
    chart = SMALL.chart
    coarse = LoadChart(chart.radius_m[::4], chart.capacity_kg[::4])
    if coarse.radius_m[-1] < chart.radius_m[-1]:
        coarse = LoadChart((*coarse.radius_m, chart.radius_m[-1]), (*coarse.capacity_kg, chart.capacity_kg[-1]))
    assert len(coarse.radius_m) < len(chart.radius_m)
    assert same_chart(coarse, chart)
    assert not same_chart(chart, coarse)
    assert not same_chart(LoadChart(chart.radius_m[:-1], chart.capacity_kg[:-1]), chart)
    assert not same_chart(LoadChart(chart.radius_m[3:], chart.capacity_kg[3:]), chart)
    assert is_same(dataclasses.replace(SMALL, chart=coarse), SMALL)


def test_a_luffing_jib_is_compared_key_by_key_but_its_mast_is_the_sites():
    for name, heights in (("luffing-40", ()), ("mobile-60t", ("jib.pivot_height_m", "jib.tail_low_m"))):
        crane = default_luffing_crane(name)
        jib = dataclasses.replace(crane.luffing, pivot_height_m=60.0, tail_low_m=55.0)
        assert tuple(one.key for one in differences(with_luffing_jib(crane, jib), crane)) == heights
        jib = dataclasses.replace(crane.luffing, length_m=30.0, luff_rad=(0.5, 1.2), width_m=2.0)
        keys = [one.key for one in differences(with_luffing_jib(crane, jib), crane)]
        assert keys == ["jib.length_m", "jib.width_m", "jib.luff_deg"]


def test_more_is_more_capacity_reach_or_wind_or_hidden_mass():
    chart = SMALL.chart
    for more in (
        {"jib_length_m": 33.0},
        {"max_wind_m_s": 25.0},
        {"hook_block_kg": 10.0},
        {"chart": LoadChart(chart.radius_m, tuple(1.1 * mass for mass in chart.capacity_kg))},
    ):
        assert does_more(dataclasses.replace(SMALL, **more), SMALL)
    for less in ({"jib_length_m": 20.0}, {"max_wind_m_s": 15.0}, {"hook_block_kg": 200.0}, {"gears": ()}):
        assert not does_more(dataclasses.replace(SMALL, **less), SMALL)
