from __future__ import annotations

import numpy as np

from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.voxel_grid import VoxelGrid


def test_counts_cover_every_cell_air_included() -> None:
    labels = np.zeros((2, 3, 4), np.uint8)
    labels[0, 0] = Label.COMPONENT
    labels[1, 0, 0] = Label.GROUND
    none = np.empty(0, np.int32)
    grid = VoxelGrid(
        GridFrame((0.0, 0.0, 0.0), 1.0),
        labels,
        np.full(labels.shape, -1, np.int32),
        (),
        none.reshape(0, 3),
        none,
        none.astype(np.float32),
    )
    assert grid.shape == (2, 3, 4)
    assert grid.counts() == {"air": 19, "ground": 1, "component": 4}
    assert sum(grid.counts().values()) == labels.size
