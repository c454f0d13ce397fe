"""A machine's file: what it says, and how a wrong one is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from own_machine import machine_text

from bimvox.errors import ConfigError
from bimvox.site.config.crane import MACHINE_FILES, MachineConfig

PATH = Path("lx.toml")
TEXT = machine_text("LX 280", "hammerhead-65").decode()
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
