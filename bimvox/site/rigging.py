"""The gear of a site: the catalogue, or the files that the site file names."""

from __future__ import annotations

from bimvox.crane.gear import Gear, GearFamily
from bimvox.errors import ConfigError
from bimvox.site.config.gear_file import gear_catalogue, gear_of
from bimvox.site.config.site_config import SiteConfig


def gear_of_site(config: SiteConfig) -> Gear:
    """Return the gear of a site: its own files, and of the kinds that they lack the catalogue.

    Raises:
        ConfigError: If a file is not there or is not one of gear.
    """
    own: list[GearFamily] = []
    for number, name in enumerate(config.rigging.gear):
        text = config.machine_files.get(name)
        if text is None:
            raise config.error(f"rigging.gear[{number}]", f"the file of gear {name!r} is not there")
        family = gear_of(text, config.file.parent / name)
        if family.name in [one.name for one in (*own, *gear_catalogue())]:
            hint = "give your gear its own name"
            raise ConfigError(config.file.parent / name, "name", f"{family.name!r} is known already", hint=hint)
        own.append(family)
    kinds = {family.kind for family in own}
    catalogue = (family for family in gear_catalogue() if family.kind not in kinds)
    return Gear((*own, *catalogue), config.rigging.spreader_from_m)


def gear_by_crane(config: SiteConfig, count: int) -> tuple[Gear | None, ...]:
    """Return what the rigs of each crane's parts are chosen from; None if the site file describes the rigging.

    Args:
        config: The site file.
        count: How many cranes the site has.
    """
    tables = config.cranes[:count]
    chosen = [one.sling_m is None and one.rigging_mass_kg is None for one in tables] + [False] * (count - len(tables))
    if not any(chosen):
        return (None,) * count
    gear = gear_of_site(config)
    return tuple(gear if one else None for one in chosen)
