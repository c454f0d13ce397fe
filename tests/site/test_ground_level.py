from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of
from hills import hill, terrain

from bimvox.bim.building import Building, Role, Storey, TriangleMesh
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.errors import SelectionError
from bimvox.site.ground import ground_level, heights_at, terrain_of


def house(*, slab=(-0.3, 0.0), basement=True, up=0.0, more=(), storeys=(("Erdgeschoss", 0.0),)) -> Building:
    """Return a house of 10 x 10 m with a basement."""
    parts = [
        box_element("wall", (0, 0, up), (10, 0.3, up + 3), ifc_class="IfcWall"),
        box_element("slab", (0, 0, up + slab[0]), (10, 10, up + slab[1]), ifc_class="IfcSlab"),
    ]
    if basement:
        parts.append(box_element("cellar", (0, 0, up - 3), (10, 0.3, up + slab[0]), ifc_class="IfcWall"))
    named = tuple(Storey(name, elevation, elevation + up) for name, elevation in storeys)
    return replace(building_of(*parts, *more), storeys=named)


def test_terrain_around_the_building_decides():
    slope = terrain(lambda x, y: 0.1 * (x - 5.0) - 0.4)
    found = ground_level(house(more=[slope]))
    assert found.height_m == pytest.approx(-0.4, abs=0.02)
    assert "terrain" in found.why


def test_terrain_under_the_building_only_or_far_above_it_does_not():
    far_above = terrain(lambda x, y: 50.0 + 0.0 * x)
    apart = replace(
        far_above, mesh=TriangleMesh(far_above.mesh.vertices_m + np.array([500, 0, -50]), far_above.mesh.faces)
    )
    for other in (far_above, apart):
        assert ground_level(house(more=[other])) == ground_level(house())


def test_the_level_that_the_file_states_comes_before_storeys():
    assert ground_level(replace(house(), terrain_m=-0.75)).height_m == -0.75
    assert ground_level(replace(house(), terrain_m=112.0)).height_m == -0.3  # above sea level: not of this model


@pytest.mark.parametrize(
    "names",
    [
        (("Keller", -3.0), ("Erdgeschoss", 0.0), ("1. OG", 3.0)),
        (("T/FDN", -1.25), ("Level 1", 0.0), ("Level 2", 3.1)),
        (("-1 kelder", -3.0), ("00 begane grond", 0.0)),
        (("Sous-sol", -3.0), ("Rez-de-chaussée", 0.0)),
        (("0 - Piano Terra", 0.0), ("1 - Piano Primo", 3.1)),
        (("Suterén", -3.0), ("přízemí", 0.0)),
        (("1階", 0.0), ("2階", 3.0)),
        (("", 0.0),),
    ],
)
def test_it_is_the_underside_of_the_floor_of_the_storey_at_the_ground(names):
    found = ground_level(house(storeys=names))
    assert found.height_m == -0.3
    assert "slab" in found.why


def test_a_named_storey_comes_before_the_one_at_zero():
    names = (("Basement", 0.0), ("Ground floor", 3.0))
    parts = [
        box_element("cellar", (0, 0, 0), (10, 0.3, 2.8), ifc_class="IfcWall"),
        box_element("floor", (0, 0, 2.8), (10, 10, 3), ifc_class="IfcSlab"),
    ]
    building = replace(building_of(*parts), storeys=tuple(Storey(name, z, z) for name, z in names))
    assert ground_level(building).height_m == 2.8


def test_a_floor_of_planks_and_topping_reaches_down_to_the_underside_of_its_planks():
    planks = [
        box_element(f"plank {n}", (0, 1.2 * n, -0.5), (10, 1.2 * n + 1.2, -0.3), ifc_class="IfcSlab") for n in range(8)
    ]
    deep = box_element("pit", (0, 0, -3), (5, 5, -2.7), ifc_class="IfcSlab")
    assert ground_level(house(more=[*planks, deep])).height_m == -0.5


@pytest.mark.parametrize("name", ["Finish Grade", "Maaiveld", "Gelände", "GL", "Terén"])
def test_a_level_that_is_called_the_ground_is_the_ground(name):
    found = ground_level(house(storeys=((name, -0.15), ("Erdgeschoss", 0.0))))
    assert found == (-0.15, f"the level {name!r}")


