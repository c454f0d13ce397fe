"""Lifts that the crane cannot do whatever the path: too heavy, out of reach, or too much sail area for the wind.

The reason gives the figure that decides and the governing radius.
"""

from __future__ import annotations

from math import hypot

from bimvox.crane.load_chart import capacity_kg, wind_force_n
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.access import unloading_columns
from bimvox.site.component import Component
from bimvox.site.governing_wind import permitted_for
from bimvox.site.lifting import crane_for, hung_kg
from bimvox.site.site import Site
from bimvox.units import mass_text

_SLACK_M = 1e-6


def refused_by_crane(site: Site, component: Component) -> str | None:
    """Return why the crane cannot lift a part to its place whatever the path; None if it can."""
    crane = site.crane_of(component)
    if crane is None:
        return None
    if component.lifting.no_gear:
        return f"no gear serves its {mass_text(component.mass_kg)}: {component.lifting.no_gear}"
    reasons = {one.name: _by_wind(site, one, component) or _by_radius(site, one, component) for one in site.cranes}
    if reasons[crane.name] is None:
        return _by_access(site, crane, component)
    if not site.has_several_cranes:
        return reasons[crane.name]
    could = "could lift it, but the part is assigned to another crane"
    return "; ".join(f"{name}: {reason or could}" for name, reason in reasons.items())


def place_radius_m(site: Site, crane: TowerCrane, component: Component) -> float:
    """Return the radius of the hook when a part is set."""
    x, y = (component.target_vox[axis] + component.hook_line_vox[axis] + 0.5 for axis in (0, 1))
    at = site.frame.corner_of([x, y, 0])
    return hypot(float(at[0]) - crane.base_m[0], float(at[1]) - crane.base_m[1])


def _by_access(site: Site, crane: TowerCrane, component: Component) -> str | None:
    if site.access is None or len(unloading_columns(site, component)):
        return None
    return (
        f"it cannot be unloaded: {carried_where(site, crane, component)}, and no truck can stand there ([areas] access)"
    )


def carried_where(site: Site, crane: TowerCrane, component: Component) -> str:
    """Return at which radii a crane carries a part, in words."""
    low_m, high_m = allowed_radii_m(
        crane_for(site, crane, component), component.mass_kg, site.rules.highest_utilisation
    )
    radii = f"at radii from {low_m:.1f} to {high_m:.1f} m" if low_m <= high_m else "at no radius"
    return f"{crane.name} carries {mass_text(hung_kg(crane, component))} with rigging and hook block {radii}"


def _by_wind(site: Site, crane: TowerCrane, component: Component) -> str | None:
    wind, drag, area = site.rules.wind_speed_m_s, site.rules.drag_coefficient, component.sail_area_m2
    if wind <= 0.0 or "wind_speed_m_s" in site.rules.gives_way:
        return None
    if wind > crane.max_wind_m_s:
        return f"the site's wind speed is {wind:g} m/s, but {crane.name} works only up to {crane.max_wind_m_s:g} m/s"
    permitted = permitted_for(site, crane, component)
    if wind <= permitted:
        return None
    force_kn = wind_force_n(wind, area, drag) / 1000.0
    return (
        f"its sail area of {area:.1f} m2 (drag {drag:g}, {mass_text(component.mass_kg)}) permits a wind speed of "
        f"{permitted:.1f} m/s; at the site's {wind:g} m/s the wind force is {force_kn:.1f} kN"
    )


def _by_radius(site: Site, crane: TowerCrane, component: Component) -> str | None:
    radius = place_radius_m(site, crane, component)
    if not crane.min_radius_m - _SLACK_M <= radius <= crane.jib_length_m + _SLACK_M:
        return (
            f"its place is at a radius of {radius:.1f} m, but the hook of {crane.name} reaches from "
            f"{crane.min_radius_m:.1f} to {crane.jib_length_m:.1f} m"
        )
    most_used = site.rules.highest_utilisation
    _, furthest = allowed_radii_m(crane_for(site, crane, component), component.mass_kg, most_used)
    if radius <= furthest + _SLACK_M:
        return None
    mass_kg = hung_kg(crane, component)
    up_to = f"only up to {furthest:.1f} m" if furthest > 0.0 else "at no radius"
    carries_kg = capacity_kg(crane.chart, radius)
    where = f"governing radius {radius:.1f} m, at its place: {mass_text(mass_kg)} with rigging and hook block"
    if mass_kg <= carries_kg:
        return (
            f"{where}, {100.0 * mass_kg / carries_kg:.1f} % of the capacity of {crane.name} on {crane.falls} falls; "
            f"[rules] highest_utilisation permits {100.0 * most_used:g} %, {up_to}"
        )
    return (
        f"{where}, but there {crane.name} on {crane.falls} falls carries {mass_text(carries_kg)}; "
        f"it carries that mass {up_to}"
    )
