"""Lifting gear of a catalogue, and the rig of one part: what hangs between the hook and its lifting points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import degrees, radians
from typing import Any


class GearKind(StrEnum):
    """What a piece of gear is."""

    CHAIN_SLING = "chain_sling"
    SPREADER = "spreader"
    SHACKLE = "shackle"
    ROUND_SLING = "round_sling"


@dataclass(frozen=True, slots=True)
class GearSize:
    """One size of a family of gear.

    Attributes:
        name: Its name within the family: ``13 mm``.
        wll_kg: Working load limit in a straight pull: of one leg, or of one piece. Of a spreader at its shortest span.
        mass_kg: Mass of one piece without what depends on legs and length.
        leg_kg: Mass of the fittings of one leg.
        kg_per_m: Mass of a metre of leg or span.
        chart: Of a spreader: (span in m, limit in kg), ascending spans; a limit holds up to its span.
    """

    name: str
    wll_kg: float
    mass_kg: float = 0.0
    leg_kg: float = 0.0
    kg_per_m: float = 0.0
    chart: tuple[tuple[float, float], ...] = ()

    def limit_at_kg(self, span_m: float) -> float:
        """Return the working load limit of a spreader at a span; 0 if it is not made so long."""
        return next((most_kg for most_m, most_kg in self.chart if span_m <= most_m + 1e-9), 0.0)


@dataclass(frozen=True, slots=True)
class GearFamily:
    """A family of gear: one file of a catalogue.

    Attributes:
        name: Its name.
        kind: What it is.
        about: What it is, and where its data come from.
        sizes: Its sizes, ascending.
        lengths_m: Lengths of a leg or a round sling, ascending.
        choked: Share of the limit of a round sling that a choke hitch leaves.
        height_m: Of a spreader: from the eye above to the eye below.
        most_angle_rad: Of a spreader: largest angle of the top sling to the vertical.
    """

    name: str
    kind: GearKind
    about: str
    sizes: tuple[GearSize, ...]
    lengths_m: tuple[float, ...] = ()
    choked: float = 1.0
    height_m: float = 0.0
    most_angle_rad: float = radians(45.0)


@dataclass(frozen=True, slots=True)
class Gear:
    """The gear of a site.

    Attributes:
        families: Its families: those of the site before those of the catalogue.
        spreader_from_m: Lifting points further apart than this hang on a spreader.
    """

    families: tuple[GearFamily, ...]
    spreader_from_m: float = 6.0

    def of_kind(self, kind: GearKind) -> Iterator[tuple[GearFamily, GearSize]]:
        """Yield family and size of all gear of a kind, family by family, the smallest size first."""
        for family in self.families:
            if family.kind is kind:
                for size in family.sizes:
                    yield family, size


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
        result: dict[str, Any] = {
            "what": self.words,
            "count": self.count,
            "load_kg": round(self.load_kg, 1),
            "wll_kg": round(self.wll_kg, 1),
            "mass_kg": round(self.mass_kg, 3),
        }
        if self.kind is GearKind.CHAIN_SLING:
            angle_deg = round(degrees(self.angle_rad), 2)
            result |= {"legs": self.legs, "leg_m": round(self.length_m, 3), "leg_angle_deg": angle_deg}
        elif self.kind is GearKind.SPREADER:
            result["span_m"] = round(self.length_m, 3)
        return result


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
