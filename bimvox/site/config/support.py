"""The ``[[support]]`` tables of a site file: what stands under a crane, for the lift plan's loads on the ground."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bimvox.site.config.validation import NotNegative, Positive, Table, Text

MOST_SUPPORTS = 100
Mass = Annotated[Positive, Field(le=1e7)]


class SupportConfig(Table):
    """What the maker states of a crane as it stands, and its mats; only for `bimvox report`, which invents none."""

    crane: Text | None = None
    """Name of the crane. Default: the first."""
    crane_mass_kg: Mass | None = None
    """Mass of the crane as erected, with ballast and counterweight, without hook block and rigging."""
    back_moment_knm: Annotated[NotNegative, Field(le=1e7)] | None = None
    """Moment of its own masses towards the counterweight, without a load. Default: not stated."""
    free_standing_m: Annotated[Positive, Field(le=1000.0)] | None = None
    """Highest hook above the foot up to which the crane stands without ties."""
    mat_m2: Annotated[Positive, Field(le=1e4)] | None = None
    """Area of the mat under an outrigger, or of the foundation under a tower crane."""
    permitted_kpa: Annotated[Positive, Field(le=1e6)] | None = None
    """Permitted pressure on the ground."""