def test_what_lies_below_grade_is_not_the_ground():
    assert ground_level(house(storeys=(("Below Grade", -3.0), ("Level 1", 0.0)))).height_m == -0.3


@pytest.mark.parametrize("level", [-1e4, 1e30, 200.0, float("nan")])
def test_a_storey_far_from_all_parts_is_not_the_one_at_the_ground(level):
    far = (("Rez-de-chaussée", level), ("Erdgeschoss", 0.0))
    assert ground_level(house(storeys=far)) == ground_level(house())
    assert ground_level(house(storeys=far[:1])).why == "the lowest part of the model"


def test_terrain_that_cannot_be_the_ground_of_the_building_is_not():
    for height_m in (-40.0, 40.0):
        assert terrain_of(house(more=[terrain(lambda x, y, z=height_m: 0.0 * x + z)]).elements) == []
    near, apart = terrain(lambda x, y: 0.1 * x), replace(terrain(lambda x, y: 0.0 * x + 40.0), id="apart")
    apart = replace(apart, mesh=TriangleMesh(apart.mesh.vertices_m + np.array([500.0, 0.0, 0.0]), apart.mesh.faces))
    assert terrain_of(house(more=[near, apart]).elements) == [near.mesh, apart.mesh]
    assert terrain_of([near]) == [near.mesh]


def test_without_a_floor_its_thickness_is_assumed():
    building = house(slab=(5.0, 5.2))
    assert ground_level(building).height_m == -0.3
    assert "0.3 m below" in ground_level(building).why


def test_heights_far_from_zero_and_origins_are_of_the_model():
    building = replace(house(up=2.0), origin_m=np.array([0.0, 0.0, 100.0]))
    building = replace(building, storeys=(Storey("Ground floor", 0.0, 102.0),))
    assert ground_level(building).height_m == pytest.approx(101.7)


def test_what_reaches_a_little_below_the_storey_stands_on_the_ground():
    assert ground_level(house(slab=(-0.45, 0.0), basement=False)).height_m == -0.45
    assert ground_level(house(slab=(-0.30004, 0.0), basement=False)).height_m == -0.3


def test_parts_above_a_floor_that_is_not_in_the_model_do_not_raise_the_ground():
    lintel = box_element("lintel", (0, 0, 2.4), (1, 0.1, 2.5))
    building = replace(building_of(lintel), storeys=(Storey("00 begane grond", 0.0, 0.0),))
    assert ground_level(building).height_m == -0.3


def test_piles_without_storeys_end_at_the_ground():
    driven = Judgement(Kind.PILE, Confidence.STATED, "an IfcPile")
    piles = [
        replace(box_element(f"pile {x}", (x, 0, -9), (x + 0.3, 0.3, -1.2), role=Role.STRUCTURE), judgement=driven)
        for x in (0, 5)
    ]
    beam = box_element("beam", (0, 0, -1.2), (5, 0.3, -0.7))
    assert ground_level(building_of(*piles, beam)) == (-1.2, "the top of the piles")


def test_otherwise_it_is_the_lowest_part():
    fitting = box_element("pipe", (0, 0, -5), (1, 1, -4), role=Role.FITTING)
    assert ground_level(building_of(box_element("a", (0, 0, -0.123), (1, 1, 2)), fitting)).height_m == -0.123
    with pytest.raises(SelectionError):
        ground_level(building_of(fitting))


def test_heights_are_of_the_highest_surface():
    mesh = hill(lambda x, y: 0.1 * x + 0.05 * y)
    at = np.array([[1.0, 2.0], [-3.3, 7.1], [500.0, 0.0]])
    found = heights_at([mesh], at)
    np.testing.assert_allclose(found[:2], 0.1 * at[:2, 0] + 0.05 * at[:2, 1], atol=1e-12)
    assert np.isnan(found[2])
    block = box_element("block", (0, 0, -1), (4, 4, 0.5)).mesh
    assert heights_at([block], np.array([[2.0, 1.0]])) == pytest.approx([0.5])
    assert heights_at([mesh, block], np.array([[2.0, 1.0], [9.0, 2.0]])) == pytest.approx([0.5, 1.0])
    assert np.isnan(heights_at([], at)).all()
