"""What a crane has to serve: places, masses and gear of the parts, and why a crane does not carry one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.machine import carries_most
from bimvox.crane.reach import allowed_radii_m, distances_m, highest_hooks_m
from bimvox.crane.sectors import with_charts
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.catalogue import catalogue
from bimvox.site.config.gear_file import gear_by_crane, gear_of_site
from bimvox.site.config.site_config import ComponentConfig, SiteConfig
from bimvox.site.lifting import HangsAt, lifting_by
from bimvox.site.machine import cranes_of
from bimvox.site.means import Reasoned, means_of
from bimvox.site.parts import centre_of_mass_m, is_erected


@dataclass(frozen=True, slots=True, eq=False)
class Rigs:
    """The gear of all parts, before it is known where each hangs.

    Attributes:
        mass_kg: (N,) its mass for each part.
        height_m: Highest hook above a part's top.
        missing: Why no gear serves a part, by its number.
    """

    mass_kg: NDArray[np.float64]
    height_m: float
    missing: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Unserved:
    """A part that a crane cannot set.

    Attributes:
        component: Its id.
        name: Its name.
        mass_kg: Its mass.
        reason: Why: ``carries 3.2 t at 28.4 m``.
    """

    component: str
    name: str
    mass_kg: float
    reason: str

    def __str__(self) -> str:
        return f"{self.reason}; {self.name} weighs {self.mass_kg / 1000.0:.1f} t"


class Demand:
    """What a crane has to serve.

    Args:
        components: The parts, in the site frame.
        top_m: Height that the load's top must reach.
        rigs: The gear of the parts; None: the machine's usual rigging.
        most_used: As the attribute.

    Attributes:
        places_m: (N, 2) hook over each part at its place.
        masses_kg: (N,) mass of each part, with its gear if that is given.
        most_used: Share of the load chart that may be used.
    """

    def __init__(self, components: Sequence[Element], top_m: float, rigs: Rigs | None, most_used: float) -> None:
        self._components, self._top_m, self._rigs, self.most_used = components, top_m, rigs, most_used
        self.places_m = np.array([_hook_m(element) for element in components])
        self.masses_kg = np.array([element.mass_kg for element in components])
        if rigs is not None:
            self.masses_kg = self.masses_kg + rigs.mass_kg

    @property
    def without_gear(self) -> Mapping[int, str]:
        """Why no gear serves a part, by its number: no crane lifts it."""
        return {} if self._rigs is None else self._rigs.missing

    def permitting(self, most_used: float) -> Demand:
        """Return the same with another permitted share of the load chart."""
        other = copy(self)
        other.most_used = most_used
        return other

    def as_used(self, crane: TowerCrane) -> TowerCrane:
        """Return a crane with the permitted share of its chart and the highest gear; loads contain their gear."""
        crane = with_share(crane, self.most_used)
        if self._rigs is None:
            return crane
        return replace(crane, rigging_mass_kg=0.0, sling_m=max(crane.sling_m, self._rigs.height_m))

    def height_m(self, crane: TowerCrane) -> float:
        """Return the height that the hook of a crane as used must reach."""
        return float(np.ceil((self._top_m + crane.sling_m) * 2) / 2)

    def picks(
        self, part: int, crane: TowerCrane, points_m: NDArray[np.float64], margin_m: float = 0.0
    ) -> NDArray[np.bool_]:
        """Return at which of (P, 2) points a crane as used, on its base, carries a part.

        ``margin_m``: by how much radii lie inside the limits.
        """
        low_m, high_m = allowed_radii_m(crane, float(self.masses_kg[part]))
        radii_m = distances_m(np.array([crane.base_m[:2]]), points_m)[0]
        able: NDArray[np.bool_] = (radii_m >= low_m + margin_m) & (radii_m <= high_m - margin_m)
        if crane.luffing is not None:
            able &= highest_hooks_m(crane.luffing, radii_m) >= self.height_m(crane)
        return able

    def why_not(self, part: int, crane: TowerCrane, yard_m: NDArray[np.float64], margin_m: float = 0.0) -> Unserved:
        """Return why a crane as used, on its base, does not carry a part to its place or does not pick it in the yard.

        ``yard_m``: (P, 2) places of the yard; it picks the part at none of them if it carries it to its place;
        ``margin_m``: by how much radii lie inside the limits.
        """
        points_m = self.places_m[part : part + 1]
        in_yard = len(yard_m) > 0 and bool(self.picks(part, crane, points_m, margin_m)[0])
        low_m, high_m = allowed_radii_m(crane, float(self.masses_kg[part]))
        radii_m = distances_m(np.array([crane.base_m[:2]]), yard_m if in_yard else points_m)[0]
        missed_m = np.maximum(low_m + margin_m - radii_m, radii_m - high_m + margin_m)
        radius_m = float(radii_m[np.argmin(missed_m)])
        outside_m = margin_m if radius_m > high_m - margin_m else -margin_m if radius_m < low_m + margin_m else 0.0
        return self.unserved(part, crane, radius_m + outside_m, " in the yard" if in_yard else "")

    def unserved(self, part: int, crane: TowerCrane, radius_m: float, where: str) -> Unserved:
        """Return why a crane does not carry a part at a radius."""
        return self.said(part, self._reason(crane, radius_m, float(self.masses_kg[part])) + where)

    def said(self, part: int, reason: str) -> Unserved:
        """Return a part that is not served, with the reason."""
        element = self._components[part]
        return Unserved(element.id, element.name or element.id, float(self.masses_kg[part]), reason)

    def _reason(self, crane: TowerCrane, radius_m: float, mass_kg: float) -> str:
        low_m, high_m = allowed_radii_m(crane, mass_kg)
        if radius_m < low_m:
            return f"does not reach below {low_m:.1f} m, but {radius_m:.1f} m is needed"
        if radius_m > crane.jib_length_m:
            return f"reaches {crane.jib_length_m:.1f} m of the {radius_m:.1f} m needed"
        if radius_m > high_m:
            carries = max(0.0, capacity_kg(crane.chart, radius_m) - crane.tackle_kg)
            share = "" if self.most_used == 1.0 else f" with {100.0 * self.most_used:g} % of its chart"
            return f"carries {carries / 1000.0:.1f} t at {radius_m:.1f} m{share}"
        assert crane.luffing is not None
        highest = float(highest_hooks_m(crane.luffing, np.array([radius_m]))[0])
        return f"its hook reaches {highest:.1f} m of the {self.height_m(crane):.1f} m needed at {radius_m:.1f} m"


_OVER_M = 1.0
"""How high a crane that moves carries a load over its place, and over what lies beside the crane."""


def hooks_over_m(tops_m: NDArray[np.float64], crane: TowerCrane) -> NDArray[np.float64]:
    """Return (N,) how high the hook of a crane that moves must reach over parts with these tops at their places."""
    return tops_m + crane.sling_m + _OVER_M


def with_share(crane: TowerCrane, share: float) -> TowerCrane:
    """Return a crane whose load chart is a share of its own."""
    if share == 1.0:
        return crane
    return with_charts(crane, lambda own: LoadChart(own.radius_m, tuple(share * kg for kg in own.capacity_kg)))


def hook_above_m(element: Element) -> tuple[float, float, float]:
    """Return (x, y) of the hook of a part at its place, and the height of the part's top."""
    x, y = _hook_m(element).tolist()
    return x, y, float(element.mesh.bounds_m[1, 2])


