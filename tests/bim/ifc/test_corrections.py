"""What the site file says of types of parts wins over what an IFC file says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bimvox.bim.building import Building, Casting, Element, Role
from bimvox.bim.kinds.kind import Confidence, Correction, Kind
from bimvox.bim.options import ReadOptions
from bimvox.bim.read import read_building
from bimvox.errors import SelectionError


@pytest.fixture
def model(maker: Any, tmp_path: Path) -> Path:
    made = maker()
    for number in range(2):
        wall = made.box("IfcWall", (0, number, 0), (4, 0.3, 3), Name=f"Wall-{number}")
        made.material(wall, "Brick")
    made.box("IfcBeam", (9, 0, 3), (4, 0.3, 0.5), Name="Beam-1")
    made.box("IfcRailing", (9, 3, 3), (4, 0.1, 1), Name="Rail-1")
    poured = made.box("IfcSlab", (9, 9, 3), (3, 3, 0.2), Name="Slab-1")
    made.material(poured, "Concrete - Cast in situ")
    return made.write(tmp_path / "m.ifc")


def read(path: Path, *corrections: Correction) -> Building:
    return read_building(path, ReadOptions(processes=1, corrections=corrections))


def says(select: str, kind: Kind | None = None, means: Any = None, *, one_part: bool = False) -> Correction:
    return Correction(select, kind, means, "a.toml: model.kinds[0]", one_part)


def called(building: Building, name: str) -> Element:
    return next(one for one in building.elements if one.name == name)


def test_a_kind_wins_over_the_material_and_the_mass_follows(model: Path) -> None:
    found = read(model, says("IfcWall", Kind.TIMBER))
    wall = called(found, "Wall-0")
    assert (wall.judgement.kind, wall.judgement.confidence) == (Kind.TIMBER, Confidence.STATED)
    assert wall.judgement.why == "the site file says so"
    assert (wall.mass_kg, wall.mass_source) == (pytest.approx(3.6 * 500.0), "default")
    assert called(found, "Beam-1").judgement.kind is Kind.OTHER


def test_a_kind_of_the_same_material_keeps_its_density(model: Path) -> None:
    before = called(read(model), "Slab-1")
    after = called(read(model, says("IfcSlab", Kind.PRECAST)), "Slab-1")
    assert (before.casting, after.casting) == (Casting.IN_SITU, Casting.PRECAST)
    assert (after.mass_kg, after.mass_source) == (before.mass_kg, before.mass_source)


def test_a_way_decides_what_is_part_of_the_plan(model: Path) -> None:
    found = read(model, says("IfcRailing", means="crane"), says('IfcWall, Name="Wall-1"', means="out"))
    rail, wall = called(found, "Rail-1"), called(found, "Wall-1")
    assert (rail.role, rail.stated_means) == (Role.COMPONENT, "crane")
    assert (wall.role, called(found, "Wall-0").role) == (Role.FITTING, Role.COMPONENT)


def test_the_last_correction_counts_and_one_part_before_its_type(model: Path) -> None:
    own = next(one.global_id for one in read(model).elements if one.name == "Wall-0")
    part = says(own, Kind.GLAZING, one_part=True)
    found = read(model, part, says("IfcWall", Kind.TIMBER, "built"), says("IfcWall", Kind.STEEL))
    assert [called(found, f"Wall-{n}").judgement.kind for n in (0, 1)] == [Kind.GLAZING, Kind.STEEL]
    assert called(found, "Wall-0").stated_means == "built"


def test_piles_stand_there_and_formwork_is_not_in_the_plan(model: Path) -> None:
    found = read(model, says("IfcBeam", Kind.PILE), says("IfcWall", Kind.FORMWORK))
    assert (called(found, "Beam-1").role, called(found, "Wall-0").role) == (Role.STRUCTURE, Role.FITTING)


def test_what_selects_nothing_is_a_note_and_what_cannot_be_read_an_error_with_its_place(model: Path) -> None:
    found = read(model, says('IfcWall, Name="Wall-9"', Kind.TIMBER))
    said = 'a.toml: model.kinds[0]: IfcWall, Name="Wall-9" selects no part of the model, so it changes nothing'
    assert said in found.notes
    with pytest.raises(SelectionError, match=r"a\.toml: model\.kinds\[0\]: select .*IfcWal.: IFC4 has no class IfcWal"):
        read(model, says("IfcWal", Kind.TIMBER))


def test_the_rules_of_the_defaults_leave_a_stated_way_alone(maker: Any, tmp_path: Path) -> None:
    made = maker()
    made.box("IfcBeam", (0, 0, 0), (4, 0.3, 0.5), Name="Beam-1")
    made.box("IfcPlate", (9, 0, 0), (0.1, 0.1, 0.05), Name="Nut-1")
    made.box("IfcBuildingElementProxy", (9, 9, 0), (1, 1, 1), Name="Box-1")
    path = made.write(tmp_path / "m.ifc")
    assert {one.name: one.role for one in read(path).elements} == {
        "Beam-1": Role.COMPONENT, "Nut-1": Role.FITTING, "Box-1": Role.FITTING,
    }  # fmt: skip
    found = read(path, says("IfcPlate + IfcBuildingElementProxy", means="crane"))
    assert {one.role for one in found.elements} == {Role.COMPONENT}
    every = read(path, says("IfcPlate + IfcBuildingElementProxy + IfcBeam", means="crane"))
    assert {one.role for one in every.elements} == {Role.COMPONENT}
    assert not any("class that is lifted" in note for note in every.notes)


@pytest.mark.parametrize(("stated_kg", "kg"), [(44.0, 1500.0), (15_000.0, 15_000.0), (1.5, 1500.0), (-9.0, 1500.0)])
def test_of_a_doubtful_mass_the_greater_one_counts_until_the_site_file_says_what_a_part_weighs(
    maker: Any, tmp_path: Path, stated_kg: float, kg: float
) -> None:
    made = maker()
    plank = made.box("IfcSlab", (0, 0, 3), (4, 1, 0.15), Name="Plank", global_id="3nHd8ZlQ1BDPNs$oYbZrGQ")
    made.material(plank, "Prefab concrete C45/55")
    made.properties(plank, "Qto_SlabBaseQuantities", NetWeight=stated_kg)
    path = made.write(tmp_path / "m.ifc")
    found = called(read(path), "Plank")
    assert found.mass_kg == pytest.approx(kg)
    assert found.doubted_kg == (stated_kg, pytest.approx(1500.0))
    said = Correction("3nHd8ZlQ1BDPNs$oYbZrGQ", None, None, "a.toml: component[0]", one_part=True, mass_kg=700.0)
    after = called(read(path, said), "Plank")
    assert (after.mass_kg, after.mass_source, after.doubted_kg) == (700.0, "quantity", ())
    assert after.judgement == found.judgement


@pytest.mark.parametrize("order", [("EPS insulation", "Prefab concrete"), ("Prefab concrete", "EPS insulation")])
def test_without_shares_a_part_is_of_what_is_not_insulation(maker: Any, tmp_path: Path, order: tuple[str, str]) -> None:
    """An insulated plank whose materials are a list: taken as insulation, it would be set by hand."""
    made = maker()
    plank = made.box("IfcSlab", (0, 0, 3), (4, 1, 0.15), Name="Plank")
    listed = made.file.create_entity(
        "IfcMaterialList", [made.file.create_entity("IfcMaterial", Name=name) for name in order]
    )
    made.rooted("IfcRelAssociatesMaterial", RelatedObjects=[plank], RelatingMaterial=listed)
    found = called(read(made.write(tmp_path / "m.ifc")), "Plank")
    assert (found.judgement.kind, found.material) == (Kind.PRECAST, "Prefab concrete")
    assert found.mass_kg == pytest.approx(0.6 * 2500.0)
