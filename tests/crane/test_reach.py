from __future__ import annotations

import dataclasses
from dataclasses import replace
from math import cos, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import HAMMERHEADS, LUFFING_CRANES, default_crane, default_luffing_crane
from numpy.typing import NDArray

from bimvox.crane.load_chart import capacity_kg, utilisation
from bimvox.crane.reach import (
    HOOK_BLOCK_M,
    HOOK_FORBIDDEN,
    allowed_radii_m,
    built_heights,
    counted_kg,
    distance_to_polygon_m,
    distances_m,
    highest_hooks_m,
    hook_floor,
    hook_top,
    jib_blocked,
    pivoted,
    points_blocked,
    radii_for_m,
    standing,
)
from bimvox.crane.tower_crane import AxisLimits, LuffingJib
from bimvox.grid.frame import GridFrame


def brute_force(crane, frame, top, mass_kg, rope):
    floor = np.full(top.shape, HOOK_FORBIDDEN)
    for i, j in np.ndindex(top.shape):
        x, y, _ = frame.centre_of((i, j, 0))
        radius = float(np.hypot(x - crane.base_m[0], y - crane.base_m[1]))
        lowest = int(top[i, j]) if rope else 0
        slings_end_m = frame.corner_of((i, j, lowest))[2] + crane.sling_m
        if (
            crane.min_radius_m <= radius <= crane.jib_length_m
            and capacity_kg(crane.chart, radius) >= mass_kg + crane.tackle_kg
            and slings_end_m <= crane.jib_height_m + 1e-6
        ):
            floor[i, j] = lowest
    return floor


def hook_allowed(crane, frame, shape, mass_kg):
    return hook_floor(crane, frame, np.zeros(shape, np.int32), mass_kg, rope=False) != HOOK_FORBIDDEN


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-30.0, 50.0), st.floats(-30.0, 50.0), st.floats(0.0, 9000.0), st.booleans())
def test_the_floor_is_that_of_brute_force(seed, x, y, mass_kg, rope):
    crane = default_crane("hammerhead-45", (x, y, 0.0), jib_height_m=9.0)
    frame = GridFrame((-3.0, 4.0, -0.7), 0.7)
    top = np.random.default_rng(seed).integers(0, 20, (23, 31)).astype(np.int32)
    assert (hook_floor(crane, frame, top, mass_kg, rope) == brute_force(crane, frame, top, mass_kg, rope)).all()


def test_without_a_crane_nothing_is_forbidden():
    top = np.full((4, 5), 3, np.int32)
    floor = hook_floor(None, GridFrame((0.0, 0.0, 0.0), 1.0), top, 1e9, rope=True)
    assert floor.dtype == np.int32
    assert (floor == 0).all()
    assert hook_allowed(None, GridFrame((0.0, 0.0, 0.0), 1.0), (4, 5), 1e9).all()


def test_a_load_too_heavy_may_be_nowhere():
    crane = dataclasses.replace(default_crane("hammerhead-45"), min_radius_m=0.0)
    low_m, high_m = allowed_radii_m(crane, 8000.0)  # at most 8 t, which includes the slings
    assert high_m < low_m
    assert not hook_allowed(crane, GridFrame((-0.5, -0.5, 0.0), 1.0), (40, 40), 8000.0).any()


def test_a_heavier_load_reaches_less_far():
    crane = default_crane("hammerhead-45")
    frame = GridFrame((-50.0, -50.0, 0.0), 1.0)
    light, heavy = (hook_allowed(crane, frame, (100, 100), mass) for mass in (1000.0, 5000.0))
    assert heavy.sum() < light.sum()
    assert not (heavy & ~light).any()
    assert allowed_radii_m(crane, 1000.0) == pytest.approx((2.8, 45.0))


def test_a_load_reaches_less_far_if_less_of_the_capacity_is_permitted():
    crane = default_crane("hammerhead-45")
    _, whole_m = allowed_radii_m(crane, 4000.0)
    _, less_m = allowed_radii_m(crane, 4000.0, 0.8)
    hung_kg = 4000.0 + crane.tackle_kg
    assert less_m < whole_m
    assert utilisation(crane.chart, less_m, hung_kg) <= 0.8 < utilisation(crane.chart, less_m + 0.01, hung_kg)
    assert allowed_radii_m(crane, counted_kg(crane, 4000.0, 0.8)) == pytest.approx((crane.min_radius_m, less_m))
    assert counted_kg(crane, 4000.0, 1.0) == 4000.0


ANY = AxisLimits(1.0, 1.0, 1.0)
JIB = LuffingJib(0.5, 2.0, 11.0, (radians(10), radians(80)), ANY, ANY, 2.5, 1.5, 1.6, 1.0)
SIZE_M = 0.5
BASE_M = (6.2, 5.1, 0.0)
OWN_M = 0.7
SHAPE = (26, 22)
TOWERS = st.lists(st.tuples(st.integers(0, 25), st.integers(0, 21), st.integers(1, 24)), max_size=6)


