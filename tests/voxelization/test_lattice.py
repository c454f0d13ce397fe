from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.errors import GridTooLargeError, InputError
from bimvox.voxelization.lattice import (
    SAMPLES,
    TOLERANCE_M,
    cell_count,
    cell_range,
    default_voxel_size_m,
    lattice_triangles,
    require_fit,
    round_voxel_sizes_m,
    rounded,
    sample_lines,
    tolerance_vox,
)


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


def test_the_offered_sizes_continue_beyond_half_a_metre() -> None:
    assert list(itertools.islice(round_voxel_sizes_m(), 8)) == [0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 4.0]


def test_cells_on_borders_are_not_counted_twice() -> None:
    assert cell_count([[0, 0, 0], [1, 2, 3]], 0.1) == 10 * 20 * 30
    assert cell_count([[0.05, 0, 0], [1.05, 2, 3]], 0.1) == 11 * 20 * 30


@pytest.mark.parametrize(
    ("size_m", "expected"),
    [
        (1.0, 0.05),
        (13.5, 0.05),
        (13.6, 0.1),
        (27.1, 0.1),
        (27.2, 0.2),
        (54.2, 0.2),
        (60.0, 0.25),
        (100.0, 0.5),
        (8600.0, 32.0),
    ],
)
def test_the_default_is_the_smallest_size_below_twenty_million_cells(size_m: float, expected: float) -> None:
    assert default_voxel_size_m([[0, 0, 0], [size_m] * 3]) == expected


def test_too_many_cells_are_refused_with_a_size_that_fits() -> None:
    require_fit([0, 0, 0], [100, 100, 100], 0.1, 1_000_000)
    with pytest.raises(GridTooLargeError) as caught:
        require_fit([0, 0, 0], [100, 100, 101], 0.1, 1_000_000)
    assert caught.value.cells == 1_010_000
    assert caught.value.fitting_voxel_size_m == 0.2
    assert "--voxel-size 0.2" in str(caught.value)


def test_a_quarter_turn_permutes_the_lines_exactly() -> None:
    positions = sample_lines().T
    turned = np.stack([1.0 - positions[:, 1], positions[:, 0]], axis=1)
    assert sorted(map(tuple, turned.tolist())) == sorted(map(tuple, positions.tolist()))


def test_every_strip_and_every_block_has_one_line() -> None:
    positions = sample_lines().T
    for axis in (0, 1):
        assert sorted(np.floor(positions[:, axis] * SAMPLES).astype(int)) == list(range(SAMPLES))
    blocks = np.floor(positions * 4).astype(int)
    assert len(set(map(tuple, blocks.tolist()))) == SAMPLES
