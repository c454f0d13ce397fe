"""The site's cells as a Foxglove VoxelGrid."""

from __future__ import annotations

from typing import Any

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.VoxelGrid_pb2 import VoxelGrid

from bimvox.grid.frame import Label
from bimvox.log.mcap.messages import pose, stamp, vector
from bimvox.site.site import Site


def voxel_grid(site: Site, time_ns: int) -> Any:
    """Return the labels of the site, with the components at their places in the building where the cells are free.

    Data in Z-Y-X order (x fastest), one uint8 ``label`` per cell. Empty layers at the top are left out, because viewers
    expand every cell that is sent.
    """
    labels = site.labels.copy()
    parts = [component.shape.cells for component in site.components]
    targets = np.array([component.target_vox for component in site.components], np.int32).reshape(-1, 3)
    cells = np.concatenate([np.zeros((0, 3), np.int32), *parts]) + np.repeat(targets, [len(part) for part in parts], 0)
    flat, at = labels.reshape(-1), np.ravel_multi_index(tuple(cells.T), labels.shape)
    flat[at[flat[at] == Label.AIR]] = Label.COMPONENT
    filled = np.flatnonzero(labels.any(axis=(0, 1)))
    height = int(filled[-1]) + 1 if filled.size else 1
    columns, rows = site.shape[:2]
    return VoxelGrid(
        timestamp=stamp(time_ns),
        frame_id="site",
        pose=pose(site.frame.origin_m),
        row_count=rows,
        column_count=columns,
        cell_size=vector((site.frame.voxel_size_m,) * 3),
        slice_stride=rows * columns,
        row_stride=columns,
        cell_stride=1,
        fields=[PackedElementField(name="label", offset=0, type=PackedElementField.UINT8)],
        data=np.ascontiguousarray(labels[:, :, :height].T).tobytes(),
    )
