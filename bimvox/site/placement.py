"""Placement of a building on its site: from model coordinates to the site frame."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element
from bimvox.bim.cut_back import cut_back
from bimvox.bim.site_frame import in_site_frame
from bimvox.errors import SelectionError
from bimvox.site.config.site_config import SiteConfig


def place_building(config: SiteConfig, building: Building) -> tuple[Building, NDArray[np.float64]]:
    """Return a building in the site frame, with what is cut there to fit.

    Args:
        config: The site file, with ``model.ground_m``.
        building: As read.

    Returns:
        The building in the site frame (z = 0 is the top of the ground), and ``site_to_ifc``, (4, 4) float64: site
        metres to model coordinates in metres.
    """
    if config.model.ground_m is None:
        raise config.error("model.ground_m", "is missing", hint="add the height of the ground in the model")
    local_m = config.model.ground_m - float(building.origin_m[2])
    placed, site_to_local = in_site_frame(building, ground_m=local_m, yaw_rad=config.model.yaw_rad)
    site_to_ifc = site_to_local.copy()
    site_to_ifc[:3, 3] += building.origin_m
    return cut_back(placed), site_to_ifc


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
