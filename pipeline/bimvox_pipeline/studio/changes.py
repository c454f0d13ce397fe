"""What differs between two states of a site, in words: of a plan and the files now, or of two variants."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from bimvox.site.config.site_config import SiteConfig
from bimvox.site.site import Blocker

_DIGITS = 3
"""Places are compared to the millimetre: a file in map coordinates gives them back to a tenth of it."""
_MOST_KEYS = 3
_LONG = 24
_AREAS = {"yard": "the yard", "access": "the access", "construction": "the construction area"}
_PARTS = "how parts are set"


@dataclass(frozen=True, slots=True)
class SiteState:
    """All that a plan follows from, as plain values that can be compared.

    Attributes:
        tables: The tables of the complete site file by name, lengths to the millimetre.
        files: Hash of each file that they follow from, by what people call it.
    """

    tables: Mapping[str, Any]
    files: Mapping[str, str]


def state_of_site(config: SiteConfig, model_sha256: str) -> SiteState:
    """Return the state of a site: of its site file, complete, and of the hash of its model."""
    tables = config.model_dump(mode="json", exclude={"name": True, "model": {"path"}})
    tables["areas"] = _rounded(tables["areas"])
    for zone in tables["zone"]:
        zone["polygon"] = _rounded(zone["polygon"])
    cranes = tables["crane"] if isinstance(tables["crane"], list) else [tables["crane"]]
    tables["crane"] = [_placed(crane) for crane in cranes if crane is not None]
    files = {"the model": model_sha256, **{f"file {name}": _hash(data) for name, data in config.machine_files.items()}}
    if config.programme_file is not None:
        files["the programme"] = _hash(config.programme_file)
    return SiteState(tables, files)


def changes_between(was: SiteState, now: SiteState) -> list[str]:
    """Return what differs from one state to another, each in words; nothing if they are equal."""
    files = sorted(was.files.keys() | now.files.keys())
    found = [name for name in files if was.files.get(name) != now.files.get(name)]
    for name in dict.fromkeys([*was.tables, *now.tables]):
        one, other = was.tables.get(name), now.tables.get(name)
        if one != other:
            found += _TABLES.get(name, _of_table)(name, one, other)
    return list(dict.fromkeys(found))


def changes_of_obstructions(was: Iterable[Blocker], now: Iterable[Blocker]) -> list[str]:
    """Return what differs between the obstructions on a site, each in words; their cells count, not their shapes."""
    one, other = ({blocker.id: blocker.cells.tobytes() for blocker in blockers} for blockers in (was, now))
    return [
        f"obstruction {name} ({'removed' if name not in other else 'changed' if name in one else 'new'})"
        for name in sorted(one.keys() | other.keys())
        if one.get(name) != other.get(name)
    ]


def _of_table(name: str, was: Any, now: Any) -> list[str]:
    """Return a table with the keys that differ, and their values if these are short."""
    keys = _keys(was, now)
    return [f"[{name}] {', '.join(keys)}" if keys else f"[{name}]"]


def _placed(crane: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a crane, or of one of its set-ups, with its place to the millimetre."""
    more = {"setup": [_placed(one) for one in crane["setup"]]} if "setup" in crane else {}
    return crane | {"base_m": _rounded(crane["base_m"])} | more


def _of_cranes(_: str, was: list[dict[str, Any]], now: list[dict[str, Any]]) -> list[str]:
    several = len(was) > 1 or len(now) > 1
    before, after = ({crane.get("name") or f"{n}": crane for n, crane in enumerate(cranes, 1)} for cranes in (was, now))
    if not several:
        pairs = [("the crane", was[0] if was else None, now[0] if now else None)]
    else:
        names = dict.fromkeys([*before, *after])
        pairs = [(f"crane {name}", before.get(name), after.get(name)) for name in names]
    found = []
    for words, one, other in pairs:
        if one is None or other is None:
            found.append(f"{words} ({'new' if one is None else 'removed'})")
        elif one != other:
            found.append(f"{words} ({', '.join(_of_crane(one, other))})")
    return found


