"""Statuses and places that a file states, without geometry."""

from __future__ import annotations

import math

import pytest

from bimvox.bim.building import Casting
from bimvox.bim.ifc.properties import Properties, stated_casting
from bimvox.bim.ifc.units import georeference_of

from ..conftest import IfcMaker


def test_what_exists_already() -> None:
    made = IfcMaker()
    old, new = made.rooted("IfcWall"), made.rooted("IfcWall")
    made.properties(old, "Pset_WallCommon", Status="EXISTING")
    made.properties(new, "Pset_WallCommon", Status="NEW")
    found = Properties()
    assert found.is_existing(old)
    assert not found.is_existing(new)


@pytest.mark.parametrize("status", ["EXISTING", "DEMOLISH", "TEMPORARY", "NEW"])
def test_what_goes_and_what_does_not_stay(status: str) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.properties(wall, "Pset_WallCommon", Status=status)
    found = Properties()
    assert found.is_existing(wall) is (status in ("EXISTING", "DEMOLISH"))
    assert found.is_demolished(wall) is (status == "DEMOLISH")
    assert found.is_temporary(wall) is (status == "TEMPORARY")


@pytest.mark.parametrize("owner", ["IfcProject", "IfcSite"])
@pytest.mark.parametrize(
    ("unit", "map_unit", "metres"), [("mm", None, 0.001), ("mm", "METRE", 1.0), ("m", "Millimetres", 0.001)]
)
def test_ifc2x3_has_its_map_conversion_in_property_sets(
    owner: str, unit: str, map_unit: str | None, metres: float
) -> None:
    made = IfcMaker(schema="IFC2X3", unit=unit)
    where = made.project if owner == "IfcProject" else made.rooted("IfcSite")
    crs = {"Name": "EPSG:28992"} | ({"MapUnit": map_unit} if map_unit else {})
    made.properties(where, "EPset_ProjectedCRS", **crs)
    values = {"Eastings": 155000.0, "Northings": 463000.0, "OrthogonalHeight": 2.0, "Scale": 1.0}
    made.properties(where, "ePSet_MapConversion", **values, XAxisAbscissa=0.0, XAxisOrdinate=2.0)
    found = georeference_of(made.file, 0.001 if unit == "mm" else 1.0)
    assert found == {
        "eastings_m": pytest.approx(155000.0 * metres),
        "northings_m": pytest.approx(463000.0 * metres),
        "height_m": pytest.approx(2.0 * metres),
        "x_axis_yaw_rad": pytest.approx(math.pi / 2),
        "scale": 1.0,
        "crs": "EPSG:28992",
    }


def test_an_ifc2x3_conversion_without_numbers_is_none() -> None:
    made = IfcMaker(schema="IFC2X3")
    made.properties(made.project, "ePset_MapConversion", Eastings="155 km", Northings="")
    assert "eastings_m" not in georeference_of(made.file, 1.0)


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


@pytest.mark.parametrize(
    ("sets", "casting"),
    [
        ({"Pset_ConcreteElementGeneral": {"CastingMethod": "INSITU"}}, Casting.IN_SITU),
        ({"Pset_ConcreteElementGeneral": {"CastingMethod": "PRECAST"}}, Casting.PRECAST),
        ({"Pset_ConcreteElementGeneral": {"CastingMethod": "MIXED"}}, None),
        ({"Pset_ConcreteElementGeneral": {"ConstructionMethod": "In-Situ"}}, Casting.IN_SITU),
        ({"Tekla Common": {"Cast_unit type": "CAST IN PLACE"}}, Casting.IN_SITU),
        ({"Pset_PrecastConcreteElementFabrication": {}}, Casting.PRECAST),
        ({"Pset_SlabCommon": {"Reference": "cast in place"}}, None),
    ],
)
def test_properties_that_state_it(sets: dict[str, dict[str, str]], casting: Casting | None) -> None:
    assert stated_casting(sets) is casting
