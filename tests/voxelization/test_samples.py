from __future__ import annotations

import numpy as np

from bimvox.voxelization.samples import SAMPLES, sample_lines


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
