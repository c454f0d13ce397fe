from __future__ import annotations

import numpy as np
import pytest
from box_grids import grid_of, random_shares
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.part_cells import all_part_cells, part_boxes, part_cells


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 99), st.tuples(*[st.integers(1, 9)] * 3), st.integers(1, 5))
def test_owned_and_shared_cells_are_both_met(seed: int, shape: tuple[int, int, int], parts: int) -> None:
    shares = random_shares(seed, shape, parts)
    grid = grid_of(shares)
    together = all_part_cells(grid)
    assert len(together) == parts
    for index, share in enumerate(shares):
        assert together[index].dtype == np.int32
        np.testing.assert_array_equal(together[index], np.argwhere(share > 0))
        np.testing.assert_array_equal(part_cells(grid, index), together[index])
        assert len(part_boxes(grid, index)) <= len(together[index])


def test_a_part_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(IndexError, match="part 1"):
        part_cells(grid_of([np.ones((1, 1, 1))]), 1)
