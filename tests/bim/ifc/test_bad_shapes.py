"""Models that no program should write: each gives a building of its good parts, and one note on the others."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bimvox.bim.building import Building, Role
from bimvox.bim.read import read_building

from ..conftest import IfcMaker

Spoil = Callable[[IfcMaker, Any], None]


def direction(made: IfcMaker, *ratios: float) -> Any:
    return made.file.create_entity("IfcDirection", list(ratios))


def without_axis(made: IfcMaker, part: Any) -> None:
    part.ObjectPlacement.RelativePlacement.Axis = direction(made, 0.0, 0.0, 0.0)


def without_reference(made: IfcMaker, part: Any) -> None:
    part.ObjectPlacement.RelativePlacement.Axis = direction(made, 0.0, 0.0, 1.0)
    part.ObjectPlacement.RelativePlacement.RefDirection = direction(made, 0.0, 0.0, 0.0)


def parallel_axes(made: IfcMaker, part: Any) -> None:
    without_reference(made, part)
    part.ObjectPlacement.RelativePlacement.RefDirection = direction(made, 0.0, 0.0, 1.0)


def extruded_nowhere(made: IfcMaker, part: Any) -> None:
    part.Representation.Representations[0].Items[0].ExtrudedDirection = direction(made, 0.0, 0.0, 0.0)


def two_parts(made: IfcMaker) -> Any:
    made.box("IfcColumn", Name="good")
    return made.box("IfcBeam", (5.0, 0.0, 0.0), Name="bad")


@pytest.mark.parametrize("spoil", [without_axis, without_reference, parallel_axes, extruded_nowhere])
def test_a_direction_without_a_length_costs_its_part_at_most(
    spoil: Spoil, maker: type[IfcMaker], tmp_path: Path
) -> None:
    made = maker()
    spoil(made, two_parts(made))
    only_the_good_one(read_building(made.write(tmp_path / "a.ifc")))


@pytest.mark.parametrize("emptied", ["IFCPOLYLOOP", "IFCFACE", "IFCCLOSEDSHELL"])
def test_faces_of_no_points_cost_their_part_at_most(emptied: str, maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    made.box("IfcColumn", Name="good")
    made.box("IfcBeam", (5.0, 0.0, 0.0), inside_out=True, Name="bad")
    path = made.write(tmp_path / "a.ifc")
    path.write_text(re.sub(rf"(={emptied}\()\([^)]*\)", r"\1()", path.read_text()))
    only_the_good_one(read_building(path))


def only_the_good_one(building: Building) -> None:
    assert [one.name for one in building.elements] == ["good"]
    (note,) = [note for note in building.notes if "left out" in note]
    assert "bad" in note
    assert "\n" not in note
    assert "#" not in note


def test_products_that_fail_alike_share_a_note(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    made.box("IfcColumn", Name="good")
    for index in range(5):
        extruded_nowhere(made, made.box("IfcBeam", (5.0 * index, 5.0, 0.0), Name=f"bad {index}"))
    (note,) = [note for note in read_building(made.write(tmp_path / "a.ifc")).notes if "left out" in note]
    assert note.startswith("5 products are left out")


def test_inches_in_an_old_schema(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker("IFC2X3", "ft")
    made.box("IfcBeam", size_m=(6.0, 0.3, 0.4))
    (unit,) = made.file.by_type("IfcConversionBasedUnit")
    unit.Name = "INCH"
    unit.ConversionFactor.ValueComponent = made.file.create_entity("IfcLengthMeasure", 0.3048 / 12.0)
    building = read_building(made.write(tmp_path / "a.ifc"))
    assert building.source.unit == "in"
    size_m = building.elements[0].mesh.bounds_m[1] - building.elements[0].mesh.bounds_m[0]
    assert size_m.tolist() == pytest.approx([0.5, 0.025, 0.4 / 12.0])


@pytest.mark.parametrize("factor", [1e9, 1e-9])
@pytest.mark.parametrize("inside_out", [False, True])
def test_a_stated_volume_a_billion_times_too_large_or_small_makes_no_mass(
    factor: float, inside_out: bool, maker: type[IfcMaker], tmp_path: Path
) -> None:
    made = maker()
    beam = made.box("IfcBeam", size_m=(6.0, 0.3, 0.4), inside_out=inside_out)
    stated = made.file.create_entity("IfcQuantityVolume", Name="NetVolume", VolumeValue=0.72 * factor)
    values = made.rooted("IfcElementQuantity", Name="Qto_BeamBaseQuantities", Quantities=[stated])
    made.rooted("IfcRelDefinesByProperties", RelatedObjects=[beam], RelatingPropertyDefinition=values)
    (element,) = read_building(made.write(tmp_path / "a.ifc")).elements
    assert element.mass_kg == pytest.approx(0.72 * 2400.0, rel=0.01)


@pytest.mark.parametrize("copies", [3, pytest.param(200, marks=pytest.mark.slow)])
def test_coincident_copies_are_one_part_with_one_note(copies: int, maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    for index in range(copies):
        made.box("IfcColumn", (0.0, 0.0, 0.0), (0.3, 0.3, 3.0), Name=f"column {index}")
        made.box("IfcBeam", (0.0, 0.0, 3.0), (6.0, 0.3, 0.4), Name=f"beam {index}", inside_out=index % 2 == 1)
    building = read_building(made.write(tmp_path / "a.ifc"))
    assert [one.name for one in building.elements if one.role is Role.COMPONENT] == ["column 0", "beam 0"]
    (note,) = [note for note in building.notes if "duplicates" in note]
    assert note.startswith(f"{2 * copies - 2} parts")
