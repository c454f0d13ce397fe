"""The way of a mobile crane to its place, and the room beside a tower crane for the one that erects and dismantles it.

It is looked for on the columns of the grid. What lies beyond the grid is not known: such a place is neither free nor
taken.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.component import Component
from bimvox.site.site import Site, is_mast_of

PLACE_M = 8.0
"""Edge of the place of a mobile crane on its outriggers: an 80 t crane stands on 7 x 8 m (suttergmbh.de, LTM 1080)."""
REACH_M = 15.0
"""How far from the mast its middle may be, so that it carries the heaviest piece (professional judgement)."""
WAY_M = 3.75
"""Width of its way: 2.75 m of the crane (as above) and 0.5 m on each side (BG BAU, ways of vehicles)."""
HEADROOM_M = 4.5
"""Height of its way: a crane on the road is up to 4.0 m high (Directive 96/53/EC), and half a metre above it."""
JIB_WIDE_M = 3.0
"""Width of the strip in which a jib is put together on the ground (professional judgement)."""
SLOPE = 0.12
"""Steepest way up or down (professional judgement)."""

_COLUMN_M = 0.25

_Columns = NDArray[np.bool_]


class Room(StrEnum):
    """Whether there is room."""

    FREE = "free"
    """On the site as it is known."""
    UNKNOWN = "unknown"
    """Only with ground beyond the site as it is known."""
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Place:
    """A place of a mobile crane, and its way in.

    Attributes:
        room: Whether there is such a place with a way to it.
        at_m: Its middle on plan; None without one.
        from_access: Whether the way begins on the access of trucks, otherwise at the edge of the site.
    """

    room: Room
    at_m: tuple[float, float] | None = None
    from_access: bool = False


class _Ground:
    """Where a mobile crane may drive and stand, over the columns of a site and a margin around it, of a quarter metre.

    Args:
        site: The site.
        crane: The crane that stands there; its own mast is not in its way.
        parts: What is in place.
        more_m: How much wider the margin is than a place needs.
    """

    def __init__(self, site: Site, crane: TowerCrane, parts: Iterable[Component], more_m: float = 0.0) -> None:
        cell_m, floor_vox = site.frame.voxel_size_m, site.ground_vox + 1
        taken, high = np.zeros(site.shape[:2], np.bool_), int(np.ceil(HEADROOM_M / cell_m))
        for blocker in site.blockers:
            own = blocker.kind == "crane" and (site.moving is not None or is_mast_of(crane, blocker.id))
            if blocker.kind != "ground" and not own:
                _take(taken, blocker.cells, floor_vox, high)
        for part in parts:
            _take(taken, part.shape.cells + np.array(part.target_vox, np.int32), floor_vox, high)
        taken |= site.dug_m > 1e-6
        if site.natural_ground_m is not None:
            taken |= _steep(site.natural_ground_m, cell_m)
        many = max(1, int(_COLUMN_M / cell_m))
        margin = int(np.ceil((_beyond_m(site, crane) + more_m) / (cell_m * many)))
        access = np.zeros_like(taken) if site.access is None else site.access
        padded: list[_Columns] = [
            np.pad(_coarse(columns, many), margin) for columns in (taken, access, np.ones_like(taken))
        ]
        self.taken, self._access, self.known = padded
        self.size_m = cell_m * many
        self._low_m = np.array(site.frame.origin_m[:2]) - margin * self.size_m

    def stand_on(self, crane: TowerCrane, edge_m: float) -> NDArray[np.float64]:
        """Take the square of a crane's foundation, and return how far each column is from its mast."""
        x, y = self.column_of(crane.base_m)
        half = int(np.ceil(edge_m / 2.0 / self.size_m))
        self.taken[max(x - half, 0) : x + half + 1, max(y - half, 0) : y + half + 1] = True
        apart = np.hypot(*(np.indices(self.taken.shape) - np.array([x, y])[:, None, None]))
        return np.asarray(apart * self.size_m, np.float64)

    def fits(self, sides_m: tuple[float, float], *, anyhow: bool) -> _Columns:
        """Return the middles of free rectangles along the cells; ``anyhow``: also beyond the site."""
        allowed = ~self.taken if anyhow else self.known & ~self.taken
        columns = tuple(int(np.ceil(side_m / self.size_m)) for side_m in sides_m)
        return np.array(ndi.minimum_filter(allowed.astype(np.uint8), columns, mode="constant", cval=0), np.bool_)

    def column_of(self, at_m: tuple[float, ...]) -> tuple[int, int]:
        """Return the column of a point."""
        x, y = np.floor((np.array(at_m[:2]) - self._low_m) / self.size_m).astype(int).tolist()
        return x, y

    def middle_of(self, column: tuple[int, ...]) -> tuple[float, float]:
        """Return the middle of a column."""
        x, y = (self._low_m + (np.array(column) + 0.5) * self.size_m).tolist()
        return x, y

    def reached(self, *, anyhow: bool) -> _Columns:
        """Return where the middle of a crane can drive to from the access, or from beyond the site if there is none.

        ``anyhow``: from beyond the site as well.
        """
        free = np.asarray(ndi.distance_transform_edt(~self.taken), np.float64)
        wide: _Columns = np.greater_equal(free, WAY_M / 2.0 / self.size_m)
        begin: _Columns = np.array(ndi.binary_dilation(self._access), np.bool_)
        if anyhow or not self._access.any():
            begin[[0, -1], :] = begin[:, [0, -1]] = True
        else:
            wide &= self.known  # nobody knows whether another way leads around
        labels, _ = ndi.label(wide, np.ones((3, 3)))
        reached: _Columns = np.logical_and(np.isin(labels, np.unique(labels[begin & wide])), wide)
        return reached


