from __future__ import annotations

import ifcopenshell
import pytest

from bimvox.bim.building import Role
from bimvox.bim.ifc.class_roles import (
    NOT_SOLID,
    ROLES,
    SPLIT,
    TOO_SMALL,
    UNKNOWN,
    reason_not_solid,
    reason_too_small,
    role_of_class,
)

_SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3_ADD2")


@pytest.mark.parametrize("schema", _SCHEMAS)
@pytest.mark.parametrize(
    ("ifc_class", "role"),
    [
        ("IfcColumn", Role.COMPONENT),
        ("IfcWallStandardCase", Role.COMPONENT),
        ("IfcStairFlight", Role.COMPONENT),
        ("IfcFooting", Role.STRUCTURE),
        ("IfcPile", Role.STRUCTURE),
        ("IfcDoor", Role.FITTING),
        ("IfcCurtainWall", Role.FITTING),
        ("IfcFlowTerminal", Role.FITTING),
        ("IfcBuildingElementProxy", Role.FITTING),
        ("IfcSite", Role.GROUND),
        ("IfcTask", None),
    ],
)
def test_roles(schema: str, ifc_class: str, role: Role | None) -> None:
    if schema == "IFC4X3_ADD2" and ifc_class == "IfcWallStandardCase":
        ifc_class = "IfcWall"
    assert role_of_class(schema, ifc_class) is role


@pytest.mark.parametrize("schema", _SCHEMAS)
def test_spaces_openings_and_sites(schema: str) -> None:
    assert reason_not_solid(schema, "IfcSpace")
    assert reason_not_solid(schema, "IfcOpeningElement")
    assert reason_not_solid(schema, "IfcSite") is None
    assert reason_not_solid(schema, "IfcBeam") is None
    assert reason_too_small(schema, "IfcReinforcingBar")
    assert reason_too_small(schema, "IfcMechanicalFastener")
    assert reason_too_small(schema, "IfcBeam") is None


def test_every_class_in_the_tables_exists_in_some_schema() -> None:
    declared = set()
    for schema in _SCHEMAS:
        declared |= {entity.name() for entity in ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema).entities()}
    assert {*ROLES, *NOT_SOLID, *TOO_SMALL, *SPLIT, *UNKNOWN} <= declared
