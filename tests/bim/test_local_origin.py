from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.site_frame import FAR_M, local_origin, stray


def cube(x: float, y: float, z: float) -> np.ndarray:
    return np.array([[x, y, z], [x + 1, y + 1, z + 1]])


@given(st.floats(-6e6, 6e6), st.floats(-6e6, 6e6), st.floats(-500, 500))
def test_the_origin_is_whole_metres_and_near(x: float, y: float, z: float) -> None:
    origin = local_origin([cube(x, y, z)])
    assert np.array_equal(origin, np.floor(origin))
    assert origin[2] == 0.0
    for place, shift in zip((x, y), origin[:2], strict=True):
        assert abs(place - shift) <= FAR_M + 1


def test_no_origin_where_the_model_reaches_near_zero() -> None:
    assert local_origin([cube(0, 0, 0), cube(5e6, 0, 0)]).tolist() == [0, 0, 0]
    assert local_origin([]).tolist() == [0, 0, 0]


def test_strays() -> None:
    assert stray([cube(0, 0, 0), cube(2, 0, 0), cube(5000, 0, 0)]).tolist() == [2]
    assert stray([]).tolist() == []
