"""Cranes from a site file, and back."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, fields, replace
from math import degrees, radians
from typing import Any, Literal

from bimvox.crane.auxiliary import Auxiliary
from bimvox.crane.kinematics import raised, with_luffing_jib, with_reeving
from bimvox.crane.machine import Machine, carries_most, differences
from bimvox.crane.sectors import charts_of
from bimvox.crane.tower_crane import UNLIMITED, LuffingJib, Override, Reeving, SlowZone, TowerCrane
from bimvox.errors import ConfigError, InputError, enumerated
from bimvox.site.catalogue import every_machine, machine_called, machines_of, usual_machine
from bimvox.site.config.crane import (
    AuxiliaryConfig,
    CraneConfig,
    LuffAxisConfig,
    LuffingConfig,
    MovingConfig,
    OverrideConfig,
    SlewingConfig,
    TravelConfig,
    WorkingRangeConfig,
    chart_of,
    reeving_of,
)
from bimvox.site.config.machine_file import MACHINE_FILE, MACHINE_FILES
from bimvox.site.config.project import support_of
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.validation import in_radians
from bimvox.site.moving import Moving

_LENGTHS = (
    "pivot_height_m", "pivot_offset_m", "length_m", "tail_radius_m", "tail_low_m", "tail_width_m", "width_m",
)  # fmt: skip


def _own_luffing_crane(config: SiteConfig, given: CraneConfig, values: Mapping[str, Any]) -> TowerCrane:
    """Return the crane that a table describes with every key; ``values`` are those that all kinds have."""
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
    own = {"auxiliary": None} | {key: value for key, value in values.items() if key not in ("trolley", "hoist")}
    crane = replace(usual_machine(given.kind).usual, **own)
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


def _jib_config(jib: LuffingJib) -> LuffingConfig:
    """Return the complete site-file table of a jib."""
    lengths = {key: getattr(jib, key) for key in _LENGTHS}
    return LuffingConfig.model_validate({**lengths, "luff_rad": jib.luff_rad, "luffing": LuffAxisConfig.of(jib.limits)})


def _is_complete(given: CraneConfig) -> bool:
    jib = given.jib
    keys = ("base_m", "mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist")
    charted = given.chart is not None or given.reeving is not None
    whole = jib is not None and all(getattr(jib, key) is not None for key in (*_LENGTHS, "luff_deg", "luffing"))
    return charted and whole and all(getattr(given, key) is not None for key in keys)


_SLOW = 0.5
# Keys that a table and a ``TowerCrane`` have in common: those of the site, and those of the machine.
_SITE_KEYS = {"jib_height_m", "sling_m", "rigging_mass_kg"}
_MACHINE_KEYS = {"jib_length_m", "min_radius_m", "mast_size_m", "hook_block_kg", "gears", "max_wind_m_s"}
_AXES = ("slewing", "trolley", "hoist")


def cranes_of(config: SiteConfig) -> tuple[TowerCrane, ...]:
    """Return the cranes of a site file; empty if it has none.

    The data of a machine of the catalogue, or of a machine's file, come from there.

    Raises:
        ConfigError: If a key is missing and the name is not a machine's, if a key differs from the machine, or if the
            crane is not consistent.
    """
    if len(config.cranes) < 2:
        crane = crane_of(config)
        return () if crane is None else (crane,)
    cranes = []
    for number, given in enumerate(config.cranes):
        try:
            crane = crane_of(config.model_copy(update={"crane": given}))
        except ConfigError as error:
            if error.path != config.file:
                raise
            own = error.message.removeprefix(f"{error.path}: {error.key}").lstrip(": ")
            first, _, rest = (error.key or "").removeprefix("crane.").partition(".")
            key = config.crane_key(number, first) + (f".{rest}" if rest and not config.moves else "")
            raise config.error(key, own, available=error.available, hint=error.hint) from None
        assert crane is not None
        cranes.append(_on_foundation(config, crane, is_first=number == 0))
    return _in_set_ups(config, cranes) if config.moves else tuple(cranes)


def _in_set_ups(config: SiteConfig, cranes: Sequence[TowerCrane]) -> tuple[TowerCrane, ...]:
    """Return one crane in each of its set-ups, under the names of these."""
    assert isinstance(config.crane, CraneConfig)
    if cranes[0].kind != "mobile":
        raise config.error(
            "crane.setup",
            f"is for a mobile crane, but {cranes[0].name} stays where it is",
            hint="give one place as [crane] base_m, or name a mobile crane",
        )
    if not follows_foot(config, config.cranes[0]):  # one pivot height is stated for all of them
        cranes = [raised(crane, crane.base_m[2]) for crane in cranes]
    return tuple(
        replace(crane, name=f"{crane.name} at {one.name}", machine=crane.machine or crane.name)
        for one, crane in zip(config.crane.setup, cranes, strict=True)
    )


def follows_foot(config: SiteConfig, given: CraneConfig) -> bool:
    """Return whether a crane's pivot and counterweight are as high above its foot as its machine says.

    Those of a mobile machine are. A tower crane's, and those of a crane that the site file itself describes, are stated
    above z = 0.
    """
    machine = _machine(config, given)
    return machine is not None and machine.kind == "mobile"


_CLASSES_MIN = ((60_000.0, 30.0, 45.0), (130_000.0, 45.0, 60.0), (float("inf"), 90.0, 120.0))
"""Largest capacity up to which it holds, kg; time to derig and to rig, minutes (professional judgement): larger cranes
have more counterweight, which comes off before they drive, and larger mats."""


def moving_times_s(cranes: Sequence[TowerCrane]) -> tuple[float, float]:
    """Return how long a crane usually takes to derig and to rig, by its largest capacity in its set-ups, seconds."""
    most_kg = max(kg for crane in cranes for chart in charts_of(crane) for kg in chart.capacity_kg)
    derig_min, rig_min = next(minutes for limit_kg, *minutes in _CLASSES_MIN if most_kg <= limit_kg)
    return 60.0 * derig_min, 60.0 * rig_min


def moving_of(config: SiteConfig, cranes: Sequence[TowerCrane]) -> Moving | None:
    """Return how the crane of a site file moves; None if the cranes stay where they are.

    ``cranes``: the crane in each of its set-ups, from ``bimvox.site.machine.cranes_of``.
    """
    if not config.moves:
        return None
    assert isinstance(config.crane, CraneConfig)
    given = config.crane.moving or MovingConfig()
    derig_s, rig_s = moving_times_s(cranes)
    return Moving(
        tuple(one.name for one in config.crane.setup),
        derig_s=derig_s if given.derig_min is None else 60.0 * given.derig_min,
        drive_m_s=given.drive_km_h / 3.6,
        rig_s=rig_s if given.rig_min is None else 60.0 * given.rig_min,
    )


def crane_of(config: SiteConfig) -> TowerCrane | None:
    """Return the (first) crane of a site file, None if it has none; see :func:`cranes_of`."""
    given = config.one_crane
    if given is None or given.kind == "none":
        return None
    machine = _machine(config, given)
    crane = _described(config, given) if machine is None else _of_machine(config, given, machine)
    crane = replace(crane, slow_zones=_slow_zones(config), auxiliary=_auxiliary(config, crane))
    if crane.min_radius_m >= crane.jib_length_m:
        raise config.error("crane.min_radius_m", f"must be smaller than the jib of {crane.jib_length_m:g} m")
    if crane.luffing is None and crane.jib_height_m - crane.sling_m <= crane.base_m[2]:
        raise config.error("crane.jib_height_m", "leaves no room for the slings above the crane's foot")
    return _on_foundation(config, crane, is_first=True)


def _auxiliary(config: SiteConfig, crane: TowerCrane) -> Auxiliary | None:
    """Return the second hook of a crane, fitted; None if no part of the site is turned over with it."""
    hook = crane.auxiliary
    return None if hook is None or config.rules_in_force.two_hooks is None else replace(hook, fitted=True)


def _on_foundation(config: SiteConfig, crane: TowerCrane, *, is_first: bool) -> TowerCrane:
    """Return a tower crane with the area of its foundation, if a ``[[support]]`` table states it."""
    stated = support_of(config.support, crane.name, crane.machine or crane.name, is_first=is_first)
    return replace(crane, foundation_m2=None if stated is None or crane.kind == "mobile" else stated.mat_m2)


def _machine(config: SiteConfig, given: CraneConfig) -> Machine | None:
    """Return the machine that a table names, from its file or from the catalogue; None if it describes the crane."""
    named = given.machine or given.name
    if given.machine is not None and given.machine.endswith(MACHINE_FILE):
        taken = [one.name for one in every_machine()]
        machine = MACHINE_FILES.named(config, "crane.machine", given.machine, taken)
    elif named is None and given.kind in ("luffing", "mobile"):
        machine = usual_machine(given.kind)
    else:
        found = machine_called(named)
        if found is None and (given.machine is not None or given.override is not None):
            raise _unknown(config, given)
        if found is None:
            return None
        machine = found
    if given.kind is not None and given.kind != machine.kind:
        raise config.error(
            "crane.machine" if given.machine else "crane.name",
            f"{machine.name!r} is not a machine of kind {given.kind!r}",
            available=[one.name for one in machines_of(given.kind)],
            hint=f"it is of kind {machine.kind!r}: leave kind out, or name another machine",
        )
    return machine


def _unknown(config: SiteConfig, given: CraneConfig) -> ConfigError:
    """Return the error about a table that names no machine of the catalogue."""
    named = given.machine or given.name
    names = [one.name for one in every_machine() if given.kind in (None, one.kind)]
    near = difflib.get_close_matches(named or "", names, n=1)
    wanted = f'machine = "{near[0] if near else names[0]}"'
    return config.error(
        "crane.machine" if given.machine else "crane.override",
        f"{given.machine!r} is not a machine of the catalogue" if given.machine else "names no machine that it changes",
        available=names,
        hint=f'{wanted}? `bimvox cranes` lists all; your own machine is a file: machine = "my-crane.toml"',
    )


def _of_machine(config: SiteConfig, given: CraneConfig, machine: Machine) -> TowerCrane:
    """Return a crane that is a machine of the catalogue or of a file, with what the site changes."""
    if given.base_m is None:
        raise config.error("crane.base_m", "is missing", hint="add the crane's position, or leave [crane] out")
    entry = replace(_configured(config, given, machine), **_of_site(given))
    if machine.kind == "mobile":
        entry = raised(entry, entry.base_m[2])
    if given.name is not None and given.name != machine.name:
        entry = replace(entry, name=given.name, machine=machine.name)
    if entry.luffing is not None and given.jib is not None:
        # The mast of a luffing tower crane carries the pivot and the counterweight: their height is the site's.
        heights = given.jib.model_dump(include={"pivot_height_m", "tail_low_m"}, exclude_none=True)
        entry = with_jib(config, entry, LuffingConfig(**heights) if machine.kind == "luffing" else None, None)
    crane = _changed(config, entry, given)
    if found := differences(crane, entry):
        raise _contradicted(config, machine, entry, found)
    if given.override is None:
        return crane
    changed = _changed(config, crane, given.override, falls=given.falls)
    return replace(changed, overrides=differences(changed, crane))


def _configured(config: SiteConfig, given: CraneConfig, machine: Machine) -> TowerCrane:
    """Return the machine with the jib and the reeving that a table asks for."""
    length = given.jib_length_m
    if machine.kind != "hammerhead" and given.jib is not None:
        length = given.jib.length_m
    usual = machine.with_jib(max(machine.lengths_m))
    cranes: Sequence[TowerCrane] = usual if length is None else machine.with_jib(length) or usual
    longer = [own for own in machine.lengths_m if length is not None and own > length]
    if machine.kind == "mobile" and length is not None and cranes is usual and longer:
        # A boom between two listed lengths carries what the next longer one does.
        cranes = tuple(_as_long_as(crane, length) for crane in machine.with_jib(min(longer)))
    cranes = _set_up(config, given, machine, cranes)
    if given.falls is None:
        return carries_most(cranes)
    for crane in cranes:
        if crane.falls == given.falls:
            return crane
    override = given.override or OverrideConfig()
    if any(table.chart is not None or table.reeving is not None for table in (given, override)):
        return carries_most(cranes)
    falls = sorted(crane.falls for crane in cranes)
    raise config.error(
        "crane.falls",
        f"{machine.name} has no reeving of {given.falls} falls",
        available=[str(count) for count in falls],
        hint=f"it has {' and '.join(map(str, falls))}; another reeving needs its own chart in [crane.override]",
    )


def _as_long_as(crane: TowerCrane, length_m: float) -> TowerCrane:
    assert crane.luffing is not None
    return with_luffing_jib(crane, replace(crane.luffing, length_m=length_m))


def _set_up(
    config: SiteConfig, given: CraneConfig, machine: Machine, cranes: Sequence[TowerCrane]
) -> Sequence[TowerCrane]:
    """Return the cranes with the counterweight and the outriggers that a table asks for, on their heading."""
    carriers = [crane.carrier for crane in cranes if crane.carrier is not None]
    for key in ("heading_deg", "counterweight_kg", "outriggers"):
        if getattr(given, key) is not None and not carriers:
            raise config.error(
                f"crane.{key}",
                f"is given, but {machine.name} describes neither outriggers nor counterweights",
                hint='leave it out, or describe them in the file of a mobile crane: machine = "my-crane.toml"',
            )
    if not carriers:
        return cranes
    weights = sorted({one.counterweight_kg for one in carriers if one.counterweight_kg is not None})
    weight_kg = given.counterweight_kg if given.counterweight_kg is not None else max(weights, default=None)
    if given.counterweight_kg is not None and weight_kg not in weights:
        raise config.error(
            "crane.counterweight_kg",
            f"{machine.name} has no chart for {weight_kg:g} kg",
            available=[f"{one:g}" for one in weights],
            hint="give one that it has a chart for",
        )
    fitted = [crane for crane in cranes if crane.carrier is not None and crane.carrier.counterweight_kg == weight_kg]
    bases = {crane.carrier.outriggers for crane in fitted if crane.carrier is not None} - {None}
    widest = max(bases, key=lambda base: (base.area_m2, base.name), default=None)  # type: ignore[union-attr]
    name = given.outriggers or (None if widest is None else widest.name)
    if name not in {None if base is None else base.name for base in bases or {None}}:
        raise config.error(
            "crane.outriggers",
            f"{machine.name} has no chart for {name!r}" + ("" if weight_kg is None else f" with {weight_kg:g} kg"),
            available=sorted(base.name for base in bases if base is not None),
            hint="give one that it has a chart for",
        )
    if given.heading_deg is None and any(crane.carrier.sectors for crane in fitted if crane.carrier is not None):
        raise config.error(
            "crane.heading_deg",
            f"is missing: {machine.name} carries more in some sectors than in others",
            hint="say where the carrier's front points, in degrees from the x axis, counter-clockwise",
        )
    heading_rad = radians(given.heading_deg or 0.0)
    return [
        replace(crane, carrier=replace(crane.carrier, heading_rad=heading_rad))
        for crane in fitted
        if crane.carrier is not None and (crane.carrier.outriggers is None or crane.carrier.outriggers.name == name)
    ]


def _contradicted(config: SiteConfig, machine: Machine, entry: TowerCrane, found: Sequence[Override]) -> ConfigError:
    """Return the error about keys that differ from the machine without being declared."""
    keys = enumerated([one.key for one in found])
    what = f"{machine.name} with a jib of {entry.jib_length_m:g} m and {entry.falls} falls"
    lengths = ", ".join(f"{length:g}" for length in machine.lengths_m)
    return config.error(
        f"crane.{found[0].key}",
        f"contradicts the machine {what}: {'; '.join(map(str, found))}",
        hint=f"remove {keys} from [crane], name the machine that you mean, or move what differs on purpose to "
        f"[crane.override]; {machine.name} has jibs of {lengths} m",
    )


def _changed(config: SiteConfig, crane: TowerCrane, table: OverrideConfig, *, falls: int | None = None) -> TowerCrane:
    """Return a crane with the machine's keys that a table gives; ``falls`` selects one of several reevings."""
    if isinstance(table, CraneConfig):
        falls = table.falls
    values: dict[str, Any] = {}
    if crane.luffing is None and table.jib is not None:
        raise config.error("crane.jib", f"{crane.machine or crane.name} has no luffing jib")
    if crane.luffing is not None:
        for key in ("jib_length_m", "min_radius_m", "trolley"):
            if getattr(table, key) is not None:
                raise config.error(f"crane.{key}", "follows from the jib: leave it out")
    if (reeving := _reeving_of(table, falls)) is not None:
        crane = with_reeving(crane, reeving)
    elif table.chart is not None:
        values = {"chart": chart_of(table.chart)}
        values |= {} if falls is None else {"falls": falls}
    if crane.carrier is not None and (table.chart is not None or table.reeving is not None):
        # A chart of the site's own holds in every direction, as it is.
        values["carrier"] = replace(crane.carrier, sectors=(), rating="", deductions=())
    values |= table.model_dump(include=_MACHINE_KEYS, exclude_none=True)
    if table.auxiliary is not None:
        values["auxiliary"] = table.auxiliary.value()
    if crane.luffing is None:
        crane = replace(crane, **values, **_axes_of(table))
    else:
        crane = replace(crane, **values, **{key: axis for key, axis in _axes_of(table).items() if key == "slewing"})
        crane = with_jib(config, crane, table.jib, table.hoist)
    return crane


