"""Cranes from a site file, and back."""

from __future__ import annotations

import difflib
from dataclasses import MISSING, asdict, fields, replace
from typing import Any

from bimvox.crane.defaults import DEFAULT_CRANES, DEFAULT_REEVINGS
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.rigging import with_reeving
from bimvox.crane.tower_crane import Reeving, TowerCrane
from bimvox.crane.working_range import UNLIMITED, SlowZone, WorkingRange
from bimvox.errors import ConfigError
from bimvox.site.config import CraneConfig, SiteConfig, SlewingConfig, TravelConfig, WorkingRangeConfig
from bimvox.site.luffing_machine import jib_config, luffing_machine, with_jib

_SLOW = 0.5
# Keys that a table and a ``TowerCrane`` have in common.
_SAME_KEYS = {
    *("jib_height_m", "jib_length_m", "min_radius_m", "mast_size_m", "sling_m", "rigging_mass_kg"),
    *("hook_block_kg", "falls", "gears", "max_wind_m_s"),
}


def cranes_of(config: SiteConfig) -> tuple[TowerCrane, ...]:
    """Return the cranes of a site file; empty if it has none.

    Missing keys come from the built-in machine of that name.

    Raises:
        ConfigError: If a key is missing and the name is not a built-in machine, or if the machine is not consistent.
    """
    if len(config.cranes) < 2:
        crane = crane_of(config)
        return () if crane is None else (crane,)
    cranes = []
    for number, given in enumerate(config.cranes):
        try:
            crane = crane_of(config.model_copy(update={"crane": given}))
        except ConfigError as error:
            own = error.message.removeprefix(f"{error.path}: {error.key}").lstrip(": ")
            key = f"crane[{number}]{(error.key or '').removeprefix('crane')}"
            raise config.error(key, own, available=error.available, hint=error.hint) from None
        assert crane is not None
        cranes.append(crane)
    return tuple(cranes)


def crane_of(config: SiteConfig) -> TowerCrane | None:
    """Return the (first) crane of a site file, None if it has none; see :func:`cranes_of`."""
    given = config.one_crane
    if given is None or given.kind == "none":
        return None
    values = _values(given)
    if given.kind != "hammerhead":
        return _luffing(config, given, values)
    named = given.machine or given.name
    machine = next((crane for crane in DEFAULT_CRANES if crane.name == named), None)
    missing = [key.name for key in fields(TowerCrane) if key.default is MISSING and key.name not in values]
    if machine is None and missing:
        names = [crane.name for crane in DEFAULT_CRANES]
        near = difflib.get_close_matches(named or "", names, n=1)
        own_name = given.machine or (given.name and not near)
        raise config.error(
            f"crane.{missing[0]}",
            f"is missing, and {named!r} is not a built-in machine" if named else "is missing",
            available=names,
            hint=f'{"machine" if own_name else "name"} = "{near[0] if near else names[0]}" would fill in '
            "the missing keys; "
            f"built-in machines: {', '.join(names)}",
        )
    if machine is not None and "base_m" not in values:
        raise config.error("crane.base_m", "is missing", hint="add the crane's position, or leave [crane] out")
    crane = replace(_reeved(config, machine, given), **values) if machine else TowerCrane(**values)
    if (chosen := _reeving_given(given)) is not None:
        crane = with_reeving(crane, chosen)
    crane = replace(crane, slow_zones=_slow_zones(config))
    if crane.min_radius_m >= crane.jib_length_m:
        raise config.error("crane.min_radius_m", f"must be smaller than the jib of {crane.jib_length_m:g} m")
    if crane.jib_height_m - crane.sling_m <= crane.base_m[2]:
        raise config.error("crane.jib_height_m", "leaves no room for the slings above the crane's foot")
    return crane


