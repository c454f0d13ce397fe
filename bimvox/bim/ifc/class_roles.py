"""The role of each IFC class for a lift planner, and what is lifted without a query."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar

import ifcopenshell
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element, Role
from bimvox.bim.ifc.properties import INSULATION_KG_M3
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.bim.kinds.words import is_barrier, machine_of, meaning_of
from bimvox.errors import shown

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
def _ancestry(schema: str, ifc_class: str) -> tuple[str, ...]:
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
    return None if "IfcSite" in _ancestry(schema, ifc_class) else _nearest(NOT_SOLID, schema, ifc_class)


def reason_too_small(schema: str, ifc_class: str) -> str | None:
    """Return why a class is left out by default; None if it is not."""
    return _nearest(TOO_SMALL, schema, ifc_class)


def is_never_precast(schema: str, ifc_class: str) -> bool:
    """Return whether a fitting is never a precast part of concrete: a door, a window, furniture, services."""
    above = _ancestry(schema, ifc_class)
    return _CHAMBER not in above and not _NEVER_PRECAST.isdisjoint(above)


def _nearest(table: Mapping[str, T], schema: str, ifc_class: str) -> T | None:
    """Return what a table has for a class, otherwise for its nearest supertype; None if it has nothing."""
    return next((table[name] for name in _ancestry(schema, ifc_class) if name in table), None)


HAND_CARRIED_KG = 5.0
"""A part lighter than this is not a crane lift, unless every part is (a model at toy scale)."""
_SHOWN = 3
_TOUCHES_M = 0.1
_PILE_SLENDER = 3.0
"""A pile is at least this many times as high as wide."""
CRANE_KG = 300.0
"""Machines and barriers from this mass are lifts: lighter ones are moved with a pallet truck or a hoist."""


def by_default(elements: list[Element], notes: list[str]) -> list[Element]:
    """Return the elements with the roles that they have if nothing is selected.

    What the site file says of the way of an element stays.

    Args:
        elements: All elements, each with the role that its class and name give it.
        notes: Each decision is appended here; a planner can override it with a query.
    """
    promoted = _promoted(elements, notes)
    free = iter(_by_default([one for one in promoted if one.stated_means is None], notes))
    return [next(free) if one.stated_means is None else one for one in elements]


def _by_default(elements: list[Element], notes: list[str]) -> list[Element]:
    elements = _piles(elements, notes)
    formwork = sum(one.judgement.kind is Kind.FORMWORK and one.role is Role.FITTING for one in elements)
    if formwork:
        notes.append(f"formwork and temporary works, not part of the plan: {formwork}; select them to lift them")
    elements = _fitted(
        elements, notes, _is_insulation, f"insulation and air (under {INSULATION_KG_M3:g} kg/m3), treated as fittings"
    )
    return _fitted(elements, notes, _is_light, f"parts under {HAND_CARRIED_KG:g} kg, treated as fittings")


def _promoted(elements: list[Element], notes: list[str]) -> list[Element]:
    """Return machines and barriers in the open as components, and the unknown classes if the file has no others."""
    machines = _machines(elements, notes)
    left = _promoted_unknown([one for one in elements if one.id not in machines], notes)
    rest = iter(left)
    return [replace(one, role=Role.COMPONENT) if one.id in machines else next(rest) for one in elements]


def _machines(elements: list[Element], notes: list[str]) -> set[str]:
    """Return the ids of the machines, tanks, containers and noise barriers that need a crane and have nothing above."""
    found = [one for one in elements if one.role is Role.FITTING and one.mass_kg >= CRANE_KG and _is_machine(one)]
    if not found:
        return set()
    frame = [one.mesh.bounds_m for one in elements if one.role in (Role.COMPONENT, Role.STRUCTURE)]
    bounds_m = np.array(frame).reshape(-1, 2, 3)
    inside = [one for one in found if _is_under(one.mesh.bounds_m, bounds_m)]
    within = {one.id for one in inside}
    for some, words in (
        ([one for one in found if one.id not in within], "machines, tanks, containers and noise barriers, lifted"),
        (inside, "machines, tanks and containers under a roof, treated as fittings"),
    ):
        if some:
            names = ", ".join(dict.fromkeys(one.name for one in some[:_SHOWN]))
            notes.append(f"{words}: {len(some)} ({names}{', ...' if len(some) > _SHOWN else ''})")
    return {one.id for one in found} - within


def _is_machine(element: Element) -> bool:
    names = (element.name, element.type_name)
    return machine_of(element.ifc_class, names) is not None or is_barrier(element.ifc_class, names)


def _is_under(machine_m: NDArray[np.float64], frame_m: NDArray[np.float64]) -> bool:
    """Return whether one of (N, 2, 3) boxes is above the middle of another."""
    middle_m, top_m = machine_m[:, :2].mean(axis=0), machine_m[1, 2]
    covers = (frame_m[:, 0, :2] <= middle_m).all(axis=1) & (frame_m[:, 1, :2] >= middle_m).all(axis=1)
    return bool((covers & (frame_m[:, 0, 2] >= top_m - _TOUCHES_M)).any())


def _promoted_unknown(elements: list[Element], notes: list[str]) -> list[Element]:
    """Return elements of unknown class as components if the file has no others (infrastructure, plain exports)."""
    unknown = [element.ifc_class in UNKNOWN and element.role is Role.FITTING for element in elements]
    if any(element.role is Role.COMPONENT for element in elements):
        if any(unknown):
            notes.append(
                f"elements of unknown class (proxies), treated as fittings: {sum(unknown)}; select them to lift them"
            )
        return elements
    if not any(unknown):
        notes.append("no element has a class that is lifted: select what to lift")
        return elements
    notes.append(f"no element has a class that is lifted, so those of unknown class (proxies) are: {sum(unknown)}")
    return [
        replace(element, role=Role.COMPONENT) if is_unknown else element
        for element, is_unknown in zip(elements, unknown, strict=True)
    ]


def _piles(elements: list[Element], notes: list[str]) -> list[Element]:
    """Return the elements; an upright part below the rest that is called a pile is in place before the first lift."""
    parts = [element for element in elements if element.role is Role.COMPONENT]
    named = {element.id: element for element in parts if _is_pile(element)}
    rest = [float(one.mesh.bounds_m[0, 2]) for one in parts if one.id not in named]
    level_m = float(np.median(rest)) if rest else -np.inf
    piles = {name for name, element in named.items() if element.mesh.bounds_m[1, 2] <= level_m}
    if not piles:
        return elements
    notes.append(f"piles, in place before the first lift: {len(piles)}; select them to lift them")
    return [_as_pile(one) if one.id in piles else one for one in elements]


def _as_pile(element: Element) -> Element:
    why = f"its name {shown(element.name or element.type_name)} says a pile, and it stands below the rest"
    return replace(element, role=Role.STRUCTURE, judgement=Judgement(Kind.PILE, Confidence.NAMED, why))


def _is_pile(element: Element) -> bool:
    """Return whether a part is called a pile and has the shape of one."""
    x_m, y_m, z_m = np.ptp(element.mesh.bounds_m, axis=0)
    names = (element.name, element.type_name)
    said = (meaning_of(name, "part") for name in names if name)
    is_stated = element.judgement.confidence is Confidence.STATED
    return (
        not is_stated
        and bool(z_m >= _PILE_SLENDER * max(x_m, y_m))
        and any(one is not None and one.kind is Kind.PILE for one in said)
    )


def _is_insulation(element: Element) -> bool:
    """Return whether a part is insulation; only if its mass comes from the density of its material."""
    volume_m3 = abs(element.mesh.signed_volume_m3)
    return element.mass_source == "density" and 0.0 < element.mass_kg < INSULATION_KG_M3 * volume_m3


def _is_light(element: Element) -> bool:
    """Return whether a part is carried by hand: detailed models contain nuts and anchors as ``IfcBeam``."""
    return element.mass_kg < HAND_CARRIED_KG


def _fitted(elements: list[Element], notes: list[str], is_one: Callable[[Element], bool], words: str) -> list[Element]:
    """Return the components of a kind as fittings, unless no component would be left."""
    found = [element.role is Role.COMPONENT and is_one(element) for element in elements]
    if not any(found) or sum(found) == sum(element.role is Role.COMPONENT for element in elements):
        return elements
    notes.append(f"{words}: {sum(found)}; select them to lift them")
    return [
        replace(element, role=Role.FITTING) if is_found else element
        for element, is_found in zip(elements, found, strict=True)
    ]
