import math

import numpy as np
import pytest
from bimvox_pipeline.inspect.map_frame import ifc_to_map, metric_scale
from hypothesis import given
from hypothesis import strategies as st


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
