"""Map coordinates: the transform from a model's, from its file (IfcMapConversion), and what a surveyor sets out."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import shown
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.placement import built_bounds_m, place_building
from bimvox.units import METRES_PER_UNIT

Matrix = list[list[float]]
NO_CONVERSION = "the model has no map conversion (IfcMapConversion; in IFC2X3 the property set ePset_MapConversion)"
_FAR_M = 10_000.0
"""What is further from the building is not on its site."""


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


def map_of_model(stated: str, source: Mapping[str, str | float | bool]) -> Matrix | None:
    """Return the (4, 4) transform from a model's metres to map metres that a log states; None if it states none.

    Args:
        stated: The map conversion as JSON, as a log's metadata have it.
        source: ``Site.source``.
    """
    with suppress(ValueError, TypeError, AttributeError, KeyError):
        given = json.loads(stated or "{}")
        return ifc_to_map(given, str(source.get("unit", "m"))) if isinstance(given, dict) else None
    return None


def metric_scale(stated: float, unit: str) -> float:
    """Return a map conversion's scale as a factor from metres to metres.

    By the standard the scale includes the unit conversion and the map's distortion, which is within a few per mille of
    1. Real files include either or both, so the reading near 1 is taken.
    """
    for scale in (stated, stated / METRES_PER_UNIT.get(unit, 1.0)):
        if 0.9 < scale < 1.1:
            return scale
    return 1.0


def read_from_map(config: SiteConfig, building: Building) -> SiteConfig:
    """Return a site file in the site's frame; one that is in it already stays as it is.

    Raises:
        ConfigError: If the model has no map conversion, a crane's foot has a height but the ground has none, or
            something is more than 10 km from the building.
    """
    if config.coordinates == "site":
        return config
    to_map = ifc_to_map(building.georeference, building.source.unit)
    grounded = config
    if config.model.ground_m is None:
        for number, crane in enumerate(config.cranes):
            if crane.base_m is not None and len(crane.base_m) > 2:
                key = config.crane_key(number)
                hint = "add [model] ground_m, or leave the height out: the crane stands on the ground"
                raise config.error(key, "a height on the map needs the height of the ground", hint=hint)
        grounded = config.at_ground(0.0)
    _, site_to_ifc = place_building(grounded, replace(building, elements=()))
    result = on_site(config, site_to_ifc, to_map)
    bounds_m = built_bounds_m(place_building(grounded, building)[0].elements)
    middle = bounds_m.mean(axis=0)[:2]
    for (key, given), (_, at) in zip(_points(config), _points(result), strict=True):
        off_m = float(np.hypot(*(np.array(at[:2]) - middle)))
        if off_m > _FAR_M:
            hint = 'coordinates = "map" takes [easting, northing] in metres'
            raise config.error(key, f"{shown(given)} is {off_m / 1000.0:,.0f} km from the building", hint=hint)
    return result


def on_site(config: SiteConfig, site_to_ifc: NDArray[np.float64], ifc_to_map: Matrix | None) -> SiteConfig:
    """Return a site file whose areas, zones and cranes' feet are in the site's frame, to the micrometre.

    ``site_to_ifc``: (4, 4) transform from the site frame to model coordinates; ``ifc_to_map``: the (4, 4) transform
    from there to the map; None if the model has none.

    Raises:
        ConfigError: If the site file is in map coordinates, but there is no such transform.
    """
    if config.coordinates == "site":
        return config
    if ifc_to_map is None:
        raise config.error(
            "coordinates",
            NO_CONVERSION,
            hint='add it to the model, or give site coordinates: coordinates = "site"',
        )
    matrix = np.array(ifc_to_map) @ site_to_ifc
    (a, b), (c, d) = matrix[:2, :2].tolist()
    east, north, height = matrix[:3, 3].tolist()
    determinant = a * d - b * c

    def at(point: Sequence[float]) -> tuple[float, ...]:
        e, n = point[0] - east, point[1] - north
        plan = ((d * e - b * n) / determinant, (a * n - c * e) / determinant)
        up = tuple((z - height) / matrix[2, 2] for z in point[2:])
        return tuple(round(float(value), 6) + 0.0 for value in (*plan, *up))

    def polygon(corners: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
        return tuple(map(at, corners))

    areas = config.areas
    moved = areas.model_copy(
        update={
            "construction": areas.construction and polygon(areas.construction),
            "yard": areas.yard and tuple(map(polygon, areas.yard)),
            "access": areas.access and tuple(map(polygon, areas.access)),
            "plot": areas.plot and polygon(areas.plot),
        }
    )
    given = config.crane if isinstance(config.crane, tuple) else () if config.crane is None else (config.crane,)
    cranes = [
        one.model_copy(
            update={
                "base_m": one.base_m and at(one.base_m),
                "setup": tuple(place.model_copy(update={"base_m": at(place.base_m)}) for place in one.setup),
            }
        )
        for one in given
    ]
    several = isinstance(config.crane, tuple)
    return config.model_copy(
        update={
            "coordinates": "site",
            "areas": moved,
            "crane": tuple(cranes) if several else cranes[0] if cranes else None,
            "zone": tuple(zone.model_copy(update={"polygon": polygon(zone.polygon)}) for zone in config.zone),
        }
    )


def _points(config: SiteConfig) -> Iterator[tuple[str, Sequence[float]]]:
    """Yield every point of a site file that may be in map coordinates, with its key."""
    for name in ("construction", "plot"):
        yield from ((f"areas.{name}", corner) for corner in getattr(config.areas, name) or ())
    for name, polygons in (("yard", config.areas.yard), ("access", config.areas.access)):
        for number, polygon in enumerate(polygons or ()):
            yield from ((f"areas.{name}[{number}]", corner) for corner in polygon)
    for number, crane in enumerate(config.cranes):
        if crane.base_m is not None:
            yield config.crane_key(number), crane.base_m
    for number, zone in enumerate(config.zone):
        yield from ((f"zone[{number}].polygon", corner) for corner in zone.polygon)


def set_out(
    config: SiteConfig, cranes: Sequence[TowerCrane], site_to_ifc: NDArray[np.float64], ifc_to_map: Matrix
) -> dict[str, Any]:
    """Return a site's cranes, areas and zones in map coordinates.

    ``site_to_ifc``: (4, 4) transform from the site frame to model coordinates; ``ifc_to_map``: the (4, 4) transform
    from there to the map.

    Returns:
        ``site_to_map`` (4, 4); ``north_deg``: map north, counter-clockwise from the site's y axis; eastings, northings
        and heights in metres, to the millimetre: of every crane's foot by its name, and of the corners of areas and
        zones on the ground.
    """
    site_to_map = np.array(ifc_to_map) @ site_to_ifc

    def on_map(points: Sequence[Sequence[float]]) -> list[list[float]]:
        at = np.array([[*point[:2], point[2] if len(point) > 2 else 0.0, 1.0] for point in points])
        result: list[list[float]] = (np.round(at @ site_to_map.T, 3) + 0.0)[:, :3].tolist()
        return result

    areas = config.areas
    return {
        "site_to_map": (site_to_map + 0.0).tolist(),
        "north_deg": round(math.degrees(math.atan2(site_to_map[0, 1], site_to_map[1, 1])), 6) + 0.0,
        "cranes": {name: on_map([crane.base_m])[0] for name, crane in zip(_names(cranes), cranes, strict=True)},
        "construction": on_map(areas.construction) if areas.construction else None,
        "yard": [on_map(polygon) for polygon in areas.yard or ()],
        **({"access": [on_map(polygon) for polygon in areas.access]} if areas.access else {}),
        "zones": [{"kind": zone.kind, "name": zone.name, "corners": on_map(zone.polygon)} for zone in config.zone],
    }


def _names(cranes: Sequence[TowerCrane]) -> list[str]:
    """Return a name for every crane: its own, with its number if there are several."""
    return [crane.name if len(cranes) == 1 else f"{number} {crane.name}" for number, crane in enumerate(cranes, 1)]