def _described(config: SiteConfig, given: CraneConfig) -> TowerCrane:
    """Return a crane that a table describes with every key."""
    values: dict[str, Any] = {"hook_block_kg": 0.0, "gears": (), "name": given.name or "crane"}
    values |= given.model_dump(include=_MACHINE_KEYS | {"falls"}, exclude_none=True) | _of_site(given) | _axes_of(given)
    if given.auxiliary is not None:
        values["auxiliary"] = given.auxiliary.value()
    if (chosen := _reeving_of(given, given.falls)) is not None:
        values["chart"] = chosen.chart
    elif given.chart is not None:
        values["chart"] = chart_of(given.chart)
    if given.kind in ("luffing", "mobile"):
        crane = _own_luffing_crane(config, given, values)
    else:
        missing = [key.name for key in fields(TowerCrane) if key.default is MISSING and key.name not in values]
        missing = [key for key in missing if key not in ("overrides", "machine")]
        if missing:
            raise _incomplete(config, given, missing[0])
        crane = TowerCrane(**values)
    if chosen is not None:
        crane = with_reeving(crane, chosen if crane.luffing is None else replace(chosen, trolley_rate_m_s=None))
    return crane


def _incomplete(config: SiteConfig, given: CraneConfig, missing: str) -> ConfigError:
    names = [machine.name for machine in machines_of("hammerhead")]
    near = difflib.get_close_matches(given.name or "", names, n=1)
    return config.error(
        f"crane.{missing}",
        f"is missing, and the catalogue has no machine {given.name!r}" if given.name else "is missing",
        available=names,
        hint=f'{"name" if near else "machine"} = "{near[0] if near else names[0]}" would fill in the missing keys; '
        f"machines of the catalogue: {', '.join(names)}",
    )


