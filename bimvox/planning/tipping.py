"""Where a part is while it is tipped up from how it lies: turned by quarters first, then tipped about its foot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.records.lift import YardPlace
from bimvox.site.component import Component, StoredPose
from bimvox.site.shape import turned_hook
from bimvox.site.site import Site


def lying_width_vox(component: Component, place: YardPlace) -> int:
    """Return how wide a part is across the axis about which it is tipped up."""
    across = (place.pose is StoredPose.LYING_Y) != bool(place.turn % 2)
    return component.shape.size_vox[1 if across else 0]


def from_box_to_origin_m(
    site: Site, component: Component, place: YardPlace, angle_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, 3) from the lowest corner of a stored part's box, tipped by angles, to the origin of the part's own frame.

    That is the same corner where it is not turned.
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
