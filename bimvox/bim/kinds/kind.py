"""What a part is made of and who makes it: its kind, with the evidence for it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """What a part is."""

    PRECAST = "precast"
    """Concrete that is stated to come ready-made."""
    CONCRETE = "concrete"
    """Concrete of which nothing says that it is precast."""
    MASONRY = "masonry"
    TIMBER = "timber"
    STEEL = "steel"
    LIGHT = "light"
    """Partitions, cladding, insulation, roof coverings, floor finishes: thin layers mounted by their trade."""
    GLAZING = "glazing"
    FORMWORK = "formwork"
    """And other temporary works: not part of the building."""
    PILE = "pile"
    """In the ground before the first lift."""
    EARTH = "earth"
    OTHER = "other"
    """Nothing says what it is."""


class Confidence(StrEnum):
    """How much the source says about a kind."""

    STATED = "stated"
    """By a property, a classification, or the site file."""
    NAMED = "named"
    """By the words of its materials, or its class."""
    ASSUMED = "assumed"
    """By the words of its name or type only, by its shape, or by nothing at all: a person should look."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The kind of a part, and why.

    Attributes:
        kind: What it is.
        confidence: How much the source says about it.
        why: The evidence that decided, as a sentence without a full stop.
    """

    kind: Kind = Kind.OTHER
    confidence: Confidence = Confidence.ASSUMED
    why: str = "nothing says what it is made of"


UNKNOWN = Judgement()
