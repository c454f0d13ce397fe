"""Choice of a crane and its base: the first machine that carries every mass where it is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.fit_luffing import BuiltHeights, highest_hooks_m, pivoted, points_blocked
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError

MAST_CLEARANCE_M = 1.5
"""Free width between the mast and the building or the yard."""
HOOK_BLOCK_M = 2.0
"""Room between the highest hook and the rope exit: hook block and limit switch."""
MARGIN_M = 0.5
"""Distance by which points lie inside the radius limits."""

_PITCH_M = 1.0
_RING_M = 12.0
_AT_ONCE = 32  # points that are compared at once: most bases fail at the heaviest ones
_MOST_PAIRS = 1_000_000  # of bases and points: beyond, fewer bases are tried
_MOST_BASES = 400  # bases at which the jib is checked, those with the lowest utilisation first


def fit_crane(
    points_m: ArrayLike,
    masses_kg: ArrayLike,
    ground: Ground,
    height_under_hook_m: float,
    *,
    cranes: Sequence[TowerCrane],
    built: BuiltHeights | None = None,
) -> TowerCrane:
    """Return the first crane that serves every point, on the base with the lowest utilisation; deterministic.

    Bases are tried on a lattice of 1 m in a ring around the building, clear of it and of the other areas by 1.5 m plus
    half the mast. Of the bases that serve every point, the one is chosen whose largest radius, as a share of the radius
    allowed for that mass, is smallest; ties go to the lowest y, then x.

    A luffing tower crane gets a mast so high that its jib slews above everything. A mobile crane must reach the height
    at every point; its base is where the finished building blocks the boom at the fewest points.

    Args:
        points_m: (N, 2) hook positions on plan: targets and yard corners.
        masses_kg: (N,) mass to be carried there, without rigging.
        ground: Where the mast may stand.
        height_under_hook_m: Height above the site's z = 0 that the hook must reach.
        cranes: Machines to choose from, the preferred one first; their base and jib height are ignored.
        built: Heights of the finished building; None if no jib can touch anything.

    Raises:
        InputError: If no crane serves every point; names the point that the last one cannot serve.
    """
    points = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
    masses = np.broadcast_to(np.asarray(masses_kg, dtype=np.float64), len(points))
    if not len(points):
        raise InputError("no point is given for a crane to reach", hint="give at least one target")
    heaviest_first = np.argsort(-masses, kind="stable")
    for machine in cranes:
        crane = standing(machine, height_under_hook_m)
        bases = fitting = ground.bases(crane)
        for first in range(0, len(points), _AT_ONCE):
            some = heaviest_first[first : first + _AT_ONCE]
            reached = served(crane, fitting, points[some], masses[some], height_under_hook_m, MARGIN_M)
            fitting = fitting[reached.all(axis=1)]
            if not len(fitting):
                break
        if not len(fitting):
            continue
        high = np.array([allowed_radii_m(crane, float(mass))[1] for mass in masses]) - MARGIN_M
        use = np.round((distances_m(fitting, points) / high).max(axis=1), 9)
        return _least_blocked(crane, fitting[np.argsort(use, kind="stable")], points, built)
    reached = served(crane, bases, points, masses, height_under_hook_m, MARGIN_M)
    raise _no_crane(crane, points, masses, bases, distances_m(bases, points), reached)


def fit_most(
    points_m: NDArray[np.float64],
    masses_kg: NDArray[np.float64],
    stores_m: NDArray[np.float64],
    height_under_hook_m: float,
    *,
    crane: TowerCrane,
    ground: Ground,
) -> tuple[TowerCrane, int, int] | None:
    """Return a crane on the base from which it serves most points, their number, and how many its jib reaches.

    Args:
        points_m: (N, 2) hook positions.
        masses_kg: (N,) mass to be carried there, without rigging.
        stores_m: (K, 2) places from which the masses come: one of them must be within reach with the mass.
        height_under_hook_m: Height above the site's z = 0 that the hook must reach.
        crane: The machine; its base and jib height are ignored.
        ground: Where the mast may stand.

    Returns:
        None if the mast has no place. Ties go to the base that reaches most points, then to the lowest y, then x.
    """
    crane = standing(crane, height_under_hook_m)
    bases = ground.bases(crane)
    if not len(bases):
        return None
    bases = bases[:: 1 + len(bases) * len(points_m) // _MOST_PAIRS]
    able = served(crane, bases, points_m, masses_kg, height_under_hook_m, MARGIN_M)
    from_store = np.full_like(able, not len(stores_m))
    for store in stores_m:
        there = np.broadcast_to(store, points_m.shape)
        from_store |= served(crane, bases, there, masses_kg, height_under_hook_m, MARGIN_M)
    able &= from_store
    reach = (distances_m(bases, points_m) <= crane.jib_length_m - MARGIN_M).sum(axis=1)
    best = np.lexsort((-reach, -able.sum(axis=1)))[0]
    placed = replace(crane, base_m=(*bases[best].tolist(), 0.0))
    return placed, int(able[best].sum()), int(reach[best])


class Ground:
    """Where a mast may stand: around the first area, clear of all areas.

    Args:
        areas_m: (K, 2) polygons: the building's footprint, then the yards.
    """

    def __init__(self, areas_m: Sequence[ArrayLike]) -> None:
        self._areas = [np.asarray(area, dtype=np.float64) for area in areas_m]
        self._known: dict[float, NDArray[np.float64]] = {}

    def bases(self, crane: TowerCrane) -> NDArray[np.float64]:
        """Return the (B, 2) places for a crane's mast, by y, then x."""
        clear_m = MAST_CLEARANCE_M + crane.mast_size_m / 2.0
        if clear_m not in self._known:
            self._known[clear_m] = _bases(self._areas, clear_m)
        return self._known[clear_m]


