"""Whether a part is precast or cast in place, as the properties of the file state it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bimvox.bim.building import Casting
from bimvox.bim.ifc.properties import plain_key
from bimvox.bim.kinds.words import casting_by_name

_STATED = ("castingmethod", "constructionmethod", "castunittype")
"""Properties that state it: ``Pset_ConcreteElementGeneral`` of IFC4 and of IFC2X3, and Tekla's cast unit type."""
_PRECAST_SET = "Pset_PrecastConcreteElement"


def stated_casting(sets: Mapping[str, Mapping[str, Any]]) -> Casting | None:
    """Return how a part is cast, as its property sets state it; None if they do not."""
    for name, properties in sets.items():
        for key, value in properties.items():
            is_stated = plain_key(key) in _STATED and isinstance(value, str)
            if is_stated and (found := casting_by_name(value)) is not None:
                return found
        if name.startswith(_PRECAST_SET):
            return Casting.PRECAST
    return None
