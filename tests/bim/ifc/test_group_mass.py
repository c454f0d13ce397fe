"""Masses of wholes with parts."""

from __future__ import annotations

from math import cos, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bimvox.bim.building import Building, Element, TriangleMesh
from bimvox.bim.ifc.assembly import Aggregation, Extent, MeshedProduct
from bimvox.bim.ifc.group_mass import GroupMasses, share_inside
from bimvox.bim.ifc.group_mass import _doubted_kg as doubted
from bimvox.bim.ifc.mass import ASSEMBLY_LOW, REPEATED, REPEATED_WHOLE, WEIGHT_DOUBTFUL, WEIGHT_SLIP, Mass, Masses
from bimvox.bim.ifc.properties import Properties
from bimvox.bim.mesh.repair import Solid
from bimvox.bim.options import ReadOptions
from bimvox.bim.read import read_building

from ..conftest import IfcMaker

CONCRETE_KG = 4.0 * 0.3 * 3.0 * 2500.0


def read(made: IfcMaker, tmp_path: Path, **options: Any) -> tuple[Building, dict[str, Element]]:
    building = read_building(made.write(tmp_path / "a.ifc"), ReadOptions(**options))
    return building, {element.name: element for element in building.elements}


def wall(made: IfcMaker, ifc_class: str = "IfcElementAssembly", **attributes: Any) -> Any:
    whole = made.box(ifc_class, size_m=(4.0, 0.3, 3.0), Name="W", **attributes)
    made.material(whole, "Concrete C30/37")
    return whole


def leaves(made: IfcMaker, materials: tuple[str | None, ...], ifc_class: str = "IfcWall") -> list[Any]:
    made_parts = []
    for (y, thick), material in zip(((0.0, 0.08), (0.08, 0.14), (0.22, 0.08)), materials, strict=True):
        made_parts.append(made.box(ifc_class, (0, y, 0), (4.0, thick, 3.0), Name=f"leaf {y:g}"))
        if material is not None:
            made.material(made_parts[-1], material)
    return made_parts


def has_note(building: Building, start: str) -> bool:
    return any(note.startswith(start) for note in building.notes)


def test_a_doubtful_plate_in_a_panel_makes_the_panel_not_doubtful() -> None:
    panel = Mass(10_000.0, "quantity")
    assert doubted([panel, Mass(40.0, "quantity", doubted_kg=(2.0, 40.0))]) == ()
    assert doubted([panel, panel]) == ()
    half = Mass(9_000.0, "material", doubted_kg=(90.0, 9_000.0))
    assert doubted([panel, half]) == (10_090.0, 19_000.0)


@pytest.mark.parametrize("ifc_class", ["IfcElementAssembly", "IfcWall"])
@pytest.mark.parametrize("material", ["Concrete C30/37", None])
def test_parts_that_repeat_the_body_of_their_whole_do_not_count_twice(
    ifc_class: str, material: str | None, tmp_path: Path
) -> None:
    made = IfcMaker()
    made.aggregate(wall(made, ifc_class), leaves(made, (material,) * 3, "IfcBuildingElementPart"))
    building, found = read(made, tmp_path)
    assert list(found) == ["W"]
    assert found["W"].mass_kg == pytest.approx(CONCRETE_KG)
    assert found["W"].mesh.signed_volume_m3 == pytest.approx(3.6)
    assert len(found["W"].members) == 4
    assert has_note(building, REPEATED)


def test_a_part_in_its_whole_weighs_what_its_own_material_weighs(tmp_path: Path) -> None:
    made = IfcMaker()
    made.aggregate(wall(made), leaves(made, ("Concrete", "EPS", "Concrete")))
    building, found = read(made, tmp_path)
    assert found["W"].mass_kg == pytest.approx(4.0 * 3.0 * (0.16 * 2500.0 + 0.14 * 40.0), rel=1e-3)
    assert has_note(building, REPEATED)


def test_a_part_outside_the_body_of_its_whole_adds_to_it(tmp_path: Path) -> None:
    made = IfcMaker()
    corbel = made.box("IfcBuildingElementPart", (1.0, 0.3, 1.0), (2.0, 0.3, 0.5), Name="corbel")
    made.material(corbel, "Concrete")
    made.aggregate(wall(made), [corbel])
    building, found = read(made, tmp_path)
    assert found["W"].mass_kg == pytest.approx(CONCRETE_KG + 750.0)
    assert found["W"].mesh.signed_volume_m3 == pytest.approx(3.9)
    assert not has_note(building, REPEATED)


