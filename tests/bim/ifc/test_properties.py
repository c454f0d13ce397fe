"""Statuses and places that a file states, without geometry."""

from __future__ import annotations

from bimvox.bim.ifc.georeference import georeference_of
from bimvox.bim.ifc.properties import Properties

from ..conftest import IfcMaker


def test_what_exists_already() -> None:
    made = IfcMaker()
    old, new = made.rooted("IfcWall"), made.rooted("IfcWall")
    made.properties(old, "Pset_WallCommon", Status="EXISTING")
    made.properties(new, "Pset_WallCommon", Status="NEW")
    found = Properties()
    assert found.is_existing(old)
    assert not found.is_existing(new)


def test_georeference_is_plain_metres_radians_and_degrees() -> None:
    made = IfcMaker(unit="mm", map_at=(1000.0, 2000.0, 0.0))
    made.rooted("IfcSite", RefLatitude=(52, 9, 0, 0), RefLongitude=(-5, -30, 0, 0), RefElevation=2500.0)
    assert georeference_of(made.file, 0.001) == {
        "eastings_m": 1.0,
        "northings_m": 2.0,
        "height_m": 0.0,
        "x_axis_yaw_rad": 0.0,
        "scale": 1.0,
        "crs": "EPSG:28992",
        "latitude_deg": 52.15,
        "longitude_deg": -5.5,
        "elevation_m": 2.5,
    }
