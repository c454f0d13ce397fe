"""The states of a component on a site under construction, and the colours of things, as in the paper.

Zhu, Pauwels and de Vries, "Automatic Prefabricated Construction Simulation using Deep Reinforcement Learning": unbuilt
orange, in transit blue, arrived green, assembled pink, obstruction black, ground gray. Its construction area and its
load in transit are the same blue, which cannot be told apart in a picture: the area is pale here.
"""

from __future__ import annotations

from enum import StrEnum

Rgba = tuple[float, float, float, float]


class ConstructionState(StrEnum):
    """What has become of a component."""

    UNBUILT = "unbuilt"
    IN_TRANSIT = "in_transit"
    ARRIVED = "arrived"
    ASSEMBLED = "assembled"


STATE_RGBA: dict[ConstructionState, Rgba] = {
    ConstructionState.UNBUILT: (1.0, 0.55, 0.0, 1.0),
    ConstructionState.IN_TRANSIT: (0.12, 0.36, 0.95, 1.0),
    ConstructionState.ARRIVED: (0.1, 0.7, 0.25, 1.0),
    ConstructionState.ASSEMBLED: (1.0, 0.55, 0.72, 1.0),
}
KIND_RGBA: dict[str, Rgba] = {
    "ground": (0.6, 0.6, 0.6, 1.0),
    "construction_area": (0.78, 0.85, 0.97, 1.0),
    "structure": (0.75, 0.73, 0.7, 1.0),
    "obstruction": (0.0, 0.0, 0.0, 1.0),
    "crane": (0.95, 0.8, 0.1, 1.0),
}
