"""The time of parts that a trade builds in their place, of pieces: masonry, partitions, glazing, earth.

The defaults are working hours of one person, typical values of the field, not measured: a cubic metre of masonry of
large blocks takes 3 to 4 hours, of bricks 6 to 8; a square metre of partition or cladding 0.8 to 1.2, of glazing 1 to
2; a cubic metre of filled earth half an hour. Masonry carries after a day. Professional judgement without a source at
hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.bim.kinds.kind import Kind
from bimvox.site.limits import MOST_WORK_S


@dataclass(frozen=True, slots=True)
class BuildingTimes:
    """The times of parts that are built in place.

    Attributes:
        people: People of a trade; the parts are built one after the other.
        masonry_h_m3: Working hours of one person for a cubic metre of masonry.
        light_h_m2: The same for a square metre of a partition, of cladding, of a roof's covering.
        glazing_h_m2: The same for a square metre of glass.
        earth_h_m3: The same for a cubic metre of earth.
        other_h_m3: The same for a cubic metre of anything else that the site file says is built.
        wait_h: Hours from the end of the work until it carries what rests on it.
    """

    people: float
    masonry_h_m3: float
    light_h_m2: float
    glazing_h_m2: float
    earth_h_m3: float
    other_h_m3: float
    wait_h: float


FIELD_BUILDING = BuildingTimes(4.0, 4.0, 1.0, 1.5, 0.5, 6.0, 24.0)
"""The defaults of the site file."""


def built_and_wait_s(building: BuildingTimes, kind: Kind, mesh: TriangleMesh) -> tuple[float, float]:
    """Return how long a part is built, and then waited for until it carries, seconds."""
    volume_m3 = abs(mesh.signed_volume_m3)
    if kind is Kind.LIGHT:
        hours = building.light_h_m2 * _side_m2(mesh)
    elif kind is Kind.GLAZING:
        hours = building.glazing_h_m2 * _side_m2(mesh)
    elif kind is Kind.MASONRY:
        hours = building.masonry_h_m3 * volume_m3
    elif kind is Kind.EARTH:
        hours = building.earth_h_m3 * volume_m3
    else:
        hours = building.other_h_m3 * volume_m3
    return min(3600.0 * hours / building.people, MOST_WORK_S), 3600.0 * building.wait_h


def _side_m2(mesh: TriangleMesh) -> float:
    """Return half the surface of a mesh: of a thin part, one of its sides."""
    a, b, c = np.moveaxis(mesh.triangles_m, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 4.0
