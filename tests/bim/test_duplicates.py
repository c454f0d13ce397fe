"""Of parts that are drawn twice in the same place, one is built."""

from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Role, TriangleMesh
from bimvox.bim.strays import without_duplicates

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
        box_element("two", (0, 0, 0), (4, 0.3, 2.3)),  # a lower wall in it
        box_element("two", (0, 0, 1), (4, 0.3, 4)),
        box_element("two", (0, 0.01, 0.01), (4, 0.31, 3.01)),
        box_element("two", (0, 0, 0), (4, 0.3, 3.1), ifc_class="IfcColumn"),
        box_element("two", (0, 0, 0), (4, 0.3, 3.1), material="Steel"),
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


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((0, 0, 0), (4, 0.3, 3.01)),
        ((0, 0, 0.2), (4, 0.3, 3.2)),
        ((0, 0, 0), (4.5, 0.3, 3)),
        ((0, 0, 0), (4, 0.33, 3)),
    ],
)
def test_of_drafts_of_one_part_the_longest_is_built(low, high):
    draft = box_element("draft", low, high)
    found = without_duplicates(building_of(ONE, draft))
    longer = max((ONE, draft), key=lambda one: (one.mass_kg, one is ONE))
    assert [one.id for one in found.elements if one.role is Role.COMPONENT] == [longer.id]
    assert "1 part is a duplicate of another in the same place" in " ".join(found.notes)


def test_columns_drawn_with_two_heights_on_every_storey_are_built_once():
    columns = [
        box_element(f"{height}-{storey}", (0, 0, 3.8 * storey), (0.3, 0.3, 3.8 * storey + height))
        for storey in range(3)
        for height in (3.3, 3.5)
    ]
    found = without_duplicates(building_of(*columns))
    assert [one.id for one in found.elements if one.role is Role.COMPONENT] == ["3.5-0", "3.5-1", "3.5-2"]


def test_panels_that_stand_on_each_other_or_side_by_side_all_stay():
    panels = [
        box_element(f"{x}-{z}", (4 * x, 0, 3 * z), (4 * x + 4, 0.3, 3 * z + 3)) for x in range(3) for z in range(3)
    ]
    building = building_of(*panels)
    assert without_duplicates(building) is building


def test_braces_that_cross_in_one_frame_both_stay():
    def brace(name, foot_m, head_m):
        corners = [(x + wide, y, z) for x, z in ((foot_m, 0), (head_m, 3)) for wide in (0, 0.1) for y in (0, 0.1)]
        return replace(ONE, id=name, mesh=TriangleMesh(np.array(corners, float), ONE.mesh.faces))

    building = building_of(brace("up", 0, 4), brace("down", 4, 0))
    assert without_duplicates(building) is building
