"""A path on which a load has room to swing: beside a wall it could be accelerated hardly at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.planning.search import roomy_path, which_free
from bimvox.planning.shorten_path import straightened
from bimvox.site.collision import CollisionSpace


def with_room(space: CollisionSpace, path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a straightened path between the same ends, wherever it can a cell away from what is at its sides.

    Args:
        space: The collision rule.
        path_vox: (N, 3) int32, unit moves over free placements.

    Returns:
        (M, 3) int32, unit moves over free placements.
    """
    wide = widened(space)
    if not which_free(wide, path_vox).all():
        path_vox = roomy_path(space, wide, path_vox)
    has_room = which_free(wide, path_vox)
    cuts = np.flatnonzero(has_room[1:] != has_room[:-1]) + 1
    starts = (0, *cuts.tolist())
    parts = zip(starts, np.split(path_vox, cuts), strict=True)
    return np.concatenate([straightened(wide if has_room[start] else space, part) for start, part in parts])


def widened(space: CollisionSpace) -> CollisionSpace:
    """Return the rule for a load that is one cell wider to each side on plan."""
    return space._replace(boxes=space.boxes + np.array([-1, -1, 0, 1, 1, 0], np.int32))
