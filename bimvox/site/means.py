"""How a part gets to its place: lifted by the crane, cast there, built there by its trade, or set by hand.

What the site file says of a part decides; then its kind: masonry, partitions, glazing and earth are built in place.
Then what the building file states about casting, then size and mass: concrete that no road, gear or machine takes in
one piece is cast where it stays, and what a few people carry is not a lift of its own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Casting, Element, plain_class, type_of
from bimvox.bim.kinds.kind import SITE_FILE_SAYS, Confidence, Kind
from bimvox.bim.own_box import boxes_m, sizes_m
from bimvox.errors import SelectionError, enumerated
from bimvox.site.default_rules import ON_GROUND_M
from bimvox.site.work import Work, kind_of, work_of

if TYPE_CHECKING:
    from bimvox.site.component import Component
    from bimvox.site.config.site_config import ComponentConfig, MeansConfig

_CONCRETE_KG_M3 = (1500.0, 2900.0)
"""Density of concrete and masonry, from lightweight to heavily reinforced."""
_LIGHT_KG_M3 = 500.0
"""Density below which nothing is cast: insulation, foam glass, aerated blocks."""
_CAST_ALIKE = "most of its type are too large to be lifted, and so cast in place"
_FOUNDATION = "it lies in the ground and is no higher than 1 m, so it is taken as a foundation, cast in place"
_WHOLE_M = 1e-3
_DEEPEST_M = 1.0
"""Layers under a slab on the ground reach less far below it, and what thickens it does; a basement reaches further."""


class Means(StrEnum):
    """How a part gets to its place."""

    CRANE = "crane"
    """The crane lifts it."""
    IN_SITU = "in_situ"
    """It is cast in its place."""
    BUILT = "built"
    """Its trade builds it in its place, of pieces: masonry, partitions, cladding, glazing."""
    BY_HAND = "by_hand"
    """A few people set it; it comes up in a bundle with others of its kind and storey."""


class Reasoned(NamedTuple):
    """How a part gets to its place, and why."""

    means: Means
    why: str = ""


LIFTED = Reasoned(Means.CRANE)
WAY_ASSUMED = "nothing says that it is precast: that it comes by crane is an assumption"
HOW = {Means.IN_SITU: "cast in place", Means.BUILT: "built in place", Means.BY_HAND: "set by hand"}
"""What a part is that the crane does not lift."""
SAY_WHAT = (
    "bimvox inspect MODEL --csv kinds.csv lists what the parts are; write crane into the column set_means of what is "
    "to be lifted, then bimvox init MODEL --kinds kinds.csv"
)
"""It needs no site file: `init` writes none if there is nothing to lift."""
_BUILT = (Kind.MASONRY, Kind.LIGHT, Kind.GLAZING, Kind.EARTH)


def means_of(
    elements: Sequence[Element],
    entries: Mapping[str, ComponentConfig],
    limits: MeansConfig,
    not_lifted: Callable[[Element], str] = lambda element: "",
    *,
    selected: bool = False,
) -> dict[str, Reasoned]:
    """Return how each part gets to its place, by id.

    Args:
        elements: The components, in the site frame.
        entries: Their tables in the site file, by id.
        limits: The site file's ``[means]`` table.
        not_lifted: Why no gear or no machine lifts a part in one piece; empty if some do.
        selected: Whether a person has selected them as parts to lift; no trade then builds them in place.
    """
    result = {element.id: _means_of(element, limits, not_lifted, selected=selected) for element in elements}
    by_size = {one.id for one in elements if result[one.id].means is Means.IN_SITU and may_be_cast(one, limits)}
    lifted = [one for one in elements if one.id in by_size or result[one.id].means is Means.CRANE]
    result |= dict.fromkeys(cast_alike(by_size, lifted, limits) - by_size, Reasoned(Means.IN_SITU, _CAST_ALIKE))
    result |= _in_the_ground(elements, result, limits, selected=selected)
    for element_id, entry in entries.items():
        if entry.means is not None and element_id in result:
            said = Reasoned(Means(entry.means), entry.why or SITE_FILE_SAYS)
            result[element_id] = LIFTED if entry.means == "crane" else said
    return result


def _in_the_ground(
    elements: Sequence[Element], found: Mapping[str, Reasoned], limits: MeansConfig, *, selected: bool
) -> dict[str, Reasoned]:
    """Return what would be lifted but is cast, or laid by hand, under a slab on the ground or as a foundation."""
    slabs = [element for element in elements if found[element.id].means is Means.IN_SITU and _is_ground_slab(element)]
    under: dict[str, Reasoned] = {}
    for element in elements:
        is_lift = found[element.id].means is Means.CRANE and element.stated_means is None
        if not is_lift or element.casting is Casting.PRECAST or kind_of(element) is Work.STAIR:
            continue
        over = next((slab for slab in slabs if _is_under(element.mesh.bounds_m, slab.mesh.bounds_m)), None)
        if over is not None and _is_light(element):  # an insulation strip
            why = f"it is too light for concrete, and laid before {over.label} is cast on it"
            under[element.id] = Reasoned(Means.BY_HAND, why)
        elif over is not None:
            under[element.id] = Reasoned(Means.IN_SITU, f"it is under {over.label}, which is cast on the ground")
        elif not selected and _is_foundation(element) and may_be_cast(element, limits):
            under[element.id] = Reasoned(Means.IN_SITU, _FOUNDATION)
    return under


def cast_alike(cast: Collection[str], lifted: Sequence[Element], limits: MeansConfig) -> set[str]:
    """Return the ids of the parts that are cast in place, with those of their types: one trade makes them all.

    ``cast``: ids of parts that are too large or too heavy for a lift; ``lifted``: these and the parts that could be
    lifted. Those of a type of which most, by mass, are cast are cast.
    """
    alike: dict[tuple[str, str | None, str | None], list[Element]] = {}
    for one in lifted:
        if one.id in cast or (one.stated_means is None and may_be_cast(one, limits)):
            alike.setdefault((plain_class(one.ifc_class), type_of(one), one.material), []).append(one)
    result = set(cast)
    for (_, name, _), same in alike.items():
        cast_kg = sum(one.mass_kg for one in same if one.id in cast)
        if name is not None and 2.0 * cast_kg > sum(one.mass_kg for one in same):
            result |= {one.id for one in same}
    return result


def nothing_to_lift(parts: Sequence[Component | Reasoned]) -> SelectionError:
    """Return the error for a model in which the crane has nothing to do; ``parts`` are those that are no lifts."""
    if not parts:
        return SelectionError("nothing to lift: no part of the model is a component", hint=SAY_WHAT)
    counts = Counter(part.means for part in parts)
    there = [(counts[means], HOW[means]) for means in HOW if counts[means]]
    what = enumerated([f"{count:,} {'is' if count == 1 else 'are'} {how}" for count, how in there])
    of = "1 part" if len(parts) == 1 else f"{len(parts):,} parts"
    return SelectionError(f"nothing to lift: of {of}, {what}", hint=SAY_WHAT)


def _means_of(
    element: Element, limits: MeansConfig, not_lifted: Callable[[Element], str], *, selected: bool
) -> Reasoned:
    if element.stated_means is not None:
        stated = Means(element.stated_means)
        return LIFTED if stated is Means.CRANE else Reasoned(stated, SITE_FILE_SAYS)
    kind, why = element.judgement.kind, element.judgement.why
    if element.casting is Casting.IN_SITU:
        said = why if kind is Kind.CONCRETE else "the building file says that it is cast in place"
        return Reasoned(Means.IN_SITU, said)
    is_bar = plain_class(element.ifc_class) != "IfcPlate" and work_of(element) in (Work.BEAM, Work.COLUMN)
    # a bar that is light by its material is a mullion or a stud; one by its name alone may be a cladding rail of steel
    is_light_bar = kind is Kind.LIGHT and is_bar and element.judgement.confidence is Confidence.ASSUMED
    if kind in _BUILT and element.casting is None and not is_light_bar and not selected:
        return Reasoned(Means.BUILT, why)
    if element.mass_kg < limits.lift_from_kg:
        return Reasoned(
            Means.BY_HAND, f"it weighs {element.mass_kg:.0f} kg; lifts of their own begin at {limits.lift_from_kg:g} kg"
        )
    is_plane = kind_of(element) in (Work.SLAB, Work.WALL)
    if kind is Kind.TIMBER and is_plane and not selected and (beyond := beyond_road(element, limits)) is not None:
        return Reasoned(Means.BUILT, f"{beyond}: timber beyond what goes by road in one piece is built in place")
    if not may_be_cast(element, limits):
        return LIFTED
    if (beyond := beyond_road(element, limits)) is not None:
        return Reasoned(Means.IN_SITU, f"{beyond}: concrete beyond what goes by road in one piece is cast in place")
    if why := not_lifted(element):
        return Reasoned(Means.IN_SITU, f"{why}: concrete that nothing lifts in one piece is cast in place")
    return LIFTED


def may_be_cast(element: Element, limits: MeansConfig) -> bool:
    """Return whether a part is cast if it cannot be brought and lifted in one piece: concrete not said to be precast.

    A floor wider than any load that is called precast only by its words is drawn in one piece: planks with a topping.
    """
    judgement = element.judgement
    if element.casting is not Casting.PRECAST:
        return judgement.kind in (Kind.CONCRETE, Kind.OTHER) and _is_concrete(element)
    is_floor = work_of(element) in (Work.SLAB, Work.FOOTING)
    is_said = judgement.confidence is Confidence.STATED or judgement.kind is Kind.OTHER  # a machine
    return not is_said and is_floor and sizes_m(element.mesh)[1] > limits.widest_m


def is_way_assumed(part: Element | Component) -> bool:
    """Return whether nothing says that a part comes by crane, if it does: concrete that is not said to be precast."""
    return part.judgement.kind is Kind.CONCRETE and part.casting is None and part.stated_means is None


def beyond_road(element: Element, limits: MeansConfig) -> str | None:
    """Return what of a part is beyond the limits of a single load on the road; None if nothing is."""
    if element.mass_kg > limits.heaviest_kg:
        return f"it weighs {element.mass_kg / 1000.0:.1f} t, the limit is {limits.heaviest_kg / 1000.0:g} t"
    beyond = [_beyond_sizes(sizes, limits) for sizes in boxes_m(element.mesh)]
    return None if None in beyond else beyond[-1]


def _beyond_sizes(sizes: tuple[float, float, float], limits: MeansConfig) -> str | None:
    length_m, width_m, height_m = sizes
    for name, size_m, most_m in (
        ("long", length_m, limits.longest_m),
        ("wide", width_m, limits.widest_m),
        ("high", height_m, limits.highest_m),
    ):
        if size_m > most_m + _WHOLE_M:
            return f"it is {size_m:.1f} m {name}, the limit is {most_m:g} m"
    return None


def _is_concrete(element: Element) -> bool:
    """Return whether a part is of concrete: by its kind, otherwise by its density; also if nothing is known of it."""
    if element.judgement.kind is Kind.CONCRETE:
        return True
    volume_m3 = abs(element.mesh.signed_volume_m3)
    low, high = _CONCRETE_KG_M3
    return element.mass_source == "default" or low * volume_m3 <= element.mass_kg <= high * volume_m3


def _is_light(element: Element) -> bool:
    """Return whether a part of a known material is lighter than any that is cast: insulation."""
    volume_m3 = abs(element.mesh.signed_volume_m3)
    return element.mass_source != "default" and element.mass_kg < _LIGHT_KG_M3 * volume_m3


def _is_ground_slab(element: Element) -> bool:
    return element.ifc_class.startswith("IfcSlab") and bool(element.mesh.bounds_m[0, 2] <= ON_GROUND_M)


def _is_foundation(element: Element) -> bool:
    """Return whether a wall, beam or footing lies in the ground, and is lower than a cellar; a slab may be a floor."""
    if kind_of(element) is Work.SLAB:
        return False
    low_m, high_m = element.mesh.bounds_m[:, 2]
    return bool(high_m <= _WHOLE_M and high_m - low_m <= _DEEPEST_M)


def _is_under(low_high_m: NDArray[np.float64], slab_m: NDArray[np.float64]) -> bool:
    """Return whether a part lies under a slab, and is not as high as a storey."""
    apart = (low_high_m[0, :2] >= slab_m[1, :2]).any() or (low_high_m[1, :2] <= slab_m[0, :2]).any()
    layer = low_high_m[1, 2] <= slab_m[1, 2] + _WHOLE_M and low_high_m[0, 2] >= slab_m[0, 2] - _DEEPEST_M
    return bool(layer and not apart)
