"""Which rules of a site ask for less than the rules of a site file that says nothing about them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from enum import StrEnum
from typing import Any

from bimvox.site.config.rules import RulesConfig
from bimvox.site.site import Rules

MORE_IS_WEAKER = frozenset(
    (
        "contact_tolerance_m",
        "support_gap_m",
        "sample_period_s",
        "sling_angle_rad",
        "critical_share",
        "highest_utilisation",
        "people",
        "bundle_kg",
    )
)
"""Rules, and times in them, of which a larger value asks for less; of all other numbers, a smaller one does."""
NONE_IS_WEAKER = frozenset(
    (
        "bracing_s",
        "release_s",
        "truckload_kg",
        "by_other_means",
        "gives_way",
        "curing",
        "heading",
        "yard",
        "order_search",
    )
)
"""Rules whose default asks for nothing, or that are a choice; one time of all classes is compared with ``times``."""


def weaker_rules(rules: Rules, *, has_crane: bool) -> list[str]:
    """Return the rules that ask for less than the defaults of this version, each as ``key = value (default: value)``.

    Args:
        rules: The rules of a site.
        has_crane: Whether it has a crane: some defaults are for cranes only.
    """
    default = RulesConfig().rules(has_crane=has_crane)
    found = [
        f"{key} = {_written(own)} (default: {_written(usual)})"
        for key, own, usual in _pairs("", rules, default)
        if _is_weaker(key.rpartition(".")[2], own, usual)
    ]
    for key in ("bracing_s", "release_s"):
        own = getattr(rules, key)
        most_s = max(
            getattr(getattr(default.times, work.name), key.replace("bracing", "brace"))
            for work in fields(default.times)
        )
        if own is not None and own < most_s:
            found.append(f"{key} = {_written(own)} (default: by class of work, up to {_written(most_s)})")
    return found


def _pairs(prefix: str, own: Any, usual: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield the rules, and each value of those that are tables, by their keys."""
    for field in fields(usual):
        key, one, other = f"{prefix}{field.name}", getattr(own, field.name), getattr(usual, field.name)
        if field.name in NONE_IS_WEAKER:
            continue
        if is_dataclass(other):
            yield from _pairs(f"{key}.", one, other)
        else:
            yield key, one, other


def _is_weaker(key: str, own: Any, usual: Any) -> bool:
    """Return whether a value asks for less than the default; one that cannot be compared does if it differs."""
    if isinstance(usual, StrEnum):
        return bool(own != usual)
    return bool(own > usual if key in MORE_IS_WEAKER else own < usual)


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, int | float) else str(value)