def _of_site(given: CraneConfig) -> dict[str, Any]:
    """Return the given keys that belong to the site, not to the machine."""
    values = given.model_dump(include=_SITE_KEYS, exclude_none=True)
    if given.base_m is not None:
        values["base_m"] = (given.base_m[0], given.base_m[1], given.base_m[2] if len(given.base_m) == 3 else 0.0)
    if given.working_range is not None:
        values["working_range"] = given.working_range.limiters()
    return values


def _axes_of(table: OverrideConfig) -> dict[str, Any]:
    return {key: axis.limits() for key in _AXES if (axis := getattr(table, key)) is not None}


def _reeving_of(table: OverrideConfig, falls: int | None) -> Reeving | None:
    """Return the reeving in use of a table: the one with the given falls, otherwise the one that carries most."""
    if table.reeving is None:
        return None
    one = next((r for r in table.reeving if r.falls == falls), None)
    return reeving_of(one or max(table.reeving, key=lambda r: (r.chart[0][1], r.falls)))


def _slow_zones(config: SiteConfig) -> tuple[SlowZone, ...]:
    return tuple(
        SlowZone(zone.polygon, _SLOW if zone.share is None else zone.share)
        for zone in config.zone
        if zone.kind == "slow"
    )


def crane_config(crane: TowerCrane | None) -> CraneConfig:
    """Return the complete site-file table of a crane, every key of it; see :func:`machine_config`."""
    if crane is None:
        return CraneConfig(kind="none")
    luffing, limiters = crane.luffing, crane.working_range
    keys = _SITE_KEYS | _MACHINE_KEYS | {"falls"}
    keys -= {"jib_height_m", "jib_length_m", "min_radius_m"} if luffing else set()
    return CraneConfig(
        kind=_kind(crane),
        name=crane.name,
        base_m=crane.base_m,
        jib=None if luffing is None else _jib_config(luffing),
        slewing=SlewingConfig.of(crane.slewing),
        trolley=None if luffing else TravelConfig.of(crane.trolley),
        hoist=TravelConfig.of(luffing.winch if luffing else crane.hoist),
        chart=tuple(zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True)),
        auxiliary=None if crane.auxiliary is None else AuxiliaryConfig.of(crane.auxiliary),
        working_range=None if limiters == UNLIMITED else WorkingRangeConfig(**asdict(limiters)),
        **{key: getattr(crane, key) for key in keys},
    )


