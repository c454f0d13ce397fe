"""The catalogue: real entries of several sizes, each figure with its source."""

from __future__ import annotations

import re
from importlib import resources

import numpy as np
import pytest
from named_cranes import BUILT_IN

from bimvox.crane.ground import G_M_S2, crane_kg, pad_loads_n
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.machine import Machine
from bimvox.crane.outline import outline_of
from bimvox.errors import InputError
from bimvox.site.catalogue import (
    KINDS,
    catalogue,
    every_machine,
    machine_called,
    machines_called,
    machines_of,
    usual_machine,
)

MOBILE = [f"mobile-{size}t" for size in (35, 50, 60, 100, 130, 160, 220, 300, 500)]

FILES = {
    file.name: file.read_text(encoding="utf-8")
    for file in (resources.files("bimvox") / "crane" / "catalogue").iterdir()
}


def named(machine: Machine) -> str:
    return machine.name


def test_it_holds_machines_of_several_sizes_jibs_and_kinds_the_smallest_first():
    sizes = [machine.load_moment_tm for machine in catalogue()]
    assert len(catalogue()) >= 12
    assert sizes == sorted(sizes)
    assert sizes[0] < 100 < 600 < sizes[-1]
    assert sum(len(machine.lengths_m) > 1 for machine in catalogue()) >= 12
    assert {machine.kind for machine in catalogue()} == {"hammerhead", "luffing", "mobile"}


def test_mobile_cranes_go_from_35_to_500_tonnes_with_booms_and_masses():
    assert [machine.name for machine in machines_of("mobile")] == MOBILE
    for machine in machines_of("mobile"):
        assert len(machine.lengths_m) == (6 if machine.name == "mobile-100t" else 4)
        assert all(crane_kg(crane.carrier) > 20_000.0 for crane in machine.cranes)
    weights = {name: {crane.carrier.counterweight_kg for crane in machine_called(name).cranes} for name in MOBILE}
    assert [len(weights[name]) for name in MOBILE] == [2, 2, 1, 1, 2, 2, 2, 2, 2]


def test_a_longer_boom_and_less_counterweight_carry_no_more():
    for machine in machines_of("mobile"):
        heaviest = max(crane.carrier.counterweight_kg for crane in machine.cranes)
        for crane in machine.cranes:
            radii = np.array(crane.chart.radius_m)
            for other in machine.cranes:
                longer = crane.jib_own_m > other.jib_own_m and radii[-1] <= other.chart.radius_m[-1]
                lighter = crane.jib_own_m == other.jib_own_m and other.carrier.counterweight_kg == heaviest
                if lighter or (
                    longer and other.carrier == crane.carrier and crane.jib_own_m != machine.usual.jib_own_m
                ):
                    common = radii[radii >= other.chart.radius_m[0]]
                    assert (capacity_kg(crane.chart, common) <= capacity_kg(other.chart, common)).all()


@pytest.mark.parametrize("machine", every_machine(), ids=named)
def test_every_machine_is_consistent(machine: Machine):
    assert 50.0 < machine.load_moment_tm < 3000.0
    for crane in machine.cranes:
        radii, masses = (np.array(values) for values in (crane.chart.radius_m, crane.chart.capacity_kg))
        assert (np.diff(radii) > 0.0).all() and (np.diff(masses) <= 0.0).all()
        assert outline_of(crane).tail_m > 0.0
        rates = [rate for _, rate in crane.gears]
        assert rates == sorted(rates, reverse=True)
        if machine.hoist_kw is not None:
            winch = crane.hoist if crane.luffing is None else crane.luffing.winch
            pairs = [*crane.gears, (masses[0], min([winch.rate, *rates]))]
            needed_kw = max(mass_kg * G_M_S2 * rate for mass_kg, rate in pairs) / 1e3
            assert needed_kw <= 0.78 * machine.hoist_kw, "74 % of the winch's power, rounded"
        if crane.kind == "mobile" and not machine.sources:
            assert crane_kg(crane.carrier) is not None
    if machine.sources:
        has_mass = any(crane.stand is not None and crane.stand.mass_kg for crane in machine.cranes)
        assert has_mass or any("mass" in one for one in machine.not_found)


def test_a_machine_that_nobody_names_is_the_one_of_earlier_versions():
    assert [usual_machine(kind).name for kind in ("luffing", "mobile")] == ["luffing-40", "mobile-60t"]


def test_a_machine_is_found_by_its_name():
    assert [machine_called(machine.name) for machine in catalogue()] == list(catalogue())
    assert machine_called("hammerhead-31") is None
    assert machine_called(None) is None


@pytest.mark.parametrize("text", FILES.values(), ids=FILES.keys())
def test_every_figure_has_a_source_that_the_file_explains(text):
    head = text[: text.index("\nname = ")]
    explained = set(re.findall(r"\[\d\]", head))
    keys = [line for line in text.splitlines() if re.match(r"\s*\w+ = [\d\[{]", line) and "lengths_m" not in line]
    assert len(keys) > 8
    inside = ""
    for line in text[len(head) :].splitlines():
        inside = line if line.startswith("[") else inside
        if line in keys and "falls" not in line:
            own, of_section = (re.findall(r"\[\d\]", one.partition("  # ")[2]) for one in (line, inside))
            sources = own or of_section
            assert sources, f"{line!r} has no source"
            assert explained.issuperset(sources), line
    assert "not a maker's" in head
    assert "maker" not in text[len(head) :]


@pytest.mark.parametrize("machine", machines_of("mobile"), ids=named)
def test_a_mobile_crane_stands_with_a_quarter_more_than_its_chart_in_every_direction(machine: Machine):
    for crane in machine.cranes:
        assert crane.carrier.sectors == ()
        for radius_m, mass_kg in zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True):
            loads = pad_loads_n(crane.carrier, crane.luffing, np.radians(range(0, 360, 5)), radius_m, 1.25 * mass_kg)
            assert np.isfinite(loads).all()


