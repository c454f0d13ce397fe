"""Role of a body by its name, for files without classes (meshes) and for classes without meaning (IFC proxies)."""

from __future__ import annotations

import re

from bimvox.bim.building import Role

_GROUND = "ground terrain topography topo soil subsoil earth landscape dtm dem gelaende gelände terrein maaiveld"
_EXISTING = "existing bestand bestaand existant existente esistente"
_STRUCTURE = """obstruction obstructions obstacle obstacles excavator digger crane truck lorry
    vehicle fence hoarding scaffold scaffolding neighbour neighbor stockpile"""

WORDS: dict[Role, frozenset[str]] = {
    Role.GROUND: frozenset(_GROUND.split()),
    Role.STRUCTURE: frozenset((_EXISTING + " " + _STRUCTURE).split()),
}
"""Words that give a role wherever they occur in a name."""

WHOLE_NAMES: dict[str, Role] = {"floor": Role.GROUND, "site": Role.GROUND}
"""Names that give a role only as the whole name: ``floor_2`` is a storey, ``floor`` is the ground."""

_WORD = re.compile(r"[A-ZÄÖÜ]+(?![a-zäöü])|[A-ZÄÖÜ]?[a-zäöüß]+")


def role_by_name(name: str) -> Role | None:
    """Return the role that a name implies; None if it implies none.

    The name is split at spaces, punctuation, digits and camel case: ``ExistingWall-3`` contains ``existing``.
    """
    words = _words(name)
    if len(words) == 1 and name.strip().lower() in WHOLE_NAMES:
        return WHOLE_NAMES[words[0]]
    return next((role for role, known in WORDS.items() if known.intersection(words)), None)


def is_existing_by_name(name: str) -> bool:
    """Return whether a name states that the element already exists: ``Existing Strip Footing``."""
    return not set(_EXISTING.split()).isdisjoint(_words(name))


def _words(name: str) -> list[str]:
    return [word.lower() for word in _WORD.findall(name)]
