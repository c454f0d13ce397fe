import numpy as np
import pytest
from box_buildings import box_element, building_of, frame_house
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import Role
from bimvox.bim.site_frame import in_site_frame
from bimvox.errors import ConfigError, SelectionError
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.placement import built_bounds_m, dominant_yaw_rad, place_building


def site(**model) -> SiteConfig:
    return SiteConfig(model=ModelConfig(path="a.ifc", **model))


@given(st.floats(-3, 3), st.floats(-50, 50), st.tuples(*[st.integers(-1000, 1000)] * 3))
def test_site_to_ifc_leads_back_to_the_models_own_coordinates(yaw_rad, ground_m, origin_m):
    building = building_of(box_element("a", (0, 0, 0), (1, 2, 3)), origin_m=origin_m)
    placed, site_to_ifc = place_building(site(yaw_rad=yaw_rad, ground_m=ground_m), building)
    there = placed.elements[0].mesh.vertices_m
    back = there @ site_to_ifc[:3, :3].T + site_to_ifc[:3, 3]
    np.testing.assert_allclose(back, building.elements[0].mesh.vertices_m + np.array(origin_m), atol=1e-9)
    height = building.elements[0].mesh.vertices_m[:, 2] + origin_m[2]
    np.testing.assert_allclose(there[:, 2], height - ground_m, atol=1e-9)


def test_the_ground_must_be_known():
    with pytest.raises(ConfigError) as caught:
        place_building(site(), frame_house())
    assert caught.value.key == "model.ground_m"


def test_bounds_are_of_components_and_structure():
    assert built_bounds_m(frame_house().elements).tolist() == [[-0.5, -0.5, 0.0], [8.5, 5.5, 4.2]]
    door = box_element("door", (0, 0, -9), (1, 1, 1), role=Role.FITTING)
    footing = box_element("footing", (0, 0, -1.25), (1, 1, 1), role=Role.STRUCTURE)
    with_footing = building_of(door, footing, box_element("a", (0, 0, 0), (1, 1, 1)))
    assert built_bounds_m(with_footing.elements)[0, 2] == -1.25
    with pytest.raises(SelectionError):
        built_bounds_m([door])


@pytest.mark.parametrize("turned", [-0.7, -0.3, 0.0, 0.2, 0.5, 0.78])
def test_the_yaw_of_a_turned_building_is_found(turned):
    building, _ = in_site_frame(frame_house(), ground_m=0.0, yaw_rad=-turned)
    assert dominant_yaw_rad(building) == pytest.approx(turned, abs=1e-6)


def test_a_stray_part_does_not_pull_the_yaw():
    house = frame_house()
    stray, _ = in_site_frame(building_of(box_element("stray", (20, 0, 0), (24, 0.2, 3))), ground_m=0, yaw_rad=0.4)
    assert dominant_yaw_rad(building_of(*house.elements, *stray.elements)) == pytest.approx(0.0, abs=1e-6)


def test_no_yaw_without_walls():
    assert dominant_yaw_rad(building_of()) == 0.0