def _of_crane(was: dict[str, Any], now: dict[str, Any]) -> list[str]:
    found = []
    if was["base_m"] and now["base_m"] and was["base_m"] != now["base_m"]:
        found.append(f"moved {math.dist(was['base_m'][:2], now['base_m'][:2]):.2f} m")
    machines = [crane.get("machine") or crane.get("name") for crane in (was, now)]
    if machines[0] != machines[1]:
        return [*found, f"{machines[1]}, was {machines[0]}"]
    places = [{one["name"]: one for one in crane.get("setup", ())} for crane in (was, now)]
    for name in dict.fromkeys([*places[0], *places[1]]):
        one, other = (place.get(name) for place in places)
        if one is None or other is None:
            found.append(f"set-up {name} {'new' if one is None else 'removed'}")
        elif one != other:
            found += [f"set-up {name} {words}" for words in _of_crane(one, other)]
    return [*found, *_keys(was, now, leave=("base_m", "setup"))]


def _of_areas(_: str, was: dict[str, Any], now: dict[str, Any]) -> list[str]:
    return [_AREAS.get(key, f"[areas] {key}") for key in now if was.get(key) != now[key]]


def _of_zones(_: str, was: list[Any], now: list[Any]) -> list[str]:
    named = [f"zone {zone['name'] or 'without a name'}" for zone in [*now, *was] if (zone in now) != (zone in was)]
    return named or ["the order of the zones"]


def _of_parts(_: str, was: Any, now: Any) -> list[str]:
    if not isinstance(now, list):
        return [_PARTS]
    before, after = ({part["global_id"]: part for part in parts} for parts in (was, now))
    changed = sum(before.get(name) != after.get(name) for name in before.keys() | after.keys())
    return [f"{_PARTS} ({changed})"] if changed else [_PARTS]


def _of_model(_: str, was: dict[str, Any], now: dict[str, Any]) -> list[str]:
    found = []
    if was["ground_m"] != now["ground_m"] and None not in (was["ground_m"], now["ground_m"]):
        found.append(f"the ground ({now['ground_m'] - was['ground_m']:+.2f} m)")
    if keys := _keys(was, now, leave=("ground_m",) if found else ()):
        found.append(f"[model] {', '.join(keys)}")
    return found


_TABLES: dict[str, Callable[[str, Any, Any], list[str]]] = {
    "crane": _of_cranes,
    "areas": _of_areas,
    "zone": _of_zones,
    "component": _of_parts,
    "means": _of_parts,
    "model": _of_model,
}


def _keys(was: Any, now: Any, leave: tuple[str, ...] = ()) -> list[str]:
    """Return the keys that differ between two tables, the first few with their values."""
    if not isinstance(was, Mapping) or not isinstance(now, Mapping):
        return []
    keys = [key for key in dict.fromkeys([*now, *was]) if was.get(key) != now.get(key) and key not in leave]
    both = {key: (now.get(key), was.get(key)) for key in keys[:_MOST_KEYS]}
    words = [
        f"{key} {_word(new)}, was {_word(old)}" if _are_short(new, old) else key for key, (new, old) in both.items()
    ]
    return words if len(keys) <= _MOST_KEYS else [*words, f"{len(keys) - _MOST_KEYS} more"]


def _are_short(*values: Any) -> bool:
    return all(isinstance(value, str | int | float | None) and len(str(value)) <= _LONG for value in values)


def _word(value: Any) -> str:
    return "not set" if value is None else f"{value}"


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _rounded(value: Any) -> Any:
    """Return plain values with numbers to the millimetre."""
    if isinstance(value, Mapping):
        return {key: _rounded(own) for key, own in value.items()}
    if isinstance(value, list):
        return [_rounded(own) for own in value]
    return round(float(value), _DIGITS) + 0.0 if isinstance(value, int | float) else value
