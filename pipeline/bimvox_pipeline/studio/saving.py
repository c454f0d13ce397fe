"""A set-up into a site file: only what it changes, with the file's comments and order kept."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from numpy.typing import NDArray
from pydantic import BaseModel
from tomlkit.items import AoT, Array, Table

from bimvox.bim.read import read_building
from bimvox.errors import BimvoxError, ConfigError, FileError
from bimvox.files import read_input, write_atomically, write_together
from bimvox.site.config.crane import CraneConfig, SetUpConfig
from bimvox.site.config.file import load_site_config
from bimvox.site.config.site_config import KindConfig, SiteConfig
from bimvox.site.config.template import site_toml
from bimvox.site.guess import complete_config, ground_why
from bimvox.site.start_guess import start_of
from bimvox_pipeline.studio.changes import changes_between, state_of_site
from bimvox_pipeline.studio.obstacles import file_of
from bimvox_pipeline.studio.opened import (
    SITE_SUFFIX,
    ChangedMeanwhileError,
    Opened,
    alone_in,
    said_of_parts,
    unchanged,
)
from bimvox_pipeline.studio.setup import Setup, origins_of

_SAME_M = 1e-4


def save(opened: Opened, wanted: Setup) -> tuple[Opened, list[str]]:
    """Write a set-up into its site file.

    Args:
        opened: The site.
        wanted: The set-up.

    Returns:
        The site as saved, and the keys that changed.

    Raises:
        ChangedMeanwhileError: If the file is not as it was opened.
        InputError: If the set-up is impossible.
        FileError: If it cannot be written.
    """
    site = opened.site
    text, changed, saved = as_text(opened, opened.with_setup(wanted), wanted, site)
    with alone_in(site.parent):
        if not unchanged(opened):
            raise ChangedMeanwhileError(site)
        write_atomically(site, text.encode(), inputs=[saved.given.model.path])
    return saved, changed


def save_variant(opened: Opened, wanted: Setup, target: Path) -> tuple[Opened, list[str]] | Path:
    """Write a set-up into a new site file, and the obstructions of the one that is open next to it.

    Args:
        opened: The site.
        wanted: The set-up.
        target: The new site file, in the folder of the one that was opened.

    Returns:
        The site as saved, and the keys that changed; the site file that holds this set-up already if there is one:
        then nothing is written.

    Raises:
        InputError: If the set-up is impossible.
        FileError: If one of the files exists or cannot be written.
    """
    text, changed, saved = as_text(opened, opened.with_setup(wanted), wanted, target)
    files = {target: text.encode()}
    with alone_in(target.parent):
        if (obstructions := file_of(opened.site)).exists():
            files[file_of(target)] = read_input(obstructions)
        for file in files:
            if os.path.lexists(file):
                raise FileError(file, "exists already and may hold edits", hint="choose another name")
        if (same := _same_as(saved.given, target)) is not None:
            return same
        write_together(files, inputs=[saved.given.model.path])
    return saved, changed


def _same_as(given: SiteConfig, target: Path) -> Path | None:
    """Return a site file in the folder of another that says the same of the same model; None if there is none."""
    wanted, model = state_of_site(given, ""), given.model.path.resolve()
    for file in sorted(target.parent.glob(f"*{SITE_SUFFIX}")):
        try:
            other = load_site_config(file)
        except BimvoxError:
            continue
        if other.model.path.resolve() == model and not changes_between(wanted, state_of_site(other, "")):
            return file
    return None


def as_text(opened: Opened, config: SiteConfig, wanted: Setup, site: Path) -> tuple[str, list[str], Opened]:
    """Return the text of a site file with a set-up, the keys that change, and the site as the text is read back.

    Args:
        opened: The site.
        config: Its values with the set-up.
        wanted: The set-up.
        site: The file that the text is for, in the folder of the one that was opened.

    Raises:
        InputError: If the text would be read as something else.
    """
    if opened.content is None:
        text, changed = _new_text(config, opened), ["everything"]
    else:
        text, changed = _edited(opened, config, wanted)
    return text, changed, _as_read(opened, text, site, wanted)


def _new_text(config: SiteConfig, opened: Opened) -> str:
    """Return a new site file, as ``bimvox init`` writes it."""
    ground, (_, start_why) = ground_why(config, opened.building), start_of(opened.building)
    return site_toml(config, kinds=opened.kinds, ground_why=ground, start_why=start_why, short=True)


def _as_read(opened: Opened, text: str, site: Path, wanted: Setup) -> Opened:
    """Return a site as the ordinary reader finds it in a text that is to be saved.

    Its model is read again if the text says something else of what its parts are.

    Raises:
        InputError: If that is not what was wanted.
    """
    given = load_site_config(site, text.encode())
    is_same_model = said_of_parts(given) == said_of_parts(opened.given)
    building = opened.building if is_same_model else read_building(given.model.path, given.read_options)
    saved = Opened(complete_config(given, building), building, site, text.encode(), given)
    found = saved.setup.model_dump()
    for key, value in wanted.model_dump().items():
        if key == "cranes":
            # What was left open is chosen; a new machine gets its height from the site.
            pairs = zip(value, found[key], strict=True)
            same = all(
                _is_same(own["base_m"], there["base_m"]) and own["machine"] == there["machine"] for own, there in pairs
            )
        elif key in ("ground_m", "kinds", "calendar"):
            same = value is None or _is_same(value, found[key])
        elif key == "truckload_kg":
            same = value in (None, saved.config.rules.truckload_kg)
        elif key == "part_kinds":
            same = all(found[key].get(name) == kind for name, kind in value.items())
        elif key == "means":
            own = opened.setup.means
            changed = {name: means for name, means in value.items() if own.get(name) != means}
            same = all(found[key].get(name) == means for name, means in changed.items())
        else:
            same = _is_same(value, found[key])
        if not same:
            raise ConfigError(
                site, key, "would not be read as it was set; nothing was saved", hint="this is a fault of bimvox"
            )
    return saved


def _is_same(one: Any, other: Any) -> bool:
    """Return whether two values are the same, lengths to the millimetre."""
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(_is_same(value, other[key]) for key, value in one.items())
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(_is_same(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) < 1e-3
    return bool(one == other) or (not one and not other)


def _edited(opened: Opened, config: SiteConfig, wanted: Setup) -> tuple[str, list[str]]:
    """Return the text of the site file with what changed, and the keys of it."""
    assert opened.content is not None
    document = tomlkit.parse(opened.content.decode("utf-8-sig"))
    before, changed = opened.setup, []
    to_file = _ToFile(opened)
    given = opened.given
    if wanted != before:
        # What the file leaves to be chosen depends on the rest: from now on it says what people saw.
        areas = document.setdefault("areas", tomlkit.table())
        for name in ("construction", "yard", "access"):
            own = getattr(config.areas, name)
            if getattr(wanted, name) == getattr(before, name) and (getattr(given.areas, name) is not None or not own):
                continue
            if not own:
                areas.remove(name)
            else:
                areas[name] = _array(
                    to_file.polygon(own) if name == "construction" else [to_file.polygon(one) for one in own]
                )
            changed.append(f"areas.{name}")
    if wanted.ground_m not in (None, before.ground_m):
        document.setdefault("model", tomlkit.table())["ground_m"] = _tidy(wanted.ground_m)
        changed.append("model.ground_m")
    if wanted.calendar not in (None, before.calendar):
        changed += _calendar(document, before, wanted)
    if wanted.truckload_kg is not None:
        document.setdefault("rules", tomlkit.table())["truckload_kg"] = _tidy(wanted.truckload_kg)
        changed.append("rules.truckload_kg")
    if wanted.cranes != before.cranes or (wanted != before and given.crane is None and config.cranes):
        changed += _cranes(document, opened, config, wanted, to_file)
    if wanted.zones != before.zones:
        document.pop("zone", None)
        if config.zone:
            document["zone"] = _tables(
                [_plain(zone) | {"polygon": to_file.polygon(zone.polygon)} for zone in config.zone]
            )
        changed.append("zone")
    if wanted.kinds not in (None, before.kinds):
        _kinds(document, config)
        changed.append("model.kinds")
    if config.component != opened.config.component:
        changed += _components(document, opened.config, config)
    return tomlkit.dumps(document), changed


def _calendar(document: Any, before: Setup, wanted: Setup) -> list[str]:
    """Write what differs between two calendars; return the keys."""
    assert wanted.calendar is not None
    was = {} if before.calendar is None else before.calendar.model_dump()
    differ = {key: value for key, value in wanted.calendar.model_dump().items() if value != was.get(key)}
    table = document.setdefault("calendar", tomlkit.table())
    for key, value in differ.items():
        if value is None:
            table.remove(key)
        else:
            table[key] = _item(value)
    return [f"calendar.{key}" for key in differ]


class _ToFile:
    """Turns points of the site's frame into those of the file: of the site, or of the map."""

    def __init__(self, opened: Opened) -> None:
        self._matrix: NDArray[np.float64] | None = opened.to_map if opened.given.coordinates == "map" else None

    def point(self, at: Sequence[float]) -> list[float]:
        """Return a point with as many coordinates."""
        if self._matrix is None:
            return [_tidy(value) for value in at]
        full = self._matrix @ np.array([*at[:2], at[2] if len(at) > 2 else 0.0, 1.0])
        return [_tidy(float(value)) for value in full[: len(at)]]

    def polygon(self, corners: Sequence[Sequence[float]]) -> list[list[float]]:
        """Return the corners."""
        return [self.point(corner) for corner in corners]