def blocked(top: NDArray[np.int32]) -> NDArray[np.bool_]:
    return jib_blocked(JIB, BASE_M, (0.0, 0.0, 0.0), SIZE_M, top, OWN_M, (2.0, 11.0))


def heights(towers: list[tuple[int, int, int]]) -> NDArray[np.int32]:
    top = np.zeros(SHAPE, np.int32)
    for i, j, height in towers:
        top[i, j] = height
    return top


def jib_is_in_a_cell(top: NDArray[np.int32], i: int, j: int) -> bool:
    """Whether the middle line of the jib above a column's middle, or that of its counterweight, is in a cell."""
    aim = (np.array([i, j]) + 0.5) * SIZE_M - BASE_M[:2]
    radius_m = float(np.hypot(*aim))
    share = (radius_m - JIB.pivot_offset_m) / JIB.length_m
    if not cos(JIB.luff_rad[1]) <= share <= cos(JIB.luff_rad[0]) or radius_m < 2.0:
        return False
    along_m = np.arange(-JIB.tail_radius_m, radius_m, 0.05)
    slope = np.sqrt(1.0 - share**2) / share
    height_m = np.where(along_m < 0.0, JIB.tail_low_m, JIB.pivot_height_m + (along_m - JIB.pivot_offset_m) * slope)
    cells = np.floor((np.outer(along_m, aim / radius_m) + BASE_M[:2]) / SIZE_M).astype(int)
    own = (np.abs(np.outer(along_m, aim / radius_m)) <= OWN_M + 2.0 * SIZE_M).all(axis=1)
    part = (along_m < 0.0) | (along_m >= JIB.pivot_offset_m)
    inside = ((cells >= 0) & (cells < SHAPE)).all(axis=1) & part & ~own
    return bool((top[tuple(cells[inside].T)] * SIZE_M > height_m[inside]).any())


@settings(max_examples=60)
@given(TOWERS)
def test_where_the_jib_would_be_in_a_cell_the_hook_may_not_be(towers: list[tuple[int, int, int]]) -> None:
    top = heights(towers)
    found = blocked(top)
    for i, j in np.ndindex(SHAPE):
        assert found[i, j] or not jib_is_in_a_cell(top, i, j), (i, j)


@given(TOWERS, TOWERS)
def test_more_cells_never_free_a_column(some: list[tuple[int, int, int]], more: list[tuple[int, int, int]]) -> None:
    fewer = heights(some)
    assert not (blocked(fewer) & ~blocked(np.maximum(fewer, heights(more)))).any()


def test_only_what_is_higher_than_the_jib_blocks_columns() -> None:
    assert not blocked(heights([])).any()
    assert not blocked(np.full(SHAPE, 1, np.int32)).any(), "below pivot and counterweight"
    behind = blocked(heights([(22, 10, 24)]))
    assert behind[24, 10]
    assert not behind[:10].any(), "the other side of the crane; the counterweight is shorter"


def test_a_map_that_was_changed_in_place_is_looked_at_again() -> None:
    top = heights([])
    assert not blocked(top).any()
    top[20, 10] = 24
    assert blocked(top).any()
    assert np.array_equal(blocked(top.copy()), blocked(top))


def test_the_hook_of_a_standing_machine_reaches_the_height():
    crane = standing(HAMMERHEADS[0], 18.0)
    assert crane.jib_height_m == 18.0 + HOOK_BLOCK_M
    assert crane.highest_hook_m >= 18.0


def test_many_radii_and_distances_are_those_of_each():
    crane, masses = HAMMERHEADS[1], np.array([1500.0, 300.0, 1500.0, 60_000.0])
    found = radii_for_m(crane, masses)
    assert found.tolist() == [list(allowed_radii_m(crane, mass)) for mass in masses.tolist()]
    assert capacity_kg(crane.chart, found[0, 1]) >= 1500.0 + crane.tackle_kg - 1e-6
    assert found[3, 1] < found[3, 0]
    assert distances_m(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[3.0, 4.0]])).tolist() == [[5.0], [4.0]]


@settings(max_examples=50, deadline=None)
@given(st.floats(-10.0, 40.0), st.floats(-10.0, 40.0))
def test_distance_to_a_polygon_is_that_of_shapely(x, y):
    from shapely.geometry import Point, Polygon

    corners = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [12.0, 10.0], [12.0, 25.0], [0.0, 25.0]])
    found = distance_to_polygon_m(np.array([[x, y]]), corners)[0]
    assert found == pytest.approx(Polygon(corners).distance(Point(x, y)), abs=1e-9)


def test_default_cranes_ascend_by_size():
    assert [crane.jib_length_m for crane in HAMMERHEADS] == [30.0, 45.0, 65.0, 75.0]


