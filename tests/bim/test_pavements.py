"""A slab around the whole site is ground."""

import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Role
from bimvox.bim.strays import pavements_as_ground


def _house(*, role=Role.COMPONENT):
    return [box_element(f"column-{n}", (8.0 * n, 0.0, 0.0), (8.0 * n + 0.3, 0.3, 3.0), role=role) for n in range(3)]


@pytest.mark.parametrize("z_m", [-0.2, 0.0, 3.0])
def test_a_slab_that_no_jib_reaches_across_is_ground(z_m):
    slab = box_element("pavement", (-90.0, -80.0, z_m), (100.0, 80.0, z_m + 0.2), ifc_class="IfcSlab")
    found = pavements_as_ground(building_of(slab, *_house()))
    assert [element.role for element in found.elements] == [Role.GROUND, *[Role.COMPONENT] * 3]
    assert "pavement" in found.notes[-1]


@pytest.mark.parametrize(
    "low, high",
    [
        ((-20.0, -20.0, 0.0), (36.0, 20.0, 0.2)),
        ((0.0, -200.0, 0.0), (20.0, 200.0, 0.2)),
        ((-2.0, -80.0, 0.0), (190.0, 80.0, 0.2)),
        ((-90.0, -80.0, 3.0), (100.0, 80.0, 9.0)),
    ],
    ids=["small", "a road", "the building at its edge", "a storey"],
)
def test_other_slabs_are_parts(low, high):
    building = building_of(box_element("slab", low, high), *_house())
    assert pavements_as_ground(building) is building


def test_what_exists_already_stays():
    slab = box_element("slab", (-90.0, -80.0, 0.0), (100.0, 80.0, 0.2), role=Role.STRUCTURE)
    for building in (building_of(slab, *_house()), building_of(slab), building_of(*_house())):
        assert pavements_as_ground(building) is building
