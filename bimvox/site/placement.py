"""Placement of a building on its site: from model coordinates to the site frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element, Role
from bimvox.bim.cut_back import cut_back
from bimvox.bim.site_frame import in_site_frame
from bimvox.crane.outline import highest_point_m, mast_box_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import GridTooLargeError, SelectionError
from bimvox.grid.frame import GridFrame, whole_cells
from bimvox.kept import kept
from bimvox.site.component import Component, IntVec
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.ground import lowest_terrain_m, terrain_of
from bimvox.site.means import Means


def place_building(config: SiteConfig, building: Building) -> tuple[Building, NDArray[np.float64]]:
    """Return a building in the site frame, with what is cut there to fit.

    ``config``: the site file, with ``model.ground_m``.

    Returns:
        The building in the site frame (z = 0 is the top of the ground), and ``site_to_ifc``, (4, 4) float64: site
        metres to model coordinates in metres.
    """
    if config.model.ground_m is None:
        raise config.error("model.ground_m", "is missing", hint="add the height of the ground in the model")
    local_m = config.model.ground_m - float(building.origin_m[2])
    placed, site_to_local = _placed(building, local_m, config.model.yaw_rad)
    site_to_ifc = site_to_local.copy()
    site_to_ifc[:3, 3] += building.origin_m
    return placed, site_to_ifc


@kept  # what a site file leaves open is guessed, and then its site is built, from the same parts
def _placed(building: Building, ground_m: float, yaw_rad: float) -> tuple[Building, NDArray[np.float64]]:
    placed, site_to_local = in_site_frame(building, ground_m=ground_m, yaw_rad=yaw_rad)
    return cut_back(placed), site_to_local


def built_elements(elements: Iterable[Element]) -> list[Element]:
    """Return the elements that are components or structure."""
    return [element for element in elements if element.role in BUILT]


def built_bounds_m(elements: Iterable[Element]) -> NDArray[np.float64]:
    """Return the (2, 3) bounding box of components and structure.

    Raises:
        SelectionError: If there are none.
    """
    corners = [element.mesh.bounds_m for element in built_elements(elements)]
    if not corners:
        raise SelectionError(
            "the model has neither components nor structure", hint="see bimvox inspect, and [model] select"
        )
    return np.stack([np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]])


def dominant_yaw_rad(building: Building) -> float:
    """Return the yaw of the building's walls, in (-pi/4, pi/4]; 0 if there is no clear answer.

    Vertical faces vote by area for the direction of their normal modulo a right angle: the mean of ``exp(4 i angle)``,
    then the area-weighted median within two degrees of it, which outliers do not affect.
    """
    elements = built_elements(building.elements)
    if not elements:
        return 0.0
    corners = np.concatenate([element.mesh.triangles_m for element in elements])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    upright = (areas > 1e-9) & (np.abs(normals[:, 2]) < 0.01 * areas)
    if not upright.any():
        return 0.0
    angles, weights = np.arctan2(normals[upright, 1], normals[upright, 0]), areas[upright]
    mean = np.sum(weights * np.exp(4j * angles)) / weights.sum()
    if abs(mean) < 0.5:
        return 0.0
    middle = float(np.angle(mean)) / 4.0
    off = np.remainder(angles - middle + np.pi / 4, np.pi / 2) - np.pi / 4
    near = np.flatnonzero(np.abs(off) < np.radians(2.0))
    if not len(near):
        return 0.0
    near = near[np.argsort(off[near], kind="stable")]
    half = np.searchsorted(np.cumsum(weights[near]), weights[near].sum() / 2.0)
    yaw = middle + float(off[near[half]])
    return float(np.round(yaw, 9)) if abs(yaw) > np.radians(0.05) else 0.0


MAX_CELLS = 50_000_000
MARGIN_VOX = 2
_SPARE_M = 1.0
HEADROOM_M = 3.0
"""Free height between the building's top and the tallest part carried over it; 2 to 3 m is common practice."""


def site_extent(
    config: SiteConfig, building: Building, *cranes: TowerCrane | None, least_depth_m: float = 0.0
) -> tuple[GridFrame, IntVec]:
    """Return the frame and the shape of the site's grid.

    Without ``[grid]``, the grid covers the building, the areas and the masts plus two cells. Its height lets the
    tallest part pass over the building with 3 m to spare (see :func:`top_m`), but is at most the cranes' highest load
    and at least the building's top. The transit clearance is added on every side. Cell corners lie at whole multiples
    of the cell size in the site frame; an explicit extent is widened to them. The layer k = 0 is ground everywhere: it
    lies below z = 0, or below the lowest part and the lowest terrain if they are lower.

    Args:
        config: The site file, with ``model.voxel_size_m``.
        building: In the site frame.
        cranes: The cranes; None values are ignored.
        least_depth_m: How far below z = 0 the ground reaches at least, for a building without its terrain.

    Raises:
        ConfigError: If the explicit extent does not fit the cell size.
        GridTooLargeError: If the grid would have more than 50 million cells.
    """
    size_m = config.model.voxel_size_m
    if size_m is None:
        raise config.error("model.voxel_size_m", "is missing", hint="add the edge length of a planning cell")
    if config.grid is not None:
        low, high = _explicit(config, size_m)
    else:
        low, high = _around(config, building, [crane for crane in cranes if crane is not None], size_m)
    depth = whole_cells(max(least_depth_m, _depth_m(building, low, high)) - 1e-4, size_m)
    if config.grid is not None and len(config.grid.low_m) == 3:
        _check_floor(config, config.grid.low_m, -(1 + depth) * size_m)
    frame = GridFrame((float(low[0]), float(low[1]), -(1 + depth) * size_m), size_m)
    nx, ny = (int(n) for n in np.ceil((high[:2] - low[:2]) / size_m - 1e-6))
    nz = 1 + depth + int(np.ceil(high[2] / size_m - 1e-6))
    cells = nx * ny * nz
    if cells > MAX_CELLS:
        fitting_m = size_m * (cells / MAX_CELLS) ** (1 / 3)
        raise GridTooLargeError(cells, MAX_CELLS, size_m, float(np.ceil(fitting_m * 20) / 20))
    return frame, (nx, ny, nz)


