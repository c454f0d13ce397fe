"""A machine's file: what it says, and how a wrong one is refused."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest
from own_machine import SHEET, machine_text

from bimvox.crane.outline import outline_of
from bimvox.crane.sectors import capacities_kg
from bimvox.errors import ConfigError
from bimvox.site.config.machine_file import MACHINE_FILES, MachineConfig

PATH = Path("lx.toml")
STANDING = machine_text("LX 280", "hammerhead-65").decode()
TEXT = STANDING[: STANDING.index("[[stand]]")] + STANDING[STANDING.index("[[jib]]") :]
"""Without how it stands."""
LUFFING = machine_text("LX L", "luffing-40").decode()


def test_a_machine_has_every_jib_with_every_reeving_the_shortest_and_lightest_first():
    machine = MACHINE_FILES.read(TEXT.encode(), PATH)
    assert (machine.name, machine.kind) == ("LX 280", "hammerhead")
    assert [(crane.jib_length_m, crane.falls) for crane in machine.cranes] == [
        (length, falls) for length in (40.0, 50.0, 60.0, 65.0) for falls in (2, 4)
    ]
    assert (machine.usual.jib_length_m, machine.usual.falls) == (65.0, 4)
    assert machine.load_moment_tm == pytest.approx(175.0)
    assert [crane.falls for crane in machine.with_jib(50.0)] == [2, 4]
    assert machine.with_jib(51.0) == ()


def test_a_luffing_machine_has_its_radii_from_its_jib():
    machine = MACHINE_FILES.read(LUFFING.encode(), PATH)
    assert machine.lengths_m == (30.0, 35.0, 40.0)
    assert [crane.luffing.length_m for crane in machine.cranes] == [30.0, 35.0, 40.0]
    assert all(crane.jib_length_m == crane.luffing.radii_m[1] for crane in machine.cranes)


@pytest.mark.parametrize(
    ("old", "new", "key", "said"),
    [
        ("mast_size_m", "mast_sise_m", "mast_sise_m", "unknown key"),
        ("mast_size_m = 2 ", "mast_size_m = -2 ", "mast_size_m", "greater than 0"),
        ('kind = "hammerhead"', 'kind = "luffing"', None, "luffing is missing"),
        ("min_radius_m = 3.2", "min_radius_m = 50", None, "shorter|smaller than the shortest jib of 40 m"),
        ("lengths_m = [40, 50, 60, 65]", "lengths_m = [40, 40]", None, "a length is given twice"),
        ("lengths_m = [40, 50, 60, 65]", "lengths_m = []", "jib[0].lengths_m", "at least 1 values"),
        ("falls = 2", "falls = 4", None, "the same falls"),
        ("[17.5, 10000]", "[17.5, 100]", "jib[0].reeving[0].chart", "no ascending capacity"),
        ("[[5000, 1.1167]", "[[5000, 0.1]", None, "a heavier load is never hoisted faster"),
        ('name = "LX 280"', 'name = "LX 280', None, "not TOML"),
    ],
)
def test_a_wrong_file_is_refused_by_file_and_key(old, new, key, said):
    assert old in TEXT
    with pytest.raises(ConfigError, match=said) as caught:
        MACHINE_FILES.read(TEXT.replace(old, new).encode(), PATH)
    assert (caught.value.path, caught.value.key) == (PATH, key)


def test_bytes_that_are_not_text_are_refused():
    with pytest.raises(ConfigError, match="not UTF-8"):
        MACHINE_FILES.read(b"\xff\xff", PATH)


def test_the_schema_describes_every_key():
    schema = MachineConfig.file_schema()
    assert {"name", "kind", "about", "jib", "luffing"} <= schema["properties"].keys()
    assert all(value.keys() & {"description", "$ref"} for value in schema["properties"].values())


def sheet(old: str = "", new: str = ""):
    assert old in SHEET
    return MACHINE_FILES.read(SHEET.replace(old, new, 1).encode(), PATH)


def test_tables_give_a_crane_for_every_length_reeving_counterweight_and_base():
    machine = sheet()
    cases = [
        (length, crane.falls, crane.carrier.counterweight_kg, crane.carrier.outriggers.name)
        for length, crane in zip(machine.jibs_m, machine.cranes, strict=True)
    ]
    full = [(length, falls, 12_000.0, "full") for length in (18.0, 30.0, 36.0) for falls in (4, 8)]
    assert sorted(cases) == sorted([*full, (18.0, 4, 4_000.0, "half"), (18.0, 8, 4_000.0, "half")])
    short = next(crane for crane in machine.with_jib(18.0) if crane.falls == 4)
    # The line pull of four falls is 16 t; 400 kg of the stowed jib are deducted from every capacity.
    assert dict(zip(short.chart.radius_m, short.chart.capacity_kg, strict=True)) == {4: 15_600, 6: 15_600, 10: 10_000}
    assert short.carrier.rating == "75 % of the tipping load, EN 13000"
    assert short.carrier.masses.counterweight_behind_m == pytest.approx(3.4)


def test_a_sector_has_its_own_chart_and_a_blank_no_capacity():
    crane = next(crane for crane in sheet().with_jib(30.0) if crane.falls == 8)
    (rear,) = crane.carrier.sectors
    assert (rear.name, rear.chart.capacity_kg) == ("over rear", (14_000, 12_000, 7_000, 3_000))
    assert crane.chart.capacity_kg == (14_000, 10_000, 5_000, 2_000)
    # The boom is not raised above the first radius of the table.
    assert crane.min_radius_m == pytest.approx(6.0)
    assert sheet().with_jib(36.0)[0].carrier.sectors == ()


def test_without_a_chart_all_around_no_load_hangs_where_no_sector_has_one():
    table = '[[table]]\nsector = "over rear"\nlengths_m = [18]\nrows = [[4, 9000], [10, 5000]]\n'
    crane = MACHINE_FILES.read((SHEET[: SHEET.index("[[table]]")] + table).encode(), PATH).cranes[0]
    names = [(one.name, one.chart is None) for one in crane.carrier.sectors]
    assert names == [("over rear", False), ("no chart", True)]
    assert capacities_kg(crane, radians(180), 8.0) == 4_600
    assert capacities_kg(crane, 0.0, 8.0) == 0.0


@pytest.mark.parametrize(
    ("old", "new", "key", "said"),
    [
        ("[6, 20400, 14400, 0]", "[6, 20400, 14400]", "table[0]", "2 capacities for 3 lengths_m"),
        ("[6, 20400, 14400, 0]", "[6, 20400, 0, 0]", None, None),
        ("[10, 10400, 10400, 9400]", "[10, 10400, 0, 9400]", "table[0]", "blank at 10 m, between two"),
        ("[10, 10400, 10400, 9400]", "[10, 21000, 10400, 9400]", "table[0]", "of 18 m the capacity grows at 10 m"),
        ("[10, 10400, 10400, 9400]", "[6, 10400, 10400, 9400]", "table[0]", "radii must be above 0 and ascend"),
        ('sector = "over rear"', 'sector = "over side"', None, "table.1..sector is 'over side'.*360, over rear"),
        ('outriggers = "half"\nlengths', 'outriggers = "third"\nlengths', None, "table.2..outriggers is 'third'"),
        ("counterweight_kg = 4000", "counterweight_kg = 12000", None, None),
        ("deg = [150, 210]", "deg = [210, 150]", "sector[0]", "counter-clockwise"),
        ("[[reeving]]\nfalls = 4\nmost_kg = 16000\nhook_block_kg = 250", "", None, None),
        ("falls = 8", "falls = 4", None, "two have the same falls"),
    ],
)
def test_a_wrong_table_is_refused_by_file_and_place(old, new, key, said):
    if said is None:
        assert sheet(old, new).cranes
        return
    with pytest.raises(ConfigError, match=said) as caught:
        sheet(old, new)
    assert (caught.value.path, caught.value.key) == (PATH, key)


def test_how_a_tower_crane_stands_depends_on_its_jib():
    text = (
        TEXT
        + """
