"""Load charts as people have them: CSV, pasted text, units, blanks, footnotes, decimal commas."""

from __future__ import annotations

import pytest
from bimvox_pipeline.crane_import.read_text import TextOptions, read_text
from bimvox_pipeline.crane_import.sheet import doubtful_in, wrong_in

from bimvox.errors import InputError

ROWS = [
    (6.0, (20_400.0, 14_400.0, 0.0)),
    (10.0, (10_400.0, 10_400.0, 9_400.0)),
    (16.0, (0.0, 5_400.0, 4_900.0)),
]
SEMICOLONS = """Radius (m);18,0 m;30,0 m;36,0 m
;t;t;t
6;20,4;14,4;-
10;10,4;10,4;9,4
16;;5,4;4,9
"""
COMMAS = """"Radius [m]",18,30,36
6,20.4,14.4,
10,10.4,10.4,9.4
16,,5.4,4.9
"""
SPACES = """
   Boom length  18.0 m   30.0 m   36.0 m
      m            t        t        t
      6          20.4     14.4
     10          10.4     10.4      9.4
     16                    5.4      4.9
"""
DASHES = "m 18 30 36\n6 20,4 14,4 -\n10 10,4 10,4 9,4\n16 - 5,4 4,9\nloads in: t\n"
TABS = "R m\t18\t30\t36\n6\t20400 kg\t14400\t—\n10\t10400\t10400\t9400\n16\tn/a\t5400\t4900\n"
MARKDOWN = """| Radius m | 18 | 30 | 36 |
|---------:|---:|---:|---:|
| 6  | 20.4 | 14.4 | |
| 10 | 10.4 | 10.4 | 9.4 |
| 16 |      | 5.4  | 4.9 |
"""
TURNED = "Radius m;6;10;16\n18;20.4;10.4;-\n30;14.4;10.4;5.4\n36;-;9.4;4.9\n"


@pytest.mark.parametrize(
    "text", [SEMICOLONS, COMMAS, SPACES, DASHES, TABS, MARKDOWN, TURNED, SEMICOLONS.replace("\n", "\r\n")]
)
def test_the_same_chart_in_many_forms(text: str) -> None:
    unit = "kg" if "kg" in text else "t"
    (table,) = read_text(text, TextOptions(load_unit=unit)).tables
    assert table.lengths_m == (18.0, 30.0, 36.0)
    assert table.rows == ROWS
    assert not wrong_in(table)


def test_pounds_and_feet_with_thousands() -> None:
    text = 'Capacities in lb\nRadius ft,59.1,98.4\n20,"45,000","31,700"\n40,"22,900","20,100"\n'.replace('"', "")
    with pytest.raises(InputError, match="line 3: 4 capacities for 2 lengths"):
        read_text(text, TextOptions())
    text = "Capacities in lb\nRadius ft;59.1;98.4\n20;45,000;31,700\n40;22,900;20,100\n"
    (table,) = read_text(text, TextOptions()).tables
    assert table.lengths_m == (18.013, 29.992)
    # Rounded down, so that no listed load or radius is more than the sheet's.
    assert table.rows == [(6.096, (20_411.0, 14_378.0)), (12.192, (10_387.0, 9_117.0))]


@pytest.mark.parametrize(
    ("unit", "kg"), [("t", 10_500), ("kN", 1_070), ("klb", 4_762), ("lb", 4), ("short_ton", 9_525), ("kg", 10)]
)
def test_every_unit_of_loads(unit: str, kg: float) -> None:
    (table,) = read_text("R m; 20\n5; 10.5\n", TextOptions(load_unit=unit)).tables
    assert table.rows == [(5.0, (kg,))]


def test_units_that_the_text_does_not_say_are_asked_for_by_name() -> None:
    with pytest.raises(InputError, match=r"--load-unit \(t, kg, lb, klb, kN, short_ton\) and --length-unit"):
        read_text("radius; 18\n6; 20\n", TextOptions())
    (table,) = read_text("radius; 18\n6; 20\n", TextOptions("t", "m")).tables
    assert table.rows == [(6.0, (20_000.0,))]


def test_a_capacity_with_a_footnote_is_left_out_and_named() -> None:
    text = "R m;18;30\n4;30.4*;20.1 1)\n6;20.4;14.4\n* over rear only\n1) with special equipment\n"
    sheet = read_text(text, TextOptions(load_unit="t"))
    assert sheet.tables[0].rows[0] == (4.0, (0.0, 0.0))
    assert "footnote *: 30.4 t at 4 m, 18 m: left out; * over rear only" in sheet.notes
    assert any(note.endswith("1) with special equipment") for note in sheet.notes)
    kept = read_text(text, TextOptions(load_unit="t", keep_footnoted=True))
    assert kept.tables[0].rows[0] == (4.0, (30_400.0, 20_100.0))


def test_lines_before_a_table_say_what_it_holds_for() -> None:
    text = """name: LTX 1060
rated: 85 %
standard: ASME B30.5
counterweight: 12.8 t
outriggers: full
sector: 360
R m; 18; 30
6; 20.4; 14.4

sector: over rear
falls: 8
R m; 18; 30
6; 22.4; 16.4
"""
    sheet = read_text(text, TextOptions(load_unit="t"))
    first, second = sheet.tables
    assert sheet.facts == {"name": "LTX 1060", "rated_percent": 85.0, "standard": "ASME B30.5"}
    assert (first.counterweight_kg, first.outriggers, first.sector, first.falls) == (12_800.0, "full", None, None)
    assert (second.counterweight_kg, second.outriggers, second.sector, second.falls) == (
        12_800.0,
        "full",
        "over rear",
        8,
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "--load-unit"),
        ("loads in: t\nR m\n", "there is no table"),
        ("R m;18 m;30 m\n6;20.4t\n8;1;2;3;4\n", "line 3: 4 capacities for 2"),
        ("R m;18;30\n6;20.4t;14.4\n8;heavy;3\n", None),
        ("counterweight: full\nR m;18\n6;20t\n", "counterweight 'full' is not a mass"),
    ],
)
def test_what_cannot_be_read_is_named_by_line(text: str, said: str | None) -> None:
    if said is None:
        sheet = read_text(text, TextOptions())
        assert any("line 3, not read" in note for note in sheet.notes)
        return
    with pytest.raises(InputError, match=said):
        read_text(text, TextOptions())


def test_growing_capacities_gaps_and_slips_are_found_by_line() -> None:
    def table(rows: str):
        return read_text(f"R m;18 m\n{rows}", TextOptions(load_unit="t")).tables[0]

    assert "line 3" in wrong_in(table("6;20\n8;21\n10;5\n"))[0]
    assert "grows from 20 t at 6 m to 21 t at 8 m" in wrong_in(table("6;20\n8;21\n10;5\n"))[0]
    assert "a blank at 8 m, between two" in wrong_in(table("6;20\n8;-\n10;5\n"))[0]
    assert "radii must ascend" in wrong_in(table("6;20\n6;19\n"))[0]
    (doubt,) = doubtful_in(table("6;20\n8;9.9\n10;9.8\n"))
    assert doubt.startswith("line 3: 9.9 t at 8 m")
    assert not doubtful_in(table("6;20\n8;14\n10;10.4\n"))
    assert "is the unit of loads right" in doubtful_in(table("6;20000\n8;14000\n"))[0]
