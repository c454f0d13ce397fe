"""What the parts of a model are, by type."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from box_buildings import box_element

from bimvox.bim.building import Building, Casting, Role, Source
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.site.config.site_config import ComponentConfig, ModelConfig, SiteConfig
from bimvox.site.kind_rows import kind_rows

WALL = Judgement(Kind.MASONRY, Confidence.NAMED, "its material 'Brick' says masonry")
GUESSED = Judgement(Kind.TIMBER, Confidence.ASSUMED, "a bar 80 mm thick is too thin for concrete")


def part(name, ifc_class="IfcBeam", at=0.0, kg=500.0, judgement=GUESSED, role=Role.COMPONENT, **more):
    element = box_element(name, (at, 0, 3), (at + 6, 0.3, 3.5), ifc_class=ifc_class, mass_kg=kg, role=role)
    return dataclasses.replace(element, name=name, judgement=judgement, **more)


def rows_of(*elements, entries=()):
    building = Building(elements, (), Source("m.ifc", "0" * 64, "IFC4", "m"))
    return kind_rows(SiteConfig(model=ModelConfig(path=Path("m.ifc")), component=entries), building)


def test_parts_of_the_same_type_are_one_row_with_its_masses_and_its_query():
    found = rows_of(
        part("a:1", "IfcWall", judgement=WALL, type_name="Brick 100", material="Brick"),
        part("b:2", "IfcWallStandardCase", 9, 900.0, WALL, type_name="Brick 100", material="Brick"),
    )
    assert [row.to_dict() for row in found] == [
        {
            "ifc_class": "IfcWall",
            "type": "Brick 100",
            "material": "Brick",
            "kind": "masonry",
            "means": "built",
            "count": 2,
            "mass_kg": [500.0, 900.0],
            "kind_from": "its material 'Brick' says masonry",
            "confidence": "named",
            "doubtful": False,
            "assumed": [],
            "select": 'IfcWall, type="Brick 100"',
            "selects": 2,
        }
    ]


def test_doubtful_rows_come_first_then_what_weighs_most_then_what_is_not_in_the_plan():
    found = rows_of(
        part("door", "IfcDoor", role=Role.FITTING),
        part("footing", "IfcFooting", role=Role.STRUCTURE),
        part("light", judgement=WALL),
        part("heavy", kg=1e4, judgement=WALL),
        part("unsure", kg=100.0),
    )
    assert [(row.type_name, row.is_doubtful) for row in found[:3]] == [
        ("unsure", True),
        ("heavy", False),
        ("light", False),
    ]
    assert {(row.ifc_class, row.means, row.is_doubtful) for row in found[3:]} == {
        ("IfcDoor", "out", False),
        ("IfcFooting", "pinned", False),
    }


def test_parts_without_a_type_are_called_by_their_names_without_the_numbers():
    found = rows_of(
        *(part(name) for name in ("Sparren-1", "Sparren-2", "C101", "C102", "W310X60:207325", "W310X60:2", "")),
    )
    assert sorted((row.type_name or "", row.count) for row in found) == [
        ("", 1), ("C", 2), ("Sparren", 2), ("W310X60", 2),
    ]  # fmt: skip


def test_one_type_that_goes_two_ways_is_two_rows_and_each_says_how_many_its_query_selects():
    found = rows_of(part("a", kg=20.0, type_name="Lintel"), part("b", type_name="Lintel"), part("c", type_name="X"))
    assert [(row.means, row.count, row.selects) for row in found if row.type_name == "Lintel"] == [
        ("crane", 1, 2), ("by_hand", 1, 2),
    ]  # fmt: skip
    assert "it weighs 20 kg" in next(row.why for row in found if row.means == "by_hand")


def test_few_parts_of_a_type_of_several_materials_or_kinds_are_selected_one_by_one():
    """A query for a material would find whatever has a layer of it."""
    found = rows_of(
        *(part(name, type_name="X", material="Wood") for name in "ab"),
        part("c", type_name="X", judgement=WALL),
        *(part(f"d{n}", type_name="X") for n in range(30)),
    )
    assert sorted((row.select, row.count, row.selects) for row in found) == [
        ('IfcBeam, type="X"', 30, 33),
        ("a + b", 2, 2),
        ("c", 1, 1),
    ]


def test_names_with_quotes_slashes_and_brackets_can_be_selected():
    found = rows_of(part("a", type_name='8" Block (a/b)'))
    assert found[0].select == r"IfcBeam, type=/8. Block \(a.b\)$/"


def test_bodies_of_a_mesh_are_selected_by_their_names():
    found = rows_of(part("col-1", "Mesh"), part("col-2", "Mesh"))
    assert [(row.type_name, row.count, row.select) for row in found] == [("col", 2, "col-1, col-2")]
    many = rows_of(*(part(f"col-{n}", "Mesh") for n in range(40)))
    assert many[0].select == "col*"


def test_what_the_site_file_says_of_a_part_counts():
    entries = (ComponentConfig(global_id="a", means="in_situ"), ComponentConfig(global_id="b", pinned=True))
    found = rows_of(part("a"), part("b"), part("c"), entries=entries)
    assert {row.type_name: row.means for row in found} == {"a": "in_situ", "b": "pinned", "c": "crane"}
    assert next(row.why for row in found if row.type_name == "b") == "the site file says that it stands already"


def test_what_is_not_part_of_the_plan_has_no_mass_unless_it_is_stated():
    rows = rows_of(
        part("beam", judgement=WALL),
        part("terrain", "IfcSite", kg=3e9, role=Role.GROUND),
        part("sofa", "IfcFurniture", kg=4000.0, role=Role.FITTING),
        part("pump", "IfcPump", kg=70.0, role=Role.FITTING, mass_source="quantity"),
        part("footing", "IfcFooting", kg=900.0, role=Role.STRUCTURE),
    )
    masses = {row.ifc_class: row.to_dict()["mass_kg"] for row in rows}
    assert masses["IfcSite"] is masses["IfcFurniture"] is None
    assert (masses["IfcPump"], masses["IfcFooting"]) == ([70.0, 70.0], [900.0, 900.0])


def test_what_init_wrote_of_a_part_keeps_its_reason():
    entries = (
        ComponentConfig(global_id="a", means="in_situ", why="no usual crane lifts it"),
        ComponentConfig(global_id="b", means="in_situ"),
    )
    found = rows_of(part("a"), part("b"), entries=entries)
    assert {row.why.partition("; ")[2] for row in found} == {"no usual crane lifts it", "the site file says so"}


def test_a_model_of_fittings_alone_has_rows():
    assert [row.means for row in rows_of(part("door", "IfcDoor", role=Role.FITTING))] == ["out"]


def test_formwork_is_not_installed_after_the_lifts():
    formwork = Judgement(Kind.FORMWORK, Confidence.NAMED, "'bekisting' in its name says formwork or temporary works")
    (row,) = rows_of(part("bekisting", judgement=formwork, role=Role.FITTING))
    assert (row.means, row.why) == ("out", "not part of the building")


NAMED = Judgement(Kind.CONCRETE, Confidence.NAMED, "its material 'C30/37' says concrete")


@pytest.mark.parametrize("ifc_class", ["IfcWall", "IfcColumn", "IfcStair"])
def test_that_concrete_of_unknown_make_comes_by_crane_is_an_assumption(ifc_class):
    (row,) = rows_of(part("a", ifc_class, judgement=NAMED))
    assert (row.means, row.confidence, row.is_doubtful) == ("crane", Confidence.NAMED, True)
    assert row.to_dict()["assumed"] == ["way"]
    assert row.why == f"{NAMED.why}; nothing says that it is precast: that it comes by crane is an assumption"


@pytest.mark.parametrize(
    "said",
    [
        {"casting": Casting.PRECAST},
        {"stated_means": "crane"},
        {"judgement": Judgement(Kind.STEEL, Confidence.NAMED, "its material 'S355' says steel")},
    ],
    ids=["precast", "by its type", "steel"],
)
def test_the_way_of_what_is_said_to_be_lifted_is_no_assumption(said):
    (row,) = rows_of(part("a", **({"judgement": NAMED} | said)))
    assert (row.means, row.is_doubtful) == ("crane", False)


def test_the_way_of_a_part_that_the_site_file_lifts_is_no_assumption():
    entries = (ComponentConfig(global_id="a", means="crane"),)
    found = rows_of(*(part(name, judgement=NAMED) for name in "ab"), entries=entries)
    assert {(row.type_name, row.is_doubtful) for row in found} == {("a", False), ("b", True)}


def test_of_eight_walls_of_a_type_the_one_that_is_cast_has_a_row_of_its_own():
    walls = [part(f"w{n}", "IfcWall", 9.0 * n, judgement=NAMED, type_name="Concrete 300") for n in range(8)]
    entries = (ComponentConfig(global_id="w3", means="in_situ", why="no usual crane lifts it"),)
    lifted, cast = rows_of(*walls, entries=entries)
    assert [(row.means, row.count, row.is_way_assumed) for row in (lifted, cast)] == [
        ("crane", 7, True),
        ("in_situ", 1, False),
    ]
    assert cast.why.endswith("; no usual crane lifts it")
