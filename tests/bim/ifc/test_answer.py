"""Shapes are cleaned and measured in the worker, and placed without loss of precision."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ifcopenshell
import numpy as np
import pytest

from bimvox.bim.building import TriangleMesh
from bimvox.bim.ifc.answer import PlacedShape, Shape, clean_shape, shape_groups
from bimvox.bim.ifc.geometry import GeometryPool
from bimvox.bim.mesh.repair import Solid

from ..conftest import IfcMaker

CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), dtype=float).reshape(3, -1).T
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([half for a, b, c, d in QUADS for half in ((a, b, c), (a, c, d))], dtype=np.int32)


def test_an_inside_out_box_with_waste_is_cleaned() -> None:
    vertices = np.concatenate([[[9.0, 9.0, 9.0]], CORNERS])
    faces = np.concatenate([FACES[:, ::-1] + 1, [[1, 1, 2]]]).astype(np.int32)
    shape = clean_shape(vertices, faces)
    assert isinstance(shape, Shape)
    assert (shape.solid.volume_m3, shape.solid.exact, shape.dropped, shape.turned) == (1.0, True, 1, True)
    assert shape.mesh.signed_volume_m3 > 0
    assert np.array_equal(shape.mesh.vertices_m, CORNERS)


def test_shapes_that_are_not_a_surface_say_why() -> None:
    assert clean_shape(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)) == "no triangles"
    flat = clean_shape(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    assert flat == "its triangles have no area"


def test_far_placements_keep_their_precision() -> None:
    vertices = np.random.default_rng(0).uniform(-5, 5, (50, 3))
    shape = Shape(TriangleMesh(vertices, np.array([[0, 1, 2]], dtype=np.int32)), Solid(0.0, False, 0.0), 0, False)
    near, far = np.eye(4), np.eye(4)
    far[:3, 3] = origin = np.array([5_000_000.0, 450_000.0, 0.0])
    a = PlacedShape(shape, near).mesh(np.zeros(3))
    b = PlacedShape(shape, far).mesh(origin)
    assert np.array_equal(a.vertices_m, b.vertices_m)


def mapped(made: IfcMaker, source: Any, ifc_class: str, at_m: tuple[float, float, float], scale: float = 1.0) -> Any:
    """Make a product that maps a representation with its own transformation."""
    file = made.file
    origin = file.create_entity("IfcCartesianPoint", [0.0, 0.0, 0.0])
    target = file.create_entity("IfcCartesianTransformationOperator3D", LocalOrigin=origin, Scale=scale)
    item = file.create_entity("IfcMappedItem", source, target)
    shape = file.create_entity("IfcShapeRepresentation", made.context, "Body", "MappedRepresentation", [item])
    product = made.box(ifc_class, at_m)
    product.Representation = file.create_entity("IfcProductDefinitionShape", Representations=[shape])
    return product


@pytest.fixture
def catalogue(maker: type[IfcMaker], tmp_path: Path) -> tuple[Path, list[int]]:
    """Four equal mapped columns, a larger one, one with an opening, a beam of the same shape, a plain box."""
    made = maker()
    body = made.file.create_entity(
        "IfcShapeRepresentation", made.context, "Body", "Brep", [made.brep((1, 2, 3), False)]
    )
    source = made.file.create_entity("IfcRepresentationMap", made.placement((0.0, 0.0, 0.0)), body)
    products = [mapped(made, source, "IfcColumn", (5.0 * index, 0.0, 0.0)) for index in range(4)]
    products.append(mapped(made, source, "IfcColumn", (0.0, 9.0, 0.0), scale=2.0))
    products.append(mapped(made, source, "IfcColumn", (9.0, 9.0, 0.0)))
    opening = made.box("IfcOpeningElement", (9.2, 9.2, -1.0), (0.5, 0.5, 9.0))
    made.rooted("IfcRelVoidsElement", RelatingBuildingElement=products[-1], RelatedOpeningElement=opening)
    products.append(mapped(made, source, "IfcBeam", (0.0, 20.0, 0.0)))
    products.append(made.box("IfcColumn", (30.0, 0.0, 0.0)))
    return made.write(tmp_path / "a.ifc"), [product.id() for product in products]


def test_who_shares(catalogue: tuple[Path, list[int]]) -> None:
    path, ids = catalogue
    groups = shape_groups(ifcopenshell.open(path), ids)
    assert groups == [tuple(ids[:4]), *((step_id,) for step_id in ids[4:])]


def test_shared_equals_alone(catalogue: tuple[Path, list[int]]) -> None:
    path, ids = catalogue
    with GeometryPool(path, timeout_s=60.0) as workers:
        together = workers.mesh(shape_groups(ifcopenshell.open(path), ids))
        alone = workers.mesh([(step_id,) for step_id in ids])
    assert not together.failures
    for step_id in ids:
        one, other = together.shapes[step_id], alone.shapes[step_id]
        assert np.array_equal(one.mesh(np.zeros(3)).vertices_m, other.mesh(np.zeros(3)).vertices_m)
        assert np.array_equal(one.shape.mesh.faces, other.shape.mesh.faces)
    assert together.shapes[ids[4]].shape.solid.volume_m3 == pytest.approx(48.0)
    assert together.shapes[ids[5]].shape.solid.volume_m3 == pytest.approx(6.0 - 0.75)


def test_the_parts_of_a_whole_with_an_opening_are_meshed_alone(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    wall = made.box("IfcWall")
    parts = [made.box("IfcBuildingElementPart", (float(index), 0, 0)) for index in range(3)]
    for part in parts[1:]:
        part.Representation = parts[0].Representation
    made.aggregate(wall, parts[:2])
    opening = made.box("IfcOpeningElement", (0.2, 0.2, -1.0), (0.5, 0.5, 9.0))
    made.rooted("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=opening)
    path = made.write(tmp_path / "a.ifc")
    ids = [part.id() for part in parts]
    assert shape_groups(ifcopenshell.open(path), ids) == [(step_id,) for step_id in ids]
