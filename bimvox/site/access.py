"""The access of trucks: where they stand, and which parts the crane can unload there.

Only the places are looked at here: that no part lies in the way of a truck, and that the crane carries a part over some
place where a truck stands. How a truck is loaded and driven is not.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame
from bimvox.site.areas import columns_centred_in
from bimvox.site.collision import HOOK_FORBIDDEN
from bimvox.site.component import Component
from bimvox.site.config.site_config import AreasConfig, SiteConfig
from bimvox.site.hook_room import hook_room
from bimvox.site.site import Site

TRUCK_WIDTH_M: Final = 2.55
"""The widest vehicle without a permit (Directive 96/53/EC)."""
DECK_M: Final = 1.2
"""Height of a truck's deck; typical of flat-bed semi-trailers."""


def ground_of(
    areas: AreasConfig, frame: GridFrame, shape: tuple[int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_] | None]:
    """Return the (X, Y) columns of the yard, those of the access left out, and those of the access; None without."""
    yard = columns_centred_in(areas.yard or (), frame, shape)
    if areas.access is None:
        return yard, None
    access = columns_centred_in(areas.access, frame, shape)
    return yard & ~access, access


def check_access(config: SiteConfig) -> None:
    """Raise an error for an access on which no truck can stand.

    Raises:
        ConfigError: Names the polygon.
    """
    for number, polygon in enumerate(config.areas.access or ()):
        if shapely.Polygon(polygon).buffer(0.001 - TRUCK_WIDTH_M / 2.0).is_empty:
            raise config.error(
                f"areas.access[{number}]",
                f"is nowhere {TRUCK_WIDTH_M:g} m wide, as a truck is",
                hint="widen it; 4 m leaves room for a person on one side",
            )


def unloading_columns(site: Site, component: Component) -> NDArray[np.int64]:
    """Return the (N, 2) columns of the access over which its crane carries a part, gear included.

    On a site without an access or a crane there are none.
    """
    crane = site.crane_of(component)
    if site.access is None or crane is None:
        return np.zeros((0, 2), np.int64)
    flat = np.zeros(site.shape[:2], np.int32)
    free = site.access & (hook_room(site, crane, flat, component).floor < HOOK_FORBIDDEN)
    return np.argwhere(free)
