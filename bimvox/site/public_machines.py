"""Real machines from public figures: the files of ``bimvox/crane/public_machines``.

A file holds what sources state, and nothing else. What a plan needs besides comes from the generic machine of the class
(``like``), and is named. Of its load charts it has the points that a source gives, mostly the ends.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import resources
from itertools import pairwise
from math import ceil, cos, floor, radians
from typing import Annotated, Any

from pydantic import Field

from bimvox.crane.machine import Machine, Source
from bimvox.site.config.machine_file import MACHINE_FILES, MachineConfig
from bimvox.site.config.validation import Table, Text

MARK = "from public figures; check against the machine's own chart"
"""Stands in ``about`` of every such machine."""
_FOLDER = "public_machines"
_DOWN_TO_KG = 10.0
"""Capacities between given points are rounded down to this."""


class SourceConfig(Table):
    """A publication with figures of the machine."""

    title: Text
    publisher: Text
    date: str
    address: Text
    states: Text


class PublicConfig(Table):
    """What the file of a real machine has besides the keys of a machine file."""

    like: Text
    """The generic machine whose values stand in for what no source states."""
    source: Annotated[tuple[SourceConfig, ...], Field(min_length=1)]
    not_found: tuple[Text, ...] = ()


@cache
def public_machines() -> tuple[Machine, ...]:
    """Return the real machines, by name."""
    folder = resources.files("bimvox") / "crane" / _FOLDER
    files = sorted((file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name)
    return tuple(_machine(tomllib.loads(file.read_text(encoding="utf-8")), file.name) for file in files)


def _machine(given: dict[str, Any], name: str) -> Machine:
    """Return the machine that a file describes, with what is missing from the generic one."""
    own = PublicConfig.model_validate({key: given.pop(key) for key in PublicConfig.model_fields if key in given})
    usual = _generic(own.like)
    assumed = tuple(dict.fromkeys(_filled_in(given, usual)))
    given["table"] = [_whole(table, given) for table in given["table"]]
    machine = MACHINE_FILES.value(MachineConfig.model_validate(given))
    sources = tuple(Source(**one.model_dump()) for one in own.source)
    return replace(machine, sources=sources, assumed=assumed, not_found=own.not_found, like=own.like)


def _generic(name: str) -> dict[str, Any]:
    text = (resources.files("bimvox") / "crane" / "catalogue" / f"{name}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


_NEEDED = {
    "hammerhead": ("jib_height_m", "min_radius_m", "trolley"),
    "luffing": ("luffing",),
    "mobile": ("luffing",),
}
_ALWAYS = ("mast_size_m", "sling_m", "rigging_mass_kg", "max_wind_m_s", "slewing", "hoist")


def _filled_in(given: dict[str, Any], usual: Mapping[str, Any]) -> Iterator[str]:
    """Add what the file does not state and a plan needs, from the generic machine; yield the keys."""
    slower = min(1.0, _most_kg(usual) / _most_kg(given))
    for key in (*_ALWAYS, *_NEEDED[given["kind"]]):
        if key not in given:
            given[key] = usual[key]
            if key == "hoist":
                # The class's winch lifts a larger load as much slower.
                given[key] = {**usual[key], "rate_m_s": slower * usual[key]["rate_m_s"]}
            yield key
        elif isinstance(given[key], dict):
            missing = [name for name in usual[key] if name not in given[key]]
            given[key] = {**usual[key], **given[key]}
            yield from (f"{key}.{name}" for name in missing)
    tackles = usual.get("reeving") or usual["jib"][-1]["reeving"]
    for one in given["reeving"]:
        like = max(tackles, key=lambda tackle: (tackle["falls"] == one["falls"], tackle["falls"]))
        for key in ("hook_block_kg", "trolley_rate_m_s"):
            if key not in one and key in like:
                one[key] = like[key]
                yield f"reeving.{key}"


def _most_kg(given: Mapping[str, Any]) -> float:
    """Return the largest load that a file states."""
    charts = [one["chart"] for jib in given.get("jib", ()) for one in jib["reeving"]]
    stated = [one.get("most_kg", 0.0) for one in given.get("reeving", ())]
    most_kg: float = max([0.0, *stated, *(mass for chart in charts for _, mass in chart)])
    return most_kg or max(mass for table in given["table"] for row in table["rows"] for mass in row[1:])


def _whole(table: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table of given points with a row for every metre."""
    (length_m,) = table["lengths_m"]
    masses = [one.get("most_kg", 0.0) for one in given["reeving"]]
    nearest_m = table["rows"][0][0]
    if all(masses) or len(table["rows"]) == 1:
        nearest_m = min(nearest_m, _nearest_m(given, length_m))
    points = [(float(radius), float(mass)) for radius, mass in table["rows"]]
    return {**table, "rows": between(points, nearest_m, max(masses, default=0.0))}


def _nearest_m(given: Mapping[str, Any], length_m: float) -> float:
    """Return the smallest radius of a jib, rounded down."""
    if given["kind"] == "hammerhead":
        return float(given["min_radius_m"])
    jib = given["luffing"]
    nearest_m: float = jib["pivot_offset_m"] + length_m * cos(radians(jib["luff_deg"][1]))
    return floor(10.0 * nearest_m) / 10.0


def between(points: Sequence[tuple[float, float]], nearest_m: float, most_kg: float) -> list[tuple[float, float]]:
    """Return a load chart with a row for every metre from given points: never more than these permit.

    - Between two points the smaller of their two load moments holds, divided by the radius: on published charts the
      moment there is nowhere below both. It is not less than the load at the farther point, and not more than at the
      nearer one.
    - Inside the first point its load moment holds, up to the largest load of the machine: the moment of a tower crane
      does not fall towards the mast. Without a largest load, the load of the first point.
    - Beyond the last point there is nothing.

    Args:
        points: (radius in m, load in kg), ascending radii, loads that do not grow.
        nearest_m: The first radius of the chart.
        most_kg: The largest load.
    """
    first_m, first_kg = points[0]
    found: dict[float, float] = dict(points)
    for radius_m in (nearest_m, *_metres(nearest_m, first_m)):
        if radius_m < first_m:
            found[radius_m] = min(max(most_kg, first_kg), _down(first_m * first_kg / radius_m))
    for (near_m, near_kg), (far_m, far_kg) in pairwise(points):
        moment = min(near_m * near_kg, far_m * far_kg)
        for radius_m in _metres(near_m, far_m):
            found[radius_m] = min(near_kg, max(far_kg, _down(moment / radius_m)))
    return sorted(found.items())


def _metres(near_m: float, far_m: float) -> Iterable[float]:
    """Return the whole metres between two radii."""
    return map(float, range(floor(near_m) + 1, ceil(far_m)))


def _down(mass_kg: float) -> float:
    return _DOWN_TO_KG * floor(mass_kg / _DOWN_TO_KG)
