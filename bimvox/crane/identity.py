"""Which machine a crane is, and what its site changes in it: the same in every output."""

from __future__ import annotations

from typing import Any

from bimvox.crane.tower_crane import TowerCrane


def identity(crane: TowerCrane) -> dict[str, Any]:
    """Return name, machine, largest hook radius, falls and overrides of a crane, for JSON documents."""
    return {
        "name": crane.name,
        "machine": crane.machine or crane.name,
        "jib_length_m": crane.jib_length_m,
        "falls": crane.falls,
        "overrides": [override.to_dict() for override in crane.overrides],
    }
