"""What is set by crane although it is no part of the building's frame: machines, tanks, containers, noise barriers."""

from __future__ import annotations

from collections.abc import Sequence

from bimvox.bim.building import plain_class
from bimvox.bim.kinds.words import Meaning, meaning_of

MODULE_CLASSES = frozenset({"IfcBuildingElementProxy", "IfcProxy", "IfcBuiltElement", "IfcElementAssembly"})
"""What a room that comes ready-made, a machine or a barrier is drawn as; a wall with such a name is a wall of it."""
_WORD_OF_CLASS = {
    "IfcUnitaryEquipment": "rooftop unit",
    "IfcChiller": "chiller",
    "IfcCoolingTower": "cooling tower",
    "IfcCondenser": "condensing unit",
    "IfcBoiler": "boiler",
    "IfcElectricGenerator": "generator",
    "IfcEngine": "generator",
    "IfcTransformer": "transformer",
    "IfcTank": "tank",
}
_MACHINE_CLASSES = MODULE_CLASSES | {
    *("IfcEnergyConversionDevice", "IfcFlowStorageDevice", "IfcFlowMovingDevice", "IfcFlowTreatmentDevice"),
    *("IfcDistributionElement", "IfcDistributionFlowElement", "IfcCivilElement"),
}
_BARRIER_CLASSES = MODULE_CLASSES | {"IfcCivilElement", "IfcRailing", "IfcWall"}


def machine_of(ifc_class: str, names: Sequence[str | None]) -> Meaning | None:
    """Return what says that an element is a machine, a tank or a container: its names, else its class; None if not."""
    plain = plain_class(ifc_class)
    if plain not in _MACHINE_CLASSES and plain not in _WORD_OF_CLASS:
        return None
    named = _named(names, "machine")
    return named or (meaning_of(_WORD_OF_CLASS[plain], "shape") if plain in _WORD_OF_CLASS else None)


def is_barrier(ifc_class: str, names: Sequence[str | None]) -> bool:
    """Return whether an element is a noise barrier."""
    return plain_class(ifc_class) in _BARRIER_CLASSES and _named(names, "barrier") is not None


def _named(names: Sequence[str | None], says: str) -> Meaning | None:
    found = (meaning_of(name, "shape") for name in names if name)
    return next((meaning for meaning in found if meaning is not None and meaning.says == says), None)
