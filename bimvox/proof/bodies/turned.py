"""A solid of the proof, turned: what was measured of it stays true."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.proof.bodies.solid import Solid


def turned(solid: Solid, turn: NDArray[np.float64]) -> Solid:
    """Return a solid after a rotation ((3, 3)) about the origin of its frame."""
    corners = np.ascontiguousarray(solid.corners_m @ turn.T)
    if not len(corners):
        return solid
    least_m = float(solid.skins_m.min())
    low, high = corners.min(axis=(0, 1)) + least_m, corners.max(axis=(0, 1)) - least_m
    return solid._replace(
        corners_m=corners,
        normals=np.ascontiguousarray(solid.normals @ turn.T),
        boxes_m=_boxes(corners, solid.spans),
        core_m=np.stack([low, high]),
        seed_m=np.ascontiguousarray(solid.seed_m @ turn.T),
        ends_m=np.ascontiguousarray(solid.ends_m @ turn.T),
    )


@kernel
def _boxes(corners: NDArray[np.float64], spans: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (N, 2, 3) the boxes around the triangles of each node of a tree."""
    boxes = np.empty((spans.shape[0], 2, 3))
    for n in range(spans.shape[0]):
        for k in range(3):
            low, high = np.inf, -np.inf
            for f in range(spans[n, 0], spans[n, 1]):
                for c in range(3):
                    low, high = min(low, corners[f, c, k]), max(high, corners[f, c, k])
            boxes[n, 0, k], boxes[n, 1, k] = low, high
    return boxes
