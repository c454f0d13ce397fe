"""The luffing crane of a site file: a luffing tower crane, or a mobile crane on a fixed pad."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bimvox.crane.kinematics import with_luffing_jib
from bimvox.crane.tower_crane import LuffingJib, TowerCrane
from bimvox.errors import InputError
from bimvox.site.catalogue import machines_of
from bimvox.site.config.crane import CraneConfig, LuffAxisConfig, LuffingConfig, TravelConfig
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.validation import in_radians

_LENGTHS = (
    "pivot_height_m", "pivot_offset_m", "length_m", "tail_radius_m", "tail_low_m", "tail_width_m", "width_m",
)  # fmt: skip


def own_luffing_crane(config: SiteConfig, given: CraneConfig, values: Mapping[str, Any]) -> TowerCrane:
    """Return the crane that a table describes with every key; ``values`` are those that it has in common.

    Raises:
        ConfigError: If a key is missing, or the jib is not consistent.
    """
    assert given.kind is not None
    names = [machine.name for machine in machines_of(given.kind)]
    if not _is_complete(given):
        raise config.error(
            "crane.name",
            f"{given.name!r} is not a machine of kind {given.kind!r}, and not every key is given",
            available=names,
            hint=f"machines of the catalogue: {', '.join(names)}; your own machine is a file: "
            'machine = "my-crane.toml"',
        )
    own = {key: value for key, value in values.items() if key not in ("trolley", "hoist")}
    crane = replace(machines_of(given.kind)[0].usual, **own)
    return with_jib(config, crane, given.jib, given.hoist)


def with_jib(
    config: SiteConfig, crane: TowerCrane, given: LuffingConfig | None, hoist: TravelConfig | None
) -> TowerCrane:
    """Return a crane with the keys of a jib and of its winch, and everything that follows from them.

    Raises:
        ConfigError: If the jib is not consistent.
    """
    jib = crane.luffing
    assert jib is not None
    values: dict[str, Any] = {}
    if given is not None:
        values = given.model_dump(include=set(_LENGTHS), exclude_none=True)
        if given.luff_deg is not None:
            values["luff_rad"] = in_radians(given.luff_deg)
        if given.luffing is not None:
            values["limits"] = given.luffing.limits()
    if hoist is not None:
        values["winch"] = hoist.limits()
    try:
        return with_luffing_jib(crane, replace(jib, **values))
    except InputError as error:
        raise config.error("crane.jib", error.message, hint=error.hint) from error


def jib_config(jib: LuffingJib) -> LuffingConfig:
    """Return the complete site-file table of a jib."""
    lengths = {key: getattr(jib, key) for key in _LENGTHS}
    return LuffingConfig.model_validate({**lengths, "luff_rad": jib.luff_rad, "luffing": LuffAxisConfig.of(jib.limits)})


def _is_complete(given: CraneConfig) -> bool:
    jib = given.jib
    keys = ("base_m", "mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist")
    charted = given.chart is not None or given.reeving is not None
    whole = jib is not None and all(getattr(jib, key) is not None for key in (*_LENGTHS, "luff_deg", "luffing"))
    return charted and whole and all(getattr(given, key) is not None for key in keys)
