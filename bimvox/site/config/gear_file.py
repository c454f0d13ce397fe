"""The schema of a file of lifting gear, in the catalogue or next to a site file. ``bimvox schema gear`` prints it."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from math import radians
from typing import Annotated, Self

from pydantic import Field, model_validator

from bimvox.crane.gear import Gear, GearFamily, GearKind, GearSize
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.validation import NotNegative, Positive, Table, TableFiles, Text

_Ascending = Annotated[tuple[Positive, ...], Field(min_length=1)]


class GearSizeConfig(Table):
    """One size of a family of gear."""

    name: Text
    """Its name within the family."""
    wll_kg: Positive | None = None
    """Working load limit in a straight pull, of one leg or one piece. Not for a spreader."""
    mass_kg: NotNegative = 0.0
    """Mass of one piece, without legs and length."""
    leg_kg: NotNegative = 0.0
    """Only for a chain sling: mass of the fittings of a leg."""
    kg_per_m: NotNegative = 0.0
    """Mass of a metre of leg or span."""
    chart: Annotated[tuple[tuple[Positive, Positive], ...], Field(min_length=1)] | None = None
    """Only for a spreader: [span in m, working load limit in kg] pairs; a limit holds up to its span."""


class GearConfig(Table):
    """A family of lifting gear, as its data sheet or its tags describe it."""

    name: Text
    """Its name."""
    kind: GearKind
    """What it is."""
    about: Text
    """What it is, and where its data come from."""
    lengths_m: _Ascending | None = None
    """Lengths of a leg of a chain sling, or of a round sling, ascending."""
    choked: Annotated[Positive, Field(le=1.0)] | None = None
    """Only for a round sling: share of the limit that a choke hitch leaves. Default: 0.8 (EN 1492-2)."""
    height_m: NotNegative | None = None
    """Only for a spreader: from its upper eye to its lower eye. Default: 0."""
    most_angle_deg: Annotated[Positive, Field(le=60.0)] | None = None
    """Only for a spreader: largest angle of its upper sling to the vertical. Default: 30."""
    size: Annotated[tuple[GearSizeConfig, ...], Field(min_length=1)]
    """Its sizes, the weakest first."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        spreader = self.kind is GearKind.SPREADER
        for number, size in enumerate(self.size):
            needed, other = ("chart", "wll_kg") if spreader else ("wll_kg", "chart")
            if getattr(size, needed) is None:
                raise ValueError(f'size[{number}].{needed} is missing: kind = "{self.kind.value}" needs it')
            if getattr(size, other) is not None:
                raise ValueError(f'size[{number}].{other} is not for kind = "{self.kind.value}"')
            if size.leg_kg and self.kind is not GearKind.CHAIN_SLING:
                raise ValueError(f'size[{number}].leg_kg is not for kind = "{self.kind.value}"')
            if any(a[0] >= b[0] or a[1] < b[1] for a, b in pairwise(size.chart or ())):
                raise ValueError(f"size[{number}].chart: spans must ascend, and limits must not")
        limits = [size.chart[0][1] if size.chart else size.wll_kg or 0.0 for size in self.size]
        if limits != sorted(limits):
            raise ValueError("size: the weakest comes first")
        if len({size.name for size in self.size}) < len(self.size):
            raise ValueError("size: two sizes have the same name")
        if self.lengths_m is None and self.kind in (GearKind.CHAIN_SLING, GearKind.ROUND_SLING):
            raise ValueError(f'lengths_m is missing: kind = "{self.kind.value}" needs it')
        if list(self.lengths_m or ()) != sorted(set(self.lengths_m or ())):
            raise ValueError("lengths_m must ascend")
        own = {"choked": GearKind.ROUND_SLING, "height_m": GearKind.SPREADER, "most_angle_deg": GearKind.SPREADER}
        for key, kind in own.items():
            if getattr(self, key) is not None and self.kind is not kind:
                raise ValueError(f'{key} is not for kind = "{self.kind.value}"')
        return self


def _family(given: GearConfig) -> GearFamily:
    """Return the gear that a file describes."""
    choked = 0.8 if given.choked is None and given.kind is GearKind.ROUND_SLING else given.choked or 1.0
    return GearFamily(
        given.name, given.kind, given.about, tuple(map(_size, given.size)), given.lengths_m or (), choked,
        given.height_m or 0.0, radians(given.most_angle_deg or 30.0),
    )  # fmt: skip


def _size(given: GearSizeConfig) -> GearSize:
    chart = given.chart or ()
    most_kg = chart[0][1] if chart else given.wll_kg or 0.0
    return GearSize(given.name, most_kg, given.mass_kg, given.leg_kg, given.kg_per_m, chart)


GEAR_FILES = TableFiles(GearConfig, _family, "gear_catalogue", "gear")


@cache
def gear_catalogue() -> tuple[GearFamily, ...]:
    """Return the gear of the catalogue: the files of ``bimvox/crane/gear_catalogue``, by name."""
    return GEAR_FILES.catalogue()


def gear_of_site(config: SiteConfig) -> Gear:
    """Return the gear of a site: its own files, and of the kinds that they lack the catalogue.

    Raises:
        ConfigError: If a file is not there or is not one of gear.
    """
    own: list[GearFamily] = []
    for number, name in enumerate(config.rigging.gear):
        taken = [family.name for family in (*own, *gear_catalogue())]
        own.append(GEAR_FILES.named(config, f"rigging.gear[{number}]", name, taken))
    kinds = {family.kind for family in own}
    catalogue = (family for family in gear_catalogue() if family.kind not in kinds)
    return Gear((*own, *catalogue), config.rigging.spreader_from_m)


def gear_by_crane(config: SiteConfig, count: int) -> tuple[Gear | None, ...]:
    """Return what the rigs of each crane's parts are chosen from; None if the site file describes the rigging.

    ``count``: how many cranes the site has.
    """
    tables = config.cranes[:count]
    chosen = [one.sling_m is None and one.rigging_mass_kg is None for one in tables] + [False] * (count - len(tables))
    if not any(chosen):
        return (None,) * count
    gear = gear_of_site(config)
    return tuple(gear if one else None for one in chosen)
