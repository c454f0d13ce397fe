"""Grid files in memory."""

from __future__ import annotations

import io

from bimvox.grid.frame import CELL_LIMIT
from bimvox.grid.storage import read_grid, write_grid
from bimvox.grid.voxel_grid import VoxelGrid


def grid_to_bytes(grid: VoxelGrid) -> bytes:
    """Return the bytes of a grid file."""
    stream = io.BytesIO()
    write_grid(grid, stream)
    return stream.getvalue()


def grid_from_bytes(data: bytes, name: str, *, cell_limit: int = CELL_LIMIT) -> VoxelGrid:
    """Return the grid that the bytes of a grid file hold."""
    return read_grid(io.BytesIO(data), name, cell_limit=cell_limit)
