import ifcopenshell
import ifcopenshell.guid
import numpy as np
import pytest
from box_buildings import box_element

from bimvox.bim.ifc.assembly import anchors_without_mesh, points_of_group


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
