"""The ground of a site: terrain, yard, excavation; and whole plans on a hillside and over a basement."""

from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of
from box_sites import box_component
from hills import hill, terrain

import bimvox
from bimvox.bim.building import Building, Role, Storey, TriangleMesh
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.errors import ConfigError, SelectionError
from bimvox.grid.frame import GridFrame, Label
from bimvox.library.site import built_site
from bimvox.progress import SilentProgress
from bimvox.remarks.conditions import conditions_of
from bimvox.site.build import NOT_ITS_TERRAIN
from bimvox.site.ground import Ground, ground_cells, ground_level, heights_at, natural_ground_m, terrain_of

DEEP = GridFrame((0.0, 0.0, -4.0), 0.5)  # seven layers below the one under z = 0
COLUMNS = (40, 40)
FLAT_LAYER = 7


def component(index, low, high, **more):
    return box_component(DEEP, index, f"part {index}", low, high, **more)


def test_without_terrain_and_parts_below_the_ground_is_flat():
    assert natural_ground_m(DEEP, [], np.ones(COLUMNS, bool)) is None
    tops = Ground(DEEP, COLUMNS, None, [component(0, (5, 5, 0), (10, 10, 3))]).tops()
    assert (tops == FLAT_LAYER).all()
    assert len(ground_cells(tops, (*COLUMNS, 20))) == (FLAT_LAYER + 1) * 40 * 40


def test_terrain_fills_whole_layers_and_the_yard_is_level():
    yard = np.zeros(COLUMNS, bool)
    yard[10:20, 10:20] = True
    found = natural_ground_m(DEEP, [hill(lambda x, y: 0.2 * x - 1.0)], yard)
    layers = found / 0.5
    np.testing.assert_allclose(layers, np.round(layers), atol=1e-9)
    x_m = DEEP.voxel_size_m * (np.arange(40) + 0.5)
    rest = found[:, 30]
    assert (rest >= 0.2 * x_m - 1.0 - 0.101).all(), "the terrain is an obstacle as high as it is, to a fifth of a cell"
    assert (rest <= 0.2 * x_m - 1.0 + 0.6).all()
    assert len(np.unique(found[yard])) == 1
    assert natural_ground_m(DEEP, [hill(lambda x, y: 0.0 * x + 0.05)], yard) is None, "5 cm are level with 0"


def test_the_ground_is_dug_out_to_each_part_and_around_it():
    cellar = component(0, (5, 5, -3), (10, 10, -0.5))
    tops = Ground(DEEP, COLUMNS, None, [cellar]).tops()
    pit = np.zeros(COLUMNS, bool)
    pit[8:22, 8:22] = True  # 5 m and a metre on each side
    assert (tops[pit] == 1).all()
    assert (tops[~pit] == FLAT_LAYER).all()


def test_it_is_not_dug_from_under_a_part_that_stands_on_it():
    cellar, pad = component(0, (5, 5, -3), (10, 10, -0.5)), component(1, (10.5, 5, -0.5), (11.5, 6, 0))
    roof = component(2, (3, 3, 4), (12, 12, 4.5))
    tops = Ground(DEEP, COLUMNS, None, [cellar, pad, roof]).tops()
    assert (tops[21:23, 10:12] == 6).all()
    assert (tops[8:10, 10:20] == 1).all(), "what is above the ground keeps nothing under it"
    assert Ground(DEEP, COLUMNS, None, [cellar, pad, roof]).carries(0.05) == [True, True, False]


def test_the_ceiling_of_a_basement_spans_and_a_slab_on_the_ground_does_not():
    floor, wall = component(0, (5, 5, -3), (10, 10, -2.5)), component(1, (5, 5, -2.5), (5.5, 10, -0.5))
    ceiling, terrace = component(2, (5, 5, -0.5), (10, 10, 0)), component(3, (12, 5, -0.5), (15, 8, 0))
    parts = [floor, wall, ceiling, terrace]
    assert Ground(DEEP, COLUMNS, None, parts).carries(0.05) == [True, False, False, True]
    assert Ground(DEEP, COLUMNS, None, parts).spanning() == [False, True, True, False]


def basement():
    """A precast box of walls and slabs, 3 m deep, with a storey above it."""
    concrete = {"material": "C30/37 precast"}
    walls = [
        (f"wall {z} {n}", (x0, y0, z), (x1, y1, z + 2.7), {"ifc_class": "IfcWall", **concrete})
        for z in (-3.0, 0.0)
        for n, (x0, y0, x1, y1) in enumerate(
            [(0, 0, 5, 0.2), (0, 4.8, 5, 5), (0, 0.25, 0.2, 4.75), (4.8, 0.25, 5, 4.75)]
        )
    ]
    slabs = [
        (f"slab {z} {n}", (x, 0, z), (x + 2.4, 5, z + 0.3), {"ifc_class": "IfcSlab", **concrete})
        for z in (-3.3, -0.3, 2.7)
        for n, x in enumerate((0.0, 2.6))
    ]
    return [box_element(name, low, high, **more) for name, low, high, more in (*slabs, *walls)]


