from __future__ import annotations

import numpy as np
import pytest
from reference import box_mesh, moved, rotation

from bimvox.voxelization.building import Ownership
from bimvox.voxelization.part import voxelize_mesh

LOW, HIGH = np.array([-10, -10, -10]), np.array([11, 13, 15])


def filled(parts: int = 6) -> Ownership:
    rng = np.random.default_rng(2)
    owners = Ownership(LOW, HIGH, parts)
    for index in range(6):
        half = rng.uniform(0.1, 0.6, size=3)
        mesh = moved(box_mesh(-half, half), turn=rotation(rng), by=rng.uniform(-0.4, 0.4, size=3))
        owners.add(index, voxelize_mesh(mesh, 0.1, clip=(LOW, HIGH)))
    return owners


def test_room_is_made_as_it_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    reserved = filled()
    monkeypatch.setattr("bimvox.voxelization.building._RESERVED", 0)
    grown = filled()
    for a, b in zip(reserved.shared(), grown.shared(), strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(reserved.owners().dense(), grown.owners().dense())


@pytest.mark.parametrize(
    ("parts", "dtype"), [(255, np.uint8), (256, np.uint16), (65_535, np.uint16), (70_000, np.uint32)]
)
def test_cells_are_as_narrow_as_the_number_of_parts_allows(parts: int, dtype: type) -> None:
    bricks = filled(parts).owners()
    assert bricks.cells.dtype == dtype
    np.testing.assert_array_equal(bricks.dense(), filled().owners().dense())


def test_the_last_part_of_many_owns_its_cells() -> None:
    owners = Ownership(np.zeros(3, np.int64), np.array([9, 9, 9]), 70_000)
    owners.add(69_999, voxelize_mesh(box_mesh((0, 0, 0), (1, 1, 9)), 1.0))
    assert owners.owners().dense().max() == 69_999


def test_a_part_inside_another_is_listed_and_loses_ties() -> None:
    owners = Ownership(np.zeros(3, np.int64), np.array([20, 20, 20]), 2)
    owners.add(0, voxelize_mesh(box_mesh((0, 0, 0), (20, 20, 20)), 1.0))
    owners.add(1, voxelize_mesh(box_mesh((8, 8, 8), (17, 16, 16)), 1.0))
    cells, parts, shares = owners.shared()
    assert len(cells) == 2 * 9 * 8 * 8
    assert parts.tolist() == [0, 1] * (9 * 8 * 8)
    assert np.all(shares == 1.0)
    bricks = owners.owners()
    assert np.all(bricks.index == -2)
    assert len(bricks.cells) == 0
