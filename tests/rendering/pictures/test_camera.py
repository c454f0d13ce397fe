from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.errors import InputError
from bimvox.rendering.pictures.camera import View, fitted_camera

ANGLES = st.floats(-720, 720), st.floats(5, 89)


@given(*ANGLES, st.lists(st.tuples(*[st.floats(-100, 100)] * 3), min_size=2, max_size=12))
def test_everything_lies_in_the_frame_and_touches_it(azimuth, elevation, points):
    points = np.array([*points, (0.0, 0.0, 0.0), (3.0, 2.0, 1.0)])
    camera = fitted_camera(View(azimuth, elevation), points, (200, 100), (10.0, 20.0, 190.0, 95.0))
    x, y, depth = camera.project(points).T
    assert depth.min() > 0.0
    assert x.min() >= 10 - 1e-6
    assert x.max() <= 190 + 1e-6
    assert y.min() >= 20 - 1e-6
    assert y.max() <= 95 + 1e-6
    fills_x = np.isclose(x.min(), 10) and np.isclose(x.max(), 190)
    fills_y = np.isclose(y.min(), 20) and np.isclose(y.max(), 95)
    assert fills_x or fills_y


@given(*ANGLES)
def test_the_axes_are_right_handed_and_up_is_up(azimuth, elevation):
    camera = fitted_camera(View(azimuth, elevation), [(0, 0, 0), (1, 1, 1)], (64, 64), (0.0, 0.0, 64.0, 64.0))
    np.testing.assert_allclose(np.cross(camera.right, camera.up), -camera.forward, atol=1e-12)
    high, low = camera.project([(0.5, 0.5, 1.0), (0.5, 0.5, 0.0)])
    assert high[1] < low[1]


def test_the_eye_stands_where_the_azimuth_says():
    camera = fitted_camera(View(90.0, 30.0), [(-1, -1, -1), (1, 1, 1)], (64, 64), (0.0, 0.0, 64.0, 64.0))
    assert camera.eye_m[0] == pytest.approx(0.0, abs=1e-9)
    assert camera.eye_m[1] > 0.0
    assert camera.eye_m[2] == pytest.approx(camera.eye_m[1] * np.tan(np.radians(30.0)))


def test_more_samples_show_the_same():
    camera = fitted_camera(View(), [(-1, -1, -1), (1, 1, 1)], (64, 48), (4.0, 4.0, 60.0, 44.0))
    point = (0.3, -0.2, 0.9)
    np.testing.assert_allclose(camera.scaled(3).project(point)[:2], 3 * camera.project(point)[:2])


@pytest.mark.parametrize("view", [(float("nan"), 30.0), (float("inf"), 30.0), (0.0, 4.0), (0.0, 90.0)])
def test_a_view_that_cannot_be_is_refused(view):
    with pytest.raises(InputError):
        View(*view)
