"""Whether a part is precast or cast in place, as the file states it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from bimvox.bim.building import Casting

_STATED = ("castingmethod", "constructionmethod", "castunittype")
"""Properties that state it: ``Pset_ConcreteElementGeneral`` of IFC4 and of IFC2X3, and Tekla's cast unit type."""
_PRECAST_SET = "Pset_PrecastConcreteElement"
_IN_SITU = re.compile(
    r"cast[ -]?in[ -]?(situ|place)|\bin[ -]?situ\b|cast[ -]?on[ -]?site|site[ -]?cast|poured|ortbeton"
    r"|in het werk gestort|coul[ée] en place|in opera\b|vaciado in situ|\bcip\b|^insitu$",
    re.IGNORECASE,
)
_PRECAST = re.compile(
    r"pre[ -]?cast|pre[ -]?fab|fertigteil|kanaalplaat|breedplaat|predal|pr[ée]fabriqu[ée]|prefabricad|prefabbricat",
    re.IGNORECASE,
)


def stated_casting(sets: Mapping[str, Mapping[str, Any]]) -> Casting | None:
    """Return how a part is cast, as its property sets state it; None if they do not."""
    for name, properties in sets.items():
        for key, value in properties.items():
            is_stated = key.lower().replace(" ", "").replace("_", "") in _STATED and isinstance(value, str)
            if is_stated and (found := casting_by_words([value])) is not None:
                return found
        if name.startswith(_PRECAST_SET):
            return Casting.PRECAST
    return None


def casting_by_words(texts: Iterable[str | None]) -> Casting | None:
    """Return how a part is cast by the words of its material, type and name; None if they do not say it."""
    words = [text for text in texts if text]
    if any(_PRECAST.search(text) for text in words):
        return Casting.PRECAST
    return Casting.IN_SITU if any(_IN_SITU.search(text) for text in words) else None
