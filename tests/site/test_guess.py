from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from box_buildings import box_element, building_of, frame_house, rasterise_boxes
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.bim.building import Casting, Role
from bimvox.bim.kinds.kind import Judgement, Kind
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.reach import allowed_radii_m
from bimvox.errors import ConfigError, SelectionError
from bimvox.site.access_guess import proposed_access
from bimvox.site.build import PlacedModel, build_site
from bimvox.site.catalogue import FICTITIOUS, machine_called, machines_called, machines_of
from bimvox.site.config.crane import CraneConfig, OverrideConfig
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.site_config import (
    AreasConfig,
    ComponentConfig,
    GridConfig,
    MeansConfig,
    ModelConfig,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.config.template import site_toml
from bimvox.site.guess import (
    PLANNING_CELLS,
    VOXEL_SIZES_M,
    complete_config,
    cranes_that_fit,
    guess_site,
    lifted_of,
    placed_on_site,
)
from bimvox.site.machine import crane_config, crane_of, cranes_of
from bimvox.site.means import Means, means_of
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.placement import place_building, site_extent
from bimvox.site.trial import yard_points

HOUSE = guess_site(frame_house(), ModelConfig(path="models/house.ifc"))


def tower(floors: int, mass_kg: float | None = None):
    more = {} if mass_kg is None else {"mass_kg": mass_kg}
    panels = (
        box_element(f"panel-{f}-{n}", (n * 6.0, 0, 3.0 * f), (n * 6.0 + 5.9, 0.2, 3.0 * f + 3.0), **more)
        for f in range(floors)
        for n in range(4)
    )
    return building_of(*(replace(one, casting=Casting.PRECAST) for one in panels))


def built(config, building):
    placed, site_to_ifc = place_building(config, building)
    crane = crane_of(config)
    frame, shape = site_extent(config, placed, crane)
    parts = [(element, rasterise_boxes(element.mesh, frame, shape)) for element in placed.elements]
    return build_site(
        config,
        PlacedModel(parts, frame, shape, site_to_ifc),
        cranes=() if crane is None else (crane,),
        rasterise=rasterise_boxes,
    )


def test_a_guessed_site_is_complete_and_can_be_built():
    assert HOUSE.name == "house"
    assert HOUSE.model.path == Path("models/house.ifc")
    assert complete_config(HOUSE, frame_house()).model_dump() == HOUSE.model_dump()
    site = built(HOUSE, frame_house())
    assert site.notes == ()
    assert len(site.components) == 7
    assert site.yard.any()


@pytest.mark.parametrize("building", [frame_house(), tower(6), tower(2, 9000.0)], ids=["house", "tower", "heavy"])
def test_the_crane_serves_every_place_and_the_yard(building):
    config = guess_site(building, ModelConfig(path="a.ifc"))
    placed, _ = place_building(config, building)
    crane = crane_of(config)
    components = [element for element in placed.elements if element.role is Role.COMPONENT]
    heaviest = max(element.mass_kg for element in components)
    base = np.array(crane.base_m[:2])
    for element in components:
        radius = np.hypot(*(centre_of_mass_m(element.mesh)[:2] - base))
        low, high = allowed_radii_m(crane, element.mass_kg)
        assert low <= radius <= high
        assert capacity_kg(crane.chart, radius) >= element.mass_kg + crane.rigging_mass_kg
    low, high = allowed_radii_m(crane, heaviest)
    radii = np.hypot(*(yard_points(config) - base).T)
    assert ((low <= radii) & (radii <= high)).mean() > 0.45
    highest = max(element.mesh.bounds_m[1, 2] for element in components)
    assert crane.jib_height_m - crane.sling_m > highest + 3.0


def test_parts_too_heavy_for_any_crane_give_a_site_file_to_edit_if_a_crane_is_asked_for():
    boxes = (box_element(f"s{n}", (0, 0, 3 * n), (20, 20, 3 * n + 3), mass_kg=5e6) for n in range(3))
    storeys = building_of(*(replace(box, judgement=Judgement(Kind.STEEL)) for box in boxes))
    with pytest.raises(SelectionError, match="no machine of the catalogue lifts any of the 3 parts"):
        guess_site(storeys, ModelConfig(path="a.ifc"))
    config = guess_site(storeys, ModelConfig(path="a.ifc"), machines=machines_of("hammerhead"))
    crane = crane_of(config)
    placed, _ = place_building(config, storeys)
    base = np.array(crane.base_m[:2])
    assert machine_called(crane.name) is not None
    for element in placed.elements:
        radius = float(np.hypot(*(centre_of_mass_m(element.mesh)[:2] - base)))
        assert crane.min_radius_m <= radius <= crane.jib_length_m
        assert capacity_kg(crane.chart, radius) < element.mass_kg


def test_areas_keep_apart():
    building = shapely.box(-0.5, -0.5, 8.5, 5.5)
    construction = shapely.Polygon(HOUSE.areas.construction)
    (yard,) = (shapely.Polygon(corners) for corners in HOUSE.areas.yard)
    half = crane_of(HOUSE).mast_size_m / 2
    mast = shapely.Point(HOUSE.crane.base_m[:2]).buffer(half, cap_style="square")
    assert construction.contains(building.buffer(0.99, join_style="mitre"))
    assert construction.distance(yard) >= 1.0 - 1e-9
    assert mast.distance(building) >= 1.5 - 1e-9
    assert mast.distance(yard) >= 1.5 - half - 1e-9


@given(
    st.lists(st.tuples(st.floats(0.2, 14), st.floats(0.2, 9), st.floats(0.2, 4)), min_size=1, max_size=30),
    st.sampled_from(["IfcSlab", "IfcColumn"]),
)
@settings(deadline=None, max_examples=8)
def test_the_largest_lift_fits_into_the_yard(sizes, ifc_class):
    boxes = [
        box_element(f"p{n}", (0, 0, 5 * n), (x, y, 5 * n + z), ifc_class=ifc_class, mass_kg=500.0)
        for n, (x, y, z) in enumerate(sizes)
    ]
    parts = [replace(box, judgement=Judgement(Kind.STEEL)) for box in boxes]
    config = guess_site(building_of(*parts), ModelConfig(path="a.ifc"))
    size_m = config.model.voxel_size_m
    width, depth = np.ptp(np.array(config.areas.yard[0]), axis=0)
    works = means_of(parts, {}, MeansConfig())
    for x, y, z in (size for n, size in enumerate(sizes) if works[f"p{n}"].means is Means.CRANE):
        if ifc_class == "IfcColumn" and z >= 2 * max(x, y) - 1e-9:
            assert max(width, depth) >= np.hypot(z, max(x, y)) + size_m
        else:
            assert width >= x + 2 * size_m
            assert depth >= y + 2 * size_m


def test_the_yard_is_for_truckloads_not_for_everything():
    few, many = (guess_site(tower(floors), ModelConfig(path="a.ifc")).areas.yard for floors in (7, 40))
    area_few, area_many = (sum(shapely.Polygon(corners).area for corners in yard) for yard in (few, many))
    assert area_many < 1.5 * area_few


@pytest.mark.parametrize("floors", [1, 8, 40])
def test_the_finest_cell_size_that_plans_quickly(floors):
    building = tower(floors)
    config = guess_site(building, ModelConfig(path="a.ifc"))
    size_m = config.model.voxel_size_m

    def cells(size: float) -> int:
        model = config.model.model_copy(update={"voxel_size_m": size})
        placed, _ = place_building(config, building)
        return int(np.prod(site_extent(config.model_copy(update={"model": model}), placed, crane_of(config))[1]))

    assert cells(size_m) <= PLANNING_CELLS * 1.02
    if size_m != VOXEL_SIZES_M[0]:
        assert cells(VOXEL_SIZES_M[VOXEL_SIZES_M.index(size_m) - 1]) > PLANNING_CELLS * 0.98


def test_the_mast_stands_outside_of_the_buildings_convex_outline():
    wings = [box_element(f"w{n}", (6.0 * n, 0, 0), (6.0 * n + 5.9, 0.2, 3.0), mass_kg=900.0) for n in range(8)]
    wings += [box_element(f"v{n}", (0, 6.0 * n + 0.3, 0), (0.2, 6.0 * n + 6.2, 3.0), mass_kg=900.0) for n in range(8)]
    config = guess_site(building_of(*wings), ModelConfig(path="a.ifc"))
    x, y, _ = crane_of(config).base_m
    corners = shapely.MultiPoint([(0, 0), (47.9, 0), (47.9, 0.2), (0, 48.2), (0.2, 48.2)]).convex_hull
    assert not corners.contains(shapely.Point(x, y))


def test_given_values_are_kept():
    said = SiteConfig(
        name="mine",
        model=ModelConfig(path="a.ifc", voxel_size_m=0.5, ground_m=-1.0, yaw_rad=0.25),
        areas=AreasConfig(yard=(((-20.0, 0.0), (-12.0, 0.0), (-12.0, 12.0), (-20.0, 12.0)),)),
        crane=CraneConfig(name="hammerhead-30", base_m=(-8.0, 2.0)),
    )
    config = complete_config(said, frame_house())
    assert config.model == said.model
    assert config.crane == said.crane
    assert config.areas.yard == said.areas.yard
    assert config.areas.construction is not None
    assert config.file == said.file


@pytest.mark.parametrize(("ground_m", "says"), [(-500.0, "500 m below all parts"), (1e4, "m above all parts")])
def test_a_ground_far_from_all_parts_is_refused_by_name(ground_m, says):
    with pytest.raises(ConfigError, match=says) as refused:
        complete_config(SiteConfig(model=ModelConfig(path="a.ifc", ground_m=ground_m)), frame_house())
    assert refused.value.key == "model.ground_m"


def test_a_ground_some_metres_off_is_taken_as_said():
    for ground_m in (-30.0, 5.0):
        config = complete_config(SiteConfig(model=ModelConfig(path="a.ifc", ground_m=ground_m)), frame_house())
        assert config.model.ground_m == ground_m


def test_without_a_crane_none_is_guessed():
    said = SiteConfig(model=ModelConfig(path="a.ifc"), crane=CraneConfig(kind="none"))
    config = complete_config(said, frame_house())
    assert crane_of(config) is None
    assert not built(config, frame_house()).cranes


def test_a_given_crane_draws_the_yard_to_its_side():
    for base, axis, sign in (((4.0, 9.0), 1, 1), ((4.0, -4.0), 1, -1)):
        changed = OverrideConfig(jib_length_m=11.0, chart=((11.0, 9e4),))
        crane = CraneConfig(machine="hammerhead-30", base_m=base, override=changed)
        config = complete_config(SiteConfig(model=ModelConfig(path="a.ifc"), crane=crane), frame_house())
        middle = np.mean(config.areas.yard[0], axis=0)
        assert np.sign(middle[axis] - 2.5) == sign


def test_an_explicit_extent_counts_for_the_cell_size():
    grid = GridConfig(low_m=(-30.0, -30.0), high_m=(60.0, 60.0, 30.0))
    config = complete_config(SiteConfig(model=ModelConfig(path="a.ifc"), grid=grid), frame_house())
    assert config.model.voxel_size_m == 0.5


def test_a_turned_building_is_planned_square_to_itself():
    from bimvox.bim.site_frame import in_site_frame

    turned, _ = in_site_frame(frame_house(), ground_m=0.0, yaw_rad=-0.4)
    config = guess_site(turned, ModelConfig(path="a.ifc"))
    assert config.model.yaw_rad == pytest.approx(0.4, abs=1e-6)
    placed, _ = place_building(config, turned)
    np.testing.assert_allclose(placed.bounds_m, frame_house().bounds_m, atol=1e-6)


def test_a_machine_that_does_not_exist_is_proposed_only_on_request_and_is_called_fictitious():
    real = guess_site(tower(2, 30_000.0), ModelConfig(path="a.ifc")).crane
    assert machine_called(real.machine) is not None
    config = guess_site(tower(2, 30_000.0), ModelConfig(path="a.ifc"), machines=machines_called(FICTITIOUS))
    assert config.crane.name.startswith(FICTITIOUS)
    light = guess_site(tower(2), ModelConfig(path="a.ifc"), machines=machines_called(FICTITIOUS))
    assert machine_called(light.crane.machine) is not None
    crane = crane_of(config)
    assert capacity_kg(crane.chart, 15.0) >= 30_000.0


@pytest.mark.parametrize("kind", ["luffing", "mobile"])
def test_a_crane_of_another_kind_is_proposed_on_request(kind):
    config = guess_site(frame_house(), ModelConfig(path="a.ifc"), machines=machines_called(kind))
    crane = crane_of(config)
    assert (config.crane.kind, crane.kind, crane.luffing is not None) == (kind, kind, True)
    assert crane_of(config.model_copy(update={"crane": crane_config(crane)})) == crane
    site = built(config, frame_house())
    assert site.notes == ()
    base = np.array(crane.base_m[:2])
    for component in site.components:
        low, high = allowed_radii_m(crane, component.mass_kg)
        hook = site.frame.centre_of(np.array([component.target_vox]) + component.hook_offset_vox)[0, :2]
        assert low <= float(np.hypot(*(hook - base))) <= high


def test_the_other_suitable_machines_are_named():
    def names(config, building):
        return {fit.machine for fit in cranes_that_fit(config, building)[1] if fit.serves}

    assert {HOUSE.crane.machine, "luffing-40", "mobile-60t"} <= names(HOUSE, frame_house())
    heavy = tower(2, 9000.0)
    assert "flat-top-75" not in names(guess_site(heavy, ModelConfig(path="a.ifc")), heavy)


def test_a_machine_that_cannot_carry_everything_is_still_proposed_on_request():
    heavy = tower(2, 30_000.0)
    assert (
        guess_site(heavy, ModelConfig(path="a.ifc"), machines=machines_called("mobile-60t")).crane.machine
        == "mobile-60t"
    )


def test_a_mobile_crane_that_reaches_not_everything_from_one_place_gets_set_ups():
    row = [
        box_element(f"p{n}", (12.0 * n, 0.0, 0.0), (12.0 * n + 10.0, 0.2, 3.0), mass_kg=6000.0, ifc_class="IfcWall")
        for n in range(8)
    ]
    building = building_of(*row)
    config = guess_site(building, ModelConfig(path="a.ifc"), machines=machines_called("mobile-60t"))
    assert config.moves
    cranes = cranes_of(config)
    assert len(cranes) == len(config.crane.setup) > 1
    own, _ = cranes_that_fit(config, building)
    assert (own.set_ups, own.serves, own.parts) == (len(cranes), True, 8)
    yards, taken = [shapely.Polygon(one) for one in config.areas.yard], shapely.Polygon(config.areas.construction)
    assert all(taken.intersection(yard).area < 1e-6 for yard in yards)
    read = parse_site_config(site_toml(config), Path("a.site.toml"))
    assert read.crane.setup == config.crane.setup
    near = guess_site(building_of(*row[:2]), ModelConfig(path="a.ifc"), machines=machines_called("mobile-60t"))
    assert not near.moves


def test_a_part_that_nothing_can_lift_does_not_stop_the_others():
    rock = box_element("rock", (0, 2, 0), (3, 5, 3), mass_kg=9e6, casting=Casting.PRECAST)
    building = building_of(*tower(2).elements, rock)
    config = guess_site(building, ModelConfig(path="a.ifc"))
    (rock,) = cranes_that_fit(config, building)[0].unserved
    assert (rock.component, rock.mass_kg) == ("rock", 9e6)


def test_pinned_parts_and_unknown_ids():
    pinned = SiteConfig(
        model=ModelConfig(path="a.ifc"),
        component=tuple(ComponentConfig(global_id=one.id, pinned=True) for one in tower(1).elements),
    )
    with pytest.raises(SelectionError, match="nothing to lift"):
        complete_config(pinned, tower(1))
    unknown = pinned.model_copy(update={"component": (ComponentConfig(global_id="pannel-0-1"),)})
    with pytest.raises(ConfigError, match="panel-0-1"):
        complete_config(unknown, tower(1))


def test_the_crane_is_chosen_for_what_is_lifted():
    slab = box_element("slab", (0, 0, 0), (30, 20, 0.3), ifc_class="IfcSlab")
    building = building_of(*tower(2).elements, slab)
    config = guess_site(building, ModelConfig(path="a.ifc"))
    assert config.component == ()
    assert cranes_that_fit(config, building)[0].unserved == ()


def test_a_new_site_has_a_lane_from_which_the_crane_unloads_every_part() -> None:
    config = guess_site(frame_house(), ModelConfig(path="house.ifc"))
    (lane,) = config.areas.access or ()
    own, taken = shapely.Polygon(lane), [config.areas.construction, *(config.areas.yard or ())]
    assert not any(own.intersection(shapely.Polygon(area)).area for area in taken)
    (crane,) = cranes_of(config)
    assert own.distance(shapely.Point(crane.base_m[:2])) > crane.mast_size_m / 2.0
    kept = config.model_copy(update={"areas": config.areas.model_copy(update={"access": None})})
    placed = placed_on_site(kept, frame_house())
    assert proposed_access(kept, placed, lifted_of(kept, placed)) == (lane,)
    given = complete_config(kept, frame_house())
    assert given.areas.access is None, "who gives the yard says where lorries stand"


def test_a_lane_lies_on_the_plot_and_off_closed_zones() -> None:
    config = guess_site(frame_house(), ModelConfig(path="house.ifc"))
    placed, lane = placed_on_site(config, frame_house()), (config.areas.access or ())[0]
    lifted = lifted_of(config, placed)
    closed = config.model_copy(update={"zone": (ZoneConfig(kind="prohibited", polygon=lane),)})
    assert proposed_access(closed, placed, lifted) != (lane,)
    tight = shapely.MultiPoint([at for area in (config.areas.yard or ()) for at in area]).convex_hull
    plot = tuple(tight.exterior.coords[:-1])
    within = config.model_copy(update={"areas": config.areas.model_copy(update={"plot": plot})})
    assert proposed_access(within, placed, lifted) is None