def machine_config(crane: TowerCrane, own: Sequence[Machine] = ()) -> CraneConfig:
    """Return the site-file table of a machine as the catalogue has it: its name, jib and reeving, and its place.

    On level ground its place has no height: the crane stands on the ground.

    Args:
        crane: The crane.
        own: Machines with files of their own: the table names such a file.
    """
    base_m = crane.base_m if crane.base_m[2] else crane.base_m[:2]
    named = next((one.file[0] for one in own if one.file is not None and one.name == crane.name), crane.name)
    table = CraneConfig(kind=_kind(crane), machine=named, base_m=base_m, falls=crane.falls)
    if (jib := crane.luffing) is None:
        return table.model_copy(update={"jib_height_m": crane.jib_height_m, "jib_length_m": crane.jib_length_m})
    if (carrier := crane.carrier) is not None:
        base = None if carrier.outriggers is None else carrier.outriggers.name
        own_keys = {"counterweight_kg": carrier.counterweight_kg, "outriggers": base}
        table = table.model_copy(update=own_keys | {"heading_deg": round(degrees(carrier.heading_rad), 9)})
    lengths = LuffingConfig(length_m=jib.length_m)
    if crane.kind == "luffing":
        lengths = LuffingConfig(length_m=jib.length_m, pivot_height_m=jib.pivot_height_m, tail_low_m=jib.tail_low_m)
    return table.model_copy(update={"jib": lengths})


def _kind(crane: TowerCrane) -> Literal["hammerhead", "luffing", "mobile"]:
    if crane.luffing is None:
        return "hammerhead"
    return "mobile" if crane.kind == "mobile" else "luffing"
