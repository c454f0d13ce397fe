"""The set-up of a site as the web page has it, and its way into a site file's values and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import date
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bimvox.bim.kinds.kind import Kind
from bimvox.crane.machine import carries_most
from bimvox.crane.reach import standing
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.site.catalogue import machines_called, own_machines
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.crane import CraneConfig, LuffingConfig, SetUpConfig
from bimvox.site.config.site_config import ComponentConfig, KindConfig, Polygon, SiteConfig, ZoneConfig
from bimvox.site.config.validation import Number, first_finding
from bimvox.site.machine import cranes_of, machine_config

Plane = tuple[Number, Number]
HookHeight = Callable[[TowerCrane], float]
_MOST = 100_000


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class CraneSetup(_Part):
    """A crane, or one set-up of a crane that moves: its machine, and where and how it stands."""

    name: str | None = None
    machine: str | None = None
    base_m: Plane
    height_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    jib_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    falls: Annotated[int, Field(ge=1, le=100)] | None = None


class _ZoneSetup(_Part):
    """A zone, as in the site file."""

    name: str | None = None
    kind: str
    polygon: Polygon
    share: float | None = None
    lowest_hook_m: float | None = None
    highest_hook_m: float | None = None


class _KindSetup(_Part):
    """What the parts of a type are, and how they get to their places."""

    select: str
    kind: str | None = None
    means: str | None = None


class _CalendarSetup(_Part):
    """When work begins, and on which days and in which shifts it is done."""

    start: date | None = None
    days: Annotated[tuple[str, ...], Field(max_length=7)] = ()
    shifts: Annotated[tuple[str, ...], Field(max_length=24)] = ()


class Setup(_Part):
    """What people set by hand: cranes, areas, zones, truckload, ground, calendar, what parts are, how they are set."""

    cranes: tuple[CraneSetup, ...] = ()
    yard: tuple[Polygon, ...] = ()
    access: tuple[Polygon, ...] = ()
    construction: Polygon | tuple[()] = ()
    zones: Annotated[tuple[_ZoneSetup, ...], Field(max_length=1000)] = ()
    means: Annotated[dict[str, str], Field(max_length=_MOST)] = {}  # pydantic copies it
    kinds: Annotated[tuple[_KindSetup, ...], Field(max_length=1000)] | None = None
    """Of types; those in files of kinds stay as they are. None: the site file's."""
    part_kinds: Annotated[dict[str, str], Field(max_length=_MOST)] = {}
    """Of parts for which the site file says it, or is to say it."""
    truckload_kg: Annotated[float, Field(ge=0.0)] | None = None
    """None: the site file's."""
    ground_m: Annotated[Number, Field(ge=-1e6, le=1e6)] | None = None
    """Height of the ground in the model; None: the site file's."""
    calendar: _CalendarSetup | None = None
    """None: the site file's."""


def impossible(error: ValidationError, schema: type[BaseModel], what: str) -> InputError:
    """Return the error that says what the first wrong value of the page's JSON is."""
    found = first_finding(error, schema)
    return InputError(f"{what}: {f'{found.key}: ' if found.key else ''}{found.message}", hint=found.hint)


def read_setup(values: object) -> Setup:
    """Return a set-up from the page's JSON.

    Raises:
        InputError: Names the first value that is impossible.
    """
    try:
        return Setup.model_validate(values)
    except ValidationError as error:
        raise impossible(error, Setup, "the set-up") from None


def setup_of(
    config: SiteConfig, cranes: tuple[TowerCrane, ...], means: Mapping[str, str], part_kinds: Mapping[str, str]
) -> dict[str, Any]:
    """Return the set-up of a complete site file in the site's frame, as JSON.

    Args:
        config: The site file.
        cranes: Its cranes.
        means: How each part gets to its place, by id.
        part_kinds: What the parts are of which the site file says it one by one, by id.
    """
    names = [one.name or "" for one in set_ups_of(config) or config.cranes]
    return {
        "cranes": [
            _crane(name, given, crane) for name, given, crane in zip(names, config.cranes, cranes, strict=False)
        ],
        "yard": [_points(polygon) for polygon in config.areas.yard or ()],
        "access": [_points(polygon) for polygon in config.areas.access or ()],
        "construction": _points(config.areas.construction or ()),
        "zones": [
            {
                key: _points(value) if key == "polygon" else value
                for key, value in zone.model_dump().items()
                if value is not None
            }
            for zone in config.zone
        ],
        "means": dict(means),
        "ground_m": config.model.ground_m,
        "calendar": config.calendar.model_dump(mode="json", include={"start", "days", "shifts"}),
        "kinds": [one.model_dump() for one in config.model.kinds if isinstance(one, KindConfig)],
        "part_kinds": dict(part_kinds),
    }


