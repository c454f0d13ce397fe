"""The role of each IFC class for a lift planner."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TypeVar

import ifcopenshell

from bimvox.bim.building import Role

T = TypeVar("T")

NOT_SOLID: dict[str, str] = {
    "IfcFeatureElement": "a void or surface feature: it is cut from its host",
    "IfcSpatialElement": "a space: it is not built",
    "IfcSpatialStructureElement": "a space: it is not built",
    "IfcVirtualElement": "virtual: it is not built",
    "IfcAnnotation": "an annotation",
    "IfcGrid": "a grid",
    "IfcPositioningElement": "a positioning element",
    "IfcLinearPositioningElement": "a positioning element",
    "IfcPort": "a port",
    "IfcStructuralItem": "structural analysis",
    "IfcStructuralActivity": "structural analysis",
}
"""Products that are neither lifted nor obstacles, whatever is selected."""

TOO_SMALL: dict[str, str] = {
    "IfcReinforcingElement": "reinforcement comes inside its concrete",
    "IfcFastener": "a fastener",
    "IfcMechanicalFastener": "a fastener",
    "IfcDiscreteAccessory": "an accessory",
}
"""Products left out unless a query selects them: they arrive with their host, and thousands of them cost minutes."""

_CLASSES: dict[Role, tuple[str, ...]] = {
    # Lifted from the yard.
    Role.COMPONENT: (
        *("IfcColumn", "IfcBeam", "IfcSlab", "IfcWall", "IfcMember", "IfcPlate", "IfcStair", "IfcStairFlight"),
        *("IfcRamp", "IfcRampFlight", "IfcRoof", "IfcChimney", "IfcElementAssembly", "IfcBuildingElementPart"),
        "IfcBuildingElementComponent",
    ),
    # Cast or driven in place before the first lift.
    Role.STRUCTURE: ("IfcFooting", "IfcPile", "IfcDeepFoundation"),
    # Terrain.
    Role.GROUND: (
        *("IfcSite", "IfcGeographicElement", "IfcGeotechnicalElement", "IfcEarthworksElement", "IfcCourse"),
        "IfcPavement",
    ),
    # All other elements are installed after the lifts: doors, windows, coverings, railings, curtain walls,
    # furniture, services, lifts and escalators.
    Role.FITTING: ("IfcElement", "IfcProxy"),
}
ROLES: dict[str, Role] = {ifc_class: role for role, classes in _CLASSES.items() for ifc_class in classes}
"""Role by class; an unlisted class has the role of its nearest listed supertype."""

UNKNOWN = frozenset({"IfcBuildingElementProxy", "IfcProxy", "IfcCivilElement", "IfcBuiltElement"})
"""Classes without meaning. They are fittings (in real files: model text, trees and markers) unless their name gives
another role, and components if the file has no others."""

CURTAIN_TYPES = frozenset({"MULLION", "CURTAIN_PANEL"})
"""Predefined types of curtain wall parts: fittings, also if the file has no curtain wall around them."""

SPLIT = frozenset({"IfcStair", "IfcRamp", "IfcRoof"})
"""Wholes that are assembled on site: their flights, stringers and slabs are lifted one by one."""


_NEVER_PRECAST = frozenset({"IfcDoor", "IfcWindow", "IfcFurnishingElement", "IfcDistributionElement"})
"""Fittings that are never lifted as precast parts, whatever their names say; chambers of drains are."""
_CHAMBER = "IfcDistributionChamberElement"


@functools.cache
def ancestry(schema: str, ifc_class: str) -> tuple[str, ...]:
    """Return a class and its supertypes, nearest first."""
    declaration = ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema).declaration_by_name(ifc_class).as_entity()
    names = []
    while declaration is not None:
        names.append(str(declaration.name()))
        declaration = declaration.supertype()
    return tuple(names)


def role_of_class(schema: str, ifc_class: str) -> Role | None:
    """Return the role of a class; None if it is not built."""
    return _nearest(ROLES, schema, ifc_class)


def reason_not_solid(schema: str, ifc_class: str) -> str | None:
    """Return why a class is never an element; None if it can be one."""
    return None if "IfcSite" in ancestry(schema, ifc_class) else _nearest(NOT_SOLID, schema, ifc_class)


def reason_too_small(schema: str, ifc_class: str) -> str | None:
    """Return why a class is left out by default; None if it is not."""
    return _nearest(TOO_SMALL, schema, ifc_class)


def is_never_precast(schema: str, ifc_class: str) -> bool:
    """Return whether a fitting is never a precast part of concrete: a door, a window, furniture, services."""
    above = ancestry(schema, ifc_class)
    return _CHAMBER not in above and not _NEVER_PRECAST.isdisjoint(above)


def _nearest(table: Mapping[str, T], schema: str, ifc_class: str) -> T | None:
    """Return what a table has for a class, otherwise for its nearest supertype; None if it has nothing."""
    return next((table[name] for name in ancestry(schema, ifc_class) if name in table), None)
