"""The page of the machines of the catalogue, from their data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bimvox_pipeline.cranes import cranes

from bimvox.progress import SilentProgress
from docs.reference.markdown import table

_HEADS = ("machine", "what it is", "load moment tm", "jibs or booms m", "largest load t", "winch kW")


def machine_pages() -> dict[str, str]:
    """Return the page of the machines by its path in ``docs``."""
    machines = cranes(None, progress=SilentProgress())["machines"]
    real = [one for one in machines if one["sources"]]
    lines = [
        "# Machines",
        "",
        "From `bimvox cranes`; explained in [cranes](../cranes.md#the-catalogue).",
        "",
        "## Generic machines",
        "",
        "Each is typical of its class, and not a machine of a maker.",
        "",
        *table(_HEADS, [_row(one) for one in machines if not one["sources"]]),
        "",
        "## Real machines from public figures",
        "",
        "Check each against the machine's own chart. What no source states is named.",
        "",
        *table(_HEADS, [_row(one) for one in real]),
        "",
        *(line for one in real for line in _sources(one)),
    ]
    return {"formats/machines.md": "\n".join(lines).rstrip() + "\n"}


def _row(machine: Mapping[str, Any]) -> Sequence[str]:
    power = machine["hoist_kw"]
    return (
        f"`{machine['machine']}`",
        machine["about"].partition(", from public figures")[0],
        f"{machine['load_moment_tm']:.0f}",
        ", ".join(f"{length:g}" for length in machine["jib_lengths_m"]),
        f"{machine['largest_capacity_kg'] / 1000.0:g}",
        "" if power is None else f"{power:g}",
    )


def _sources(machine: Mapping[str, Any]) -> Iterator[str]:
    yield from [f"### {machine['machine']}", ""]
    for source in machine["sources"]:
        when = f", {source['date']}" if source["date"] else ""
        yield f"- {source['states']}: [{source['title']}]({source['address']}), {source['publisher']}{when}"
    assumed = ", ".join(f"`{key}`" for key in machine["assumed"])
    yield from [f"- As of `{machine['like']}`: {assumed}", f"- Not found: {'; '.join(machine['not_found'])}", ""]
