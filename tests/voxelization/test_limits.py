from __future__ import annotations

import itertools

import pytest

from bimvox.errors import GridTooLargeError
from bimvox.voxelization.limits import cell_count, default_voxel_size_m, require_fit, round_voxel_sizes_m


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