def _cranes(document: Any, opened: Opened, config: SiteConfig, wanted: Setup, to_file: _ToFile) -> list[str]:
    """Write the tables of the cranes that differ; return their keys."""
    if config.moves or opened.config.moves:
        return _moving(document, opened, config, to_file)
    origins = origins_of(opened.setup.cranes, wanted.cranes)
    if not opened.given.cranes:
        origins = [None] * len(origins)
    own = {origin for origin in origins if origin is not None}
    several = isinstance(config.crane, tuple)
    tables = document.get("crane")
    changed = [f"crane[{n}]" for n in range(len(opened.given.cranes)) if n not in own]
    if several and not isinstance(tables, AoT):
        document["crane"] = tomlkit.aot()
        if own:
            document["crane"].append(tables if isinstance(tables, Table) else _table(tables.unwrap()))
        tables = document["crane"]
    for number in sorted(set(range(len(opened.given.cranes))) - own, reverse=True) if several else ():
        if number < len(tables):
            del tables[number]
    for number, (crane, origin) in enumerate(zip(config.cranes, origins, strict=True)):
        key = f"crane[{number}]" if several else "crane"
        if origin is None:
            table = _table(_crane_values(crane, to_file))
            if several:
                tables.insert(number, table)
            else:
                document["crane"] = table
            changed.append(key)
        elif crane != opened.config.cranes[origin]:
            table = tables[number] if several else document["crane"]
            changed += [f"{key}.{name}" for name in _crane(table, opened.config.cranes[origin], crane, to_file)]
    return changed


