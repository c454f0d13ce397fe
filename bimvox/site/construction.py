"""The states of a component on a site under construction, and the colours of things: one table for log and pictures.

The paper's states are orange, blue, green and pink, its obstructions black, its ground gray (Zhu, Pauwels and de Vries
2021); the tones are from the palette of Okabe and Ito, so that they stay apart for colour-blind readers. Its
construction area has the blue of the load in transit, which cannot be told apart in a picture: the area is pale here.
"""

from __future__ import annotations

from enum import StrEnum

Rgb = tuple[int, int, int]
"""sRGB, 0..255."""


class ConstructionState(StrEnum):
    """What has become of a component."""

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
    "structure": (150, 150, 152),
    "obstruction": (0, 0, 0),
    "crane": (236, 188, 28),
}
