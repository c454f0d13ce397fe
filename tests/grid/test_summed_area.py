from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bimvox.grid.summed_area import box_sum, boxes_of, summed_area_table, top_of_columns, update_table

grids = hnp.arrays(np.bool_, hnp.array_shapes(min_dims=3, max_dims=3, min_side=1, max_side=7))


@settings(deadline=None)
@given(grids, st.data())
def test_any_box_sums_to_the_cells_in_it(occupied: np.ndarray, data: st.DataObject) -> None:
    table = summed_area_table(occupied)
    assert table.shape == tuple(n + 1 for n in occupied.shape)
    ends = [sorted(data.draw(st.tuples(st.integers(0, n), st.integers(0, n)))) for n in occupied.shape]
    (x0, x1), (y0, y1), (z0, z1) = ends
    assert box_sum(table, x0, y0, z0, x1, y1, z1) == occupied[x0:x1, y0:y1, z0:z1].sum()


@settings(deadline=None)
@given(grids)
def test_the_table_is_the_running_sum_along_all_axes(occupied: np.ndarray) -> None:
    expected = occupied.astype(np.int32).cumsum(0).cumsum(1).cumsum(2)
    table = summed_area_table(occupied)
    np.testing.assert_array_equal(table[1:, 1:, 1:], expected)
    assert not table[0].any()
    assert not table[:, 0].any()
    assert not table[:, :, 0].any()


@settings(deadline=None)
@given(grids)
def test_the_top_is_one_above_the_highest_occupied_cell(occupied: np.ndarray) -> None:
    top = top_of_columns(occupied)
    for i, j in np.ndindex(occupied.shape[:2]):
        filled = np.flatnonzero(occupied[i, j])
        assert top[i, j] == (filled[-1] + 1 if filled.size else 0)


@settings(max_examples=60, deadline=None)
@given(hnp.arrays(np.uint16, st.tuples(*[st.integers(1, 7)] * 3), elements=st.integers(0, 2)), st.data())
def test_an_updated_table_equals_a_new_one(counts: np.ndarray, data: st.DataObject) -> None:
    table = summed_area_table(counts > 0)
    for _ in range(3):
        low = [data.draw(st.integers(0, size - 1)) for size in counts.shape]
        high = [data.draw(st.integers(at + 1, size)) for at, size in zip(low, counts.shape, strict=True)]
        box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        counts[box] = data.draw(hnp.arrays(np.uint16, counts[box].shape, elements=st.integers(0, 2)))
        below = np.zeros((*counts.shape[:2], counts.shape[2] + 1), np.uint16)
        below[:, :, 1:] = np.cumsum(counts > 0, axis=2)
        update_table(table, below, *low)
        assert np.array_equal(table, summed_area_table(counts > 0))


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
