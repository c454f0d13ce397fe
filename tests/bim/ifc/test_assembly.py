"""Which products form one lift."""

from __future__ import annotations

from typing import Any

import ifcopenshell
import ifcopenshell.guid
import numpy as np
import pytest
from box_buildings import box_element

from bimvox.bim.ifc.assembly import Aggregation, Extent, Group, anchors_without_mesh, hang_together, points_of_group

from ..conftest import IfcMaker


def extent(x: float, size: float = 1.0) -> Extent:
    return Extent(np.array([x, 0.0, 0.0]), np.array([x + size, size, size]), size**3)


def aggregation(made: IfcMaker, parts: dict[Any, Extent]) -> Aggregation:
    return Aggregation(
        made.file, {part.id(): where for part, where in parts.items()}, lambda product: product.is_a("IfcFooting")
    )


def groups(made: IfcMaker, parts: dict[Any, Extent], selected: frozenset[int] | None = None) -> list[tuple[Any, int]]:
    found = aggregation(made, parts).wholes(selected)
    return [(made.file.by_id(group.owner), len(group.members)) for group in found]


def test_parts_that_touch_are_one_lift_with_nested_assemblies() -> None:
    made = IfcMaker()
    beams = [made.rooted("IfcBeam") for _ in range(3)]
    inner, outer = made.rooted("IfcElementAssembly"), made.rooted("IfcElementAssembly", AssemblyPlace="FACTORY")
    made.aggregate(inner, beams[1:])
    made.aggregate(outer, [beams[0], inner])
    parts = {beam: extent(index) for index, beam in enumerate(beams)}
    assert groups(made, parts) == [(outer, 3)]
    assert [group.owner for group in aggregation(made, parts).parts()] == [beam.id() for beam in beams]
    assert aggregation(made, parts).parts()[1].ancestors == (outer.id(), inner.id())


def test_one_part_is_that_part_and_empty_assemblies_are_nothing() -> None:
    made = IfcMaker()
    beam, one, empty = made.rooted("IfcBeam"), made.rooted("IfcElementAssembly"), made.rooted("IfcElementAssembly")
    made.aggregate(one, [beam, empty])
    assert groups(made, {beam: extent(0)}) == [(beam, 1)]
    assert aggregation(made, {beam: extent(0)}).wholes() == [Group(beam.id(), (beam.id(),), (one.id(),))]


def test_assembled_on_site_holding_a_footing_or_scattered_is_opened() -> None:
    made = IfcMaker()
    for place, classes, gap in (
        ("SITE", ("IfcBeam", "IfcColumn"), 0.0),
        (None, ("IfcFooting", "IfcColumn"), 0.0),
        (None, ("IfcBeam", "IfcBeam"), 3.0),
    ):
        whole = made.rooted("IfcElementAssembly", AssemblyPlace=place)
        parts = [made.rooted(ifc_class) for ifc_class in classes]
        made.aggregate(whole, parts)
        placed = {part: extent(index * (1.0 + gap)) for index, part in enumerate(parts)}
        assert groups(made, placed) == [(part, 1) for part in parts]


def test_a_small_loose_anchor_does_not_open_its_assembly() -> None:
    assert hang_together([extent(0, 2.0), extent(5, 0.1)])
    assert hang_together([extent(0), extent(1.04)])
    assert not hang_together([extent(0), extent(1.2)])


def test_stairs_are_lifted_flight_by_flight_and_walls_with_their_parts() -> None:
    made = IfcMaker()
    stair, wall = made.rooted("IfcStair"), made.rooted("IfcWall")
    flights = [made.rooted("IfcStairFlight") for _ in range(2)]
    leaves = [made.rooted("IfcBuildingElementPart") for _ in range(2)]
    made.aggregate(stair, flights)
    made.aggregate(wall, leaves)
    parts = {part: extent(0) for part in (*flights, *leaves)}
    assert groups(made, parts) == [(wall, 2), *((flight, 1) for flight in flights)]


def test_a_curtain_wall_is_opened_only_for_a_selection_inside_it() -> None:
    made = IfcMaker()
    wall = made.rooted("IfcCurtainWall")
    bars = [made.rooted("IfcMember") for _ in range(2)]
    made.aggregate(wall, bars)
    parts = {bar: extent(0) for bar in bars}
    assert groups(made, parts) == [(wall, 2)]
    assert groups(made, parts, frozenset({bars[0].id()})) == [(bar, 1) for bar in bars]
    assert groups(made, parts, frozenset({bars[0].id(), wall.id()})) == [(wall, 2)]


@pytest.fixture
def model():
    """A beam with a lifting eye, a bolt and a drawn anchor inside its aggregate, millimetres."""
    file = ifcopenshell.file(schema="IFC4")

    def product(ifc_class, name, at):
        axis = file.createIfcAxis2Placement3D(file.createIfcCartesianPoint(tuple(map(float, at))))
        made = file.create_entity(ifc_class, ifcopenshell.guid.new(), Name=name)
        made.ObjectPlacement = file.createIfcLocalPlacement(None, axis)
        return made

    beam = product("IfcBeam", "beam", (0, 0, 0))
    eye = product("IfcDiscreteAccessory", "Lifting eye 60", (1000, 200, 600))
    bolt = product("IfcMechanicalFastener", "anchor bolt", (500, 0, 0))
    drawn = product("IfcBeam", "Hijsanker", (0, 0, 0))
    file.createIfcRelAggregates(ifcopenshell.guid.new(), RelatingObject=beam, RelatedObjects=[eye, bolt, drawn])
    return file, beam, drawn


def test_an_eye_without_a_mesh_is_where_it_is_placed(model):
    file, beam, _ = model
    found = anchors_without_mesh(file, [beam.id()], 0.001, np.array([1.0, 0.0, 0.0]))
    assert found == {beam.id(): [(0.0, 0.2, 0.6)]}


def test_a_drawn_anchor_is_held_at_its_top_and_the_beam_itself_is_none(model):
    file, beam, drawn = model
    meshes = {
        beam.id(): box_element("b", (0, 0, 0), (6, 0.4, 0.6)).mesh,
        drawn.id(): box_element("a", (4.9, 0.1, 0.5), (5.1, 0.3, 0.7)).mesh,
    }
    bare = anchors_without_mesh(file, meshes, 0.001, np.zeros(3))
    points = points_of_group(file, meshes, [beam.id()], meshes, bare)
    assert points == ((5.0, 0.2, 0.7), (1.0, 0.2, 0.6))


def test_a_lift_of_anchors_only_has_no_anchors(model):
    file, _, drawn = model
    meshes = {drawn.id(): box_element("a", (0, 0, 0), (1, 1, 1)).mesh}
    assert points_of_group(file, meshes, [drawn.id()], meshes, {}) == ()