def _hook_m(element: Element) -> NDArray[np.float64]:
    centre = centre_of_mass_m(element.mesh)
    return (element.mesh.bounds_m.mean(axis=0) if centre is None else centre)[:2]


# What goes up in one piece: how each part gets to its place, by the site file, its kind, the road, gear and machine.
#
# Asked before a crane is chosen, and the same when the site is built and proven, so that all of them lift the same
# parts.

_STEP_M = 0.2
"""The hook is raised by whole multiples; the cells of the site are not known yet."""


def means_by(
    config: SiteConfig, elements: Sequence[Element], entries: Mapping[str, ComponentConfig]
) -> dict[str, Reasoned]:
    """Return how each part gets to its place, by id.

    ``entries``: their tables in the site file, by id.

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
    # Of the tower cranes: a larger mobile crane is for the few parts for which a site file asks for it.
    towers = [crane for machine in catalogue() if machine.kind != "mobile" for crane in machine.cranes]
    largest = carries_most([*towers, *cranes_of(config)])
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


def rigs_of(config: SiteConfig, lifted: Sequence[Element]) -> Rigs:
    """Return the gear of parts before it is known on which cells they hang, on slings of the catalogue's usual height.

    ``lifted``: the parts, in the site frame.
    """
    gear, size_m = gear_of_site(config), config.model.voxel_size_m or _STEP_M
    angle_rad, usual_m = config.rules_in_force.sling_angle_rad, catalogue()[0].cranes[0].sling_m
    mass_kg, highest_m = np.zeros(len(lifted)), usual_m
    missing: dict[int, str] = {}
    for number, element in enumerate(lifted):
        x, y, top_m = hook_above_m(element)
        at = HangsAt((x, y), top_m, usual_m, angle_rad, size_m)
        lifting = lifting_by(gear, element, at, upended=is_erected(element))
        if lifting.rig is not None:
            mass_kg[number], highest_m = lifting.rig.mass_kg, max(highest_m, lifting.rig.height_m)
        elif lifting.no_gear:
            missing[number] = lifting.no_gear
    return Rigs(mass_kg, highest_m, missing)
