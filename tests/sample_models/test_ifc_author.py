from __future__ import annotations

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.unit
import numpy as np
import pytest

from sample_models.ifc_author import IfcAuthor
from sample_models.ifc_entities import ACROSS_Y, ALONG_X


def bounds(ifc: IfcAuthor, product: object) -> list[list[float]]:
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    vertices = np.reshape(ifcopenshell.geom.create_shape(settings, product).geometry.verts, (-1, 3))
    return np.round([vertices.min(axis=0), vertices.max(axis=0)], 6).tolist()


def test_global_ids_depend_on_project_class_and_name_alone() -> None:
    first = IfcAuthor("one").rooted("IfcColumn", "A")
    later = IfcAuthor("one", schema="IFC2X3", units_per_metre=1000)
    later.rooted("IfcColumn", "B")
    assert later.rooted("IfcColumn", "A").GlobalId == first.GlobalId
    assert IfcAuthor("two").rooted("IfcColumn", "A").GlobalId != first.GlobalId
    assert later.rooted("IfcBeam", "A").GlobalId != first.GlobalId


@pytest.mark.parametrize("units_per_metre", [1, 1000])
def test_lengths_are_given_in_metres_whatever_the_unit(units_per_metre: int) -> None:
    ifc = IfcAuthor("one", units_per_metre=units_per_metre)
    storey = ifc.storey("0", 3.0, within=ifc.spatial("IfcBuilding", "B", (0, 0, 0.5)))
    part = ifc.product(
        "IfcBeam", "A", (1, 2, 0), within=storey, body=ifc.body_of([ifc.box((0, 0, 0), (0.1, 0.2, 0.3))])
    )
    assert bounds(ifc, part) == [[1, 2, 3.5], [1.1, 2.2, 3.8]]
    assert storey.Elevation == 3.0 * units_per_metre
    assert ifcopenshell.util.unit.calculate_unit_scale(ifc.file) == pytest.approx(1 / units_per_metre)


def test_outlines_in_upright_planes() -> None:
    ifc = IfcAuthor("one")
    storey = ifc.storey("0", 0.0, within=ifc.spatial("IfcBuilding", "B"))
    outline = [(1.0, 2.0), (3.0, 2.0), (3.0, 5.0)]
    across = ifc.extrusion(ifc.polygon(outline), 7.0, (0, 10, 0), ACROSS_Y)
    along = ifc.extrusion(ifc.polygon(outline), 7.0, (0, 0, 0), ALONG_X)
    first = ifc.product("IfcBeam", "A", within=storey, body=ifc.body_of([across]))
    second = ifc.product("IfcBeam", "B", within=storey, body=ifc.body_of([along]))
    assert bounds(ifc, first) == [[1, 3, 2], [3, 10, 5]]
    assert bounds(ifc, second) == [[0, 1, 2], [7, 3, 5]]


@pytest.mark.parametrize(
    ("quarter_turns", "expected"),
    [
        (0, [[10, 20, 0], [13, 21, 1]]),
        (1, [[9, 20, 0], [10, 23, 1]]),
        (2, [[7, 19, 0], [10, 20, 1]]),
        (3, [[10, 17, 0], [11, 20, 1]]),
    ],
)
def test_occurrences_repeat_their_type_in_quarter_turns(quarter_turns: int, expected: list[list[float]]) -> None:
    ifc = IfcAuthor("one")
    storey = ifc.storey("0", 0.0, within=ifc.spatial("IfcBuilding", "B"))
    kind = ifc.product_type("IfcBeamType", "T", [ifc.box((0, 0, 0), (3, 1, 1))], PredefinedType="BEAM")
    part = ifc.occurrence(kind, "A", (10, 20, 0), within=storey, quarter_turns=quarter_turns)
    ifc.define_by_type(kind, [part])
    assert part.is_a() == "IfcBeam"
    assert ifcopenshell.util.element.get_type(part) == kind
    assert bounds(ifc, part) == expected


def test_rounding_noise_is_not_written() -> None:
    ifc = IfcAuthor("one", units_per_metre=1000)
    assert ifc.point((0.1 + 0.2, -0.0)).Coordinates == (300.0, 0.0)
    assert ifc.point((0.3, 0.0)) == ifc.point((0.1 + 0.2, 0.0))
    assert "-0." not in ifc.to_bytes("one.ifc").decode()
