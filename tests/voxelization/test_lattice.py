from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.errors import InputError
from bimvox.voxelization.lattice import TOLERANCE_M, cell_range, lattice_triangles, rounded, tolerance_vox


def test_the_tolerance_is_a_tenth_of_a_millimetre_but_small_relative_to_a_cell() -> None:
    assert tolerance_vox(0.25) == pytest.approx(TOLERANCE_M / 0.25)
    assert tolerance_vox(0.001) == 0.01


@given(st.integers(-(10**6), 10**6), st.sampled_from([0.05, 0.1, 0.2, 0.25, 0.3, 0.5]))
def test_multiples_of_the_cell_lie_exactly_on_borders(n: int, h: float) -> None:
    assert rounded(n * h, 0.0, h) == n


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 1.0, (0, 1)),
        (0.0, 1.0003, (0, 1)),
        (-0.0003, 1.001, (0, 2)),
        (0.5, 0.6, (0, 1)),
        (1.0, 1.0, (1, 2)),
        (0.9998, 1.0002, (1, 2)),
        (0.99, 0.9998, (0, 1)),
        (-1.0, -1.0, (-1, 0)),
    ],
)
def test_ranges_do_not_spill_and_are_never_empty(low: float, high: float, expected: tuple[int, int]) -> None:
    start, stop = cell_range(np.full(3, low), np.full(3, high), 0.25)
    assert (start.tolist(), stop.tolist()) == ([expected[0]] * 3, [expected[1]] * 3)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e12])
def test_coordinates_out_of_range_are_refused(value: float) -> None:
    with pytest.raises(InputError, match="vertex"):
        lattice_triangles(np.array([[value, 0.0, 0.0]]), np.zeros((1, 3), np.int32), 0.1, (0.0, 0.0, 0.0))
