"""How a part gets to its place: lifted by the crane, cast there, or set by hand.

What the site file says of a part decides; then what the building file states about casting; then size and mass:
concrete that no road and no crane takes in one piece is cast where it stays, and what a few people carry is not a lift
of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Casting, Element
from bimvox.errors import SelectionError
from bimvox.site.limits import ON_GROUND_M
from bimvox.site.upright_box import sizes_m

if TYPE_CHECKING:
    from bimvox.site.component import Component
    from bimvox.site.config.site_config import ComponentConfig, MeansConfig

_CONCRETE_KG_M3 = (1500.0, 2900.0)
"""Density of concrete and masonry, from lightweight to heavily reinforced."""
_LIGHT_KG_M3 = 500.0
"""Density below which nothing is cast: insulation, foam glass, aerated blocks."""
_WHOLE_M = 1e-3


class Means(StrEnum):
    """How a part gets to its place."""

    CRANE = "crane"
    """The crane lifts it."""
    IN_SITU = "in_situ"
    """It is cast, or built up, in its place."""
    BY_HAND = "by_hand"
    """A few people set it; it comes up in a bundle with others of its kind and storey."""


class Reasoned(NamedTuple):
    """How a part gets to its place, and why."""

    means: Means
    why: str = ""


LIFTED = Reasoned(Means.CRANE)


def means_of(
    elements: Sequence[Element], entries: Mapping[str, ComponentConfig], limits: MeansConfig
) -> dict[str, Reasoned]:
    """Return how each part gets to its place, by id.

    Args:
        elements: The components, in the site frame.
        entries: Their tables in the site file, by id.
        limits: The site file's ``[means]`` table.
    """
    found = {element.id: _means_of(element, limits) for element in elements}
    if not any(one.means is Means.CRANE for one in found.values()):
        # A model in which everything says so says nothing (a default material), and one at toy scale has light parts.
        found = {element.id: _means_of(element, limits, by_words=False, by_hand=False) for element in elements}
    if not any(one.means is Means.CRANE for one in found.values()):
        found = dict.fromkeys(found, LIFTED)  # somebody wants a plan of it: let the crane say no
    slabs = [element for element in elements if found[element.id].means is Means.IN_SITU and _is_ground_slab(element)]
    bounds_m = {element.id: element.mesh.bounds_m for element in (*elements, *slabs)}
    under: dict[str, Reasoned] = {}
    for element in elements:
        over = next((slab for slab in slabs if _is_under(bounds_m[element.id], bounds_m[slab.id])), None)
        if over is None or found[element.id].means is not Means.CRANE or element.casting is Casting.PRECAST:
            continue
        if _is_light(element):  # an insulation strip
            why = f"it is too light for concrete, and laid before {over.label} is cast on it"
            under[element.id] = Reasoned(Means.BY_HAND, why)
        else:
            under[element.id] = Reasoned(Means.IN_SITU, f"it is under {over.label}, which is cast on the ground")
    if any(one.means is Means.CRANE for one in {**found, **under}.values()):  # otherwise it is not a slab, but a whole
        found |= under
    for element_id, entry in entries.items():
        if entry.means is not None and element_id in found:
            found[element_id] = (
                LIFTED if entry.means == "crane" else Reasoned(Means(entry.means), "the site file says so")
            )
    return found


def nothing_to_lift(parts: Sequence[Component | Reasoned]) -> SelectionError:
    """Return the error for a model in which the crane has nothing to do; ``parts`` are those that are no lifts."""
    if not parts:
        return SelectionError("nothing to lift: no part of the model is a component", hint="see [model] select")
    cast = sum(part.means is Means.IN_SITU for part in parts)
    return SelectionError(
        f"nothing to lift: {cast:,} parts are cast in place and {len(parts) - cast:,} are set by hand",
        hint='give limits in [means], or means = "crane" in a [[component]]',
    )


def _means_of(element: Element, limits: MeansConfig, *, by_words: bool = True, by_hand: bool = True) -> Reasoned:
    if by_words and element.casting is Casting.IN_SITU:
        return Reasoned(Means.IN_SITU, "the building file says that it is cast in place")
    if by_hand and element.mass_kg < limits.lift_from_kg:
        return Reasoned(
            Means.BY_HAND, f"it weighs {element.mass_kg:.0f} kg; lifts of their own begin at {limits.lift_from_kg:g} kg"
        )
    may_be_cast = element.casting is not Casting.PRECAST and _is_concrete(element)
    if may_be_cast and (beyond := _beyond(element, limits)) is not None:
        return Reasoned(Means.IN_SITU, f"{beyond}: concrete beyond what goes by road in one piece is cast in place")
    return LIFTED


def _beyond(element: Element, limits: MeansConfig) -> str | None:
    """Return what of a part is beyond the limits of a single load on the road; None if nothing is."""
    if element.mass_kg > limits.heaviest_kg:
        return f"it weighs {element.mass_kg / 1000.0:.1f} t, the limit is {limits.heaviest_kg / 1000.0:g} t"
    length_m, width_m, height_m = sizes_m(element.mesh)
    for name, size_m, most_m in (
        ("long", length_m, limits.longest_m),
        ("wide", width_m, limits.widest_m),
        ("high", height_m, limits.highest_m),
    ):
        if size_m > most_m + _WHOLE_M:
            return f"it is {size_m:.1f} m {name}, the limit is {most_m:g} m"
    return None


def _is_concrete(element: Element) -> bool:
    """Return whether a part is of concrete or masonry, by its density; also if its material is not known."""
    volume_m3 = abs(element.mesh.signed_volume_m3)
    low, high = _CONCRETE_KG_M3
    return element.mass_source == "default" or low * volume_m3 <= element.mass_kg <= high * volume_m3


def _is_light(element: Element) -> bool:
    """Return whether a part of a known material is lighter than any that is cast: insulation."""
    volume_m3 = abs(element.mesh.signed_volume_m3)
    return element.mass_source != "default" and element.mass_kg < _LIGHT_KG_M3 * volume_m3


def _is_ground_slab(element: Element) -> bool:
    return element.ifc_class.startswith("IfcSlab") and bool(element.mesh.bounds_m[0, 2] <= ON_GROUND_M)


def _is_under(low_high_m: NDArray[np.float64], slab_m: NDArray[np.float64]) -> bool:
    apart = (low_high_m[0, :2] >= slab_m[1, :2]).any() or (low_high_m[1, :2] <= slab_m[0, :2]).any()
    return not apart and bool(low_high_m[1, 2] <= slab_m[1, 2] + _WHOLE_M)