def _moving(document: Any, opened: Opened, config: SiteConfig, to_file: _ToFile) -> list[str]:
    """Write the crane's table if it moves or moved: of set-ups, what differs; otherwise all of it."""
    was, crane = opened.config.crane, config.crane
    assert isinstance(was, CraneConfig)
    assert isinstance(crane, CraneConfig)
    alike = was.model_copy(update={"setup": crane.setup}) == crane and len(was.setup) == len(crane.setup)
    if not alike or not crane.setup:
        document["crane"] = _table(_crane_values(crane, to_file))
        return ["crane"]
    changed = []
    for number, (old, new) in enumerate(zip(was.setup, crane.setup, strict=True)):
        values, before = _set_up_values(new, to_file), _set_up_values(old, to_file)
        for key in (key for key in values if values[key] != before.get(key)):
            document["crane"]["setup"][number][key] = _item(values[key])
            changed.append(f"crane.setup[{number}].{key}")
    return changed


def _set_up_values(one: SetUpConfig, to_file: _ToFile) -> dict[str, Any]:
    return _plain(one) | {"base_m": to_file.point(one.base_m)}


def _crane_values(crane: CraneConfig, to_file: _ToFile) -> dict[str, Any]:
    """Return the values of a crane's table, its place as in the file."""
    values = _plain(crane) | ({} if crane.base_m is None else {"base_m": to_file.point(crane.base_m)})
    setup = [_set_up_values(one, to_file) for one in crane.setup]
    return {key: value for key, value in values.items() if key != "setup"} | ({"setup": setup} if setup else {})