def served(
    crane: TowerCrane,
    bases_m: NDArray[np.float64],
    points_m: NDArray[np.float64],
    masses_kg: NDArray[np.float64],
    height_under_hook_m: float,
    margin_m: float,
) -> NDArray[np.bool_]:
    """Return (B, N) whether a crane on each base carries each mass at its point, high enough."""
    limits = radii_for_m(crane, masses_kg)
    radii = distances_m(bases_m, points_m)
    able: NDArray[np.bool_] = (radii >= limits[:, 0] + margin_m) & (radii <= limits[:, 1] - margin_m)
    if crane.luffing is not None:
        able &= highest_hooks_m(crane.luffing, radii) >= height_under_hook_m
    return able


def radii_for_m(crane: TowerCrane, masses_kg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) the smallest and the largest radius at which a crane carries each mass."""
    different, which = np.unique(masses_kg, return_inverse=True)
    return np.array([allowed_radii_m(crane, float(mass)) for mass in different]).reshape(-1, 2)[which.ravel()]


def distances_m(bases_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (B, N) distances on plan."""
    return np.hypot(points_m[:, 0] - bases_m[:, 0, None], points_m[:, 1] - bases_m[:, 1, None])


def standing(machine: TowerCrane, height_under_hook_m: float) -> TowerCrane:
    """Return a machine on a mast so high that its hook reaches a height."""
    if machine.luffing is not None:
        return pivoted(machine, machine.luffing, height_under_hook_m)
    return replace(machine, jib_height_m=float(height_under_hook_m + HOOK_BLOCK_M))


def _least_blocked(
    crane: TowerCrane, bases: NDArray[np.float64], points: NDArray[np.float64], built: BuiltHeights | None
) -> TowerCrane:
    """Return the crane on the first of the (B, 2) bases at which the building blocks its jib at the fewest points."""
    best, fewest = replace(crane, base_m=(*bases[0].tolist(), 0.0)), len(points) + 1
    if crane.luffing is None or built is None:
        return best
    for x, y in bases[:_MOST_BASES].tolist():
        placed = replace(crane, base_m=(x, y, 0.0))
        blocked = points_blocked(placed, crane.luffing, points, built)
        if blocked < fewest:
            best, fewest = placed, blocked
        if blocked == 0:
            break
    return best


def _no_crane(
    crane: TowerCrane,
    points: NDArray[np.float64],
    masses: NDArray[np.float64],
    bases: NDArray[np.float64],
    radii: NDArray[np.float64],
    served: NDArray[np.bool_],
) -> InputError:
    """Return the error that explains why the largest crane does not suffice."""
    if not len(bases):
        return InputError(
            f"no place for the mast of {crane.name} within {_RING_M:g} m of the building, clear of the yard",
            hint="give [crane] base_m in the site file, or move the yard",
        )
    best = int(np.argmax(served.sum(axis=1)))
    worst = int(np.argmax(np.where(served[best], -np.inf, masses * radii[best])))
    x, y = points[worst]
    radius = float(radii[best, worst])
    capacity = max(0.0, capacity_kg(crane.chart, radius) - crane.tackle_kg)
    reached = int(served[best].sum())
    return InputError(
        f"no crane serves every point: {crane.name} carries {capacity:.0f} kg at {radius:.1f} m, but "
        f"{masses[worst]:.0f} kg are needed at ({x:.1f}, {y:.1f}); it serves {reached} of {len(points)} points",
        hint="describe your own [crane] in the site file, move the yard closer, or leave the heaviest parts out",
    )


def _bases(areas: Sequence[NDArray[np.float64]], clear_m: float) -> NDArray[np.float64]:
    """Return (B, 2) lattice points around the first area, at least ``clear_m`` from all areas, by y, then x."""
    low = np.floor(areas[0].min(axis=0) - clear_m - _RING_M)
    high = np.ceil(areas[0].max(axis=0) + clear_m + _RING_M)
    y, x = np.meshgrid(
        np.arange(low[1], high[1] + _PITCH_M, _PITCH_M), np.arange(low[0], high[0] + _PITCH_M, _PITCH_M), indexing="ij"
    )
    lattice = np.stack([x.ravel(), y.ravel()], axis=1)
    distances = [distance_to_polygon_m(lattice, area) for area in areas]
    fits = distances[0] <= clear_m + _RING_M
    for distance in distances:
        fits &= distance >= clear_m
    return lattice[fits]


def distance_to_polygon_m(points_m: NDArray[np.float64], polygon_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (N,) distances of (N, 2) points to a simple polygon (K, 2), 0 inside."""
    start, end = polygon_m, np.roll(polygon_m, -1, axis=0)
    edge = end - start
    relative = points_m[:, None, :] - start[None]
    length_squared = np.maximum((edge**2).sum(axis=1), 1e-300)
    along = np.clip((relative * edge).sum(axis=2) / length_squared, 0.0, 1.0)
    nearest = np.sqrt(((relative - along[:, :, None] * edge) ** 2).sum(axis=2)).min(axis=1)
    # Even-odd rule: the ray in +x crosses an edge if the edge's ends lie on both sides of the point's y.
    y = points_m[:, 1, None]
    crosses = (start[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(edge[:, 1] == 0.0, 1.0, edge[:, 1])
    at_x = start[:, 0] + (y - start[:, 1]) / rise * edge[:, 0]
    inside = (crosses & (points_m[:, 0, None] < at_x)).sum(axis=1) % 2 == 1
    distance: NDArray[np.float64] = np.where(inside, 0.0, nearest)
    return distance
