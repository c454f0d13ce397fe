"""Whether a body of one part lies inside another part: their surfaces do not cross, yet they overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.connected import connected_labels
from bimvox.planning.contact.sweep import crossings_above

_WITHIN = np.array([0.2, 0.3, 0.5])
"""Where on a triangle the point lies: seldom on a line that triangles above it share."""


def enclosed(one_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> bool:
    """Return whether a body of one part lies inside the other one, of (F, 3, 3) triangles each.

    For parts whose surfaces do not cross: then a body is inside if one of its points is.
    """
    return _lies_inside(one_m, other_m) or _lies_inside(other_m, one_m)


def _lies_inside(part_m: NDArray[np.float64], around_m: NDArray[np.float64]) -> bool:
    if not len(part_m) or not len(around_m):
        return False
    low, high = around_m.min(axis=(0, 1)), around_m.max(axis=(0, 1))
    # Only what lies in the box of the other part; of these triangles, the first one of each body.
    near_m = part_m[((part_m >= low) & (part_m <= high)).all(axis=(1, 2))]
    if not len(near_m):
        return False
    points_m = np.einsum("k,fkd->fd", _WITHIN, near_m[_first_of_bodies(near_m)])
    return any(crossings_above(around_m, point_m) % 2 for point_m in points_m)


def _first_of_bodies(triangles_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the number of one triangle of every connected piece of (F, 3, 3) triangles."""
    _, corner = np.unique(triangles_m.reshape(-1, 3).round(7), axis=0, return_inverse=True)
    faces = corner.reshape(-1, 3)
    ends, count = np.concatenate([faces[:, :2], faces[:, 1:]]).T, int(faces.max()) + 1
    body = connected_labels(count, *ends)
    _, first = np.unique(body[faces[:, 0]], return_index=True)
    found: NDArray[np.int64] = first.astype(np.int64)
    return found
