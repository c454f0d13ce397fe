"""The plan's ways across for a load, as far as an estimate can know: clear of mast, site boundary and what is built."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.library.set_up_search.ways import Ways
from bimvox.motion.shortcut import stops_across
from bimvox.site.extent import MARGIN_VOX

SAMPLES = 33
"""Positions of a move that are looked at."""
_DIAGONAL = 2.0**0.5


class Across(NamedTuple):
    """A way across.

    Attributes:
        stops: Its stops.
        tops_m: For each move between them, (33,) how high it is built where the load passes; empty if it is not free.
    """

    stops: Sequence[CranePose]
    tops_m: Sequence[NDArray[np.float64]] = ()


def ways_across(
    crane: TowerCrane, ends: tuple[CranePose, CranePose], ways: Ways, n: int, far_m: float
) -> tuple[Across, Across | None]:
    """Return the plainest of the plan's ways across for a load, and the first that is free, or None.

    A free way is clear of mast and site boundary, and within the radius that the load may have.
    """
    start, end = ends[0], replace(ends[1], slew_rad=nearest_turn(ends[1].slew_rad, ends[0].slew_rad))
    (low_x, low_y), (high_x, high_y) = ways.around_m[n].tolist()
    mast_m = 0.5 * crane.mast_size_m + ways.mast_m + ways.cell_m
    # The site reaches as far around a mast as around everything else.
    edge_m = 0.5 * crane.mast_size_m + MARGIN_VOX * ways.cell_m
    base_m = np.array(crane.base_m[:2])
    (west, south), (east, north) = (
        np.minimum(ways.bounds_m[0] - base_m, -edge_m) - 0.5 * ways.cell_m,
        np.maximum(ways.bounds_m[1] - base_m, edge_m) + 0.5 * ways.cell_m,
    )
    share = np.linspace(0.0, 1.0, SAMPLES)
    # Slewing passes columns whose middles lie further out.
    most_m = far_m - _DIAGONAL * ways.cell_m

    def tops_m(a: CranePose, b: CranePose) -> NDArray[np.float64] | None:
        slew = a.slew_rad + share * (b.slew_rad - a.slew_rad)
        radius = a.radius_m + share * (b.radius_m - a.radius_m)
        if abs(slew[-1] - slew[0]) * radius.max() > 2.0 * ways.cell_m and radius[1:-1].max() > most_m:
            return None
        x, y = radius * np.cos(slew), radius * np.sin(slew)
        if (x + low_x < west).any() or (x + high_x > east).any():
            return None
        if (y + low_y < south).any() or (y + high_y > north).any():
            return None
        hits = (x + low_x < mast_m) & (x + high_x > -mast_m) & (y + low_y < mast_m) & (y + high_y > -mast_m)
        return None if hits.any() else ways.passed_m(n, base_m + np.column_stack([x, y]))

    first: Across | None = None
    for stops in stops_across(start, end):
        own = [*stops[:-1], replace(stops[-1], height_m=end.height_m)]
        first = first or Across(own)
        found = []
        for a, b in pairwise(own):
            tops = tops_m(a, b)
            if tops is None:
                break
            found.append(tops)
        else:
            return first, Across(own, found)
    assert first is not None
    return first, None
