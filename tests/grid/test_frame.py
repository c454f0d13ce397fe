from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.grid.frame import GridFrame

frames = st.builds(
    GridFrame,
    st.tuples(*[st.floats(-1000, 1000)] * 3),
    st.sampled_from([0.05, 0.1, 0.2, 0.25, 0.3, 0.5, 1.0]),
)
cells = st.tuples(*[st.integers(-500, 500)] * 3)


@given(frames, cells)
def test_corner_and_centre_lie_in_their_cell(frame: GridFrame, cell: tuple[int, int, int]) -> None:
    assert frame.cell_of(frame.corner_of(cell)).tolist() == list(cell)
    assert frame.cell_of(frame.centre_of(cell)).tolist() == list(cell)


@given(frames, cells)
def test_cells_are_half_open(frame: GridFrame, cell: tuple[int, int, int]) -> None:
    h = frame.voxel_size_m
    assert frame.cell_of(frame.corner_of(cell) + 0.999 * h).tolist() == list(cell)
    assert frame.cell_of(frame.corner_of(cell) + h).tolist() == [n + 1 for n in cell]


@given(frames, cells, st.tuples(*[st.integers(1, 20)] * 3))
def test_a_box_of_whole_cells_is_covered_by_them(
    frame: GridFrame, cell: tuple[int, int, int], size: tuple[int, int, int]
) -> None:
    stop = np.array(cell) + size
    low, high = frame.cells_over(frame.corner_of(cell), frame.corner_of(stop))
    assert low.tolist() == list(cell)
    assert high.tolist() == stop.tolist()
    low, high = frame.cells_over(frame.centre_of(cell), frame.centre_of(stop))
    assert high.tolist() == (stop + 1).tolist()


def test_a_flat_box_is_covered_by_one_layer_and_many_points_go_at_once() -> None:
    frame = GridFrame((0.0, 0.0, 0.0), 0.25)
    low, high = frame.cells_over((0.0, 0.0, 0.5), (1.0, 1.0, 0.5))
    assert (low.tolist(), high.tolist()) == ([0, 0, 2], [4, 4, 3])
    assert frame.cell_of(np.zeros((5, 2, 3))).shape == (5, 2, 3)
    assert frame.centre_of([[0, 1, 2]]).tolist() == [pytest.approx([0.125, 0.375, 0.625])]


def test_a_cell_in_words_is_where_its_lowest_corner_is():
    assert GridFrame((-0.5, 1.0, -0.25), 0.25).in_words((2, 0, 1)) == "(0.0, 1.0, 0.0) m"
