"""The ``[rigging]`` table of the site file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bimvox.site.config.validation import Positive, Table, Text


class RiggingConfig(Table):
    """How gear is chosen for the parts of a crane without ``sling_m`` and ``rigging_mass_kg``."""

    gear: Annotated[tuple[Text, ...], Field(max_length=20)] = ()
    """Files of your own gear next to the site file. Of a kind that they have, the catalogue's gear is not used."""
    spreader_from_m: Positive = 6.0
    """Lifting points further apart hang on a spreader."""
