"""Which parts stand next to each other: people and props brace the one while another crane may set the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.kept import kept
from bimvox.site.site import Site

BESIDE_M = 3.0
"""Parts that are no further apart stand next to each other: as far as the props of a braced wall reach."""
_SLACK_M = 0.01
"""More than the boxes lose when a site is written and read."""


@kept
def parts_beside(site: Site) -> NDArray[np.bool_]:
    """Return (N, N) whether two components stand next to each other, are connected, or have a given order.

    Their distance is that of their boxes.
    """
    bounds_m = np.array([part.mesh.bounds_m for part in site.components]).reshape(-1, 2, 3)
    near = np.ones((len(bounds_m), len(bounds_m)), np.bool_)
    for low_m, high_m in zip(bounds_m[:, 0].T, bounds_m[:, 1].T, strict=True):
        near &= low_m[:, None] - high_m <= BESIDE_M + _SLACK_M
    near &= near.T
    numbers = {part.id: part.index for part in site.components}
    for part in site.components:
        named = [numbers[one] for one in (*part.hints.connected, *part.before, *part.after) if one in numbers]
        near[part.index, named] = near[named, part.index] = True
    near.flags.writeable = False
    return near
