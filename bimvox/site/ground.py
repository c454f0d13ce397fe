"""The ground of a site: terrain, the levelled yard, and the excavation around what is set below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from bimvox.bim.building import TriangleMesh
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame, whole_cells
from bimvox.site.component import Component, IntVec
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.ground_level import heights_at
from bimvox.site.limits import ON_GROUND_M

WORKING_SPACE_M = 1.0
"""Around everything that is set below the ground. DIN 4124 asks for 0.5 m at least, beside formwork and shoring."""
_LEVEL_SHARE = 0.2
"""Terrain that reaches less into a layer of cells is level with it."""
_EPS_M = 1e-4
"""As deep may a part reach into the cells below it."""


def lowest_terrain_m(terrain: Sequence[TriangleMesh], low_m: Sequence[float], high_m: Sequence[float]) -> float:
    """Return the height of the lowest terrain in a rectangle on plan, at most 0; its underside does not count.

    Args:
        terrain: Its meshes, in the site frame.
        low_m: The lowest corner on plan.
        high_m: The highest corner.
    """
    x, y = (np.linspace(low_m[axis], high_m[axis], 65) for axis in range(2))
    heights_m = _highest(terrain, np.stack(np.meshgrid(x, y), axis=-1))
    return float(np.nanmin(np.append(heights_m, 0.0)))


def natural_ground_m(
    frame: GridFrame, terrain: Sequence[TriangleMesh], level: NDArray[np.bool_]
) -> NDArray[np.float64] | None:
    """Return the height of the ground in every column before anything is dug, (X, Y) float64 metres.

    It is the terrain's, the highest at the column's corners, to whole layers of cells; 0 where there is none. The yard
    and the access of trucks are made level, at the median of their terrain.

    Args:
        frame: Frame of the grid.
        terrain: The terrain's meshes, in the site frame.
        level: (X, Y) the columns of yard and access.

    Returns:
        The heights; None if they are 0 everywhere.
    """
    x, y = (frame.origin_m[axis] + frame.voxel_size_m * np.arange(level.shape[axis] + 1) for axis in range(2))
    at = _highest(terrain, np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1))
    highest = np.fmax.reduce([at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]])
    found_m: NDArray[np.float64] = np.where(np.isnan(highest), 0.0, _whole(highest, frame))
    if level.any():
        found_m[level] = _whole(np.median(found_m[level]), frame)
    return found_m if found_m.any() else None


def ground_tops(
    frame: GridFrame, columns: tuple[int, int], natural_m: NDArray[np.float64] | None, parts: Sequence[Component]
) -> NDArray[np.int32]:
    """Return the highest layer that the ground fills in every column once it is dug out, (X, Y) int32.

    It is dug to the underside of each part that is set below it, and around it, with ``WORKING_SPACE_M`` to work in,
    but not from under parts that stand on it.

    Args:
        frame: Frame of the grid.
        columns: (X, Y) of the grid.
        natural_m: From `natural_ground_m`; None: 0 everywhere.
        parts: What is set, of any means.
    """
    ground_m = np.zeros(columns) if natural_m is None else natural_m
    lowest_m = _lowest_m(frame, columns, parts)
    below_m = np.where(lowest_m < ground_m - _EPS_M, lowest_m, np.inf)
    if np.isfinite(below_m).any():
        reach = 2 * whole_cells(WORKING_SPACE_M, frame.voxel_size_m) + 1
        around_m = minimum_filter(below_m, size=reach, mode="constant", cval=np.inf)
        ground_m = np.minimum(ground_m, np.where(lowest_m <= ground_m + ON_GROUND_M, lowest_m, around_m))
    layers = np.floor((ground_m - frame.origin_m[2]) / frame.voxel_size_m + 1e-6).astype(np.int32)
    return np.maximum(layers - 1, 0)


def ground_cells(tops: NDArray[np.int32], shape: IntVec) -> NDArray[np.int32]:
    """Return the (N, 3) int32 cells of the ground: every column up to its top layer."""
    return np.argwhere(np.arange(shape[2], dtype=np.int32) <= tops[:, :, None]).astype(np.int32)


def stand_on_ground(
    frame: GridFrame,
    columns: tuple[int, int],
    natural_m: NDArray[np.float64] | None,
    parts: Sequence[Component],
    gap_m: float,
) -> list[bool]:
    """Return which parts stand on the ground: at or below its natural height, with no other part under them.

    Args:
        frame: Frame of the grid.
        columns: (X, Y) of the grid.
        natural_m: From `natural_ground_m`; None: 0 everywhere.
        parts: What is set, of any means.
        gap_m: How far above it a part may be.
    """
    highest_m = _lowest_m(frame, columns, parts) + gap_m
    highest_m = np.minimum(highest_m, gap_m if natural_m is None else natural_m + gap_m)
    return [bool((foot_m <= highest_m[x, y]).any()) for (x, y), foot_m in (_feet(frame, part) for part in parts)]


def are_over_others(
    frame: GridFrame, columns: tuple[int, int], natural_m: NDArray[np.float64] | None, parts: Sequence[Component]
) -> list[bool]:
    """Return which parts are as low as the ground and yet over other parts, such as the ceiling of a basement.

    The arguments are those of `stand_on_ground`.
    """
    on_ground = stand_on_ground(frame, columns, natural_m, parts, ON_GROUND_M)
    low = [bool(part.mesh.bounds_m[0, 2] <= ON_GROUND_M) for part in parts]
    return [is_low and not stands for is_low, stands in zip(low, on_ground, strict=True)]


def cranes_on_ground(
    config: SiteConfig, cranes: Sequence[TowerCrane], frame: GridFrame, natural_m: NDArray[np.float64] | None
) -> tuple[TowerCrane, ...]:
    """Return the cranes of a site file, those without a height of their own at the height of their ground.

    Args:
        config: The site file.
        cranes: Its cranes, from `cranes_of`.
        frame: Frame of the grid.
        natural_m: (X, Y) height of the ground; None: 0 everywhere.
    """
    if natural_m is None or len(config.cranes) != len(cranes):  # a site without a crane has a table that says so
        return tuple(cranes)
    found = []
    for given, crane in zip(config.cranes, cranes, strict=True):
        if given.base_m is None or len(given.base_m) < 3:
            x, y, _ = np.clip(frame.cell_of(crane.base_m), 0, [*(np.array(natural_m.shape) - 1), 0])
            crane = replace(crane, base_m=(*crane.base_m[:2], float(natural_m[x, y])))
        found.append(crane)
    return tuple(found)


def _feet(frame: GridFrame, part: Component) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the columns of a part's cells, (2, N), and the height of each cell; exact for its lowest cells."""
    x, y, z = part.shape.cells.T + np.array(part.target_vox, np.int32)[:, None]
    height_m = frame.origin_m[2] + frame.voxel_size_m * z
    height_m[z == part.target_vox[2]] = part.mesh.bounds_m[0, 2]
    return np.stack([x, y]), height_m


def _lowest_m(frame: GridFrame, columns: tuple[int, int], parts: Sequence[Component]) -> NDArray[np.float64]:
    """Return the height of the lowest part in every column, (X, Y) float64 metres; inf where there is none."""
    found = np.full(columns, np.inf)
    for part in parts:
        (x, y), foot_m = _feet(frame, part)
        np.minimum.at(found, (x, y), foot_m)
    return found


def _highest(terrain: Sequence[TriangleMesh], at_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the highest surface at (..., 2) points on plan; NaN where there is none."""
    return heights_at(terrain, at_m.reshape(-1, 2)).reshape(at_m.shape[:-1])


def _whole(height_m: NDArray[np.float64] | np.floating, frame: GridFrame) -> NDArray[np.float64]:
    return np.ceil(np.asarray(height_m) / frame.voxel_size_m - _LEVEL_SHARE) * frame.voxel_size_m + 0.0
