"""The rig of one part: what hangs between the hook and its lifting points."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import Any

from bimvox.crane.gear import GearKind


@dataclass(frozen=True, slots=True)
class RigPart:
    """Pieces of gear of one kind and size in a rig.

    Attributes:
        kind: What they are.
        name: Family and size: ``chain sling, grade 8, 13 mm``.
        count: How many there are.
        rated_kg: Working load limit in a straight pull, of one leg or one piece; of a spreader at its span.
        wll_kg: Working load limit of one piece in this use.
        load_kg: Mass that one piece carries: of a sling and a spreader all that hangs on it, of a shackle and a round
            sling the pull of its leg.
        mass_kg: Mass of one piece.
        legs: Legs of a sling.
        carrying: How many of them are taken to carry.
        angle_rad: Largest angle of its legs to the vertical.
        length_m: Longest leg, from the upper to the lower point; of a spreader its span.
        made_m: Listed length of its legs, which clutches shorten to what is needed.
    """

    kind: GearKind
    name: str
    count: int
    rated_kg: float
    wll_kg: float
    load_kg: float
    mass_kg: float
    legs: int = 1
    carrying: int = 1
    angle_rad: float = 0.0
    length_m: float = 0.0
    made_m: float = 0.0

    @property
    def words(self) -> str:
        """The piece in words, without its count: ``chain sling, grade 8, 13 mm, 2 legs of 4 m``."""
        if self.kind is GearKind.CHAIN_SLING:
            return f"{self.name}, {self.legs} leg{'s' * (self.legs > 1)} of {self.made_m:g} m"
        if self.kind is GearKind.SPREADER:
            return f"{self.name}, span {self.length_m:.1f} m"
        return f"{self.name}, {self.made_m:g} m, choked" if self.made_m else self.name

    def document(self) -> dict[str, Any]:
        """Return it as plain values."""
        found: dict[str, Any] = {
            "what": self.words,
            "count": self.count,
            "load_kg": round(self.load_kg, 1),
            "wll_kg": round(self.wll_kg, 1),
            "mass_kg": round(self.mass_kg, 3),
        }
        if self.kind is GearKind.CHAIN_SLING:
            angle_deg = round(degrees(self.angle_rad), 2)
            found |= {"legs": self.legs, "leg_m": round(self.length_m, 3), "leg_angle_deg": angle_deg}
        elif self.kind is GearKind.SPREADER:
            found["span_m"] = round(self.length_m, 3)
        return found


@dataclass(frozen=True, slots=True)
class Rig:
    """The gear of one part.

    Attributes:
        kind: ``1_leg`` to ``4_legs``, ``spreader_2`` or ``spreader_4`` (points below the spreader).
        height_m: Hook above the part's top, rounded up to whole cells.
        mass_kg: Mass of all its parts.
        parts: From the hook down.
        drop_m: Lower eyes of the spreader above the part's top; 0 without one.
        eye_m: Its upper eyes above the part's top; 0 without one.
    """

    kind: str
    height_m: float
    mass_kg: float
    parts: tuple[RigPart, ...]
    drop_m: float = 0.0
    eye_m: float = 0.0

    @property
    def top(self) -> RigPart:
        """The sling on the hook."""
        return self.parts[0]

    def document(self) -> dict[str, Any]:
        """Return it as plain values, for people and exports."""
        return {
            "kind": self.kind,
            "mass_kg": round(self.mass_kg, 3),
            "hook_above_top_m": round(self.height_m, 6),
            "legs": self.top.legs,
            "leg_m": round(self.top.length_m, 3),
            "leg_angle_deg": round(degrees(self.top.angle_rad), 2),
            "parts": [part.document() for part in self.parts],
            **({"spreader_m": round(self.eye_m - self.drop_m, 3)} if self.has_spreader else {}),
        }

    @property
    def has_spreader(self) -> bool:
        """Whether a spreader is part of it."""
        return any(part.kind is GearKind.SPREADER for part in self.parts)
