"""Position of a part while it is upended: turned by quarters first, then tipped about its foot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.records.lift import YardPlace
from bimvox.site.component import Component, StoredPose
from bimvox.site.shape import turned_hook
from bimvox.site.site import Site


def lying_width_vox(component: Component, place: YardPlace) -> int:
    """Return the width of a part along the axis about which it is upended, cells."""
    across = (place.pose is StoredPose.LYING_Y) != bool(place.turn % 2)
    return component.shape.size_vox[1 if across else 0]


def from_box_to_origin_m(
    site: Site, component: Component, place: YardPlace, angle_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (N, 3) vectors from the lowest corner of a stored part's box, tipped by (N,) angles, to its origin.

    The origin of the part's own frame is that same corner if the part is not turned.
    """
    hook = np.array(component.hook_offset_vox[:2]) + 0.5
    turned = np.array(turned_hook(component.shape, component.hook_offset_vox, place.turn)[:2]) + 0.5
    quarter = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), place.turn % 4)
    x, y = site.frame.voxel_size_m * (turned - quarter @ hook)
    cos, sin, same = np.cos(angle_rad), np.sin(angle_rad), np.ones(len(angle_rad))
    if place.pose is StoredPose.LYING_X:
        return np.stack([x * cos, y * same, -x * sin], axis=1)
    if place.pose is StoredPose.LYING_Y:
        return np.stack([x * same, y * cos, -y * sin], axis=1)
    return np.stack([x * same, y * same, 0.0 * same], axis=1)