def test_a_height_map_is_the_highest_of_its_boxes():
    boxes = np.array([[[0.0, 0.0, 0.0], [2.0, 1.0, 3.0]], [[1.0, 0.0, 2.0], [3.0, 1.0, 5.2]]])
    built = built_heights(boxes, 0.5)
    assert built.origin_m == (0.0, 0.0)
    assert built.top.shape == (6, 2)
    assert built.top[:, 0].tolist() == [6, 6, 11, 11, 11, 11]


def test_a_luffing_tower_crane_is_as_high_as_it_must_be():
    low, high = (standing(LUFFING_CRANES[0], hook_m) for hook_m in (9.2, 30.0))
    assert low.luffing.tail_low_m == 9.5
    assert high.luffing.pivot_height_m - low.luffing.pivot_height_m == pytest.approx(20.5)
    assert low.highest_hook_m > low.luffing.pivot_height_m


def test_a_mobile_crane_is_as_high_as_it_is():
    crane = default_luffing_crane("mobile-60t")
    assert pivoted(crane, crane.luffing, 99.0) is crane
    assert not (highest_hooks_m(crane.luffing, np.linspace(0.0, 100.0, 50)) >= 60.0).any()


def test_a_building_blocks_the_boom_from_places_beyond_it():
    built = built_heights(np.array([[[0.0, 0.0, 0.0], [3.0, 8.0, 16.0]], [[0.0, 0.0, 0.0], [16.0, 8.0, 3.0]]]))
    points = np.array([[6.0, 2.0], [6.0, 6.0], [14.0, 4.0], [7.0, -10.0]])
    behind = replace(default_luffing_crane("mobile-60t"), base_m=(-6.0, 4.0, 0.0))
    assert points_blocked(behind, behind.luffing, points, built) > 0
    in_front = replace(behind, base_m=(20.0, -4.0, 0.0))
    assert points_blocked(in_front, in_front.luffing, points, built) == 0


CORNERS_M = st.tuples(*(st.floats(0.1, far_m) for far_m in (9.0, 3.0, 9.0, 3.0)))


@settings(max_examples=60, deadline=None)
@given(
    CORNERS_M, st.integers(0, 3), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)
)
def test_a_load_below_its_ceiling_is_below_the_boom_at_every_hook_of_its_column(far_m, turn, i, j, out_x, out_y):
    crane = default_luffing_crane("mobile-60t")
    jib = crane.luffing
    frame, columns = GridFrame((-25.0, -25.0, 0.0), 0.5), (100, 100)
    low_x, low_y, high_x, high_y = -far_m[0], -far_m[1], far_m[2], far_m[3]
    if turn % 2:
        low_x, low_y, high_x, high_y = low_y, low_x, high_y, high_x
    top = hook_top(crane, frame, (*columns, 200), (low_x, low_y, high_x, high_y))
    x, y = int(i * 99), int(j * 99)
    hook_m = np.array([-25.0 + 0.5 * (x + 0.5 + out_x), -25.0 + 0.5 * (y + 0.5 + out_y)]) - crane.base_m[:2]
    radius_m = float(np.hypot(*hook_m))
    if not jib.radii_m[0] + 1.5 <= radius_m <= jib.radii_m[1] - 1.0 or top[x, y] < 0:
        return
    along = hook_m / radius_m
    # The solid: a band of the boom's width from its pivot to its tip, above the load's top.
    load_m = np.stack(np.meshgrid(np.linspace(low_x, high_x, 60), np.linspace(low_y, high_y, 60)), axis=-1).reshape(
        -1, 2
    )
    at_m, aside_m = radius_m + load_m @ along, load_m @ np.array([-along[1], along[0]])
    below = (np.abs(aside_m) <= jib.width_m / 2.0) & (at_m > jib.pivot_offset_m) & (at_m <= radius_m)
    rise = np.sqrt(jib.length_m**2 - (radius_m - jib.pivot_offset_m) ** 2) / (radius_m - jib.pivot_offset_m)
    boom_m = jib.pivot_height_m + (at_m[below] - jib.pivot_offset_m) * rise
    assert (0.5 * top[x, y] <= boom_m).all()


def test_a_panel_across_the_boom_hangs_nearer_than_one_along_it():
    crane = default_luffing_crane("mobile-60t")
    frame, shape = GridFrame((-25.0, -25.0, 0.0), 0.5), (100, 100, 200)
    across, along = (hook_top(crane, frame, shape, one) for one in ((-0.1, -9.0, 0.1, 9.0), (-9.0, -0.1, 9.0, 0.1)))
    x, y = (int((crane.base_m[axis] + out_m + 25.0) / 0.5) for axis, out_m in enumerate((10.0, 0.0)))
    disc = hook_top(crane, frame, shape, float(np.hypot(9.0, 0.1)))
    assert across[x, y] > along[x, y] >= disc[x, y]
    assert (np.minimum(across, along) >= disc).all()
    # Beside it, the same panels change their roles.
    x, y = (int((crane.base_m[axis] + out_m + 25.0) / 0.5) for axis, out_m in enumerate((0.0, 10.0)))
    assert along[x, y] > across[x, y] >= disc[x, y]
