"""Slow zones: a move whose hook passes over one is driven slower as a whole, and so are the moves next to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.crane.fit import distance_to_polygon_m
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.move import Move, axes_along

_SPACING_M = 0.5
_NEAR_M = 1.0
"""Distance from a zone that counts as over it: half the spacing, and room for rounded corners."""


def slow_share(crane: TowerCrane, move: Move) -> float:
    """Return the share of the axes' highest rates that a move may use; 1 if no slow zone is near."""
    if not crane.slow_zones:
        return 1.0
    slew, radius, _ = (abs(difference) for difference in move.difference)
    travel_m = slew * max(move.start.radius_m, move.end.radius_m) + radius
    count = 2 + int(np.ceil(travel_m * 2.0 / _SPACING_M))
    axes = axes_along(crane, move, np.linspace(0.0, 1.0, count))
    points_m = hook_of(crane, *axes.T)[:, :2]
    shares = [
        zone.share
        for zone in crane.slow_zones
        if float(distance_to_polygon_m(points_m, np.array(zone.polygon)).min()) <= _NEAR_M
    ]
    return min(shares, default=1.0)


def slow_shares(crane: TowerCrane, moves: Sequence[Move]) -> list[float]:
    """Return the share of each move of a motion; a move is as slow as its neighbours, since corners may be rounded."""
    own = [slow_share(crane, move) for move in moves]
    return [min(own[max(0, i - 1) : i + 2]) for i in range(len(own))]
