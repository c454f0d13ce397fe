"""The cranes of a plan, for people: which machine each is, and what the site changes in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def crane_fields(cranes: Sequence[Mapping[str, Any]]) -> list[tuple[str, object]]:
    """Return names and values about the cranes of a document: machine, jib, falls and overrides."""
    found: list[tuple[str, object]] = []
    for number, crane in enumerate(cranes, start=1):
        heading = "crane" if len(cranes) == 1 else f"crane {number}"
        own = "" if crane["name"] == crane["machine"] else f"{crane['name']}: "
        found.append((heading, f"{own}{crane['machine']}, jib {crane['jib_length_m']:.4g} m, {crane['falls']} falls"))
        changed = [f"{one['key']}: {one['site']} instead of {one['catalogue']}" for one in crane["overrides"]]
        found.append((f"{heading}, override", "\n".join(changed)))
    return found
