"""The schema of a machine's file, in the catalogue or next to a site file. ``bimvox schema crane`` prints it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from bimvox.crane.kinematics import with_luffing_jib, with_reeving
from bimvox.crane.machine import Machine
from bimvox.crane.tower_crane import AxisLimits, LuffingJib, Reeving, TowerCrane
from bimvox.errors import ConfigError, InputError
from bimvox.site.config.crane import LuffAxisConfig, ReevingConfig, SlewingConfig, TravelConfig, chart_of
from bimvox.site.config.validation import NotNegative, Number, Positive, Table, Text, in_radians, table_of

_FOLLOWS = AxisLimits(1.0, 1.0, 1.0)  # replaced by what follows from the jib


class LuffingMachineConfig(Table):
    """Geometry of a luffing jib or a mobile crane's boom, and of the counterweight."""

    pivot_height_m: Positive
    """Height of the pivot above the ground; the site file says how high a tower crane stands."""
    pivot_offset_m: Number
    """Radius of the pivot; negative behind the slewing axis."""
    luff_deg: tuple[Positive, Positive]
    """Smallest and largest angle to the horizontal."""
    luffing: LuffAxisConfig
    """Limits of the luffing axis."""
    tail_radius_m: NotNegative
    """Radius of the counterweight behind the slewing axis."""
    tail_low_m: NotNegative
    """Height of the counterweight's underside above the ground."""
    tail_width_m: Positive
    """Width of the counterweight."""
    width_m: Positive
    """Width of the jib."""


class JibConfig(Table):
    """One or more jib lengths with the same load charts."""

    lengths_m: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """The largest hook radius; of a luffing jib, from pivot to tip."""
    reeving: Annotated[tuple[ReevingConfig, ...], Field(min_length=1)]
    """Its reevings, each with its load chart."""


class MachineConfig(Table):
    """A machine, as its data sheet describes it."""

    name: Text
    """Its name, not one of the catalogue's."""
    kind: Literal["hammerhead", "luffing", "mobile"]
    """``hammerhead``: any tower crane with a trolley."""
    about: Text
    """What it is, and where its data come from."""
    mast_size_m: Positive
    """Edge of the square mast section, or of the pad."""
    jib_height_m: Positive | None = None
    """Only for a hammerhead: usual height of the trolley's rope exit; the site file says how high it stands."""
    min_radius_m: NotNegative | None = None
    """Only for a hammerhead: smallest hook radius."""
    sling_m: NotNegative
    """Usual height of the slings, from the load's top to the hook."""
    rigging_mass_kg: NotNegative
    """Usual mass of slings and spreader."""
    max_wind_m_s: Positive = 20.0
    """Wind (gust of 3 s) up to which the crane works; 20 m/s for tower cranes (EN 14439)."""
    slewing: SlewingConfig
    """Limits of the slewing axis."""
    trolley: TravelConfig | None = None
    """Only for a hammerhead."""
    hoist: TravelConfig
    """Limits of the hoist."""
    luffing: LuffingMachineConfig | None = None
    """Not for a hammerhead."""
    jib: Annotated[tuple[JibConfig, ...], Field(min_length=1)]
    """The jib lengths with their load charts."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        own = ("jib_height_m", "min_radius_m", "trolley")
        needed, other = (own, ("luffing",)) if self.kind == "hammerhead" else (("luffing",), own)
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f'{key} is missing: kind = "{self.kind}" needs it')
        for key in other:
            if getattr(self, key) is not None:
                raise ValueError(f'{key} is not for kind = "{self.kind}"')
        lengths = [length for jib in self.jib for length in jib.lengths_m]
        if len(set(lengths)) < len(lengths):
            raise ValueError("jib: a length is given twice")
        if self.min_radius_m is not None and self.min_radius_m >= min(lengths):
            raise ValueError(f"min_radius_m must be smaller than the shortest jib of {min(lengths):g} m")
        for number, jib in enumerate(self.jib):
            falls = [one.falls for one in jib.reeving]
            if len(set(falls)) < len(falls):
                raise ValueError(f"jib[{number}].reeving: two reevings have the same falls")
        return self


def machine_of(text: bytes, path: Path) -> Machine:
    """Return the machine that a file describes.

    Args:
        text: The file's content, TOML.
        path: Its name, for messages.

    Raises:
        ConfigError: If it is not TOML, a key is unknown or missing, or a value is not allowed; names file and key.
    """
    return _machine_of(text, path)


@lru_cache(maxsize=64)
def _machine_of(text: bytes, path: Path) -> Machine:
    given = table_of(text, path, MachineConfig)
    try:
        pairs = sorted(_cranes(given), key=lambda pair: (pair[0], pair[1].falls))
    except InputError as error:
        raise ConfigError(path, None, error.message, hint=error.hint) from None
    return Machine(
        given.name, given.kind, given.about, tuple(length for length, _ in pairs), tuple(crane for _, crane in pairs)
    )


def _cranes(given: MachineConfig) -> Iterator[tuple[float, TowerCrane]]:
    """Yield every jib length with the crane, once per reeving."""
    for jib in given.jib:
        for length_m in jib.lengths_m:
            for one in jib.reeving:
                yield length_m, _crane(given, length_m, reeving_of(one))


def _crane(given: MachineConfig, length_m: float, reeving: Reeving) -> TowerCrane:
    """Return the machine on the origin, with one jib and one reeving."""
    crane = TowerCrane(
        name=given.name,
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=given.mast_size_m,
        jib_height_m=given.jib_height_m or 0.0,
        jib_length_m=length_m,
        min_radius_m=given.min_radius_m or 0.0,
        sling_m=given.sling_m,
        rigging_mass_kg=given.rigging_mass_kg,
        slewing=given.slewing.limits(),
        trolley=given.trolley.limits() if given.trolley else _FOLLOWS,
        hoist=given.hoist.limits(),
        chart=reeving.chart,
        max_wind_m_s=given.max_wind_m_s,
        kind=given.kind,
    )
    crane = with_reeving(crane, reeving)
    if given.luffing is None:
        return crane
    own = given.luffing
    return with_luffing_jib(
        crane,
        LuffingJib(
            own.pivot_offset_m, own.pivot_height_m, length_m, in_radians(own.luff_deg),
            own.luffing.limits(), given.hoist.limits(),
            own.tail_radius_m, own.tail_low_m, own.tail_width_m, own.width_m,
        ),
    )  # fmt: skip


def reeving_of(given: ReevingConfig) -> Reeving:
    """Return the reeving that a table describes."""
    return Reeving(given.falls, chart_of(given.chart), given.hook_block_kg, given.trolley_rate_m_s, given.gears)


def machine_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a machine's file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **MachineConfig.model_json_schema()}
