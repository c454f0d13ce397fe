"""The wind up to which parts may be lifted, and the part that governs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bimvox.crane.load_chart import permitted_wind_m_s
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.component import Component
from bimvox.site.lifting import hung_kg
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True)
class GoverningWind:
    """The smallest wind in which every lift is permitted.

    Attributes:
        speed_m_s: It (gust of 3 s at jib height).
        component: Id of the part that governs; None if the crane's own limit does.
        name: Name of that part, or of the crane.
    """

    speed_m_s: float
    component: str | None
    name: str


def permitted_for(site: Site, crane: TowerCrane, component: Component) -> float:
    """Return the wind up to which a crane may lift a part, m/s."""
    return permitted_wind_m_s(
        crane.max_wind_m_s, hung_kg(crane, component), component.sail_area_m2, site.rules.drag_coefficient
    )


def needs_less_wind(site: Site, component: Component) -> bool:
    """Return whether a part may be lifted only in less wind than the rules ask for, where these give way."""
    crane = site.crane_of(component)
    if crane is None or "wind_speed_m_s" not in site.rules.gives_way:
        return False
    return permitted_for(site, crane, component) < min(site.rules.wind_speed_m_s, crane.max_wind_m_s)


def governing_wind(site: Site, lifted: Iterable[Component]) -> GoverningWind | None:
    """Return the smallest wind in which these parts may be lifted; None without a crane or parts."""
    least: GoverningWind | None = None
    for component in lifted:
        if (crane := site.crane_of(component)) is None:
            return None
        speed_m_s = permitted_for(site, crane, component)
        if least is None or speed_m_s < least.speed_m_s:
            by_part = speed_m_s < crane.max_wind_m_s
            name = (component.name or component.id) if by_part else crane.name
            least = GoverningWind(speed_m_s, component.id if by_part else None, name)
    return least
