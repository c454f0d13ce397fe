"""A part that is turned over in the air between two hooks: where it ends upright, and the box that it sweeps.

It lies with its head towards the main hook. Both hooks lift it level. Then the main hook hoists straight up while the
auxiliary one holds the foot end back, and the foot swings in under the head: the share of the hoist is the sine of the
part's angle. Lengths here are cells, along the axis that the part lies along.
"""

from __future__ import annotations

from math import ceil, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import whole_cells
from bimvox.site.component import (
    Component,
    IntVec,
    StoredPose,
    erection_size_vox,
    turned_aside,
    turned_hook,
    turned_shape,
)
from bimvox.site.default_rules import FlipRules

_DIPS = sqrt(2.0) - 1.0
"""The largest of cos + sin - 1: how far the lower edge sinks, as a share of what is below the head's lifting point."""
_ROUNDING = 1e-9


def rise_to_flip_vox(component: Component, rules: FlipRules, voxel_size_m: float) -> int:
    """Return how far a part is lifted level before it is turned, so that it stays clear of the ground; 0: it cannot be.

    It cannot be turned if it is not higher than it is thick.
    """
    poses = (component.stored_pose,) if component.stored_pose is not None else (StoredPose.LYING_X, StoredPose.LYING_Y)
    turns = (component.stored_turn,) if component.stored_turn is not None else (0, 1)
    below = 0.0
    for pose in poses:
        for turn in turns:
            if pose is not StoredPose.AS_BUILT:
                width, line = _across(component, pose, turn)
                if component.shape.size_vox[2] <= width:
                    return 0
                below = max(below, width - line)
    return max(1, whole_cells(rules.clear_m + _DIPS * below * voxel_size_m, voxel_size_m))


def is_flipped(component: Component, pose: StoredPose) -> bool:
    """Return whether a part that lies in a pose is turned over between two hooks."""
    return component.flip_rise_vox > 0 and pose is not StoredPose.AS_BUILT


def upright_at_vox(component: Component, pose: StoredPose, turn: int) -> tuple[int, int]:
    """Return where the reference cell of a part is on plan when it is upright, relative to the one as it lies.

    About its foot it is upended where it lies. Between two hooks it ends below its head, so far that nothing of it
    swings beyond where its foot lay.
    """
    if not is_flipped(component, pose):
        return (0, 0)
    _, line = _across(component, pose, turn)
    along = ceil(hypot(component.shape.size_vox[2], line) - line - _ROUNDING)
    return (along, 0) if pose is StoredPose.LYING_X else (0, along)


def hook_at_vox(component: Component, pose: StoredPose, turn: int) -> tuple[int, int]:
    """Return the hook's column above a part when it is upright, relative to its reference cell as it lies."""
    hook, upright = turned_hook(component.shape, component.hook_offset_vox, turn), upright_at_vox(component, pose, turn)
    return (hook[0] + upright[0], hook[1] + upright[1])


def raised_size_vox(component: Component, pose: StoredPose, turn: int) -> IntVec:
    """Return the box, from the stored reference cell up, that a part sweeps while it is raised by one cell.

    It is ``erection_size_vox``, or what it sweeps between two hooks.
    """
    size = erection_size_vox(turned_shape(component.shape, turn), pose)
    if not is_flipped(component, pose):
        return size
    (width, line), height = _across(component, pose, turn), component.shape.size_vox[2]
    along, below = max(upright_at_vox(component, pose, turn)) + width, width - line
    top = ceil(max(height, below + hypot(height - below, line)) - _ROUNDING) + 1
    return (along, size[1], top) if pose is StoredPose.LYING_X else (size[0], along, top)


def _across(component: Component, pose: StoredPose, turn: int) -> tuple[int, float]:
    """Return the thickness of a part across which it is turned, and how far into it the hook's line is."""
    axis = 0 if pose is StoredPose.LYING_X else 1
    hook = turned_hook(component.shape, component.hook_offset_vox, turn)[axis]
    width = component.shape.size_vox[axis if turn % 2 == 0 else 1 - axis]
    return width, hook + turned_aside(component.hook_aside_vox, turn)[axis] + 0.5


def least_clear_vox(component: Component, pose: StoredPose, turn: int, rise_vox: int) -> float:
    """Return how far a part that is lifted by some cells stays above where it lay while it is turned over."""
    width, line = _across(component, pose, turn)
    return rise_vox - _DIPS * (width - line)


def flipped_at_vox(
    component: Component, pose: StoredPose, turn: int, turned: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the upper corner at the foot of a part is: (N,) along the axis, and above its level underside.

    ``turned``: (N,) shares of the hoist with which it is turned, from 0 for level to 1 for upright.
    """
    (width, line), height = _across(component, pose, turn), component.shape.size_vox[2]
    below, level = width - line, np.sqrt(1.0 - turned**2)
    head = below + turned * (height - below)
    along = max(upright_at_vox(component, pose, turn)) + line - height * level - line * turned
    return along, head - height * turned + line * level
