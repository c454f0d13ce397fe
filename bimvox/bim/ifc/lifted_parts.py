"""What is lifted without a query: corrects the roles that classes gave, looking at the whole file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element, Role
from bimvox.bim.ifc.class_roles import UNKNOWN
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.bim.kinds.machines import is_barrier, machine_of
from bimvox.bim.kinds.words import meaning_of
from bimvox.errors import shown

HAND_CARRIED_KG = 5.0
"""A part lighter than this is not a crane lift, unless every part is (a model at toy scale)."""
_SHOWN = 3
_TOUCHES_M = 0.1
_PILE_SLENDER = 3.0
"""A pile is at least this many times as high as wide."""
CRANE_KG = 300.0
"""Machines and barriers from this mass are lifts: lighter ones are moved with a pallet truck or a hoist."""
INSULATION_KG_M3 = 60.0
"""A part whose mean density is below this is a layer of insulation or air modelled as a slab, wall or plate: it is
laid by hand. (The lightest layer that is lifted is a stud layer, about 100 kg/m3.)"""


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
