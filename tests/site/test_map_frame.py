import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.site.config.file import parse_site_config
from bimvox.site.machine import cranes_of
from bimvox.site.map_frame import ifc_to_map, metric_scale, set_out


def test_no_conversion_is_no_transform() -> None:
    assert ifc_to_map({"crs": "EPSG:28992"}, "m") is None


def test_a_point_on_the_x_axis_goes_where_the_axis_points() -> None:
    georeference = {"eastings_m": 1000.0, "northings_m": 2000.0, "height_m": 5.0, "x_axis_yaw_rad": math.pi / 2}
    matrix = np.array(ifc_to_map(georeference, "m"))
    assert matrix @ [10.0, 0.0, 1.0, 1.0] == pytest.approx([1000.0, 2010.0, 6.0, 1.0])


@given(
    yaw_rad=st.floats(-math.pi, math.pi),
    points=st.lists(st.tuples(*[st.floats(-100, 100)] * 3), min_size=2, max_size=2),
)
def test_distances_are_kept(yaw_rad: float, points: list[tuple[float, float, float]]) -> None:
    georeference = {"eastings_m": 1e5, "northings_m": 4e5, "height_m": 3.0, "x_axis_yaw_rad": yaw_rad, "scale": 1.0}
    matrix = np.array(ifc_to_map(georeference, "m"))
    one, other = (matrix @ [*point, 1.0] for point in points)
    assert np.linalg.norm(one - other) == pytest.approx(np.linalg.norm(np.subtract(*points)), abs=1e-6)


@pytest.mark.parametrize(
    ("stated", "unit", "scale"),
    [(1.0, "mm", 1.0), (0.001, "mm", 1.0), (0.9996, "m", 0.9996), (0.3048, "ft", 1.0), (0.0009996, "mm", 0.9996)],
)
def test_the_scale_is_read_in_metres(stated: float, unit: str, scale: float) -> None:
    assert metric_scale(stated, unit) == pytest.approx(scale)


def test_a_surveyor_gets_every_crane_area_and_zone_on_the_map() -> None:
    georeference = {"eastings_m": 1000.0, "northings_m": 2000.0, "height_m": 5.0, "x_axis_yaw_rad": math.pi / 2}
    to_map = ifc_to_map(georeference, "m")
    assert to_map is not None
    text = """
        areas = { construction = [[0, 0], [10, 0], [10, 5]], yard = [[[20, 0], [30, 0], [30, 5]]] }
        crane = { name = "west", machine = "flat-top-75", base_m = [1, 2, 0.5] }
        zone = [{ kind = "prohibited", name = "street", polygon = [[0, -9], [4, -9], [4, -5]] }]
        model = { path = "a.ifc" }"""
    config = parse_site_config(text, "site.toml")
    site_to_ifc = np.eye(4)
    site_to_ifc[2, 3] = -1.0
    found = set_out(config, cranes_of(config), site_to_ifc, to_map)
    # The site's x axis points north, so its y axis points west, and north is a right turn from it.
    assert found["north_deg"] == -90.0
    assert found["cranes"] == {"west": [998.0, 2001.0, 4.5]}
    assert found["construction"][1] == [1000.0, 2010.0, 4.0]
    assert found["yard"] == [[[1000.0, 2020.0, 4.0], [1000.0, 2030.0, 4.0], [995.0, 2030.0, 4.0]]]
    assert found["zones"] == [
        {
            "kind": "prohibited",
            "name": "street",
            "corners": [[1009.0, 2000.0, 4.0], [1009.0, 2004.0, 4.0], [1005.0, 2004.0, 4.0]],
        }
    ]
    assert np.array(found["site_to_map"]) @ [1.0, 2.0, 0.5, 1.0] == pytest.approx([998.0, 2001.0, 4.5, 1.0])