def _luffing(config: SiteConfig, given: CraneConfig, values: dict[str, Any]) -> TowerCrane:
    """Return a luffing crane: radii, height and limits of the hook follow from the jib."""
    machine = luffing_machine(config, given)
    if "base_m" not in values:
        raise config.error("crane.base_m", "is missing", hint="add the crane's position")
    own = {key: value for key, value in values.items() if key not in ("name", "trolley", "hoist")}
    crane = replace(machine, **own)
    if (chosen := _reeving_given(given)) is not None:
        crane = with_reeving(crane, replace(chosen, trolley_rate_m_s=None))
    return with_jib(config, replace(crane, slow_zones=_slow_zones(config)), given)


def _slow_zones(config: SiteConfig) -> tuple[SlowZone, ...]:
    return tuple(
        SlowZone(zone.polygon, _SLOW if zone.share is None else zone.share)
        for zone in config.zone
        if zone.kind == "slow"
    )


def crane_config(crane: TowerCrane | None) -> CraneConfig:
    """Return the complete site-file table of a crane."""
    if crane is None:
        return CraneConfig(kind="none")
    luffing, limiters = crane.luffing, crane.working_range
    keys = _SAME_KEYS - ({"jib_height_m", "jib_length_m", "min_radius_m"} if luffing else set())
    return CraneConfig(
        kind="hammerhead" if luffing is None else "mobile" if crane.kind == "mobile" else "luffing",
        name=crane.name,
        base_m=crane.base_m,
        jib=None if luffing is None else jib_config(luffing),
        slewing=SlewingConfig.of(crane.slewing),
        trolley=None if luffing else TravelConfig.of(crane.trolley),
        hoist=TravelConfig.of(luffing.winch if luffing else crane.hoist),
        chart=tuple(zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True)),
        working_range=None if limiters == UNLIMITED else WorkingRangeConfig(**asdict(limiters)),
        **{key: getattr(crane, key) for key in keys},
    )


def _values(given: CraneConfig) -> dict[str, Any]:
    """Return the given keys as values for ``TowerCrane``."""
    values = given.model_dump(include=_SAME_KEYS, exclude_none=True) | {"name": given.name or "crane"}
    if given.base_m is not None:
        values["base_m"] = (given.base_m[0], given.base_m[1], given.base_m[2] if len(given.base_m) == 3 else 0.0)
    for key, axis in (("slewing", given.slewing), ("trolley", given.trolley), ("hoist", given.hoist)):
        if axis is not None:
            values[key] = axis.limits()
    if given.working_range is not None:
        values["working_range"] = WorkingRange(**given.working_range.model_dump())
    chosen = _reeving_given(given)
    if chosen is not None:
        values["chart"] = chosen.chart
    elif given.chart is not None:
        # Your own chart is your own reeving: it takes nothing from the built-in machine's reeving.
        values = {"hook_block_kg": 0.0, "gears": (), **values, "chart": _chart(given.chart)}
    return values


def _reeving_given(given: CraneConfig) -> Reeving | None:
    """Return the reeving in use: the one with the given ``falls``, otherwise the one that carries most."""
    if given.reeving is None:
        return None
    one = next((r for r in given.reeving if r.falls == given.falls), None)
    one = one or max(given.reeving, key=lambda r: (r.chart[0][1], r.falls))
    return Reeving(one.falls, _chart(one.chart), one.hook_block_kg, one.trolley_rate_m_s, one.gears)


def _reeved(config: SiteConfig, machine: TowerCrane, given: CraneConfig) -> TowerCrane:
    """Return a built-in machine with the given ``falls``."""
    if given.falls is None or given.chart is not None or given.reeving is not None:
        return machine
    known = DEFAULT_REEVINGS[machine.name]
    for reeving in known:
        if reeving.falls == given.falls:
            return with_reeving(machine, reeving)
    falls = [reeving.falls for reeving in known]
    raise config.error(
        "crane.falls",
        f"{machine.name} has no reeving of {given.falls} falls",
        available=[str(count) for count in falls],
        hint=f"it has {' and '.join(map(str, sorted(falls)))}; another reeving needs its own chart",
    )


def _chart(pairs: tuple[tuple[float, float], ...]) -> LoadChart:
    radii, capacities = zip(*pairs, strict=True)
    return LoadChart(radii, capacities)