def _coarse(columns: _Columns, many: int) -> _Columns:
    """Return columns in squares of ``many`` by ``many``: whether any of a square is."""
    padded = np.pad(columns, [(0, -size % many) for size in columns.shape])
    x, y = (size // many for size in padded.shape)
    squares: _Columns = np.logical_or.reduce(padded.reshape(x, many, y, many), axis=(1, 3))
    return squares


def _beyond_m(site: Site, crane: TowerCrane) -> float:
    """Return how much room around the site a place may need, also if the crane stands at its edge, or outside."""
    low, size_m = site.frame.origin_m, site.frame.voxel_size_m
    outside_m = (
        max(low[axis] - crane.base_m[axis], crane.base_m[axis] - low[axis] - size_m * site.shape[axis])
        for axis in (0, 1)
    )
    return max(0.0, *outside_m) + REACH_M + PLACE_M


def _take(taken: _Columns, cells: NDArray[np.int32], floor_vox: NDArray[np.int32], high: int) -> None:
    """Mark the columns in which a cell is in the way of what drives on the ground there."""
    x, y, z = cells.T
    inside = (x >= 0) & (y >= 0) & (x < taken.shape[0]) & (y < taken.shape[1])
    x, y, z = x[inside], y[inside], z[inside]
    level = z - floor_vox[x, y]
    met = (level >= 0) & (level < high)
    taken[x[met], y[met]] = True


def _steep(ground_m: NDArray[np.float64], size_m: float) -> _Columns:
    """Return where the ground is too steep over about 2 m."""
    over = max(1, round(1.0 / size_m))
    smooth = ndi.uniform_filter(ground_m, 2 * over + 1, mode="nearest")
    slope = np.hypot(*np.gradient(smooth, size_m)) if min(ground_m.shape) > 1 else np.zeros_like(ground_m)
    steep: _Columns = slope > SLOPE
    return steep


def way_in(site: Site, crane: TowerCrane, *, finished: bool) -> Place:
    """Return whether a mobile crane can drive to its own place, or away from it when the parts are in place."""
    return way_among(site, crane, site.components if finished else ())


def way_among(site: Site, crane: TowerCrane, parts: Iterable[Component]) -> Place:
    """Return whether a mobile crane can drive to its own place, or away from it, when some parts are in place."""
    ground = _Ground(site, crane, parts)
    column = ground.column_of(crane.base_m)
    for room, anyhow in ((Room.FREE, False), (Room.UNKNOWN, True)):
        if ground.reached(anyhow=anyhow)[column]:
            return Place(room, (crane.base_m[0], crane.base_m[1]), site.access is not None)
    return Place(Room.NONE)


def place_beside(site: Site, crane: TowerCrane, foundation_m: float, *, finished: bool) -> Place:
    """Return the place of a mobile crane that erects or dismantles a tower crane: the nearest to its mast.

    ``foundation_m``: edge of the tower crane's foundation, on which nothing else stands.
    """
    ground = _Ground(site, crane, site.components if finished else ())
    apart_m = ground.stand_on(crane, foundation_m)
    for room, anyhow in ((Room.FREE, False), (Room.UNKNOWN, True)):
        good = ground.fits((PLACE_M, PLACE_M), anyhow=anyhow) & (apart_m <= REACH_M) & ground.reached(anyhow=anyhow)
        if good.any():
            at = np.unravel_index(int(np.argmin(np.where(good, apart_m, np.inf))), good.shape)
            return Place(room, ground.middle_of(tuple(int(n) for n in at)), site.access is not None)
    return Place(Room.NONE)


def room_for_jib(site: Site, crane: TowerCrane, foundation_m: float, *, finished: bool) -> Room:
    """Return whether a tower crane's jib can lie on the ground in one piece, along x or y.

    Its middle is as far from the mobile crane as this may be from the mast.
    """
    ground = _Ground(site, crane, site.components if finished else (), REACH_M + crane.jib_own_m)
    near = ground.stand_on(crane, foundation_m) <= 2.0 * REACH_M
    long_m, wide_m = crane.jib_own_m, JIB_WIDE_M
    for room, anyhow in ((Room.FREE, False), (Room.UNKNOWN, True)):
        if any((ground.fits(sides_m, anyhow=anyhow) & near).any() for sides_m in ((long_m, wide_m), (wide_m, long_m))):
            return room
    return Room.NONE