@pytest.mark.parametrize(("stated_kg", "kg"), [(9000.0, 9750.0), (9750.0, 9750.0), (10_000.0, 10_000.0)])
def test_a_weight_stated_for_a_whole_is_of_what_it_fits(stated_kg: float, kg: float, tmp_path: Path) -> None:
    made = IfcMaker()
    corbel = made.box("IfcBuildingElementPart", (1.0, 0.3, 1.0), (2.0, 0.3, 0.5), Name="corbel")
    made.material(corbel, "Concrete")
    whole = wall(made)
    made.properties(whole, "Qto", NetWeight=stated_kg)
    made.aggregate(whole, [corbel])
    _, found = read(made, tmp_path)
    assert found["W"].mass_kg == pytest.approx(kg)
    assert found["W"].mass_source == ("density" if stated_kg == 9000.0 else "quantity")


@pytest.mark.parametrize(
    ("ifc_class", "part_class", "options"),
    [("IfcStair", "IfcStairFlight", {}), ("IfcRoof", "IfcSlab", {}), ("IfcWall", "IfcWall", {"assemblies": "parts"})],
)
def test_a_whole_that_its_parts_repeat_is_left_out_if_these_are_lifted(
    ifc_class: str, part_class: str, options: dict[str, Any], tmp_path: Path
) -> None:
    made = IfcMaker()
    made.aggregate(wall(made, ifc_class), leaves(made, ("Concrete",) * 3, part_class))
    building, found = read(made, tmp_path, **options)
    assert sum(element.mass_kg for element in found.values()) == pytest.approx(CONCRETE_KG)
    assert "W" not in found
    assert [product.name for product in building.skipped] == ["W"]
    assert has_note(building, REPEATED_WHOLE)


def truss(made: IfcMaker, stated_kg: tuple[float | None, ...] = (None, None, None)) -> Any:
    """Make an assembly of three bars, 1,020.5 kg by volume."""
    bars = []
    for (at, size), kg in zip(
        (((0, 0, 0), (6, 0.1, 0.1)), ((0, 0, 0.1), (0.1, 0.1, 1)), ((0, 0, 1.1), (6, 0.1, 0.1))), stated_kg, strict=True
    ):
        bars.append(made.box("IfcMember", at, size, Name="bar"))
        made.material(bars[-1], "S355")
        if kg is not None:
            made.properties(bars[-1], "Qto", NetWeight=kg)
    whole = made.rooted("IfcElementAssembly", Name="T", AssemblyPlace="FACTORY")
    made.aggregate(whole, bars)
    return whole


@pytest.mark.parametrize(
    ("of_whole", "of_parts", "kg", "source", "note"),
    [
        (1500.0, (None, None, None), 1500.0, "quantity", None),
        (1.5, (None, None, None), 1500.0, "quantity", WEIGHT_SLIP),
        (1.5e9, (None, None, None), 1020.5, "density", WEIGHT_DOUBTFUL),
        (1500.0, (480.0, 80.0, 480.0), 1500.0, "quantity", None),
        (800.0, (480.0, 80.0, 480.0), 1040.0, "quantity", ASSEMBLY_LOW),
        (1035.0, (480.0, 80.0, 480.0), 1040.0, "quantity", None),
        (700.0, (480.0, None, 480.0), 1038.5, "density", ASSEMBLY_LOW),
        (None, (480.0, 80.0, 480.0), 1040.0, "quantity", None),
    ],
)
def test_the_weight_of_an_assembly(
    of_whole: float | None,
    of_parts: tuple[float | None, ...],
    kg: float,
    source: str,
    note: str | None,
    tmp_path: Path,
) -> None:
    made = IfcMaker()
    whole = truss(made, of_parts)
    if of_whole is not None:
        made.properties(whole, "Qto", NetWeight=of_whole)
    building, found = read(made, tmp_path)
    assert found["T"].mass_kg == pytest.approx(kg)
    assert found["T"].mass_source == source
    assert [has_note(building, one) for one in (WEIGHT_SLIP, WEIGHT_DOUBTFUL, ASSEMBLY_LOW)] == [
        note == one for one in (WEIGHT_SLIP, WEIGHT_DOUBTFUL, ASSEMBLY_LOW)
    ]


