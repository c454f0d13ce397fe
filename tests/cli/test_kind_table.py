"""The table of types on the console."""

from __future__ import annotations

import io

from bimvox_cli.part_table import show_kinds
from rich.console import Console


def row(number=0, **changed):
    return {
        "ifc_class": "IfcWall",
        "type": f"Generic {number}",
        "material": None,
        "kind": "concrete",
        "means": "crane",
        "count": 2,
        "mass_kg": [12.0, 1340.0],
        "kind_from": "its material 'Concrete' says concrete",
        "confidence": "named",
        "doubtful": False,
        "assumed": [],
    } | changed


def shown(*rows):
    text = io.StringIO()
    show_kinds(Console(file=text, width=160), rows)
    return text.getvalue().splitlines()[1:]


def test_a_row_says_what_kind_way_mass_and_why():
    title, _, line = shown(row())
    assert title == "what the parts are: 1 type"
    said = "2  Wall, Generic 0  concrete  crane  0.01 to 1.3  named     its material 'Concrete' says concrete"
    assert line.split() == said.split()


def test_doubtful_rows_are_counted_by_parts_and_marked():
    unsure = row(
        1,
        kind="other",
        doubtful=True,
        assumed=["kind"],
        confidence="assumed",
        kind_from="nothing says what it is made of",
    )
    title, _, first, _ = shown(unsure, row())
    assert title == "what the parts are: 2 types, the kind of 2 parts is an assumption: look at these first"
    assert "ASSUMED" in first
    assert "unknown" in first


def test_rows_whose_way_is_assumed_are_counted_and_marked_too():
    cast_or_not = row(1, doubtful=True, assumed=["way"])
    title, _, first, _ = shown(cast_or_not, row())
    assert title == "what the parts are: 2 types, the way of 2 parts is an assumption: look at these first"
    assert "WAY ASSUMED" in first
    unsure = row(2, kind="other", doubtful=True, assumed=["kind"], confidence="assumed")
    assert "the kind or way of 4 parts is an assumption" in shown(unsure, cast_or_not, row())[0]


def test_of_a_long_table_the_rest_is_counted():
    lines = shown(*map(row, range(31)))
    assert len(lines) == 23
    assert lines[-1] == "... and 11 more types with 22 parts (bimvox inspect --csv FILE lists all)"


def test_the_material_is_shown_where_a_type_has_several():
    wood, none = shown(row(material="Wood"), row(material=None))[2:]
    assert "Generic 0, Wood" in wood
    assert "Wood" not in none


def test_a_row_is_one_line_however_long_its_names_are():
    assert len(shown(row(type="x" * 300, material="y" * 300, kind_from="z" * 300), row(material=None))) == 4


def test_nothing_is_printed_of_no_types():
    text = io.StringIO()
    show_kinds(Console(file=text), ())
    assert not text.getvalue()
