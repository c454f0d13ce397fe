"""Where the hook may be, as one map over the columns: rope, reach, capacity, zones, limiters and the jib itself.

The only place that combines them, for a load and for the empty hook.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.reach import HOOK_FORBIDDEN, counted_kg, hook_floor, hook_top
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.collision import NO_CEILING
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.shape import turned_aside
from bimvox.site.site import Site
from bimvox.site.zones import hooks_with_load_over


class HookRoom(NamedTuple):
    """Lowest and highest cell at which the hook line's foot may be.

    Attributes:
        floor: (X, Y) int32; ``HOOK_FORBIDDEN`` where the hook may not be.
        ceiling: (X, Y) int32; size 0 if only the grid's top limits the height.
    """

    floor: NDArray[np.int32]
    ceiling: NDArray[np.int32]


def hook_room(
    site: Site,
    crane: TowerCrane | None,
    top: NDArray[np.int32],
    component: Component | None,
    turn: int = 0,
    slack_m: float = 0.0,
) -> HookRoom:
    """Return the lowest and highest hook cell per column.

    Args:
        site: The site.
        crane: The crane of the hook; None on a site without a crane.
        top: (X, Y) int32, one above the highest occupied cell of each column.
        component: The load; None for the empty hook.
        turn: By how many quarters the load is turned.
        slack_m: By how much a radius may be out of the crane's limits.
    """
    if crane is not None:
        crane = crane_for(site, crane, component)
    load_kg, aside_m = 0.0, (0.0, 0.0)
    if component is not None:
        x, y = turned_aside(component.hook_aside_vox, turn)
        load_kg, aside_m = component.mass_kg, (x * site.frame.voxel_size_m, y * site.frame.voxel_size_m)
    if crane is not None:
        load_kg = counted_kg(crane, load_kg, site.rules.highest_utilisation)
    floor = hook_floor(crane, site.frame, top, load_kg, site.rules.rope, site.rules.clearance_m, aside_m, slack_m)
    forbidden = np.zeros(top.shape, np.bool_)
    if site.prohibited is not None:
        forbidden |= site.prohibited
    if site.no_load is not None and component is not None:
        forbidden |= hooks_with_load_over(site.no_load, component)
    ceiling = NO_CEILING if crane is None else hook_top(crane, site.frame, site.shape, _half_m(site, component))
    if crane is not None and site.hook_heights is not None:
        floor, ceiling = _between(site, crane, floor, ceiling)
    if ceiling.size:
        forbidden |= floor > ceiling
    if forbidden.any():
        floor = np.where(forbidden, HOOK_FORBIDDEN, floor)
    return HookRoom(floor, ceiling)


def _half_m(site: Site, component: Component | None) -> float:
    """Return how far a load reaches from its hook on plan, metres."""
    if component is None:
        return 0.0
    corners = component.shape.boxes[:, [0, 1, 3, 4]] - np.tile(np.array(component.hook_line_vox[:2]) + 0.5, 2)
    x, y = np.abs(corners[:, [0, 2]]).max(axis=1), np.abs(corners[:, [1, 3]]).max(axis=1)
    return float(np.hypot(x, y).max()) * site.frame.voxel_size_m


def _between(
    site: Site, crane: TowerCrane, floor: NDArray[np.int32], ceiling: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return floor and ceiling within the limiters."""
    assert site.hook_heights is not None
    below_m = crane.sling_m + site.frame.origin_m[2]
    nz = site.shape[2]
    low = np.ceil((site.hook_heights.low_m - below_m) / site.frame.voxel_size_m - 1e-6)
    high = np.floor((site.hook_heights.high_m - below_m) / site.frame.voxel_size_m + 1e-6)
    lowest = np.clip(low, 0, nz + 1).astype(np.int32)
    highest = np.clip(high, -1, nz).astype(np.int32)
    raised = np.where(floor == HOOK_FORBIDDEN, floor, np.maximum(floor, lowest)).astype(np.int32)
    return raised, np.minimum(ceiling, highest).astype(np.int32) if ceiling.size else highest
