"""Triangles as an object of the collision library."""

from __future__ import annotations

import fcl
import numpy as np
from numpy.typing import NDArray


def collision_object(triangles_m: NDArray[np.float64]) -> fcl.CollisionObject:
    """Return a movable FCL object of (F, 3, 3) float64 triangles, at the origin."""
    shape = fcl.BVHModel()
    shape.beginModel(len(triangles_m), 3 * len(triangles_m))
    shape.addSubModel(triangles_m.reshape(-1, 3), np.arange(3 * len(triangles_m)).reshape(-1, 3))
    shape.endModel()
    return fcl.CollisionObject(shape)
