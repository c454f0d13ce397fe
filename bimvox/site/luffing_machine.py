"""The luffing crane of a site file: a luffing tower crane, or a mobile crane on a fixed pad."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bimvox.crane.luffing import LuffingJib
from bimvox.crane.luffing_defaults import LUFFING_CRANES, MOBILE_CRANES
from bimvox.crane.rigging import with_luffing_jib
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.site.config import CraneConfig, LuffAxisConfig, LuffingConfig, SiteConfig

_LENGTHS = (
    "pivot_height_m", "pivot_offset_m", "length_m", "luff_rad",
    "tail_radius_m", "tail_low_m", "tail_width_m", "width_m",
)  # fmt: skip


def luffing_machine(config: SiteConfig, given: CraneConfig) -> TowerCrane:
    """Return the built-in machine that a site file names; the smallest of its kind if it names none.

    Raises:
        ConfigError: If there is no machine of that name and kind.
    """
    machines = LUFFING_CRANES if given.kind == "luffing" else MOBILE_CRANES
    named = given.machine or given.name
    if named is None:
        return machines[0]
    machine = next((crane for crane in machines if crane.name == named), None)
    if machine is not None:
        return replace(machine, name=given.name or named)
    if _is_complete(given):
        return replace(machines[0], name=given.name or named)
    names = [crane.name for crane in machines]
    raise config.error(
        "crane.machine" if given.machine else "crane.name",
        f"{named!r} is not a built-in machine of kind {given.kind!r}, and not every key is given",
        available=names,
        hint=f"built-in machines: {', '.join(names)}; your own machine needs every key of [crane] and [crane.jib]",
    )


def with_jib(config: SiteConfig, crane: TowerCrane, given: CraneConfig) -> TowerCrane:
    """Return a crane with the jib of a site file, and everything that follows from it.

    Raises:
        ConfigError: If the jib is not consistent.
    """
    jib = crane.luffing
    assert jib is not None
    values: dict[str, Any] = {}
    if given.jib is not None:
        values = given.jib.model_dump(include=set(_LENGTHS), exclude_none=True)
        if given.jib.luffing is not None:
            values["limits"] = given.jib.luffing.limits()
    if (winch := given.hoist) is not None:
        values["winch"] = winch.limits()
    try:
        return with_luffing_jib(crane, replace(jib, **values))
    except InputError as error:
        raise config.error("crane.jib", error.message, hint=error.hint) from error


def jib_config(jib: LuffingJib) -> LuffingConfig:
    """Return the complete site-file table of a jib."""
    return LuffingConfig(**{key: getattr(jib, key) for key in _LENGTHS}, luffing=LuffAxisConfig.of(jib.limits))


def _is_complete(given: CraneConfig) -> bool:
    jib = given.jib
    keys = ("base_m", "mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist")
    charted = given.chart is not None or given.reeving is not None
    whole = jib is not None and all(getattr(jib, key) is not None for key in (*_LENGTHS, "luffing"))
    return charted and whole and all(getattr(given, key) is not None for key in keys)
