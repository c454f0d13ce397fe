"""Density of a material by its name, or by the kind of a part."""

from __future__ import annotations

from bimvox.bim.kinds.kind import Kind
from bimvox.bim.kinds.words import meaning_of

DEFAULT_DENSITY_KG_M3 = 2400.0
"""For parts of unknown material: plain concrete, which is on the safe side for most parts."""
STEEL_KG_M3 = 7850.0

_BY_KIND = {
    Kind.PRECAST: 2500.0,
    Kind.CONCRETE: 2500.0,
    Kind.MASONRY: 1800.0,
    Kind.TIMBER: 500.0,
    Kind.STEEL: STEEL_KG_M3,
    Kind.LIGHT: 300.0,
    Kind.GLAZING: 2500.0,
    Kind.EARTH: 1800.0,
}
"""Of parts whose kind is known, but not their material: of the usual member of the kind."""


_LIKE = {Kind.PRECAST: Kind.CONCRETE}


def of_same_mass(one: Kind | None, other: Kind) -> bool:
    """Return whether two kinds are made of the same materials."""
    return one is not None and _LIKE.get(one, one) is _LIKE.get(other, other)


def density_by_name(material: str) -> float | None:
    """Return the density that a material's name implies, kg/m3; None if it implies none."""
    meaning = meaning_of(material)
    return None if meaning is None else meaning.kg_m3


def density_of_kind(kind: Kind) -> float:
    """Return the density of a part of a kind whose material is not known, kg/m3."""
    return _BY_KIND.get(kind, DEFAULT_DENSITY_KG_M3)