def with_room_for_slings(
    config: SiteConfig, frame: GridFrame, shape: IntVec, components: Iterable[Component]
) -> IntVec:
    """Return the shape of the grid, raised if the empty hook does not fit above a part on long slings.

    After a part is set, the hook begins where the usual slings of the crane end, below it: above a long part of a low
    building, or above its stack, that may be higher than any load is carried. An explicit extent stays.

    Args:
        config: The site file.
        frame: Frame of the grid, from ``site_extent``.
        shape: (X, Y, Z) of the grid.
        components: The components, on their slings.
    """
    if config.grid is not None:
        return shape
    stack_m = config.yard.stack_height_m if config.yard else 0.0
    stack_vox = whole_cells(stack_m - frame.origin_m[2], frame.voxel_size_m)
    ends = (
        max(one.target_vox[2], stack_vox) + one.shape.size_vox[2] + one.lifting.sling_rise_vox + MARGIN_VOX
        for one in components
        if one.means is Means.CRANE and one.lifting.sling_rise_vox
    )
    return (*shape[:2], max(shape[2], *ends, 0))


def top_m(building: Building) -> float:
    """Return the height that the load's top may need: building, plus headroom, plus the tallest part."""
    heights = [
        float(np.ptp(element.mesh.bounds_m[:, 2])) for element in building.elements if element.role is Role.COMPONENT
    ]
    return float(built_bounds_m(building.elements)[1, 2]) + HEADROOM_M + max(heights, default=0.0)


def _over_other_cranes(cranes: Sequence[TowerCrane], separation_m: float) -> list[float]:
    """Return the heights to which hooks can be hoisted to clear a lower crane that slews under them."""
    wanted = [
        (highest_point_m(lower) + separation_m + _SPARE_M, upper.highest_hook_m - upper.sling_m)
        for upper, lower in permutations(cranes, 2)
    ]
    return [height_m for height_m, most_m in wanted if height_m <= most_m]


def _explicit(config: SiteConfig, size_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    assert config.grid is not None
    low, high = config.grid.low_m, config.grid.high_m
    corner = np.floor(np.array(low[:2]) / size_m + 1e-6) * size_m
    return corner, np.array([*np.ceil(np.array(high[:2]) / size_m - 1e-6) * size_m, high[2]])


def _check_floor(config: SiteConfig, low_m: Sequence[float], floor_m: float) -> None:
    if abs(low_m[2] - floor_m) > 1e-6:
        raise config.error(
            "grid.low_m",
            f"its third value is {low_m[2]:g}, but the lowest cells, which are ground, begin at {floor_m:g}",
            hint=f"write low_m = [{low_m[0]:g}, {low_m[1]:g}, {floor_m:g}], or leave the third value out",
        )


def _depth_m(building: Building, low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Return how far below z = 0 parts are set, or terrain lies within the extent."""
    feet = [float(one.mesh.bounds_m[0, 2]) for one in building.elements if one.role is Role.COMPONENT]
    terrain = terrain_of(building.elements)
    return -min([0.0, *feet, lowest_terrain_m(terrain, low[:2].tolist(), high[:2].tolist()) if terrain else 0.0])


def _around(
    config: SiteConfig, building: Building, cranes: Sequence[TowerCrane], size_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    bounds = built_bounds_m(building.elements)
    corners = [bounds[:, :2]]
    areas = (config.areas.construction, *(config.areas.yard or ()), *(config.areas.access or ()))
    corners += [np.array(polygon) for polygon in areas if polygon is not None]
    clearance_m = config.rules_in_force.transit_clearance_m
    highest = top_m(building) + clearance_m
    if cranes:
        corners += [np.array(mast_box_m(crane))[:, :2] for crane in cranes]
        highest_load_m = max(crane.highest_hook_m - crane.sling_m for crane in cranes)
        highest = max(min(highest, highest_load_m), float(bounds[1, 2]))
        if not config.moves:
            highest = max([highest, *_over_other_cranes(cranes, config.rules.crane_separation_m)])
    points = np.concatenate(corners)
    margin = MARGIN_VOX + whole_cells(clearance_m, size_m)
    low = (np.floor(points.min(axis=0) / size_m + 1e-6) - margin) * size_m
    high = (np.ceil(points.max(axis=0) / size_m - 1e-6) + margin) * size_m
    return low, np.array([*high, highest])