def set_ups_of(config: SiteConfig) -> tuple[SetUpConfig, ...]:
    """Return the set-ups of a crane that moves; empty if the cranes stay."""
    return config.crane.setup if isinstance(config.crane, CraneConfig) else ()


def _crane(name: str, given: CraneConfig, crane: TowerCrane) -> dict[str, Any]:
    jib = crane.luffing
    height_m = crane.jib_height_m if jib is None else jib.pivot_height_m if crane.kind == "luffing" else None
    return {
        "name": name,
        "machine": given.machine or crane.machine or crane.name,
        "base_m": [float(value) for value in crane.base_m[:2]],
        "height_m": height_m,
        "jib_m": crane.jib_length_m if jib is None else jib.length_m,
        "falls": crane.falls,
    }


def _points(polygon: object) -> list[list[float]]:
    return [[float(x), float(y)] for x, y in polygon]  # type: ignore[attr-defined]


def with_setup(
    config: SiteConfig, opened: Setup, wanted: Setup, hook_height_m: HookHeight, listed: Mapping[str, str]
) -> SiteConfig:
    """Return a complete site file with what differs between two set-ups.

    Args:
        config: The site file, complete, in the site's frame.
        opened: Its own set-up.
        wanted: What it becomes.
        hook_height_m: Returns the height that the hook of a new machine must reach.
        listed: The ids under which its ``[[component]]`` tables list parts, by element id.

    Raises:
        InputError: If the set-up has no yard, two cranes of the same name, or values that a site file may not have.
    """
    update: dict[str, Any] = {}
    areas = {
        name: getattr(wanted, name) or None
        for name in ("yard", "access", "construction")
        if getattr(wanted, name) != getattr(opened, name)
    }
    if areas:
        if "yard" in areas and areas["yard"] is None:
            raise InputError("there is no yard", hint="a site needs at least one yard area")
        update["areas"] = config.areas.model_copy(update=areas)
    if wanted.ground_m not in (None, opened.ground_m):
        update["model"] = config.model.model_copy(update={"ground_m": wanted.ground_m})
    if wanted.truckload_kg is not None:
        update["rules"] = config.rules.model_copy(update={"truckload_kg": wanted.truckload_kg})
    if wanted.calendar not in (None, opened.calendar):
        update["calendar"] = _calendar(config.calendar, wanted.calendar)
    if wanted.zones != opened.zones:
        update["zone"] = tuple(_zone(n, zone) for n, zone in enumerate(wanted.zones, start=1))
    if wanted.cranes != opened.cranes and isinstance(config.crane, CraneConfig) and config.moves:
        update["crane"] = _elsewhere(config.crane, opened.cranes, wanted.cranes)
    elif wanted.cranes != opened.cranes:
        cranes = _cranes(config, opened.cranes, wanted.cranes, hook_height_m)
        update["crane"] = cranes if isinstance(config.crane, tuple) or len(cranes) > 1 else cranes[0]
    if wanted.kinds is not None and wanted.kinds != opened.kinds:
        files = [one for one in config.model.kinds if isinstance(one, str)]
        tables = (_kind(n, one) for n, one in enumerate(wanted.kinds, start=1))
        update["model"] = update.get("model", config.model).model_copy(update={"kinds": (*files, *tables)})
    changed_means = {
        listed.get(name, name): means for name, means in wanted.means.items() if opened.means.get(name, means) != means
    }
    if changed_means:
        update["component"] = _with_means(config.component, changed_means)
    changed_kinds = {
        listed.get(name, name): kind for name, kind in wanted.part_kinds.items() if opened.part_kinds.get(name) != kind
    }
    if changed_kinds:
        update["component"] = _with_kinds(update.get("component", config.component), changed_kinds)
    if gone := {crane.name for crane in opened.cranes} - {crane.name for crane in wanted.cranes}:
        update["component"] = tuple(
            one.model_copy(update={"crane": None}) if one.crane in gone else one
            for one in update.get("component", config.component)
        )
    made = config.model_copy(update=update)
    made._file, made._machine_files = config._file, config._machine_files
    cranes_of(made)
    return made


