"""Map coordinates: the transform from a model's, from its file (IfcMapConversion), and what a surveyor sets out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.config.site_config import SiteConfig
from bimvox.units import METRES_PER_UNIT

Matrix = list[list[float]]


def ifc_to_map(georeference: Mapping[str, str | float], unit: str) -> Matrix | None:
    """Return the (4, 4) transform from the model's metres to map metres, or None if the file has none.

    ``map = scale * R_z(yaw) * ifc + (eastings, northings, height)``; heights are not rotated (IFC4 ADD2,
    IfcMapConversion).

    Args:
        georeference: ``Building.georeference``.
        unit: Length unit of the file: some exporters include its conversion to the map's unit in the scale.
    """
    if "eastings_m" not in georeference:
        return None
    yaw_rad = float(georeference.get("x_axis_yaw_rad", 0.0))
    scale = metric_scale(float(georeference.get("scale", 1.0)), unit)
    cos, sin = scale * math.cos(yaw_rad), scale * math.sin(yaw_rad)
    east, north, height = (float(georeference[key]) for key in ("eastings_m", "northings_m", "height_m"))
    return [[cos, 0.0 - sin, 0.0, east], [sin, cos, 0.0, north], [0.0, 0.0, scale, height], [0.0, 0.0, 0.0, 1.0]]


def metric_scale(stated: float, unit: str) -> float:
    """Return a map conversion's scale as a factor from metres to metres.

    By the standard the scale includes the unit conversion and the map's distortion, which is within a few per mille of
    1. Real files include either or both, so the reading near 1 is taken.
    """
    for scale in (stated, stated / METRES_PER_UNIT.get(unit, 1.0)):
        if 0.9 < scale < 1.1:
            return scale
    return 1.0


def set_out(
    config: SiteConfig, cranes: Sequence[TowerCrane], site_to_ifc: NDArray[np.float64], ifc_to_map: Matrix
) -> dict[str, Any]:
    """Return a site's cranes, areas and zones in map coordinates.

    Args:
        config: The site file, complete.
        cranes: Its cranes.
        site_to_ifc: (4, 4) transform from the site frame to model coordinates.
        ifc_to_map: The (4, 4) transform from there to the map.

    Returns:
        ``site_to_map`` (4, 4); ``north_deg``: map north, counter-clockwise from the site's y axis; eastings, northings
        and heights in metres, to the millimetre: of every crane's foot by its name, and of the corners of areas and
        zones on the ground.
    """
    site_to_map = np.array(ifc_to_map) @ site_to_ifc

    def on_map(points: Sequence[Sequence[float]]) -> list[list[float]]:
        at = np.array([[*point[:2], point[2] if len(point) > 2 else 0.0, 1.0] for point in points])
        found: list[list[float]] = (np.round(at @ site_to_map.T, 3) + 0.0)[:, :3].tolist()
        return found

    areas = config.areas
    return {
        "site_to_map": (site_to_map + 0.0).tolist(),
        "north_deg": round(math.degrees(math.atan2(site_to_map[0, 1], site_to_map[1, 1])), 6) + 0.0,
        "cranes": {name: on_map([crane.base_m])[0] for name, crane in zip(_names(cranes), cranes, strict=True)},
        "construction": on_map(areas.construction) if areas.construction else None,
        "yard": [on_map(polygon) for polygon in areas.yard or ()],
        "zones": [{"kind": zone.kind, "name": zone.name, "corners": on_map(zone.polygon)} for zone in config.zone],
    }


def _names(cranes: Sequence[TowerCrane]) -> list[str]:
    """Return a name for every crane: its own, with its number if there are several."""
    return [crane.name if len(cranes) == 1 else f"{number} {crane.name}" for number, crane in enumerate(cranes, 1)]
