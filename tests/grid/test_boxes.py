from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bimvox.grid.boxes import boxes_of


@settings(deadline=None)
@given(hnp.arrays(np.bool_, hnp.array_shapes(min_dims=3, max_dims=3, min_side=1, max_side=6)))
def test_boxes_are_disjoint_and_their_union_is_the_shape(cells: np.ndarray) -> None:
    covered = np.zeros(cells.shape, int)
    for x0, y0, z0, x1, y1, z1 in boxes_of(cells):
        assert x0 < x1 and y0 < y1 and z0 < z1
        covered[x0:x1, y0:y1, z0:z1] += 1
    np.testing.assert_array_equal(covered, cells.astype(int))


@settings(deadline=None)
@given(st.tuples(*[st.integers(1, 5)] * 3))
def test_a_solid_box_is_one_box(shape: tuple[int, int, int]) -> None:
    assert boxes_of(np.ones(shape, np.bool_)).tolist() == [[0, 0, 0, *shape]]


def test_the_shape_is_left_as_it_was() -> None:
    cells = np.ones((2, 2, 2), np.bool_)
    boxes_of(cells)
    assert cells.all()
    assert boxes_of(np.zeros((2, 2, 2), np.bool_)).shape == (0, 6)
