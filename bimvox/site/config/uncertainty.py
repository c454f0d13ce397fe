"""The ``[calendar.uncertainty]`` table of a site file: how much shorter or longer lifts may take."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from bimvox.site.config.validation import Positive, Table, Whole


def _ascending(factors: tuple[float, float, float]) -> tuple[float, float, float]:
    low, likely, high = factors
    if not low <= likely <= high:
        raise ValueError("must ascend: shortest, likely, longest")
    return factors


Factor = Annotated[Positive, Field(le=100.0)]
Factors = Annotated[tuple[Factor, Factor, Factor], AfterValidator(_ascending)]


class UncertaintyConfig(Table):
    """Factors of the planned time of a lift by class of work: shortest, likely, longest. Each lift draws its own."""

    footing: Factors | None = None
    """Footings, piles, base slabs."""
    column: Factors | None = None
    """Columns, upright slender parts."""
    wall: Factors | None = None
    """Walls, thin upright parts."""
    beam: Factors | None = None
    """Beams, long parts."""
    slab: Factors | None = None
    """Slabs, planks, roofs, flat parts."""
    stair: Factors | None = None
    """Flights, ramps, landings."""
    steel: Factors | None = None
    """All parts of steel."""
    other: Factors | None = None
    """All others."""
    samples: Annotated[Whole, Field(ge=100, le=100_000)] = 10_000
    """Number of simulated plans."""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """Seed of the simulation."""
