"""A grid as an xarray dataset, with the names of the grid file."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from bimvox.errors import MissingPackageError
from bimvox.grid.layout import ARRAYS, AXES
from bimvox.grid.voxel_grid import VoxelGrid

if TYPE_CHECKING:
    import xarray


def dataset_of(grid: VoxelGrid) -> xarray.Dataset:
    """Return the dense dataset of a grid; see :meth:`VoxelGrid.to_xarray`."""
    try:
        import xarray
    except ModuleNotFoundError as error:
        raise MissingPackageError("xarray", "a dataset of a grid") from error
    owners = grid.owners.dense()
    cells = np.arange(max(grid.shape))
    centres_m = grid.frame.centre_of(np.column_stack([cells, cells, cells]))
    values = {"labels": grid.label_table[owners + 1], "owners": owners}
    coordinates = {name: centres_m[: grid.shape[axis], axis] for axis, name in enumerate(AXES)}
    return xarray.Dataset(
        {name: (AXES, array, dict(ARRAYS[name].attributes)) for name, array in values.items()},
        {name: (name, array, dict(ARRAYS[name].attributes)) for name, array in coordinates.items()},
        {
            "voxel_size_m": grid.frame.voxel_size_m,
            "origin_m": list(grid.frame.origin_m),
            "source_origin_m": list(grid.origin_m),
            "source": dict(grid.source),
            "parts": [asdict(part) for part in grid.parts],
        },
    )
