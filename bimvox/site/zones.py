"""Zones of a site as maps of columns, and the hook positions that they leave.

A zone forbids the hook (``prohibited``), the load (``no_load``) or both (``public``), or it limits the hook's height
(``limiter``). All of them become one map for the collision rule: the columns over which the hook may be with this load,
and its lowest and highest position.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame
from bimvox.site.areas import columns_met_by, columns_met_by_each
from bimvox.site.component import Component
from bimvox.site.config.site_config import ZoneConfig
from bimvox.site.site import HookHeights

NO_HOOK = frozenset(("prohibited", "public"))
NO_LOAD = frozenset(("no_load", "public"))


def columns_without(
    kinds: frozenset[str], zones: Sequence[ZoneConfig], frame: GridFrame, shape: tuple[int, int]
) -> NDArray[np.bool_] | None:
    """Return the (X, Y) columns that zones of these kinds overlap; None if there is no such zone."""
    polygons = [zone.polygon for zone in zones if zone.kind in kinds]
    return columns_met_by(polygons, frame, shape) if polygons else None


def hook_heights(zones: Sequence[ZoneConfig], frame: GridFrame, shape: tuple[int, int]) -> HookHeights | None:
    """Return the limits of the hook's height per column; None if no zone gives any."""
    limiters = [zone for zone in zones if zone.kind == "limiter"]
    if not limiters:
        return None
    low, high = np.full(shape, -np.inf), np.full(shape, np.inf)
    for zone, met in zip(limiters, columns_met_by_each([one.polygon for one in limiters], frame, shape), strict=True):
        if zone.lowest_hook_m is not None:
            low[met] = np.maximum(low[met], zone.lowest_hook_m)
        if zone.highest_hook_m is not None:
            high[met] = np.minimum(high[met], zone.highest_hook_m)
    return HookHeights(low, high)


def hooks_with_load_over(zone: NDArray[np.bool_], component: Component) -> NDArray[np.bool_]:
    """Return the (X, Y) columns of the hook at which any part of a component hangs over a zone ((X, Y) bool)."""
    nx, ny = zone.shape
    taken = np.zeros((nx + 1, ny + 1), np.int32)
    taken[1:, 1:] = zone.cumsum(axis=0).cumsum(axis=1)
    over = np.zeros(zone.shape, np.bool_)
    offset = np.array(component.hook_offset_vox[:2])
    for x0, y0, x1, y1 in np.unique(component.shape.boxes[:, [0, 1, 3, 4]] - np.tile(offset, 2), axis=0).tolist():
        a, b = (np.clip(np.arange(nx) + n, 0, nx) for n in (x0, x1))
        c, d = (np.clip(np.arange(ny) + n, 0, ny) for n in (y0, y1))
        over |= taken[np.ix_(b, d)] - taken[np.ix_(a, d)] - taken[np.ix_(b, c)] + taken[np.ix_(a, c)] > 0
    return over
