"""The crane that a site file describes."""

from __future__ import annotations

import difflib
from dataclasses import fields, replace
from typing import Any

from bimvox.crane.defaults import DEFAULT_CRANES
from bimvox.crane.tower_crane import AxisLimits, LoadChart, TowerCrane
from bimvox.site.config import CraneConfig, SiteConfig, SlewingConfig, TravelConfig


def crane_of(config: SiteConfig) -> TowerCrane | None:
    """Return the crane of a site file, or None where it has none.

    Keys that are left out come from the built-in machine of that name.

    Raises:
        ConfigError: If the name is no built-in machine and a key is missing, or the machine makes no sense.
    """
    given = config.crane
    if given is None or given.kind == "none":
        return None
    values = _values(given)
    machine = next((crane for crane in DEFAULT_CRANES if crane.name == given.name), None)
    missing = [key.name for key in fields(TowerCrane) if key.name not in values]
    if machine is None and missing:
        names = [crane.name for crane in DEFAULT_CRANES]
        near = difflib.get_close_matches(given.name or "", names, n=1)
        raise config.error(
            f"crane.{missing[0]}",
            f"is missing, and {given.name!r} is no built-in machine" if given.name else "is missing",
            available=names,
            hint=f'name = "{near[0] if near else names[0]}" would fill in what is missing; '
            f"built-in machines: {', '.join(names)}",
        )
    if machine is not None and "base_m" not in values:
        raise config.error("crane.base_m", "is missing", hint="say where the crane stands, or leave [crane] out")
    crane = replace(machine, **values) if machine else TowerCrane(**values)
    if crane.min_radius_m >= crane.jib_length_m:
        raise config.error("crane.min_radius_m", f"must be smaller than the jib of {crane.jib_length_m:g} m")
    if crane.jib_height_m - crane.sling_m <= crane.base_m[2]:
        raise config.error("crane.jib_height_m", "leaves no room for the slings above the crane's foot")
    return crane


def crane_config(crane: TowerCrane | None) -> CraneConfig:
    """Return the table of a site file that describes a crane in full."""
    if crane is None:
        return CraneConfig(kind="none")
    return CraneConfig(
        kind="hammerhead",
        name=crane.name,
        base_m=crane.base_m,
        jib_height_m=crane.jib_height_m,
        jib_length_m=crane.jib_length_m,
        min_radius_m=crane.min_radius_m,
        mast_size_m=crane.mast_size_m,
        sling_m=crane.sling_m,
        rigging_mass_kg=crane.rigging_mass_kg,
        slewing=SlewingConfig(
            rate_rad_s=crane.slewing.rate,
            acceleration_rad_s2=crane.slewing.acceleration,
            jerk_rad_s3=crane.slewing.jerk,
        ),
        trolley=_travel(crane.trolley),
        hoist=_travel(crane.hoist),
        chart=tuple(zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True)),
    )


def _travel(axis: AxisLimits) -> TravelConfig:
    return TravelConfig(rate_m_s=axis.rate, acceleration_m_s2=axis.acceleration, jerk_m_s3=axis.jerk)


def _values(given: CraneConfig) -> dict[str, Any]:
    """The keys that the file gives, as ``TowerCrane`` takes them."""
    values: dict[str, Any] = {
        key: getattr(given, key)
        for key in ("jib_height_m", "jib_length_m", "min_radius_m", "mast_size_m", "sling_m", "rigging_mass_kg")
        if getattr(given, key) is not None
    }
    values["name"] = given.name or "crane"
    if given.base_m is not None:
        values["base_m"] = (given.base_m[0], given.base_m[1], given.base_m[2] if len(given.base_m) == 3 else 0.0)
    if given.slewing is not None:
        one = given.slewing
        values["slewing"] = AxisLimits(one.rate_rad_s, one.acceleration_rad_s2, one.jerk_rad_s3)
    for key, travel in (("trolley", given.trolley), ("hoist", given.hoist)):
        if travel is not None:
            values[key] = AxisLimits(travel.rate_m_s, travel.acceleration_m_s2, travel.jerk_m_s3)
    if given.chart is not None:
        radii, capacities = zip(*given.chart, strict=True)
        values["chart"] = LoadChart(radii, capacities)
    return values
