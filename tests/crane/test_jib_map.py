"""Where jib and counterweight of a luffing crane are clear of a height map."""

from __future__ import annotations

from math import cos, radians

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.jib_map import jib_blocked
from bimvox.crane.luffing import LuffingJib

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
