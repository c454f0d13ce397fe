"""How a crew guides a load on its last moves: aside and tilted, while its hook goes straight down."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

MOST_ASIDE_M = 0.3
"""Furthest that a crew guides a load out of the line of its hook."""
MOST_TILT_RAD = 0.2
"""Steepest tilt, by two legs of unequal length: 11 degrees."""
ASIDE_RATE_M_S = 0.05
"""Fastest that a crew guides a load aside."""
TILT_RATE_RAD_S = 0.02
"""Fastest that a leg of the sling is shortened, as a tilt of the load: a hand chain hoist, 1.1 degrees a second."""
MOST_FORCE_N = 1000.0
"""Largest horizontal force on the load: several people, or a lever hoist."""

_SWEPT_RAD = 0.02


@dataclass(frozen=True, slots=True)
class Guide:
    """The poses of a load on its last moves, relative to its place; between two of them it moves in proportion.

    The hook goes straight down onto the place. The load hangs on legs of unequal length, and people hold it aside: so
    it passes under the flange of a beam with one end first.

    Attributes:
        heading_rad: Direction in plan in which it is guided aside, counter-clockwise from x.
        centre_m: Its centre of mass at its place, metres in the site frame; it is tilted about it.
        poses: (height, aside, tilt) of each: metres above the place, descending to 0; metres in the direction; radians
            by which the end that is ahead in the direction is raised. The first and the last are level and in line.
    """

    heading_rad: float
    centre_m: tuple[float, float, float]
    poses: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        if len(self.poses) < 2:
            raise ValueError("a guide needs two poses or more")

    @property
    def top_m(self) -> float:
        """Height above the place at which it begins."""
        return self.poses[0][0]

    @property
    def steepest_rad(self) -> float:
        """The largest tilt."""
        return max(abs(tilt) for _, _, tilt in self.poses)

    @property
    def furthest_m(self) -> float:
        """The largest distance aside."""
        return max(abs(aside) for _, aside, _ in self.poses)

    @property
    def least_s(self) -> tuple[float, ...]:
        """The shortest time from each pose to the next at which no rate is exceeded, from rest to rest."""
        return tuple(
            2.0 * max(abs(b[1] - a[1]) / ASIDE_RATE_M_S, abs(b[2] - a[2]) / TILT_RATE_RAD_S)
            for a, b in pairwise(self.poses)
        )

    @property
    def ahead(self) -> NDArray[np.float64]:
        """(3,) float64 the direction."""
        return np.array([cos(self.heading_rad), sin(self.heading_rad), 0.0])

    @property
    def axis(self) -> NDArray[np.float64]:
        """(3,) float64 the axis of a positive tilt."""
        return np.array([sin(self.heading_rad), -cos(self.heading_rad), 0.0])

    def at(self, height_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (N, 2) distances aside and tilts at (N,) heights above the place; zeros above the first pose."""
        heights, asides, tilts = np.array(self.poses)[::-1].T
        found: NDArray[np.float64] = np.stack([np.interp(height_m, heights, n) for n in (asides, tilts)], axis=1)
        return found

    def turns(self, tilt_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (N, 3, 3) rotations by (N,) tilts."""
        x, y, z = self.axis
        across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        sines, versed = np.sin(tilt_rad)[:, None, None], (1.0 - np.cos(tilt_rad))[:, None, None]
        turns: NDArray[np.float64] = np.eye(3) + sines * across + versed * (across @ across)
        return turns

    def moved(self, points_m: NDArray[np.float64], pose: tuple[float, float, float]) -> NDArray[np.float64]:
        """Return points of the load at its place, (..., 3) metres, with the load in a pose."""
        height_m, aside_m, tilt_rad = pose
        centre = np.array(self.centre_m)
        turned = (points_m - centre) @ self.turns(np.array([tilt_rad]))[0].T
        moved: NDArray[np.float64] = turned + centre + aside_m * self.ahead + np.array([0.0, 0.0, height_m])
        return moved


def side_force_n(mass_kg: float, aside_m: float, rope_m: float) -> float:
    """Return the horizontal force that holds a load aside of the line of its hook, on a rope of a length."""
    return 9.80665 * mass_kg * aside_m / max(rope_m, 1.0)


def swept_box_m(points_m: NDArray[np.float64], guide: Guide) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest corner of a box around all that guided points sweep, metres."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for (h, a, t), (h_next, a_next, t_next) in pairwise(guide.poses):
        for share in np.linspace(0.0, 1.0, max(2, int(abs(t_next - t) / _SWEPT_RAD) + 2)):
            pose = (h + share * (h_next - h), a + share * (a_next - a), t + share * (t_next - t))
            moved = guide.moved(points_m, pose)
            low, high = np.minimum(low, moved.min(axis=0)), np.maximum(high, moved.max(axis=0))
    return low, high