def _crane(table: Any, was: CraneConfig, crane: CraneConfig, to_file: _ToFile) -> list[str]:
    """Write what differs between two tables of a crane; return the keys."""
    values, before = _crane_values(crane, to_file), _plain(was)
    has_machine = crane.machine is not None or was.machine is not None
    if has_machine and (crane.machine or crane.name) != (was.machine or was.name):
        for name in set(table) - set(values):
            table.remove(name)
        before = {}
    found = [
        name
        for name in CraneConfig.model_fields
        if name in values and (name not in before or _differs(values[name], before[name], name, to_file))
    ]
    for name in found:
        _set(table, name, values[name])
    return found


def _differs(value: Any, before: Any, name: str, to_file: _ToFile) -> bool:
    return bool(value != (to_file.point(before) if name == "base_m" else before))


def _set(table: Any, name: str, value: Any) -> None:
    """Set a value; of a table, only what differs."""
    if isinstance(value, Mapping) and isinstance(table.get(name), Table):
        for key, own in value.items():
            if table[name].get(key) != own:
                table[name][key] = _item(own)
        return
    table[name] = _item(value)


def _kinds(document: Any, config: SiteConfig) -> None:
    """Write what the types of parts are, among the comments that are there; a file of kinds stays."""
    wanted = {one.select: _plain(one) for one in config.model.kinds if isinstance(one, KindConfig)}
    model = document["model"]
    if not isinstance(model.get("kinds"), Array):
        given = model.get("kinds")
        model["kinds"] = tomlkit.array()
        if given is not None:
            model["kinds"].append(str(given))
    entries = model["kinds"]
    for number in reversed(range(len(entries))):
        if isinstance(entries[number], Mapping) and entries[number].get("select") not in wanted:
            del entries[number]
    there: dict[Any, Any] = {one.get("select"): one for one in entries if isinstance(one, Mapping)}
    for select, values in wanted.items():
        if select in there:
            for key in ("kind", "means"):
                if key in values:
                    there[select][key] = values[key]
                else:
                    there[select].pop(key, None)
            continue
        entry = tomlkit.inline_table()
        entry["select"] = tomlkit.string(select, literal="'" not in select and select.isprintable())
        entry.update({key: value for key, value in values.items() if key != "select"})
        entries.add_line(entry, indent="  ")


def _components(document: Any, before: SiteConfig, config: SiteConfig) -> list[str]:
    """Write how parts get to their places; return the keys."""
    changed = []
    known = {one.global_id: one for one in before.component}
    tables = document.get("component")
    if tables is None:
        tables = document["component"] = tomlkit.aot()
    for number, one in enumerate(config.component):
        if one.global_id in known and known[one.global_id] == one:
            continue
        if number >= len(tables):
            own = {key: value for key in ("kind", "means", "why") if (value := getattr(one, key)) is not None}
            tables.append(_table({"global_id": one.global_id, **own}))
            changed += [f"component[{number}].{key}" for key in own]
            continue
        for key in ("kind", "means", "why", "crane"):
            value = getattr(one, key)
            if value == getattr(known[one.global_id], key):
                continue
            if value is None:
                tables[number].remove(key)
            else:
                tables[number][key] = value
            changed.append(f"component[{number}].{key}")
    return changed


def _plain(table: BaseModel) -> dict[str, Any]:
    """Return the values of a table that are given, as plain values."""
    return {key: _tidied(value) for key, value in table.model_dump(exclude_none=True).items()}


def _tidied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _tidied(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [_tidied(own) for own in value]
    return _tidy(value) if isinstance(value, float) else value


def _tidy(value: float) -> float:
    """Return a number of metres to the tenth of a millimetre, whole ones without a point."""
    rounded = round(float(value) / _SAME_M) * _SAME_M
    rounded = round(rounded, 4) + 0.0
    return int(rounded) if rounded == int(rounded) else rounded


def _item(value: Any) -> Any:
    if isinstance(value, Mapping):
        return _table(value)
    if isinstance(value, list | tuple) and value and isinstance(value[0], Mapping):
        return _tables(value)
    if isinstance(value, list | tuple):
        return _array(value)
    return value


def _array(values: Sequence[Any]) -> Array:
    made = tomlkit.array()
    made.extend([_array(one) if isinstance(one, list | tuple) else one for one in values])
    return made


def _table(values: Mapping[str, Any]) -> Table:
    made = tomlkit.table()
    for key, value in values.items():
        made[key] = _item(value)
    return made


def _tables(values: Sequence[Mapping[str, Any]]) -> AoT:
    made = tomlkit.aot()
    for one in values:
        made.append(_table(one))
    return made