def test_the_weight_of_an_assembly_within_an_assembly_and_of_one_with_a_single_part(tmp_path: Path) -> None:
    made = IfcMaker()
    inner = truss(made)
    made.properties(inner, "Qto", NetWeight=1500.0)
    post = made.box("IfcMember", (5.9, 0, 0.1), (0.1, 0.1, 1.0), Name="post")
    made.material(post, "S355")
    outer = made.rooted("IfcElementAssembly", Name="outer")
    made.aggregate(outer, [inner, post])
    column = made.box("IfcColumn", (20, 0, 0), (0.5, 0.5, 2.0), Name="column")
    single = made.rooted("IfcElementAssembly", Name="single")
    made.properties(single, "Qto", NetWeight=1300.0)
    made.aggregate(single, [column])
    _, found = read(made, tmp_path)
    assert found["outer"].mass_kg == pytest.approx(1578.5)
    assert (found["column"].mass_kg, found["column"].mass_source) == (1300.0, "quantity")


@pytest.mark.slow
def test_wholes_may_be_nested_deeper_than_the_interpreter_calls() -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    whole = beam
    for _ in range(1200):
        part, whole = whole, made.rooted("IfcElementAssembly")
        made.aggregate(whole, [part])
    made.properties(whole, "Qto", NetWeight=3000.0)
    mesh = TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32))
    extent = Extent(np.zeros(3), np.ones(3), 1.0)
    parts = {beam.id(): MeshedProduct(mesh, extent, Solid(1.0, True, 0.0))}
    aggregation = Aggregation(made.file, {beam.id(): extent}, lambda product: False)
    masses = GroupMasses(made.file, Masses(made.file, Properties()), parts, aggregation.parts_of)
    (group,) = aggregation.parts()
    weighed = masses.weigh(aggregation.highest_of(group), group.members)
    assert weighed is not None
    assert (weighed.mass.kg, weighed.mass.source) == (3000.0, "quantity")


_FACES = np.array(
    [
        *((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4)),
        *((2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)),
    ],
    np.int32,
)


def box(low: tuple[float, float, float], high: tuple[float, float, float], turned: float = 0.0) -> TriangleMesh:
    corners = np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for k, j, i in np.ndindex(2, 2, 2)])
    c, s = cos(radians(turned)), sin(radians(turned))
    return TriangleMesh(corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), _FACES)


def test_the_box_itself_looks_outward() -> None:
    assert box((0, 0, 0), (1, 2, 3)).signed_volume_m3 == pytest.approx(6.0)


@pytest.mark.parametrize("turned", [0.0, 30.0, 45.0])
def test_shares_of_a_leaf_in_its_wall(turned: float) -> None:
    wall = box((0, 0, 0), (4, 0.3, 3), turned)
    assert share_inside(box((0, 0, 0), (4, 0.08, 3), turned), wall) == pytest.approx(1.0)
    assert share_inside(wall, wall) == pytest.approx(1.0)
    assert share_inside(box((0, 0, 2), (4, 0.3, 4), turned), wall) == pytest.approx(0.5)
    assert share_inside(box((0, 0, 3), (4, 0.3, 4), turned), wall) == 0.0
    assert share_inside(box((9, 0, 0), (10, 0.3, 3), turned), wall) == 0.0
    assert share_inside(box((0, 0.3, 0), (4, 0.5, 3), turned), wall) == pytest.approx(0.0, abs=0.01)


def test_what_fills_a_cavity_is_not_inside() -> None:
    hole = box((1, 1, 1), (2, 2, 2))
    hollow = TriangleMesh.joined([box((0, 0, 0), (3, 3, 3)), TriangleMesh(hole.vertices_m, hole.faces[:, ::-1])])
    assert share_inside(hole, hollow) == 0.0
    assert share_inside(box((0, 0, 0), (1, 3, 3)), hollow) == pytest.approx(1.0)


def test_bodies_that_overlap_in_one_mesh_are_solid() -> None:
    both = TriangleMesh.joined([box((0, 0, 0), (2, 1, 2)), box((0, 0, 1), (2, 1, 3))])
    assert share_inside(box((0, 0, 0), (2, 1, 3)), both) == pytest.approx(1.0)
