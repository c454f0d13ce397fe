from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.frame import GridFrame
from bimvox.rendering.pictures.camera import Camera, View, fitted_camera
from bimvox.rendering.pictures.raycast import cast, cropped, first_hit, light_for, tops

FRAME = GridFrame((10.0, -4.0, 2.0), 0.5)


def camera_on(shape, size_px=(96, 64), view=None) -> Camera:
    ends = FRAME.corner_of(np.array([(0, 0, 0), shape]))
    corners = np.array([(ends[a, 0], ends[b, 1], ends[c, 2]) for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    return fitted_camera(view or View(), corners, size_px, (4.0, 4.0, size_px[0] - 4.0, size_px[1] - 4.0))


def look(solids, camera, view=None):
    return cast(solids, FRAME, camera, light_for(view or View()), 1, lines=0.0)


@given(st.tuples(st.integers(0, 7), st.integers(0, 5), st.integers(0, 4)), st.floats(-180, 180), st.floats(8, 80))
@settings(max_examples=30, deadline=None)
def test_a_single_cell_is_where_the_projection_says(cell, azimuth, elevation):
    view = View(azimuth, elevation)
    solids = np.zeros((8, 6, 5), np.uint16)
    solids[cell] = 7
    camera = camera_on(solids.shape, view=view)
    buffers = look(solids, camera, view)
    x, y, depth = camera.project(FRAME.centre_of(np.array(cell)))
    # The pixel at the middle of the cell shows the cell, and its depth is at most half a diagonal nearer.
    assert buffers.solid[int(y), int(x)] == 7
    assert 0.0 < depth - buffers.depth_m[int(y), int(x)] <= 0.5 * np.sqrt(3) / 2 + 0.02
    # No pixel outside the projected corners shows it.
    corners = FRAME.corner_of(np.array(cell) + np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]))
    seen = camera.project(corners)
    rows, columns = np.nonzero(buffers.solid)
    assert columns.min() + 0.5 >= seen[:, 0].min() - 1e-6
    assert columns.max() + 0.5 <= seen[:, 0].max() + 1e-6
    assert rows.min() + 0.5 >= seen[:, 1].min() - 1e-6
    assert rows.max() + 0.5 <= seen[:, 1].max() + 1e-6


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_the_first_hit_is_the_nearest_filled_cell_on_the_ray(seed):
    rng = np.random.default_rng(seed)
    solids = (rng.random((7, 6, 5)) < 0.08).astype(np.uint16)
    origin, aim = rng.uniform(-12, 18, 3), rng.uniform(0, 5, 3)
    direction = aim - origin
    i, j, k, axis, along = first_hit(solids, tops(solids), *origin, *direction)
    # Independent reference: intersect the ray with the box of every filled cell.
    best = np.inf
    for cell in np.argwhere(solids):
        a, b = (cell - origin) / direction, (cell + 1 - origin) / direction
        enter, leave = np.minimum(a, b).max(), np.maximum(a, b).min()
        if leave > max(enter, 0.0) + 1e-9:
            best = min(best, max(enter, 0.0))
    if axis < 0:
        assert best == np.inf
    else:
        assert solids[i, j, k]
        assert along == pytest.approx(best, abs=1e-6)


def test_level_ground_in_the_open_has_its_exact_colour_and_shadow_is_darker():
    solids = np.zeros((40, 40, 12), np.uint16)
    solids[:, :, 0] = 1
    view, open_ground = View(-60.0, 35.0), solids.copy()
    solids[18:22, 18:22, 1:] = 2
    camera = camera_on(solids.shape, (240, 200), view)
    without, with_tower = look(open_ground, camera, view), look(solids, camera, view)
    x, y, _ = camera.project(FRAME.corner_of(np.array([20, 20, 1])))
    assert without.light[int(y), int(x)] == pytest.approx(1.0, abs=0.02)
    # The shadow is on the side away from the sun.
    sun = light_for(view).directions(1)[0]
    shadow = np.array([20, 20, 1]) - 6.0 * sun / sun[2] * [1, 1, 0]
    x, y, _ = camera.project(FRAME.corner_of(shadow))
    assert with_tower.solid[int(y), int(x)] == 1
    assert with_tower.light[int(y), int(x)] < 0.8 * without.light[int(y), int(x)]


def test_corners_between_solids_are_darker():
    solids = np.zeros((40, 40, 12), np.uint16)
    solids[:, :, 0] = 1
    solids[:, 20:, 1:] = 2
    view = View(-90.0, 35.0)
    camera = camera_on(solids.shape, (240, 200), view)
    buffers = look(solids, camera, view)

    def light_at(cells) -> float:
        x, y, _ = camera.project(FRAME.corner_of(np.array(cells)))
        return float(buffers.light[int(y), int(x)])

    assert light_at((10.5, 19.8, 1)) < light_at((10.5, 10.5, 1))


def test_rows_are_shared_among_threads_without_a_trace():
    rng = np.random.default_rng(3)
    solids = (rng.random((20, 20, 10)) < 0.2).astype(np.uint16) * rng.integers(1, 9, (20, 20, 10)).astype(np.uint16)
    camera = camera_on(solids.shape, (150, 130))
    first, second = look(solids, camera), look(solids, camera)
    for name in ("solid", "plane", "depth_m", "light"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_cropping_keeps_all_that_is_filled():
    solids = np.zeros((9, 8, 7), np.uint16)
    assert cropped(solids)[1].size == 0
    solids[2, 3, 4] = 5
    solids[6, 3, 5] = 6
    low, box = cropped(solids)
    assert low.tolist() == [2, 3, 4]
    assert box.shape == (5, 1, 2)
    assert np.count_nonzero(box) == 2


def test_nothing_is_seen_where_nothing_is():
    buffers = look(np.zeros((4, 4, 4), np.uint16), camera_on((4, 4, 4)))
    assert not buffers.solid.any()
    assert np.isinf(buffers.depth_m).all()
