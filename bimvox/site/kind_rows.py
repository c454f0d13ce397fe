"""What the parts of a model are and how each gets to its place, by type: the one table that every output shows."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bimvox.bim.building import BUILT, Building, Element, Role, plain_class, type_of, without_number
from bimvox.bim.kinds.kind import SITE_FILE_SAYS, Confidence, Kind
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.guess import means_on_site, placed_on_site
from bimvox.site.means import WAY_ASSUMED, Means, Reasoned, is_way_assumed
from bimvox.site.parts import entries_by_id

OUT, PINNED = "out", "pinned"
"""The ways of what is not part of the plan, and of what stands before the first lift."""
_ROLES = {
    Role.FITTING: (OUT, "installed after the lifts"),
    Role.GROUND: (OUT, "terrain"),
    Role.STRUCTURE: (PINNED, "in place before the first lift"),
    Role.COMPONENT: (PINNED, "the site file says that it stands already"),
}
_ANY_NUMBER = r"([-\s:_#.]*\w{0,2}\d+)*$"
_OF_PATTERNS = re.compile(r"([\\.^$*+?{}\[\]|()])")
_QUOTED = set('"\\')
_MOST_NAMES, _MOST_IDS = 10, 20
"""Most names of bodies and GlobalIds that select a row one by one."""
MESH = "Mesh"
_Key = tuple[str, str | None, str | None, Kind, str]
"""Class, type, material, kind and way."""


@dataclass(frozen=True, slots=True)
class KindRow:
    """The parts of one class, type, material, kind and way.

    Attributes:
        ifc_class: For example ``IfcWall``, without the variants of IFC2X3.
        type_name: Name of their type, otherwise what their names have in common; None if they have neither, and of
            classes that are not part of the plan: of these, a row is a class.
        material: Name of their main material, if any.
        kind: What they are.
        means: How they get to their places: a value of ``Means``, ``out`` or ``pinned``.
        count: Number of parts.
        mass_kg: The lightest and the heaviest of them; None if no mass of them means anything: they are not part of the
            plan, and are solid in it although they are not (terrain, furniture, ducts).
        why: The strongest reason for kind and way.
        confidence: How much the source says about the kind.
        select: What selects them in the site file: an IfcOpenShell query, or names of bodies. It is that of their type,
            but of a type of several kinds or materials it names the parts, if they are few: a query for a material
            finds whatever has a layer of it.
        selects: How many parts it selects; more than ``count`` if other rows have the same type.
        is_way_assumed: Whether nothing says that they are lifted, although they are.
    """

    ifc_class: str
    type_name: str | None
    material: str | None
    kind: Kind
    means: str
    count: int
    mass_kg: tuple[float, float] | None
    why: str
    confidence: Confidence
    select: str
    selects: int
    is_way_assumed: bool = False

    @property
    def is_kind_assumed(self) -> bool:
        """Whether they are part of the plan, and what they are is an assumption."""
        return self.confidence is Confidence.ASSUMED and self.means not in (OUT, PINNED)

    @property
    def is_doubtful(self) -> bool:
        """Whether their kind or their way is an assumption."""
        return self.is_kind_assumed or self.is_way_assumed

    @property
    def name(self) -> str:
        """What they are called: ``IfcWall, Partition 100, Plasterboard``."""
        return ", ".join(filter(None, (self.ifc_class, self.type_name, self.material)))

    def to_dict(self) -> dict[str, Any]:
        """Return the row for the JSON documents."""
        return {
            "ifc_class": self.ifc_class,
            "type": self.type_name,
            "material": self.material,
            "kind": self.kind.value,
            "means": self.means,
            "count": self.count,
            "mass_kg": None if self.mass_kg is None else [round(kg, 1) for kg in self.mass_kg],
            "kind_from": self.why,
            "confidence": self.confidence.value,
            "doubtful": self.is_doubtful,
            "assumed": [*["kind"] * self.is_kind_assumed, *["way"] * self.is_way_assumed],
            "select": self.select,
            "selects": self.selects,
        }


def kind_rows(config: SiteConfig, building: Building) -> tuple[KindRow, ...]:
    """Return what the parts of a building are, by type: the doubtful ones first, in each group those that weigh most.

    Args:
        config: The site file.
        building: As read, before it is placed on the site.
    """
    means: Mapping[str, Reasoned] = {}
    said: set[str] = set()
    if any(element.role in BUILT for element in building.elements):
        placed = placed_on_site(config, building)
        means = means_on_site(config, placed)
        building = placed
        is_selected = config.model.select is not None  # a person says what is lifted
        entries = entries_by_id(config, placed.elements)
        said = {name for name, entry in entries.items() if entry.means is not None} | set(means if is_selected else ())
    in_plan = {plain_class(element.ifc_class) for element in building.elements if element.role in BUILT}
    kinds = {
        plain_class(one.ifc_class): one.judgement.kind for one in sorted(building.elements, key=lambda one: one.mass_kg)
    }
    groups: dict[_Key, list[Element]] = {}
    for element in building.elements:
        way = means[element.id].means.value if element.id in means else _ROLES[element.role][0]
        ifc_class = plain_class(element.ifc_class)
        key = (ifc_class, type_of(element), element.material, element.judgement.kind, way)
        groups.setdefault(key if ifc_class in in_plan else (ifc_class, None, None, kinds[ifc_class], way), []).append(
            element
        )
    of_types: dict[tuple[str, str | None], list[_Key]] = {}
    for key in groups:
        of_types.setdefault(key[:2], []).append(key)
    selects = {}
    for same_type in of_types.values():
        every = [element for key in same_type for element in groups[key]]
        query = _select(same_type[0], every, building.elements)
        is_one = len({key[2:4] for key in same_type}) == 1
        for key in same_type:
            ids = [element.global_id for element in groups[key]]
            by_type = is_one or key[0] == MESH or len(ids) > _MOST_IDS
            selects[key] = (query, len(every)) if by_type else (" + ".join(ids), len(ids))
    rows = [_row(key, own, means, said, *selects[key]) for key, own in groups.items()]
    total_kg = {key: sum(one.mass_kg for one in own) for key, own in groups.items()}
    ranked = sorted(zip(rows, total_kg.values(), strict=True), key=lambda one: (*_rank(one[0]), -one[1], one[0].name))
    return tuple(row for row, _ in ranked)


def _row(
    key: _Key,
    elements: Sequence[Element],
    means: Mapping[str, Reasoned],
    said: Collection[str],
    select: str,
    selects: int,
) -> KindRow:
    sure = list(Confidence)
    element = max(elements, key=lambda one: (sure.index(_confidence(one)), one.mass_kg))
    judgement = element.judgement
    reasons = ["not part of the building" if _is_temporary(element) else _ROLES[element.role][1]]
    is_crane = key[-1] == Means.CRANE.value
    is_assumed = is_crane and any(is_way_assumed(one) and one.id not in said for one in elements)
    if element.id in means:
        heaviest = max(elements, key=lambda one: one.mass_kg)
        reasons = [judgement.why, WAY_ASSUMED if is_assumed else means[heaviest.id].why]
        if element.stated_means is not None:
            reasons = [SITE_FILE_SAYS]
    masses_kg = [one.mass_kg for one in elements if key[-1] != OUT or _is_weighed(one)]
    return KindRow(
        *key,
        count=len(elements),
        mass_kg=(min(masses_kg), max(masses_kg)) if masses_kg else None,
        why="; ".join(dict.fromkeys(filter(None, reasons))),
        confidence=_confidence(element),
        select=select,
        selects=selects,
        is_way_assumed=is_assumed,
    )


def _is_weighed(element: Element) -> bool:
    """Return whether the mass of an element outside the plan means something: a person says so, or it is stated."""
    return element.stated_means is not None or element.mass_source == "quantity"


def _is_temporary(element: Element) -> bool:
    """Return whether an element is formwork or temporary works, which no plan lifts."""
    return element.role is Role.FITTING and element.judgement.kind is Kind.FORMWORK


def _confidence(element: Element) -> Confidence:
    """Return how much is said of an element; the way of its type is enough."""
    return element.judgement.confidence if element.stated_means is None else Confidence.STATED


def _rank(row: KindRow) -> tuple[bool, bool]:
    return not row.is_doubtful, row.means in (OUT, PINNED)


def _select(key: _Key, elements: Sequence[Element], every: Sequence[Element]) -> str:
    """Return what selects the parts of a type among all elements."""
    ifc_class, type_name, _, _, means = key
    if ifc_class == MESH:
        names = [one.name for one in elements]
        if len(names) <= _MOST_NAMES and not any("," in name for name in names):
            return ", ".join(names)
        return f"{(type_name or '').replace(',', '?')}*"
    facets = [ifc_class]
    if type_name is not None:
        is_type = all(one.type_name is not None for one in elements)
        facets.append(_equal("type", type_name) if is_type else _named(type_name, ifc_class, every))
    elif means != OUT:
        facets.append("type=NULL")
    return ", ".join(facets)


def _named(text: str, ifc_class: str, every: Sequence[Element]) -> str:
    """Return the comparison that selects the parts of a class whose names are a text with numbers."""
    alike = (one.name for one in every if plain_class(one.ifc_class) == ifc_class and text in one.name)
    if not _QUOTED & set(text) and all(without_number(name) == text for name in alike):
        return f'Name*="{text}"'
    return f"Name=/{_pattern(text)}{_ANY_NUMBER}/"


def _equal(facet: str, text: str) -> str:
    """Return the comparison of a query; a text with quotes can only be compared as a pattern."""
    return f"{facet}=/{_pattern(text)}$/" if _QUOTED & set(text) else f'{facet}="{text}"'


def _pattern(text: str) -> str:
    return _OF_PATTERNS.sub(r"\\\1", text).replace("/", ".").replace('"', ".").replace("\\\\", ".")
