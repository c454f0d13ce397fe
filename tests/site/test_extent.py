import numpy as np
import pytest
from box_buildings import box_element, building_of, frame_house
from box_sites import test_crane as some_crane
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.outline import mast_box_m
from bimvox.errors import ConfigError, GridTooLargeError
from bimvox.site.config.site_config import AreasConfig, GridConfig, ModelConfig, SiteConfig
from bimvox.site.placement import HEADROOM_M, MARGIN_VOX, site_extent, top_m

YARD = (((12.0, 0.0), (20.0, 0.0), (20.0, 5.0), (12.0, 5.0)),)


def site(size_m=0.25, **more) -> SiteConfig:
    return SiteConfig(model=ModelConfig(path="a.ifc", voxel_size_m=size_m), **more)


@given(st.sampled_from([0.1, 0.2, 0.25, 0.3, 0.5, 1.0]), st.floats(-40, 40), st.floats(-40, 40))
def test_covers_building_areas_and_mast_on_a_lattice_of_whole_cells(size_m, x, y):
    crane = some_crane(base=(x, y, 0.0))
    frame, shape = site_extent(site(size_m, areas=AreasConfig(yard=YARD)), frame_house(), crane)
    low, high = np.array(frame.origin_m), frame.corner_of(shape)
    margin = MARGIN_VOX * size_m - 1e-6
    for corner in (*np.array(mast_box_m(crane))[:, :2], *np.array(YARD[0]), (-0.5, -0.5), (8.5, 5.5)):
        assert (corner >= low[:2] + margin).all()
        assert (corner <= high[:2] - margin).all()
    assert frame.origin_m[2] == -size_m
    np.testing.assert_allclose(low / size_m, np.rint(low / size_m), atol=1e-9)
    assert high[2] >= top_m(frame_house()) - 1e-6
    assert top_m(frame_house()) == pytest.approx(4.2 + HEADROOM_M + 3.0)


def test_no_higher_than_the_crane_lifts_and_no_lower_than_the_building():
    for height, top in ((8.0, 7.0), (3.0, 4.25)):
        frame, shape = site_extent(site(), frame_house(), some_crane(height=height))
        assert frame.corner_of(shape)[2] == pytest.approx(top)


def test_the_papers_site():
    building = building_of(box_element("column", (7, 7, 0), (8, 8, 4), ifc_class="IfcColumn"))
    for low in ((0.0, 0.0), (0.0, 0.0, -1.0)):
        frame, shape = site_extent(site(1.0, grid=GridConfig(low_m=low, high_m=(15.0, 15.0, 5.0))), building, None)
        assert shape == (15, 15, 6)
        assert frame.origin_m == (0.0, 0.0, -1.0)


def test_an_explicit_extent_is_widened_to_whole_cells():
    grid = GridConfig(low_m=(0.3, -0.1), high_m=(2.1, 3.0, 4.9))
    frame, shape = site_extent(site(0.5, grid=grid), frame_house(), None)
    assert frame.origin_m == (0.0, -0.5, -0.5)
    assert shape == (5, 7, 11)


def test_a_slab_of_another_height_is_refused():
    with pytest.raises(ConfigError, match=r"low_m = \[0, 0, -0\.25\]") as caught:
        site_extent(site(grid=GridConfig(low_m=(0.0, 0.0, 0.0), high_m=(1.0, 1.0, 1.0))), frame_house(), None)
    assert caught.value.key == "grid.low_m"


def test_a_grid_that_is_too_large_is_refused_before_it_is_made():
    with pytest.raises(GridTooLargeError) as caught:
        site_extent(site(0.01), frame_house(), None)
    site_extent(site(caught.value.fitting_voxel_size_m), frame_house(), None)
