"""What goes up in one piece: how each part gets to its place, by the site file, its kind, the road, gear and machine.

Asked before a crane is chosen, and the same when the site is built and proven, so that all of them lift the same parts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from bimvox.bim.building import Element
from bimvox.crane.machine import carries_most
from bimvox.site.catalogue import catalogue
from bimvox.site.config.site_config import ComponentConfig, SiteConfig
from bimvox.site.demand import hook_above_m
from bimvox.site.lifting import HangsAt, lifting_by
from bimvox.site.machine import cranes_of
from bimvox.site.means import Reasoned, means_of
from bimvox.site.parts import is_erected
from bimvox.site.rigging import gear_by_crane, gear_of_site

_STEP_M = 0.2
"""The hook is raised by whole multiples; the cells of the site are not known yet."""


def means_by(
    config: SiteConfig, elements: Sequence[Element], entries: Mapping[str, ComponentConfig]
) -> dict[str, Reasoned]:
    """Return how each part gets to its place, by id.

    Args:
        config: The site file.
        elements: The components, in the site frame.
        entries: Their tables in the site file, by id.

    Raises:
        ConfigError: If a file of gear is not there or is not one of gear.
    """
    selected = config.model.select is not None
    return means_of(elements, entries, config.means, _not_lifted(config), selected=selected)


def _not_lifted(config: SiteConfig) -> Callable[[Element], str]:
    """Return what says why no gear of a site, or no machine, lifts a part; empty if some do.

    Neither is asked if the site file states the rigging. A machine is one of the catalogue or of the site.
    """
    gears = gear_by_crane(config, len(config.cranes)) if config.crane is not None else (gear_of_site(config),)
    if not gears or any(gear is None for gear in gears):
        return lambda element: ""
    usual_m, angle_rad = catalogue()[0].cranes[0].sling_m, config.rules_in_force.sling_angle_rad
    largest = carries_most([*(crane for machine in catalogue() for crane in machine.cranes), *cranes_of(config)])
    most_kg = largest.chart.capacity_kg[0]

    def why(element: Element) -> str:
        assert gears[0] is not None
        x, y, top_m = hook_above_m(element)
        at = HangsAt((x, y), top_m, usual_m, angle_rad, _STEP_M)
        lifting = lifting_by(gears[0], element, at, upended=is_erected(element))
        hung_kg = element.mass_kg + (lifting.rig.mass_kg if lifting.rig is not None else 0.0)
        if not lifting.no_gear and hung_kg > most_kg:
            return (
                f"no machine carries {hung_kg / 1000:.1f} t: the largest, {largest.name}, carries {most_kg / 1000:g} t"
            )
        return lifting.no_gear

    return why
