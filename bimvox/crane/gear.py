"""Lifting gear of a catalogue: chain slings, spreaders, shackles, round slings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import radians


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