def _kind(number: int, wanted: _KindSetup) -> KindConfig:
    try:
        return KindConfig.model_validate(wanted.model_dump(exclude_none=True))
    except ValidationError as error:
        raise impossible(error, KindConfig, f"type {number}") from None


def _calendar(own: CalendarConfig, wanted: _CalendarSetup) -> CalendarConfig:
    try:
        return CalendarConfig.model_validate(own.model_dump() | wanted.model_dump())
    except ValidationError as error:
        raise impossible(error, CalendarConfig, "the calendar") from None


def _zone(number: int, zone: _ZoneSetup) -> ZoneConfig:
    values = {key: value for key, value in zone.model_dump().items() if value is not None and value != ""}
    try:
        return ZoneConfig.model_validate(values)
    except ValidationError as error:
        raise impossible(error, ZoneConfig, f"zone {zone.name or number}") from None


def origins_of(opened: Sequence[CraneSetup], wanted: Sequence[CraneSetup]) -> list[int | None]:
    """Return which crane of a set-up each crane of another one was: by its name; None for a new one.

    Cranes without a known name take the place of those that had no name, or of the others if there are as many.
    """
    names = [crane.name for crane in opened]
    found = [names.index(crane.name) if crane.name in names else None for crane in wanted]
    left = [n for n, name in enumerate(names) if n not in found and (not name or len(opened) == len(wanted))]
    return [left.pop(0) if origin is None and left else origin for origin in found]


def _elsewhere(crane: CraneConfig, opened: Sequence[CraneSetup], wanted: Sequence[CraneSetup]) -> CraneConfig:
    """Return the table of a crane that moves, its set-ups in other places and with other booms."""
    free = {"base_m": None, "jib_m": None}
    if [one.model_copy(update=free) for one in wanted] != [one.model_copy(update=free) for one in opened]:
        raise InputError(
            "only places and booms of set-ups are changed here",
            hint="edit [crane] and [[crane.setup]] in the site file",
        )
    found = []
    for own, old, new in zip(crane.setup, opened, wanted, strict=True):
        boom = {"boom_m": new.jib_m} if new.jib_m not in (old.jib_m, None) else {}
        found.append(own.model_copy(update={"base_m": (*new.base_m, *own.base_m[2:]), **boom}))
    return crane.model_copy(update={"setup": tuple(found)})


def _cranes(
    config: SiteConfig, opened: Sequence[CraneSetup], wanted: Sequence[CraneSetup], hook_height_m: HookHeight
) -> tuple[CraneConfig, ...]:
    """Return the tables of the cranes of a set-up."""
    if not wanted:
        raise InputError("there is no crane", hint="a set-up that has a crane keeps one")
    names = [crane.name for crane in wanted]
    if len(wanted) > 1:
        for name in names:
            if not name or names.count(name) > 1:
                said = f"two cranes are called {name!r}" if name else "a crane has no name"
                raise InputError(said, hint="each of several cranes needs its own name")
        if config.rules.heading == "with_jib":
            raise InputError(
                "the loads turn with the jib, which is for one crane", hint='write heading = "kept" under [rules] first'
            )
    tables = []
    for new, origin in zip(wanted, origins_of(opened, wanted), strict=True):
        if origin is None:
            blank = CraneSetup(name=new.name, base_m=new.base_m)
            table = _other_machine(config, CraneConfig(), blank, new, hook_height_m)
        else:
            old, own = opened[origin], config.cranes[origin]
            table = own if new == old else _changed(config, own, old, new, hook_height_m)
        if (len(wanted) > 1 and table.name is None) or (origin is not None and new.name != opened[origin].name):
            table = table.model_copy(update={"name": new.name or None})
        tables.append(table)
    return tuple(tables)


