"""A grid as an xarray dataset, with the names of the grid file."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import MissingPackageError
from bimvox.grid.layout import ARRAYS, AXES
from bimvox.grid.voxel_grid import Part, VoxelGrid

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
        {name: (AXES, array, dict(ARRAYS[name].attributes)) for name, array in values.items()} | _parts_of(grid),
        {name: (name, array, dict(ARRAYS[name].attributes)) for name, array in coordinates.items()},
        {
            "voxel_size_m": grid.frame.voxel_size_m,
            "origin_m": list(grid.frame.origin_m),
            "source_origin_m": list(grid.origin_m),
            **{f"source_{key}": int(value) if isinstance(value, bool) else value for key, value in grid.source.items()},
        },
    )


def _parts_of(grid: VoxelGrid) -> dict[str, tuple[str, NDArray[np.generic]]]:
    """Return a variable for each column of the table of parts; an unknown name is empty."""
    columns = {entry.name: [getattr(part, entry.name) for part in grid.parts] for entry in fields(Part)}
    return {
        f"part_{name}": ("part", np.array(["" if value is None else value for value in column]))
        for name, column in columns.items()
    }