@pytest.fixture(scope="module")
def in_the_pit():
    site = bimvox.guess_site(_with_storey(building_of(*basement())), voxel_size_m=0.5)
    return site, bimvox.plan(site, policy="greedy")


def conditions(plan):
    return conditions_of(plan.record.plan, plan.record.motions)


def _with_storey(building):
    return replace(building, storeys=(Storey("Ground floor", 0.0, 0.0),))


def test_the_parts_of_a_basement_are_lifted_into_its_excavation(in_the_pit):
    site, plan = in_the_pit
    assert site.config.model.ground_m == -0.3
    assert min(part.mesh.bounds_m[0, 2] for part in site.components) == pytest.approx(-3.0)
    assert not plan.infeasible
    assert bimvox.verify(plan).verified
    below = [lift for lift in plan.lifts if lift.is_planned and lift.path_m[-1][2] < -1.0]
    assert below, "some are set below the ground"


def test_the_verdict_names_the_excavation(in_the_pit):
    _, plan = in_the_pit
    assert any("dug out" in condition and "3.0 m deep" in condition for condition in conditions(plan))


def test_the_yard_lies_on_the_ground_not_in_the_pit(in_the_pit):
    site, plan = in_the_pit
    value = site.site
    floor = value.frame.corner_of([0, 0, value.yard_floor_vox])[2]
    assert floor == pytest.approx(0.0)
    assert all(place.cell_vox[2] >= value.yard_floor_vox for lift in plan.lifts if (place := lift.lift.place))
    assert (value.labels[value.yard, value.yard_floor_vox - 1] == Label.YARD).all()


def test_crane_and_yard_stand_on_the_hillside():
    parts = [box_element(f"wall {n}", (4 * n, 0, 0), (4 * n + 3, 0.3, 3), ifc_class="IfcWall") for n in range(3)]
    slope = terrain(lambda x, y: np.maximum(0.0, 0.5 * (np.abs(y) - 3.0)))
    site = bimvox.guess_site(building_of(*parts, slope), voxel_size_m=0.5)
    value = site.site
    assert value.natural_ground_m is not None
    assert value.natural_ground_m.max() > 2.0
    (crane,) = value.cranes
    x, y, _ = value.frame.cell_of(crane.base_m)
    assert crane.base_m[2] == pytest.approx(value.natural_ground_m[x, y])
    plan = bimvox.plan(site, policy="greedy")
    assert bimvox.verify(plan).verified
    assert any("terrain" in condition for condition in conditions(plan))
    hills = {tuple(cell) for cell in value.blockers[0].cells[value.blockers[0].cells[:, 2] > 2].tolist()}
    assert hills, "the terrain is in the way of loads"


def test_an_existing_pile_below_the_ground_takes_no_place_in_the_yard():
    wall = box_element("wall", (0, 0, 0), (3, 0.3, 3), ifc_class="IfcWall")
    pile = box_element("pile", (1, 0, -9), (1.3, 0.3, -0.2), role=Role.STRUCTURE, ifc_class="IfcPile")
    building = _with_storey(building_of(wall, pile))
    site = bimvox.guess_site(building, voxel_size_m=0.5).site
    assert site.frame.origin_m[2] >= -1.0, "nothing is dug for what is in place already"


def test_terrain_of_another_place_is_left_out_with_a_note():
    wall = box_element("wall", (0, 0, 0), (3, 0.3, 3), ifc_class="IfcWall")
    site = bimvox.guess_site(building_of(wall, terrain(lambda x, y: 0.0 * x - 40.0)), voxel_size_m=0.5).site
    assert site.natural_ground_m is None
    assert site.notes == (NOT_ITS_TERRAIN,)
    assert site.shape[2] < 40, "no cells are spent on what lies between"


def test_a_crane_on_a_hill_higher_than_its_jib_is_refused_by_name():
    wall = box_element("wall", (0, 0, 0), (3, 0.3, 3), ifc_class="IfcWall")
    peak = terrain(lambda x, y: np.where(np.hypot(x - 20.0, y) < 6.0, 40.0, 0.0))
    config = bimvox.guess_site(building_of(wall), voxel_size_m=0.5).config
    assert config.crane is not None
    moved = config.model_copy(update={"crane": config.crane.model_copy(update={"base_m": (20.0, 0.0)})})
    with pytest.raises(ConfigError, match=r"stands at a height of 40\.0 m, but its mast ends at") as refused:
        built_site(moved, building_of(wall, peak), {}, SilentProgress())
    assert refused.value.key == "crane.base_m"


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
