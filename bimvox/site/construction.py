"""Construction states of a component and the colours of everything on a site: one table for log and pictures.

The paper's states are orange, blue, green and pink, its obstructions black, its ground gray (Zhu, Pauwels and de Vries
2021). The tones are from the palette of Okabe and Ito, so that colour-blind readers can distinguish them. The paper
paints the construction area in the same blue as the load in transit; here the area is pale to distinguish the two.
"""

from __future__ import annotations

from enum import StrEnum

Rgb = tuple[int, int, int]
"""sRGB, 0..255."""


class ConstructionState(StrEnum):
    """Construction state of a component."""

    UNBUILT = "unbuilt"
    IN_TRANSIT = "in_transit"
    ARRIVED = "arrived"
    ASSEMBLED = "assembled"


STATE_RGB: dict[ConstructionState, Rgb] = {
    ConstructionState.UNBUILT: (230, 145, 20),
    ConstructionState.IN_TRANSIT: (0, 100, 190),
    ConstructionState.ARRIVED: (0, 158, 115),
    ConstructionState.ASSEMBLED: (228, 150, 186),
}
KIND_RGB: dict[str, Rgb] = {
    "ground": (178, 178, 176),
    "construction_area": (206, 222, 240),
    "yard": (236, 222, 190),
    "access": (104, 116, 138),
    "structure": (150, 150, 152),
    "obstruction": (0, 0, 0),
    "crane": (236, 188, 28),
}
