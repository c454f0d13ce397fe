"""Real machines from public figures: what a source states, what is assumed, and charts that never carry more."""

from __future__ import annotations

import tomllib
from importlib import resources

import numpy as np
import pytest

from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.machine import Machine
from bimvox.site.catalogue import catalogue, machine_called
from bimvox.site.public_machines import MARK, between, public_machines

FILES = {
    file.name: tomllib.loads(file.read_text(encoding="utf-8"))
    for file in (resources.files("bimvox") / "crane" / "public_machines").iterdir()
}
MAKERS = ("grove", "jaso", "liebherr", "potain", "raimondi", "spierings", "tadano", "terex", "wolff")


def named(machine: Machine) -> str:
    return machine.name


def test_there_are_machines_of_several_makers_and_all_kinds():
    assert len(public_machines()) >= 12
    assert {machine.name.partition("-")[0] for machine in public_machines()} == set(MAKERS)
    assert {machine.kind for machine in public_machines()} == {"hammerhead", "luffing", "mobile"}
    assert not {machine.name for machine in public_machines()} & {machine.name for machine in catalogue()}


@pytest.mark.parametrize("machine", public_machines(), ids=named)
def test_each_is_marked_cites_its_sources_and_names_what_is_blank(machine: Machine):
    assert machine.about.endswith(MARK)
    assert all(source.address.startswith("http") and source.states for source in machine.sources)
    assert machine.not_found and machine.assumed
    assert machine_called(machine.like).kind == machine.kind


@pytest.mark.parametrize("given", FILES.values(), ids=FILES.keys())
def test_a_chart_carries_what_a_source_gives_there_and_nowhere_more(given):
    machine = machine_called(given["name"])
    for table in given["table"]:
        for crane in machine.with_jib(table["lengths_m"][0]):
            most_kg = next((one.get("most_kg") for one in given["reeving"] if one["falls"] == crane.falls), None)
            for radius_m, mass_kg in table["rows"]:
                assert capacity_kg(crane.chart, radius_m) == min(mass_kg, most_kg or mass_kg)
            assert crane.chart.radius_m[-1] == table["rows"][-1][0], "beyond the last point there is nothing"
            moments = [radius_m * mass_kg for radius_m, mass_kg in table["rows"]]
            radii, masses = np.array(crane.chart.radius_m), np.array(crane.chart.capacity_kg)
            assert (radii * masses <= max(moments) * (1.0 + 1e-9)).all()
            assert crane.chart.capacity_kg[0] <= (most_kg or table["rows"][0][1])
    stated = {key for key in given if key not in ("like", "source", "not_found", "table", "reeving", "stand")}
    assert not stated & set(machine.assumed), "what a source states is not assumed"


@pytest.mark.parametrize("hangs_kg", [0.0, 400.0, 2500.0])
def test_a_chart_of_constant_tipping_moment_is_nowhere_exceeded(hangs_kg: float):
    """Trolley and rope weigh too, so the load's own moment falls towards the end of a jib."""

    def carries(radius_m: float) -> float:
        return min(10_000.0, 150_000.0 / radius_m - hangs_kg)

    rows = between([(50.0, carries(50.0))], 3.0, 10_000.0)
    assert rows[0][0] == 3.0 and rows[-1][0] == 50.0
    assert all(mass_kg <= carries(radius_m) + 1e-6 for radius_m, mass_kg in rows)
    both = between([(12.0, carries(12.0)), (50.0, carries(50.0))], 3.0, 10_000.0)
    assert all(mass_kg <= carries(radius_m) + 1e-6 for radius_m, mass_kg in both)


def test_between_two_points_the_smaller_moment_holds_and_the_farther_load_at_least():
    assert between([(4.0, 1000.0), (8.0, 900.0)], 4.0, 0.0) == [
        (4.0, 1000.0), (5.0, 900.0), (6.0, 900.0), (7.0, 900.0), (8.0, 900.0),
    ]  # fmt: skip
    assert dict(between([(4.0, 1000.0), (8.0, 250.0)], 4.0, 0.0))[6.0] == 330.0, "2 tm, rounded down"
    assert between([(4.0, 1000.0)], 2.5, 0.0) == [(2.5, 1000.0), (3.0, 1000.0), (4.0, 1000.0)], "a single point"


def test_what_no_source_states_is_that_of_the_class_and_a_larger_load_is_hoisted_slower():
    machine, like = machine_called("terex-ctl-630"), machine_called("luffing-55")
    assert machine.usual.sling_m == like.usual.sling_m and "sling_m" in machine.assumed
    assert machine.usual.luffing.winch.rate == pytest.approx(like.usual.luffing.winch.rate * 16 / 32)
    assert machine.usual.mast_size_m == 2.3 and "mast_size_m" not in machine.assumed
