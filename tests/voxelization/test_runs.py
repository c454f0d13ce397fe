from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.summed_area import boxes_of
from bimvox.voxelization.bits import CellPlanes, pack
from bimvox.voxelization.runs import (
    FilledCells,
    dense_cells,
    dense_fractions,
    dense_shares,
    greedy_boxes,
    runs_of,
    share_starts,
    whole_run_boxes,
)
from bimvox.voxelization.sweep import FULL

AIR, SURFACE, INSIDE, BORDER = range(4)


def random_kinds(seed: int, height: int) -> np.ndarray:
    """Return columns in stretches of one kind, so that runs are long and cross word borders."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(4, size=(3, 4, height), p=[0.3, 0.3, 0.3, 0.1])
    hold = rng.random(kinds.shape) < rng.choice([0.0, 0.7, 0.97])
    for k in range(1, height):
        kinds[:, :, k] = np.where(hold[:, :, k], kinds[:, :, k - 1], kinds[:, :, k])
    return kinds


def cells_of(kinds: np.ndarray) -> CellPlanes:
    return CellPlanes(*(pack(kinds == kind) for kind in (SURFACE, INSIDE, BORDER)), kinds.shape[2])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 7, 63, 64, 65, 150]), st.data())
def test_runs_are_the_cells_of_a_box_with_their_shares(seed: int, height: int, data: st.DataObject) -> None:
    kinds = random_kinds(seed, height)
    low = np.array([data.draw(st.integers(0, n - 1)) for n in kinds.shape])
    high = np.array([data.draw(st.integers(a + 1, n)) for a, n in zip(low, kinds.shape, strict=True)])
    cells = cells_of(kinds)
    shares = np.random.default_rng(seed).integers(0, FULL, size=np.count_nonzero(kinds == SURFACE)).astype(np.uint16)
    columns, runs, kept, count = runs_of(FilledCells(cells, share_starts(cells.met), shares, 99), low, high)
    window = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    shape = tuple(int(n) for n in high - low)
    np.testing.assert_array_equal(dense_cells(shape, columns, runs), kinds[window] != AIR)
    assert count == np.count_nonzero(kinds[window])
    full = np.select([kinds == INSIDE, kinds == BORDER], [FULL, 99], 0)
    full[kinds == SURFACE] = shares
    np.testing.assert_array_equal(dense_fractions(shape, columns, runs, kept), full[window] / np.float32(FULL))
    dense = np.where(kinds == BORDER, 0, full)
    np.testing.assert_array_equal(dense_shares(cells, shares), dense)
    # Maximal: two runs that touch are of different kinds.
    for first, stop in columns:
        rows = runs[first:stop]
        touching = rows[1:, 0] == rows[:-1, 1]
        assert np.all((rows[1:, 2] < 0)[touching] != (rows[:-1, 2] < 0)[touching])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 5, 70]))
def test_boxes_are_the_cells_without_overlap(seed: int, height: int) -> None:
    kinds = random_kinds(seed, height)
    cells = cells_of(kinds)
    shares = np.zeros(np.count_nonzero(kinds == SURFACE), np.uint16)
    whole = (np.zeros(3, np.int64), np.array(kinds.shape))
    columns, runs, _, _ = runs_of(FilledCells(cells, share_starts(cells.met), shares, 0), *whole)
    greedy = greedy_boxes(columns, runs, *kinds.shape[:2])
    np.testing.assert_array_equal(greedy, boxes_of(kinds != AIR))
    filled = np.zeros(kinds.shape, np.int64)
    for x0, y0, z0, x1, y1, z1 in whole_run_boxes(columns, runs, *kinds.shape[:2]):
        filled[x0:x1, y0:y1, z0:z1] += 1
    np.testing.assert_array_equal(filled, kinds != AIR)


@pytest.mark.parametrize("cut", [greedy_boxes, whole_run_boxes])
def test_a_block_is_one_box(cut) -> None:
    kinds = np.full((5, 6, 7), SURFACE)
    cells = cells_of(kinds)
    filled = FilledCells(cells, share_starts(cells.met), np.full(kinds.size, FULL, np.uint16), 0)
    columns, runs, _, _ = runs_of(filled, np.zeros(3, np.int64), np.array(kinds.shape))
    assert cut(columns, runs, 5, 6).tolist() == [[0, 0, 0, 5, 6, 7]]