[[stand]]
base = "cross base"
free_standing_m = 40
[[stand]]
lengths_m = [65]
free_standing_m = 35
in_service = { vertical_kn = 800 }
mass_kg = 50000
tail_radius_m = 15
"""
    )
    machine = MACHINE_FILES.read(text.encode(), PATH)
    assert (machine.with_jib(40.0)[0].stand.base, machine.with_jib(40.0)[0].stand.free_standing_m) == (
        "cross base",
        40.0,
    )
    assert (machine.usual.stand.free_standing_m, machine.usual.stand.in_service.vertical_kn) == (35.0, 800.0)
    assert machine.usual.stand.mass_kg == 50_000.0
    assert outline_of(machine.usual).tail_m == 15.0
    assert outline_of(machine.with_jib(50.0)[0]).tail_m == pytest.approx(0.28 * 50.0), "nobody states it"
    with pytest.raises(ConfigError, match="tail_radius_m of a luffing crane is in luffing"):
        MACHINE_FILES.read((LUFFING + "[[stand]]\ntail_radius_m = 9\n").encode(), PATH)
    with pytest.raises(ConfigError, match="stand is not for"):
        MACHINE_FILES.read((SHEET + "[[stand]]\nfree_standing_m = 40\n").encode(), PATH)


def test_charts_are_given_in_one_way():
    with pytest.raises(ConfigError, match="not both"):
        MACHINE_FILES.read((TEXT + SHEET[SHEET.index("[[reeving]]") :]).encode(), PATH)
    with pytest.raises(ConfigError, match="only for kind"):
        MACHINE_FILES.read((TEXT + '[[sector]]\nname = "rear"\ndeg = [150, 210]\n').encode(), PATH)