def _changed(
    config: SiteConfig, own: CraneConfig, old: CraneSetup, new: CraneSetup, hook_height_m: HookHeight
) -> CraneConfig:
    """Return the table of a crane with what differs between two set-ups."""
    if new.machine != old.machine and new.machine:
        return _other_machine(config, own, old, new, hook_height_m)
    update: dict[str, Any] = {}
    if new.base_m != old.base_m:
        height = own.base_m[2:] if own.base_m is not None else ()
        update["base_m"] = (*new.base_m, *height)
    is_hammerhead = own.jib is None and own.kind not in ("luffing", "mobile")
    if new.falls not in (old.falls, None):
        update["falls"] = new.falls
    if new.jib_m not in (old.jib_m, None):
        if is_hammerhead:
            update["jib_length_m"] = new.jib_m
        else:
            update["jib"] = (own.jib or LuffingConfig()).model_copy(update={"length_m": new.jib_m})
    if new.height_m not in (old.height_m, None):
        if is_hammerhead:
            update["jib_height_m"] = new.height_m
        else:
            jib = update.get("jib") or own.jib or LuffingConfig()
            shift_m = new.height_m - (old.height_m or new.height_m)
            tail = {} if jib.tail_low_m is None else {"tail_low_m": jib.tail_low_m + shift_m}
            update["jib"] = jib.model_copy(update={"pivot_height_m": new.height_m, **tail})
    return own.model_copy(update=update)


def _other_machine(
    config: SiteConfig, own: CraneConfig, old: CraneSetup, new: CraneSetup, hook_height_m: HookHeight
) -> CraneConfig:
    """Return the table of another machine at the same place, on a mast as ``init`` chooses it.

    The machine is one of the catalogue, or of a file that the site file names.
    """
    files = own_machines(config)
    named = [one for one in files if one.file is not None and new.machine in (one.name, one.file[0])]
    machine = (named or machines_called(str(new.machine)))[0]
    lengths = [length for length in machine.lengths_m if new.jib_m is None or abs(length - new.jib_m) < 1e-3]
    if not lengths:
        hint = f"it has {', '.join(f'{length:g}' for length in machine.lengths_m)} m"
        raise InputError(f"{machine.name} has no jib of {new.jib_m:g} m", hint=hint)
    able = [crane for crane in machine.with_jib(max(lengths)) if new.falls in (None, crane.falls)]
    if not able:
        falls = sorted({crane.falls for crane in machine.cranes})
        raise InputError(
            f"{machine.name} has no reeving of {new.falls} falls", hint=f"it has {' and '.join(map(str, falls))}"
        )
    crane = carries_most(able)
    crane = standing(crane, hook_height_m(crane))
    if crane.luffing is None and new.height_m not in (old.height_m, None):
        crane = replace(crane, jib_height_m=float(new.height_m or 0.0))
    foot_m = own.base_m[2] if own.base_m is not None and len(own.base_m) == 3 else 0.0
    table = machine_config(replace(crane, base_m=(*new.base_m, foot_m)), files)
    return table.model_copy(update={"name": own.name if own.name != (own.machine or old.machine) else None})


def _with_means(entries: tuple[ComponentConfig, ...], changed: Mapping[str, str]) -> tuple[ComponentConfig, ...]:
    """Return the tables of parts with the means of some of them."""
    for means in set(changed.values()) - {"crane", "in_situ", "built", "by_hand"}:
        raise InputError(f"{means!r} is no way to set a part", hint="crane, in_situ, built or by_hand")
    return _with_key("means", entries, changed)


def _with_kinds(entries: tuple[ComponentConfig, ...], changed: Mapping[str, str]) -> tuple[ComponentConfig, ...]:
    """Return the tables of parts with the kinds of some of them."""
    for kind in set(changed.values()) - set(Kind):
        raise InputError(f"{kind!r} is no kind of part", hint=", ".join(Kind))
    return _with_key("kind", entries, changed)


def _with_key(
    key: str, entries: tuple[ComponentConfig, ...], changed: Mapping[str, str]
) -> tuple[ComponentConfig, ...]:
    left = dict(changed)
    found = []
    for one in entries:
        value = left.pop(one.global_id, getattr(one, key))
        why = one.why if one.means == value or key != "means" else None  # a person says otherwise
        found.append(one.model_copy(update={key: value, "why": why}))
    new = (ComponentConfig.model_validate({"global_id": name, key: value}) for name, value in left.items())
    return (*found, *new)
