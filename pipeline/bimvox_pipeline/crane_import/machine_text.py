"""Write a machine file: what the sheet says, what a person adds, and what a generic machine stands in for."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

from bimvox.crane.machine import Machine
from bimvox.errors import InputError
from bimvox.site.catalogue import machine_called, machines_of
from bimvox.site.config.machine_file import MachineConfig
from bimvox_pipeline.crane_import.sheet import Sheet

_NEEDED = {
    "mobile": ("mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist", "luffing", "reeving"),
    "luffing": ("mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist", "luffing", "reeving"),
    "hammerhead": (
        *("mast_size_m", "jib_height_m", "min_radius_m", "sling_m", "rigging_mass_kg"),
        *("slewing", "trolley", "hoist", "reeving"),
    ),
}
"""Keys that no table of loads has, by kind of crane."""
_ORDER = (
    *("name", "kind", "about", "rated_percent", "standard", "mast_size_m", "jib_height_m", "min_radius_m", "sling_m"),
    *("rigging_mass_kg", "max_wind_m_s", "hoist_kw", "slewing", "trolley", "hoist", "luffing", "masses", "deduction"),
    *("outriggers", "sector", "reeving", "stand"),
)
_TABLES = frozenset(("luffing", "masses"))
_LISTS = frozenset(("outriggers", "sector", "reeving", "stand"))


def nearest_machine(kind: str, most_kg: float) -> str:
    """Return the name of the generic machine of a kind whose largest capacity is nearest."""

    def off_kg(one: Machine) -> float:
        return abs(max(crane.chart.capacity_kg[0] for crane in one.cranes) - most_kg)

    return min(machines_of(kind), key=lambda one: (off_kg(one), one.name)).name


def values_of_machine(name: str, kind: str) -> dict[str, Any]:
    """Return the keys of a machine of the catalogue that can stand in for those of another.

    Raises:
        InputError: If the catalogue has no such generic machine, or it is of another kind.
    """
    machine = machine_called(name)
    if machine is None or machine.kind != kind or machine.sources:
        names = ", ".join(one.name for one in machines_of(kind))
        raise InputError(
            f"--like {name}: the catalogue has no such machine of kind {kind!r}", hint=f"give one of {names}"
        )
    text = (resources.files("bimvox") / "crane" / "catalogue" / f"{name}.toml").read_text(encoding="utf-8")
    given = tomllib.loads(text)
    # Of tables by boom, the reeving that carries most; of a jib, all of them.
    tackles = given["jib"][-1]["reeving"] if "jib" in given else [max(given["reeving"], key=lambda one: one["falls"])]
    usual = [
        {key: one[key] for key in ("falls", "hook_block_kg", "trolley_rate_m_s", "gears") if key in one}
        for one in tackles
    ]
    own = {key: given[key] for key in (*_NEEDED[kind], "max_wind_m_s") if key in given}
    return own | {"reeving": usual}


def stated_values(stated: Sequence[str]) -> dict[str, Any]:
    """Return the keys of ``KEY=VALUE``; the value is TOML, or a text.

    Raises:
        InputError: If one has no ``=``, or a key is not one of a machine file.
    """
    values: dict[str, Any] = {}
    for one in stated:
        key, mark, text = one.partition("=")
        key = key.strip()
        if not mark:
            raise InputError(f"--set {one!r} has no '='", hint="give KEY=VALUE: --set mast_size_m=7")
        root, _, inner = key.partition(".")
        if root not in MachineConfig.model_fields or root in ("jib", "table"):
            known = ", ".join(name for name in MachineConfig.model_fields if name not in ("jib", "table"))
            raise InputError(f"--set {key}: a machine file has no such key", hint=f"keys: {known}")
        value = _value_of(text.strip())
        if inner:
            values.setdefault(root, {})
            values[root][inner] = value
        else:
            values[root] = value
    return values


def _value_of(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def missing_keys(values: Mapping[str, Any], sheet: Sheet) -> dict[str, str]:
    """Return the keys that are missing, each with what it is."""
    missing = {}
    for key in ("name", "about"):
        if not values.get(key):
            missing[key] = described(key)
    for key in _NEEDED[values["kind"]]:
        if key not in values:
            missing[key] = described(key)
    for key, wanted in (
        ("outriggers", {table.outriggers for table in sheet.tables} - {None}),
        ("sector", {table.sector for table in sheet.tables} - {None}),
    ):
        known = {one.get("name") for one in values.get(key, ())}
        if absent := sorted(str(one) for one in wanted - known):
            missing[key] = f"{described(key)} The tables name {', '.join(map(repr, absent))}."
    return missing


_EXAMPLES = {
    "outriggers": '[{ name = "full", front_m = 3.6, rear_m = 3.2, left_m = 3.3, right_m = 3.3 }]',
    "sector": '[{ name = "over rear", deg = [150, 210] }]',
    "reeving": "[{ falls = 8, hook_block_kg = 450, most_kg = 32000 }]",
    "name": '"LTX 1060"',
    "about": '"data sheet of 2024, table 12"',
}


def example_of(key: str, like: Mapping[str, Any]) -> str:
    """Return an example of a key's value: TOML."""
    if key in _EXAMPLES:
        return _EXAMPLES[key]
    return toml_value(like[key]) if key in like else "..."


def described(key: str) -> str:
    """Return what a key of a machine file is."""
    return " ".join((MachineConfig.model_fields[key].description or "").replace("``", "").split())


def machine_text(values: Mapping[str, Any], sheet: Sheet, comments: Mapping[str, str], head: Sequence[str]) -> str:
    """Return the text of a machine file.

    Args:
        values: Its keys without tables.
        sheet: The tables.
        comments: Where a key comes from, if not from the sheet.
        head: Lines at its beginning.
    """
    lines = [f"# {line}".rstrip() for line in head] + [""]
    keys = [key for key in _ORDER if values.get(key) not in (None, [], ())]
    plain = (one for one in keys if one not in _TABLES | _LISTS)
    lines += [f"{key} = {toml_value(values[key])}{_comment(comments, key)}" for key in plain]
    for key in (one for one in keys if one in _TABLES):
        lines += ["", f"[{key}]{_comment(comments, key)}", *_pairs(values[key])]
    for key in (one for one in keys if one in _LISTS):
        for entry in values[key]:
            lines += ["", f"[[{key}]]{_comment(comments, key)}", *_pairs(entry)]
    for table in sheet.tables:
        lines += ["", "[[table]]", f"# {table.name}"] if table.line else ["", "[[table]]"]
        for key in ("counterweight_kg", "outriggers", "sector", "falls"):
            if (value := getattr(table, key)) is not None:
                lines.append(f"{key} = {toml_value(value)}")
        lines += [
            f"lengths_m = {toml_value(list(table.lengths_m))}",
            "rows = [  # radius in m, capacity in kg; 0: blank",
        ]
        lines += [f"  {toml_value([radius, *kg])}," for radius, kg in table.rows if any(kg)]
        lines.append("]")
    return "\n".join(lines) + "\n"


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {toml_value(value)}" for key, value in table.items()]


def _comment(comments: Mapping[str, str], key: str) -> str:
    return f"  # {comments[key]}" if key in comments else ""


def toml_value(value: Any) -> str:
    """Return a value as TOML in one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return str(int(value)) if float(value).is_integer() else repr(float(value))
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_value(one)}" for key, one in value.items()) + " }"
    return "[" + ", ".join(map(toml_value, value)) + "]"