def strength_kg(class_t: float, radius_m: float) -> float:
    """Return what the boom, the slewing ring and the outriggers of a mobile crane bear at a radius: the files' [7]."""
    each_m = 0.021 * (59.0 / class_t) ** (1.0 / 3.0)
    return 2900.0 * class_t * (1.0 - each_m * max(0.0, radius_m - 3.05)) / radius_m


@pytest.mark.parametrize("machine", machines_of("mobile"), ids=named)
def test_a_mobile_crane_carries_no_more_than_machines_of_its_class_bear(machine: Machine):
    class_t = float(machine.name.removeprefix("mobile-").removesuffix("t"))
    for crane in machine.cranes:
        for radius_m, mass_kg in zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True):
            assert mass_kg <= strength_kg(class_t, radius_m)


@pytest.mark.parametrize(
    ("class_t", "published"),
    [
        (58.967, ((6.096, 28_168.0), (9.144, 17_146.0), (10.668, 14_651.0))),  # Terex RT665
        (31.75, ((3.5, 28_200.0), (5.0, 20_650.0), (7.0, 14_400.0), (12.0, 7200.0))),  # Terex RT335-1
        (40.823, ((6.096, 18_325.0), (7.62, 14_333.0), (10.668, 9208.0))),  # Terex RT345-1XL
        (300.0, ((11.2, 74_000.0),)),  # Grove GMK6300L
    ],
)
def test_what_machines_of_a_class_bear_is_less_than_published(class_t, published):
    for radius_m, mass_kg in published:
        assert 0.8 * mass_kg < strength_kg(class_t, radius_m) <= mass_kg


@pytest.mark.parametrize("machine", [m for m in catalogue() if m.name.startswith("flat-top")], ids=named)
def test_a_derived_chart_follows_the_stated_rule(machine):
    """(capacity + 5.5 % of the largest load) x radius is constant along one jib, and more on a shorter one."""
    most = max(crane.chart.capacity_kg[0] for crane in machine.cranes)
    moments = []
    for crane in machine.cranes:
        radii, masses = (np.array(values) for values in (crane.chart.radius_m, crane.chart.capacity_kg))
        assert radii[-1] == crane.jib_length_m
        moment = (masses[-1] + 0.055 * most) * radii[-1]
        if len(radii) > 1:
            np.testing.assert_allclose((masses + 0.055 * most) * radii, moment, rtol=0.01)
        assert masses[0] == most * crane.falls / 4
        if crane.falls == 4:
            moments.append(moment)
    assert moments == sorted(moments, reverse=True)


@pytest.mark.parametrize(
    ("name", "jib_m", "ends"),
    [
        ("flat-top-75", 52.0, ((52.0, 1100.0),)),
        ("flat-top-120", 60.0, ((60.0, 1500.0),)),
        ("flat-top-155", 65.0, ((65.0, 1750.0),)),
        ("flat-top-260", 30.0, ((20.9, 12_500.0), (30.0, 8500.0))),
        ("flat-top-260", 65.0, ((65.0, 2300.0),)),
        ("flat-top-290", 70.0, ((70.0, 3200.0),)),
        ("flat-top-290", 75.0, ((75.0, 2500.0),)),
        ("flat-top-335", 75.0, ((75.0, 3400.0),)),
        ("flat-top-800", 80.0, ((80.0, 7500.0), (22.0, 32_000.0))),
        ("flat-top-1150", 80.0, ((80.0, 11_100.0),)),
        ("luffing-145", 40.0, ((24.0, 6000.0), (40.0, 2500.0))),
    ],
)
def test_published_ends_are_as_published(name, jib_m, ends):
    crane = max(machine_called(name).with_jib(jib_m), key=lambda one: one.falls)
    for radius_m, mass_kg in ends:
        assert capacity_kg(crane.chart, radius_m) == pytest.approx(mass_kg, rel=0.01)


def test_names_of_earlier_versions_are_the_same_machines():
    assert {
        name: (crane.chart.capacity_kg[0], crane.chart.capacity_kg[-1], crane.jib_length_m)
        for name in ("hammerhead-30", "hammerhead-45", "hammerhead-65", "hammerhead-75", "luffing-40", "mobile-60t")
        for crane in (machine_called(name).usual,)
    } == {
        "hammerhead-30": (5000.0, 2600.0, 30.0),
        "hammerhead-45": (8000.0, 2350.0, 45.0),
        "hammerhead-65": (10_000.0, 2100.0, 65.0),
        "hammerhead-75": (20_000.0, 4000.0, 75.0),
        "luffing-40": (8000.0, 2850.0, pytest.approx(39.0877, abs=1e-4)),
        "mobile-60t": (14_000.0, 1300.0, pytest.approx(31.4271, abs=1e-4)),
    }


def test_machines_are_found_by_kind_and_by_name():
    assert [crane.name for crane in machines_called("mobile")] == MOBILE
    assert {machine.name for machine in machines_called("public")} == {
        one.name for one in every_machine() if one.sources
    }
    for crane in BUILT_IN:
        assert [machine.name for machine in machines_called(crane.name)] == [crane.name]
        assert crane.kind in KINDS
        assert crane.name in [machine.name for machine in machines_called(crane.kind)]
    assert len({crane.name for crane in BUILT_IN}) == len(BUILT_IN)


def test_an_unknown_name_is_refused_with_the_one_that_was_meant():
    with pytest.raises(InputError, match=r"did you mean .luffing-40.") as caught:
        machines_called("lufing-40")
    assert "mobile-100t" in str(caught.value.hint)
