"""IFC to building, end to end, on files that the tests make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bimvox.bim.building import Building, Element, Role
from bimvox.bim.ifc import geometry
from bimvox.bim.options import MOST_SELECT
from bimvox.bim.read import ReadOptions, read_building
from bimvox.errors import IfcError, InputError, SelectionError

from ..conftest import IfcMaker


@pytest.fixture(scope="module")
def frame(frame_file: Path) -> Building:
    return read_building(frame_file)


def by_name(building: Building) -> dict[str, Element]:
    return {element.name: element for element in building.elements}


def test_roles_and_skipped(frame: Building) -> None:
    assert {element.name: element.role for element in frame.elements} == {
        "C0": Role.COMPONENT,
        "C5": Role.COMPONENT,
        "B1": Role.COMPONENT,
        "S1": Role.COMPONENT,
        "F1": Role.STRUCTURE,
        "D1": Role.FITTING,
        "tree": Role.FITTING,
    }
    assert [(product.ifc_class, product.name) for product in frame.skipped] == [
        ("IfcSpace", "room"),
        ("IfcDiscreteAccessory", "plate"),
    ]
    assert all(product.reason for product in frame.skipped)


def test_geometry_is_metres_outward_and_in_place(frame: Building) -> None:
    beam = by_name(frame)["B1"]
    assert beam.mesh.bounds_m == pytest.approx(np.array([[0, 0, 3], [5.3, 0.3, 3.4]]))
    assert beam.mesh.signed_volume_m3 == pytest.approx(5.3 * 0.3 * 0.4)
    assert beam.mesh.vertices_m.dtype == np.float64
    assert beam.mesh.faces.dtype == np.int32
    assert (frame.source.unit, frame.source.format) == ("mm", "IFC4")
    assert frame.origin_m.tolist() == [0, 0, 0]


def test_properties_and_masses(frame: Building) -> None:
    found = by_name(frame)
    assert (found["B1"].mass_kg, found["B1"].mass_source) == (1234.0, "quantity")
    assert found["C0"].mass_kg == pytest.approx(0.27 * 7850)
    assert (found["C0"].material, found["C0"].mass_source) == ("Steel S235", "density")
    assert found["S1"].mass_kg == pytest.approx(5.3 * 4 * 0.2 * 2400)
    assert found["S1"].mass_source == "default"
    assert [found[name].mass_uncertainty for name in ("B1", "C0", "S1")] == [0.03, 0.1, 0.25]
    assert found["C0"].storey == "Level 1"


def test_reading_twice_with_two_processes_gives_the_same_bytes(frame: Building, frame_file: Path) -> None:
    stages: list[tuple[str, int, int]] = []
    again = read_building(frame_file, ReadOptions(processes=2), lambda *step: stages.append(step))
    for a, b in zip(frame.elements, again.elements, strict=True):
        assert a.id == b.id
        assert a.mesh.vertices_m.tobytes() == b.mesh.vertices_m.tobytes()
        assert a.mesh.faces.tobytes() == b.mesh.faces.tobytes()
    assert [stage for stage, done, total in stages if done == total] == ["open", "geometry", "elements"]


def test_a_selection_lifts_only_what_it_names(frame_file: Path) -> None:
    building = read_building(frame_file, ReadOptions(select="IfcColumn, IfcDoor + IfcDiscreteAccessory"))
    roles = {element.name: element.role for element in building.elements}
    assert {name for name, role in roles.items() if role is Role.COMPONENT} == {"C0", "C5", "D1", "plate"}
    assert roles["S1"] is roles["B1"] is roles["F1"] is Role.STRUCTURE


@pytest.mark.parametrize(
    ("query", "said", "hint"),
    [
        ("IfcColum", "no class IfcColum", "IfcColumn"),
        ("IfcColumn, ,", "character", "written like"),
        ("IfcColumn, Name=nobody", "matches no product", "IfcColumn"),
        ("IfcWindow", "matches no product", "IfcDoor"),
        ("IfcSpace", "none of them solid", "columns"),
    ],
)
def test_wrong_selections_say_what_is_wrong(frame_file: Path, query: str, said: str, hint: str) -> None:
    with pytest.raises(SelectionError, match=said) as caught:
        read_building(frame_file, ReadOptions(select=query))
    assert query in str(caught.value)
    assert hint in (caught.value.hint or "")


@pytest.mark.parametrize(
    "query",
    ["Name=/(a+)+!/", "IfcBeam, Name=/(a|a)+!/", "IfcBeam, Name=/((((a*)*)*)*)*!/", 'IfcBeam, "Set"./(a+)+!/=1'],
)
def test_a_pattern_that_backtracks_for_ever_is_given_up(
    query: str, maker: type[IfcMaker], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(geometry, "SELECT_LIMIT_S", 0.25)
    made = maker()
    beam = made.box("IfcBeam", Name="a" * 60)
    made.properties(beam, "Set", **{"a" * 60: "1"})
    with pytest.raises(SelectionError, match=r"not finished within 0\.25 s") as caught:
        read_building(made.write(tmp_path / "a.ifc"), ReadOptions(select=query))
    assert "repetition" in (caught.value.hint or "")


@pytest.mark.parametrize(
    "query",
    ["(" * 9000, "IfcBeam, Name=" + "n" * 9000, "Ifc" + "m" * 9000, "é" * 9000, "IfcWall," * 1000, "IfcBeam, Name=/(/"],
)
def test_a_long_selection_is_not_repeated_in_its_message(query: str, frame_file: Path) -> None:
    with pytest.raises(SelectionError) as caught:
        read_building(frame_file, ReadOptions(select=query))
    assert len(str(caught.value)) < 600


@pytest.mark.slow
def test_the_longest_selection_is_read(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    ids = [made.box("IfcBeam", (2.0 * i, 0.0, 0.0)).GlobalId for i in range(400)]
    query = ", ".join(ids)
    assert MOST_SELECT - 1000 < len(query) <= MOST_SELECT
    elements = read_building(made.write(tmp_path / "a.ifc"), ReadOptions(select=query)).elements
    assert [element.role for element in elements] == [Role.COMPONENT] * len(ids)
    with pytest.raises(SelectionError, match="at most 10,000"):
        ReadOptions(select="a" * (MOST_SELECT + 1))


def test_the_same_frame_far_away_has_the_same_vertices(maker: type[IfcMaker], tmp_path: Path) -> None:
    buildings = []
    for name, far in (("near", (0.0, 0.0, 0.0)), ("far", (5_000_000.0, 450_000.0, 12.0))):
        made = maker(schema="IFC4", unit="mm", map_at=(100.0, 200.0, 3.0))
        place = made.file.create_entity("IfcLocalPlacement", None, made.placement(far))
        made.box("IfcColumn", (1.1, 2.2, 0.0), (0.3, 0.3, 3.0), under=place)
        wall = made.box("IfcWall", (1.4, 2.2, 0.0), (4.7, 0.2, 3.0), under=place)
        hole = made.box("IfcOpeningElement", (2.0, 2.1, 1.0), (1.0, 0.4, 1.0), under=place)
        made.rooted("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=hole)
        buildings.append(read_building(made.write(tmp_path / f"{name}.ifc")))
    near, far_away = buildings
    assert far_away.origin_m.tolist() == [5_000_001.0, 450_002.0, 0.0]
    assert near.elements[1].mesh.signed_volume_m3 == pytest.approx(4.7 * 0.2 * 3.0 - 0.2, abs=1e-9)
    shift = np.array([1.0, 2.0, -12.0])
    for a, b in zip(near.elements, far_away.elements, strict=True):
        assert b.mesh.vertices_m + shift == pytest.approx(a.mesh.vertices_m, abs=1e-8)
        assert np.array_equal(a.mesh.faces, b.mesh.faces)
    assert near.georeference["crs"] == "EPSG:28992"
    assert near.georeference["eastings_m"] == pytest.approx(0.1)


def test_oddities_of_real_files(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker(schema="IFC2X3", unit="ft")
    twin = "0000000000000000000001"
    made.box("IfcBeam", (0, 0, 0), (3.048, 0.3, 0.3), global_id=twin, Name="first")
    second = made.box("IfcBeam", (0, 1, 0), (3.048, 0.3, 0.3), global_id=twin, Name="second")
    made.properties(second, "Tekla Quantity", Weight=5.0e9)
    made.box("IfcWall", (0, 2, 0), (1, 1, 1), inside_out=True, Name="inverted")
    old = made.box("IfcWall", (3, 2, 0), (1, 1, 1), Name="old")
    made.properties(old, "Pset_WallCommon", Status="EXISTING")
    made.box("IfcBuildingElementProxy", (6, 0, 0), (1, 1, 1), Name="Excavator 3")
    made.box("IfcBeam", (7, 0, 0), (0.02, 0.02, 0.02), Name="nut")
    axis_only = made.box("IfcColumn", (8, 0, 0), (1, 1, 1), Name="axis only")
    ends = [made.file.create_entity("IfcCartesianPoint", [0.0, 0.0, z]) for z in (0.0, 1.0)]
    line = made.file.create_entity("IfcPolyline", ends)
    shape = axis_only.Representation.Representations[0]
    shape.RepresentationIdentifier, shape.RepresentationType, shape.Items = "Axis", "Curve3D", [line]
    building = read_building(made.write(tmp_path / "odd.ifc"))
    found = by_name(building)
    assert building.source.unit == "ft"
    assert found["first"].mesh.bounds_m[1, 0] == pytest.approx(3.048)
    assert found["first"].id == twin
    assert found["second"].id == f"{twin}#{second.id()}"
    assert found["second"].global_id == twin
    assert found["second"].mass_source == "default"
    assert found["inverted"].mesh.signed_volume_m3 == pytest.approx(1.0)
    assert found["old"].role is found["Excavator 3"].role is Role.STRUCTURE
    assert found["nut"].role is Role.FITTING
    assert [product.name for product in building.skipped] == ["axis only"]
    assert "Axis" in building.skipped[0].reason
    text = " ".join(building.notes)
    assert "more than once" in text
    assert "above five times what volume and material say" in text
    assert found["second"].doubted_kg == (5.0e9, pytest.approx(found["second"].mass_kg))


def test_assemblies_whole_and_in_parts(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    parts = [made.box("IfcBeam", (x, 0, 0), (1, 0.3, 0.3), Name=f"part {x}") for x in (0, 1)]
    assembly = made.rooted("IfcElementAssembly", Name="girder")
    made.aggregate(assembly, parts)
    made.properties(parts[0], "Pset", Weight=300.0)
    path = made.write(tmp_path / "assembly.ifc")
    (whole,) = read_building(path).elements
    assert (whole.name, whole.ifc_class, whole.role) == ("girder", "IfcElementAssembly", Role.COMPONENT)
    assert whole.members == tuple(part.GlobalId for part in parts)
    assert whole.mesh.bounds_m[1].tolist() == pytest.approx([2, 0.3, 0.3])
    assert whole.mass_kg == pytest.approx(300.0 + 0.09 * 2400)
    assert whole.mass_source == "default"
    single = read_building(path, ReadOptions(assemblies="parts", select='IfcBeam, Name="part 1"')).elements
    assert [(element.name, element.role) for element in single] == [
        ("part 0", Role.STRUCTURE),
        ("part 1", Role.COMPONENT),
    ]


def test_a_file_of_proxies_lifts_its_proxies(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    made.box("IfcBuildingElementProxy", Name="block")
    made.box("IfcBuildingElementProxy", (3, 0, 0), Name="terrain")
    building = read_building(made.write(tmp_path / "proxies.ifc"))
    assert {element.name: element.role for element in building.elements} == {
        "block": Role.COMPONENT,
        "terrain": Role.GROUND,
    }
    assert any("proxies" in note for note in building.notes)


def test_a_file_of_reinforcement_alone_is_read(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    made.box("IfcReinforcingBar", (0, 0, 0), (0.02, 0.02, 3.0))
    made.box("IfcDiscreteAccessory", (1, 0, 0), (0.1, 0.1, 0.1))
    made.box("IfcSpace")
    building = read_building(made.write(tmp_path / "bars.ifc"))
    assert [element.role for element in building.elements] == [Role.FITTING, Role.FITTING]
    assert [product.ifc_class for product in building.skipped] == ["IfcSpace"]
    assert any("so these were read: 2 products" in note for note in building.notes)


def test_nothing_solid_and_a_contradicting_unit_are_errors(
    maker: type[IfcMaker], tmp_path: Path, frame_file: Path
) -> None:
    made = maker()
    made.box("IfcSpace")
    with pytest.raises(IfcError, match="nothing solid"):
        read_building(made.write(tmp_path / "spaces.ifc"))
    with pytest.raises(InputError, match="mm"):
        read_building(frame_file, ReadOptions(unit="m"))


def test_what_is_demolished_is_named_and_temporary_works_are_no_parts(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    for n, status in enumerate(("NEW", "DEMOLISH", "TEMPORARY")):
        wall = made.box("IfcWall", (3.0 * n, 0, 0), (2, 0.2, 3), Name=status.lower())
        made.properties(wall, "Pset_WallCommon", Status=status)
    building = read_building(made.write(tmp_path / "status.ifc"))
    roles = {name: element.role for name, element in by_name(building).items()}
    assert roles == {"new": Role.COMPONENT, "demolish": Role.STRUCTURE, "temporary": Role.FITTING}
    assert any("parts to be demolished" in note and "1 (demolish)" in note for note in building.notes)
