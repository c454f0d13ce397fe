"""Of parts that are drawn twice in the same place, one is built."""

from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Role, TriangleMesh
from bimvox.bim.duplicates import without_duplicates

ONE = box_element("one", (0, 0, 0), (4, 0.3, 3))
TWO = box_element("two", (0, 0, 0), (4, 0.3, 3), mass_kg=9e3)


def _roles(*elements):
    found = without_duplicates(building_of(*elements))
    return [element.role for element in found.elements], " ".join(found.notes)


def test_the_first_is_built_and_the_others_are_named():
    roles, said = _roles(ONE, TWO, replace(ONE, id="three", name="Third"))
    assert roles == [Role.COMPONENT, Role.FITTING, Role.FITTING]
    assert said == "2 parts are duplicates of others in the same place, so left out: two, Third (three)"


def test_whatever_the_order_of_corners_and_less_than_half_a_millimetre_apart():
    order = np.arange(len(ONE.mesh.vertices_m))[::-1]
    faces = np.argsort(order)[ONE.mesh.faces].astype(np.int32)
    turned = replace(TWO, mesh=TriangleMesh(ONE.mesh.vertices_m[order] + 1e-4, faces))
    assert _roles(ONE, turned)[0] == [Role.COMPONENT, Role.FITTING]


def test_what_is_already_there_stays():
    assert _roles(ONE, replace(TWO, role=Role.STRUCTURE))[0] == [Role.FITTING, Role.STRUCTURE]


@pytest.mark.parametrize(
    "other",
    [
        box_element("two", (0, 0, 0), (4, 0.3, 3.01)),
        box_element("two", (0, 0, 0.01), (4, 0.3, 3.01)),
        replace(TWO, role=Role.FITTING),
        replace(TWO, role=Role.GROUND),
    ],
)
def test_others_are_none(other):
    building = building_of(ONE, other)
    assert without_duplicates(building) is building


def test_parts_of_other_shapes_in_the_same_box_are_none():
    wedge = ONE.mesh.vertices_m.copy()
    wedge[np.isclose(wedge[:, 2], 3.0) & np.isclose(wedge[:, 0], 4.0), 0] = 3.0
    building = building_of(ONE, replace(TWO, mesh=TriangleMesh(wedge, ONE.mesh.faces)))
    assert without_duplicates(building) is building
